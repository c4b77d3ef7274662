"""Runs commands in forked children that are killed, or meet a fault, at a given system call.

    python killed_commands.py < requests > replies

A request is a line of JSON, `{"folder": …, "arguments": […], "fatal": N, "fault": …, "exchanges":
…, "patience": …}`. The child runs the command in this folder. Without a fault it ends itself,
without any cleaning up, just before its call number N that changes something in the folder or in
the user's journals; a write that is hit writes half. With `"fault": "files"` or `"memory"` call
number N that opens something or starts a process or a thread fails instead, and so does each that
follows, as where no more files may be open, or no memory is left. With `"fatal": 0` it gets
through. `exchanges`: whether the system can swap two folders in one step. `patience`: after so many
seconds a signal ends it; 0: never.
A reply is `{"status": …, "calls": [names], "said": …, "seconds": …, "megabytes": …}`, with all that
was written for the user, the processor time of the command and of what it waited for, and the most
memory that one of its processes held; there are no names where it died. The name of a call that may
fail tells where it is made.
"""

from __future__ import annotations

import errno
import importlib
import json
import os
import signal
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import coursebuild
from coursebuild.cli import main
from coursebuild.core.engine import publish as publishing
from coursebuild.core.files.trust import state_folder
from coursebuild.core.registry import features

BY_PATH = ("open", "rename", "replace", "link", "unlink", "rmdir", "mkdir")
BY_FD = ("write", "fsync", "ftruncate", "fchmod")
KILLED_STATUS = 137
READY = (
    "argparse",
    "coursebuild.pipeline.site",
    "coursebuild.pipeline.outputs",
    "coursebuild.core.syntax.document",
    "coursebuild.core.pages.page_writer",
    "coursebuild.core.pages.document_inputs",
    "coursebuild.core.pages.page_list",
    "coursebuild.features.authoring.commands.rename",
)
"""Modules that are imported once, before children are forked."""
TOOL = str(Path(coursebuild.__file__).parent)
OPENING = frozenset({"open", "os.scandir", "os.listdir", "socket.__new__", "os.pipe"})
STARTING = frozenset({"os.fork", "os.posix_spawn", "subprocess.Popen"})
THREAD = "_thread.start_new_thread"


class Doom:
    """Counts the calls and knows the fatal one."""

    def __init__(self, folder: Path, fatal: int) -> None:
        journals = Path(state_folder(str(folder)) or folder, "journals")
        self.folders = (str(folder), str(journals))
        self.fatal = fatal
        self.calls: list[str] = []

    def meets(self, name: str) -> bool:
        self.calls.append(name)
        return len(self.calls) == self.fatal

    def concerns(self, name: str, arguments: tuple[Any, ...]) -> bool:
        if name in BY_FD:
            return self.place(arguments[0]).startswith(self.folders)
        path = arguments[0]
        if name == "open" and not arguments[1] & os.O_CREAT:
            return False
        # Relative ones are those of a tree that is being removed, or of a course as a whole.
        return not Path(path).is_absolute() or os.fspath(path).startswith(self.folders)

    def place(self, fd: int) -> str:
        try:
            return str(Path(f"/proc/self/fd/{fd}").readlink())
        except OSError:
            return ""

    def wrap(self, name: str, really: Callable[..., Any]) -> Callable[..., Any]:
        def call(*arguments: Any, **keywords: Any) -> Any:
            if self.concerns(name, arguments) and self.meets(name):
                if name == "write":
                    really(arguments[0], bytes(arguments[1])[: len(arguments[1]) // 2])
                os._exit(KILLED_STATUS)
            return really(*arguments, **keywords)

        return call

    def install(self) -> None:
        for name in (*BY_PATH, *BY_FD):
            setattr(os, name, self.wrap(name, getattr(os, name)))
        really = publishing.exchange

        def exchange(a: Path, b: Path) -> bool:
            if self.meets("exchange"):
                os._exit(KILLED_STATUS)
            return really(a, b)

        publishing.exchange = exchange


class Fault(Doom):
    """Counts the calls of this process that may fail, and fails those from the fatal one on."""

    def __init__(self, folder: Path, fatal: int, kind: str) -> None:
        super().__init__(folder, fatal)
        self.kind = kind
        self.process = os.getpid()

    def __call__(self, event: str, _arguments: object = None) -> None:
        """Called by the interpreter before each audited call."""
        if event not in OPENING | STARTING | {THREAD} or os.getpid() != self.process:
            return
        self.meets(f"{event}@{self.caller()}")
        if not self.fatal or len(self.calls) < self.fatal:
            return
        if event == THREAD:
            raise RuntimeError("can't start new thread")
        if self.kind == "memory" and event in OPENING:
            raise MemoryError
        number = errno.EMFILE if event in OPENING else errno.ENOMEM
        raise OSError(number, os.strerror(number))

    def caller(self) -> str:
        frame = sys._getframe(2)
        while not frame.f_code.co_filename.startswith(TOOL):
            if "importlib" in frame.f_code.co_filename or frame.f_back is None:
                return "import"
            frame = frame.f_back
        return f"{frame.f_code.co_filename[len(TOOL) + 1 :]}:{frame.f_lineno}"

    def install(self) -> None:
        really = os.pipe

        def pipe() -> tuple[int, int]:
            self("os.pipe")
            return really()

        os.pipe = pipe
        sys.addaudithook(self)


def serve() -> None:
    for name in READY:
        importlib.import_module(name)
    features()
    for line in sys.stdin:
        request = json.loads(line)
        read, write = os.pipe()
        with tempfile.TemporaryFile() as errors:
            child = os.fork()
            if child == 0:
                os.close(read)
                os.dup2(errors.fileno(), 1)
                os.dup2(errors.fileno(), 2)
                run(request, write)
            os.close(write)
            with os.fdopen(read) as pipe:
                calls = pipe.read()
            _, status, usage = os.wait4(child, 0)
            errors.seek(0)
            reply = {
                "status": os.waitstatus_to_exitcode(status),
                "calls": calls.split(),
                "said": errors.read().decode(errors="replace"),
                "seconds": usage.ru_utime + usage.ru_stime,
                "megabytes": usage.ru_maxrss / 1024,
            }
        print(json.dumps(reply), flush=True)


def run(request: dict[str, Any], report: int) -> None:
    """Run the command in the child, which never returns."""
    folder = Path(request["folder"])
    if not request["exchanges"]:
        publishing.exchange = lambda a, b: False
    null = os.open(os.devnull, os.O_RDWR)
    os.dup2(null, 0)
    os.chdir(folder)
    doom = Doom(folder, request["fatal"])
    if request["fault"]:
        doom = Fault(folder, request["fatal"], request["fault"])
    doom.install()
    signal.alarm(request["patience"])
    status = 70
    try:
        status = main(request["arguments"])
    finally:
        if sys.exc_info()[0] is not None:
            sys.excepthook(*sys.exc_info())
        os.write(report, " ".join(doom.calls).encode())
        os._exit(status)


if __name__ == "__main__":
    serve()
