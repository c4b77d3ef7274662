"""What Dask calls on a worker. Arguments and results are bytes.

Entry points: `describe`, `missing`, `store`, and `perform`, which is a task of the scheduler; the
others are called directly. Each thread of a worker has a process beside it (`child`).
"""

from __future__ import annotations

import contextlib
import select
import signal
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

from coursebuild.api import deciding_versions, gate
from coursebuild_cluster.child import frame_message, read_message
from coursebuild_cluster.course_copy import BlobStore
from coursebuild_cluster.messages import Answer, Piece, WorkerFacts, pack, unpack

_PATIENCE = 0.1
"""Seconds between two looks at whether a result is still wanted."""
_GRACE = 5.0
"""Seconds in which a process has to end."""
_idle: list[_Child] = []
_lock = threading.Lock()


def dask_setup(worker: Any) -> None:
    """Leave Ctrl-C to the command, where the worker is one of `local`; Dask calls this."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def describe() -> bytes:
    """What must be the same on a worker and where the command is given."""
    return pack(WorkerFacts(deciding_versions()))


def missing(digests: bytes, dask_worker: Any) -> bytes:
    """Which of these files the worker has not."""
    return pack(BlobStore(_folder(dask_worker) / "blobs").missing(unpack(digests, list[str])))


def store(pieces: bytes, sender: str, dask_worker: Any) -> None:
    """Keep files."""
    blobs = BlobStore(_folder(dask_worker) / "blobs")
    for piece in unpack(pieces, list[Piece]):
        blobs.put(piece, sender)


def perform(request: bytes) -> bytes:
    """Have a request done by a process of this worker; end that when nobody wants it any more."""
    from distributed import get_worker

    worker = get_worker()
    key = worker.get_current_task()

    def is_unwanted() -> bool:
        task = worker.state.tasks.get(key)
        is_open = worker.status.name in ("running", "paused")
        return task is None or task.state == "cancelled" or not is_open

    with _lock:
        child = _idle.pop() if _idle else None
    child = child or _Child(_folder(worker))
    answer = child.ask(request, is_unwanted)
    if answer is None:
        child.end()
        return pack([Answer(is_lost=True)])
    with _lock:
        _idle.append(child)
    return answer


class _Child:
    """A process that answers requests."""

    def __init__(self, folder: Path) -> None:
        command = gate.module_command("coursebuild_cluster.child", str(folder))
        # A session of its own: Ctrl-C in the terminal of a worker is for the worker.
        self._process = gate.start(
            command,
            gate.environment(*gate.TOOL),
            stdin=gate.PIPE,
            stdout=gate.PIPE,
            stderr=gate.OWN,
        )

    def ask(self, request: bytes, is_unwanted: Callable[[], bool]) -> bytes | None:
        """The answer to a request; `None` where the process died or nobody waits for it."""
        process = self._process
        assert process.stdin is not None
        assert process.stdout is not None
        try:
            process.stdin.write(frame_message(request))
            process.stdin.flush()
            while not select.select([process.stdout], [], [], _PATIENCE)[0]:
                if is_unwanted():
                    return None
            return read_message(process.stdout)  # type: ignore[arg-type]
        except OSError:
            return None

    def end(self) -> None:
        """End the process and all that it has started."""
        self._process.terminate()
        try:
            self._process.wait(_GRACE)
        except gate.StillRunningError:
            self._process.kill()
            self._process.wait()
        for stream in (self._process.stdin, self._process.stdout):
            with contextlib.suppress(OSError):
                if stream is not None:
                    stream.close()


def _folder(worker: Any) -> Path:
    """Where the worker keeps files; Dask removes it with the worker."""
    folder = Path(worker.local_directory, "coursebuild")
    folder.mkdir(mode=0o700, exist_ok=True)
    return folder
