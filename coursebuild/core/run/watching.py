"""A running script: its output, its limits, and the end of everything that it started.

It is used by `supervisor`, whose process has one thread and becomes the parent of orphans.
"""

from __future__ import annotations

import contextlib
import mmap
import os
import select
import signal
import struct
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Literal

PROGRAM = str(Path(__file__).with_name("script_main.py"))
"""The program of a supervisor."""
LENGTH = struct.Struct(">I")
"""Stands before each job and each report."""
STARTED = LENGTH.pack(0)
"""What a supervisor sends when it has started a script."""
_EXITING_FLAG = 0x4
"""A flag of a process, see proc_pid_stat(5): `PF_EXITING`."""
STDOUT_LIMIT = 1 << 20
"""Bytes that a script may print."""
STDERR_KEPT = 1 << 16
"""Bytes of its error output that are kept, from the end."""
GRACE = 0.5
"""Seconds between asking a script at its time limit where it is, and killing it."""

_CHUNK = 1 << 16


def has_ended(parent: int) -> bool:
    """Whether the process that started this one has ended, or is about to.

    A process that ends closes its files before its children get another parent: they may see a pipe
    closed and still have it as parent. Linux marks such a process as exiting.
    """
    if os.getppid() != parent:
        return True
    try:
        with open(f"/proc/{parent}/stat", "rb") as file:  # noqa: PTH123 (as cheap as can be)
            state, *fields = file.read().rpartition(b")")[2].split()
        return state in (b"Z", b"X") or bool(int(fields[5]) & _EXITING_FLAG)
    except (OSError, ValueError, IndexError):
        return False


class RunningScript:
    """One script, from its start until nothing of it is left.

    `pipes` are the reading ends of its output and its error output; `shared` is the memory for its
    notes, if it shares some; `awake` becomes readable when a child has ended.
    """

    def __init__(
        self, pid: int, pipes: tuple[int, int], shared: mmap.mmap | None, timeout: float, awake: int
    ) -> None:
        self.pid = pid
        self.shared = shared
        self.awake = awake
        self.stdout = bytearray()
        self.stderr = bytearray()
        self.limit: Literal["", "timeout", "output-limit"] = ""
        """The limit that it has exceeded."""
        self.seconds = 0.0
        self.start = time.monotonic()
        self.deadline = self.start + timeout
        self.status: int | None = None
        self.pipes = dict(zip(pipes, (self.stdout, self.stderr), strict=True))
        self._pipe_fds = pipes
        for fd in self.pipes:
            os.set_blocking(fd, False)

    def watch(self, tool: int, parent: int) -> None:
        """Return when the script has ended, or must be ended.

        Exit when `tool` closes its pipe, and when `parent`, which was the parent of this process
        before the script was started, no longer is.
        """
        while not self._reap_children():
            now = time.monotonic()
            if now >= self.deadline:
                self._request_position()
                return
            ready = self._wait(min(self.deadline - now, 1.0), [tool])
            if tool in ready or os.getppid() != parent:
                sys.exit(0)  # `end` and the removal of the folder happen on the way out
            if len(self.stdout) > STDOUT_LIMIT:
                self.limit = "output-limit"
                return

    def end(self) -> None:
        """Kill all that is left of the script, and read the rest of its output."""
        self.seconds = time.monotonic() - self.start
        with contextlib.suppress(OSError):
            os.killpg(self.pid, signal.SIGKILL)
        self._kill_descendants(time.monotonic() + 5.0)
        for fd in list(self.pipes):
            while self._read(fd):
                pass
        if not self.limit and len(self.stdout) > STDOUT_LIMIT:
            self.limit = "output-limit"
        for fd in self._pipe_fds:
            os.close(fd)

    def exit_status(self) -> int:
        """Its exit status; minus a signal's number where one ended it, as at a limit."""
        if self.status is None or self.limit:
            return -signal.SIGKILL
        return self.status

    def _request_position(self) -> None:
        """Let the script print where it hangs: Python's fault handler answers SIGABRT."""
        self.limit = "timeout"
        with contextlib.suppress(OSError):
            os.kill(self.pid, signal.SIGABRT)
        until = time.monotonic() + GRACE
        while not self._reap_children() and (left := until - time.monotonic()) > 0:
            self._wait(left, [])
            if len(self.stdout) > STDOUT_LIMIT:
                return

    def _wait(self, seconds: float, fds: list[int]) -> set[int]:
        """Wait for a pipe, the end of a child, or one of `fds`; those of `fds` that are ready."""
        poll = select.poll()
        for fd in (*self.pipes, self.awake, *fds):
            poll.register(fd, select.POLLIN)
        ready = {fd for fd, _ in poll.poll(max(1.0, seconds * 1000.0))}
        if self.awake in ready:
            with contextlib.suppress(BlockingIOError):
                os.read(self.awake, _CHUNK)
        for fd in ready & self.pipes.keys():
            self._read(fd)
        return ready.intersection(fds)

    def _read(self, fd: int) -> bool:
        """Read at most a chunk from a pipe; return whether there may be more."""
        try:
            data = os.read(fd, _CHUNK)
        except BlockingIOError:
            return False
        if not data:
            self.pipes.pop(fd, None)
            return False
        buffer = self.pipes[fd]
        buffer += data
        if buffer is self.stderr and len(buffer) > 4 * STDERR_KEPT:
            del buffer[:-STDERR_KEPT]
        return buffer is self.stderr or len(buffer) <= STDOUT_LIMIT

    def _reap_children(self) -> bool:
        with contextlib.suppress(ChildProcessError):
            while (child := os.waitpid(-1, os.WNOHANG))[0]:
                if child[0] == self.pid:
                    self.status = os.waitstatus_to_exitcode(child[1])
        return self.status is not None

    def _kill_descendants(self, until: float) -> None:
        while time.monotonic() < until:  # when one dies, its children become ours
            self._reap_children()
            children = list(_children())
            if not children and self.status is not None:
                return
            for child in children:
                with contextlib.suppress(OSError):
                    os.kill(child, signal.SIGKILL)
            if self.status is None:
                with contextlib.suppress(OSError):
                    os.kill(self.pid, signal.SIGKILL)
            time.sleep(0.001)


def _children() -> Iterator[int]:
    """The children of this process that are alive or not yet reaped, where the system can tell."""
    me = os.getpid()
    with contextlib.suppress(OSError):
        yield from map(int, Path(f"/proc/self/task/{me}/children").read_bytes().split())
        return
    with contextlib.suppress(OSError):
        for entry in Path("/proc").iterdir():
            with contextlib.suppress(OSError, ValueError, IndexError):
                # The name, in parentheses, may hold anything; the parent is the second field after.
                if int((entry / "stat").read_text().rpartition(")")[2].split()[1]) == me:
                    yield int(entry.name)
