"""The process beside a worker that does the work: it can be ended at any time, and costs no worker.

`python -m coursebuild_cluster.child FOLDER` answers requests that come at its input, each as
8 bytes of length and a `Request`, until the input ends. It keeps its copy of the course and a
`ScriptServer` warm. What it prints goes to its standard error.
"""

from __future__ import annotations

import contextlib
import fcntl
import functools
import importlib
import os
import re
import shutil
import signal
import stat
import sys
import tempfile
import traceback
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO, NoReturn

from coursebuild.api import (
    DECISIVE,
    EffectError,
    ScriptJob,
    ScriptServer,
    States,
    Store,
    dependencies_of,
    find_sandbox,
)
from coursebuild_cluster.course_copy import BlobStore, CourseFolder
from coursebuild_cluster.messages import Answer, Request, Work, pack, unpack

LENGTH = 8
"""Bytes before each message, which say how many follow."""


class Performer:
    """Does what requests ask for, in its copy of the course."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._copy = CourseFolder(folder / f"copy-{os.getpid()}", BlobStore(folder / "blobs"))
        self._servers: dict[bool, ScriptServer] = {}

    def answer(self, data: bytes) -> bytes:
        """Answer a request; whatever goes wrong is an answer too."""
        request = unpack(data, Request)
        return pack([self._answer(request, work) for work in request.works])

    def close(self) -> None:
        """End what runs, and remove the copy."""
        for server in self._servers.values():
            server.close()
        shutil.rmtree(self._copy.root.parent, ignore_errors=True)

    def _answer(self, request: Request, work: Work) -> Answer:
        try:
            return self._do(request, work)
        except EffectError as error:
            return Answer(refusal=error.message, help=error.help)
        except Exception:
            return Answer(bug=traceback.format_exc())

    def _do(self, request: Request, work: Work) -> Answer:
        for name in DECISIVE:
            os.environ.pop(name, None)
        os.environ.update(request.environment)
        self._copy.bring_to(request.course)
        if work.job is not None:
            return self._run(work.job, sandbox=work.sandbox)
        # Functions of the tool alone: a name is all that tells which.
        if not re.fullmatch(r"coursebuild(\.\w+)+:\w+", work.function):
            raise ValueError(f"{work.function} is not a function of coursebuild")
        module, _, name = work.function.partition(":")
        with own_processor():
            function = getattr(importlib.import_module(module), name)
            return Answer(result=function(self._copy.root, work.task))

    def _run(self, job: ScriptJob, *, sandbox: bool) -> Answer:
        root = self._copy.root
        if sandbox not in self._servers:
            self._servers[sandbox] = ScriptServer(sandbox=find_sandbox(root) if sandbox else None)
        (run,) = self._servers[sandbox].run(root, [job], parallel=1)
        states = self._states(root)
        dependencies = dependencies_of(run, job.requires, states.places, states.now)
        new_files = tuple(self._copy.changes(() if sandbox else job.writes))
        return Answer(run, dependencies, states.places, new_files)

    @functools.lru_cache(maxsize=1)  # noqa: B019 - it lives as long as the process
    def _states(self, root: Path) -> States:
        return States(root, Store(self._folder / f"store-{os.getpid()}"))


@contextlib.contextmanager
def own_processor() -> Iterator[None]:
    """Keep to a processor that no other process of this kind has taken, while one is free.

    Measurements keep to the last one that they may use: without this, all would share it.
    """
    if not hasattr(os, "sched_setaffinity"):
        yield
        return
    processors = os.sched_getaffinity(0)
    folder = Path(tempfile.gettempdir(), f"coursebuild-processors-{os.getuid()}")
    with contextlib.suppress(FileExistsError):  # perhaps somebody else's, and no folder
        folder.mkdir(mode=0o700)
    status = folder.lstat()
    if not stat.S_ISDIR(status.st_mode) or status.st_uid != os.getuid():
        yield
        return
    with contextlib.ExitStack() as stack:
        for processor in sorted(processors):
            file = stack.enter_context((folder / str(processor)).open("w"))
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                continue
            os.sched_setaffinity(0, {processor})
            break
        try:
            yield
        finally:
            os.sched_setaffinity(0, processors)


def read_message(stream: BinaryIO) -> bytes | None:
    """The next message of a stream; `None` at its end."""
    head = stream.read(LENGTH)
    size = int.from_bytes(head, "big")
    data = stream.read(size) if len(head) == LENGTH else b""
    return data if len(head) == LENGTH and len(data) == size else None


def frame_message(data: bytes) -> bytes:
    """A message with its length before it."""
    return len(data).to_bytes(LENGTH, "big") + data


def _end(number: int, frame: object) -> NoReturn:
    raise SystemExit(1)


def main() -> None:
    """Answer requests until the input ends."""
    (folder,) = sys.argv[1:]
    signal.signal(signal.SIGTERM, _end)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the command
    output = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    performer = Performer(Path(folder))
    try:
        while (data := read_message(sys.stdin.buffer)) is not None:
            output.write(frame_message(performer.answer(data)))
            output.flush()
    finally:
        performer.close()


if __name__ == "__main__":
    main()
