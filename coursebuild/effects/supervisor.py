"""The child process that runs scripts for `runner` and sees to it that nothing stays behind.

Entry point: run as a file by `runner`; it imports nothing but the standard library.

It runs one script after another, each in a session of its own, so that

1. every process that a script starts is found and killed when the script ends, daemons too: on
   Linux an orphan becomes the child of this process;
2. when the tool dies, by whatever signal, this process sees its input close and kills what runs;
3. when this process dies, the system kills the script (Linux).

It has one thread, so that it may act between fork and exec.

The protocol: on standard input JSON objects (`Job`), each after its length in 4 bytes; on standard
output for each one JSON object (`Report`) after its length, and then the bytes of the script's
output and of the end of its error output.
"""

from __future__ import annotations

import contextlib
import ctypes
import importlib
import importlib.machinery
import json
import os
import select
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Literal, TypedDict

STDOUT_LIMIT = 1 << 20
"""Bytes that a script may print."""
STDERR_KEPT = 1 << 16
"""Bytes of its error output that are kept, from the end."""
GRACE = 0.5
"""Seconds between asking a script that ran too long where it is, and killing it."""
LENGTH = struct.Struct(">I")

_PR_SET_PDEATHSIG = 1  # linux/prctl.h
_PR_SET_CHILD_SUBREAPER = 36
_CHUNK = 1 << 16


class Job(TypedDict):
    """What to run."""

    root: str
    """Working directory."""
    path: str
    """The script, relative to it."""
    args: list[str]
    timeout: float
    """Seconds."""
    requires: list[str]
    """Modules without which it is not run."""
    environment: dict[str, str]
    scratch: str
    """Where the script's temporary folder is made; it goes when the last supervisor does."""
    library: str
    """A folder to import `mjcourse` from, where it is not installed."""


class Report(TypedDict):
    """What happened."""

    end: Literal["exit", "timeout", "output-limit", "missing", "unstartable"]
    status: int
    """Exit status; minus the signal's number where one ended it."""
    seconds: float
    missing: list[str]
    stdout: int
    """Length in bytes."""
    stderr: int


def main() -> None:
    """Serve until the input closes."""
    reply = os.dup(1)
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, 1)  # whatever prints here must not end up between the reports
    os.close(null)
    prctl(_PR_SET_CHILD_SUBREAPER, 1)
    awake, wake = os.pipe()
    os.set_blocking(awake, False)
    os.set_blocking(wake, False)
    signal.set_wakeup_fd(wake, warn_on_full_buffer=False)
    signal.signal(signal.SIGCHLD, lambda *_: None)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
    os.chdir("/")
    scratch, tool = "", os.getppid()
    try:
        while (message := _receive(0)) is not None:
            job: Job = json.loads(message)
            scratch = job["scratch"]
            report, stdout, stderr = _serve(job, awake)
            _send(reply, json.dumps(report).encode(), stdout, stderr)
    finally:
        # While the tool lives the folder is its own: another supervisor may be about to use it.
        if scratch and os.getppid() != tool:
            with contextlib.suppress(OSError):  # others still use it
                Path(scratch).rmdir()


def prctl(option: int, value: int) -> None:
    """Set a property of this process, where the system is Linux."""
    if sys.platform == "linux":
        _libc().prctl(option, value, 0, 0, 0)


def _libc() -> ctypes.CDLL:
    return ctypes.CDLL(None)


def _serve(job: Job, awake: int) -> tuple[Report, bytes, bytes]:
    missing = missing_modules(
        job["requires"], Path(job["root"], job["path"]).parent, job["library"]
    )
    if missing:
        return _report("missing", missing=missing), b"", b""
    if not Path(job["root"], job["path"]).is_file():
        text = f"there is no file {job['path']}\n"
        return _report("unstartable", status=2, stderr=text), b"", text.encode()
    environment = dict(job["environment"])
    if missing_modules(["mjcourse"], None, ""):
        environment["PYTHONPATH"] = job["library"]
    folder = ""
    try:
        try:
            folder = _temporary(job["scratch"])
            run = _Run(job, environment | {"TMPDIR": folder}, awake)
        except (OSError, ValueError) as error:  # a ValueError: an argument holds a null character
            text = f"the script cannot be started: {error}\n"
            return _report("unstartable", status=2, stderr=text), b"", text.encode()
        try:
            run.watch()
        finally:
            run.end()
        return run.report(), bytes(run.stdout[:STDOUT_LIMIT]), bytes(run.stderr[-STDERR_KEPT:])
    finally:
        if folder:
            remove_folder(folder)


def _temporary(scratch: str) -> str:
    """A fresh folder in `scratch`, which another supervisor may have found empty and removed."""
    while True:
        try:
            return tempfile.mkdtemp(prefix="", dir=scratch)
        except FileNotFoundError:
            with contextlib.suppress(FileExistsError):
                Path(scratch).mkdir(mode=0o700)


class _Run:
    """One script, from its start until nothing of it is left."""

    def __init__(self, job: Job, environment: dict[str, str], awake: int) -> None:
        self.awake = awake
        self.stdout = bytearray()
        self.stderr = bytearray()
        self.over: Literal["exit", "timeout", "output-limit"] = "exit"
        self.seconds = 0.0
        self.start = time.monotonic()
        self.deadline = self.start + job["timeout"]
        self.process = subprocess.Popen(
            [sys.executable, job["path"], *job["args"]],
            cwd=job["root"],
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            bufsize=0,
            start_new_session=True,
            preexec_fn=_before_exec(os.getpid()),  # safe: there is no other thread
        )
        assert self.process.stdout is not None and self.process.stderr is not None
        self.pipes = {
            self.process.stdout.fileno(): self.stdout,
            self.process.stderr.fileno(): self.stderr,
        }
        for fd in self.pipes:
            os.set_blocking(fd, False)

    def watch(self) -> None:
        """Return when the script has ended, or must; exit when the tool is gone."""
        parent = os.getppid()
        while not self._ended():
            now = time.monotonic()
            if now >= self.deadline:
                self._ask_where()
                return
            ready = self._wait(min(self.deadline - now, 1.0), [0])
            if 0 in ready or os.getppid() != parent:
                sys.exit(0)  # `end` and the removal of the folder happen on the way out
            if len(self.stdout) > STDOUT_LIMIT:
                self.over = "output-limit"
                return

    def end(self) -> None:
        """Kill whatever is left, and take what it had printed."""
        self.seconds = time.monotonic() - self.start
        with contextlib.suppress(OSError):
            os.killpg(self.process.pid, signal.SIGKILL)
        self._kill_descendants(time.monotonic() + 5.0)
        for fd in list(self.pipes):
            while self._read(fd):
                pass
        if self.over == "exit" and len(self.stdout) > STDOUT_LIMIT:
            self.over = "output-limit"
        for pipe in (self.process.stdout, self.process.stderr):
            assert pipe is not None
            pipe.close()

    def report(self) -> Report:
        status = self.process.returncode
        return {
            "end": self.over,
            "status": -signal.SIGKILL if status is None or self.over != "exit" else status,
            "seconds": self.seconds,
            "missing": [],
            "stdout": len(self.stdout[:STDOUT_LIMIT]),
            "stderr": len(self.stderr[-STDERR_KEPT:]),
        }

    def _ask_where(self) -> None:
        """Let the script say where it hangs: Python's fault handler answers SIGABRT."""
        self.over = "timeout"
        with contextlib.suppress(OSError):
            os.kill(self.process.pid, signal.SIGABRT)
        until = time.monotonic() + GRACE
        while not self._ended() and (left := until - time.monotonic()) > 0:
            self._wait(left, [])
            if len(self.stdout) > STDOUT_LIMIT:
                return

    def _wait(self, seconds: float, others: list[int]) -> set[int]:
        """Wait for a pipe, the end of a child, or one of `others`; returns which of these."""
        poll = select.poll()
        for fd in (*self.pipes, self.awake, *others):
            poll.register(fd, select.POLLIN)
        ready = {fd for fd, _ in poll.poll(max(1.0, seconds * 1000.0))}
        if self.awake in ready:
            with contextlib.suppress(BlockingIOError):
                os.read(self.awake, _CHUNK)
        for fd in ready & self.pipes.keys():
            self._read(fd)
        return ready.intersection(others)

    def _read(self, fd: int) -> bool:
        """Take what a pipe holds, at most a chunk; whether there may be more."""
        try:
            data = os.read(fd, _CHUNK)
        except BlockingIOError:
            return False
        if not data:
            self.pipes.pop(fd, None)
            return False
        kept = self.pipes[fd]
        kept += data
        if kept is self.stderr and len(kept) > 4 * STDERR_KEPT:
            del kept[:-STDERR_KEPT]
        return kept is self.stderr or len(kept) <= STDOUT_LIMIT

    def _ended(self) -> bool:
        """Reap every child that has ended; whether the script is among them."""
        with contextlib.suppress(ChildProcessError):
            while (child := os.waitpid(-1, os.WNOHANG))[0]:
                if child[0] == self.process.pid:
                    self.process.returncode = os.waitstatus_to_exitcode(child[1])
        return self.process.returncode is not None

    def _kill_descendants(self, until: float) -> None:
        """Kill every process that the script left: a dying one hands its children on to us."""
        while time.monotonic() < until:
            self._ended()
            children = list(_children())
            if not children and self.process.returncode is not None:
                return
            for child in children:
                with contextlib.suppress(OSError):
                    os.kill(child, signal.SIGKILL)
            if self.process.returncode is None:
                with contextlib.suppress(OSError):
                    os.kill(self.process.pid, signal.SIGKILL)
            time.sleep(0.001)


def _before_exec(parent: int) -> Callable[[], None]:
    """What the script's process does before it becomes the script."""
    import resource

    libc = _libc() if sys.platform == "linux" else None

    def prepare() -> None:
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))  # a crash leaves no file in the project
        for number in (signal.SIGHUP, signal.SIGINT, signal.SIGQUIT, signal.SIGTERM):
            signal.signal(number, signal.SIG_DFL)  # `nohup coursebuild` must not make scripts deaf
        if libc is not None:
            libc.prctl(_PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)
            if os.getppid() != parent:
                os._exit(1)

    return prepare


def missing_modules(names: Sequence[str], folder: Path | None, library: str) -> list[str]:
    """Which of these modules a script in `folder` could not import; none is imported."""
    path = [*([str(folder)] if folder else []), *sys.path, *([library] if library else [])]
    importlib.invalidate_caches()
    return [name for name in names if not _exists(name, path)]


def _exists(name: str, path: list[str]) -> bool:
    prefix = ""
    where: Sequence[str] | None = path
    for part in name.split("."):
        prefix = f"{prefix}.{part}" if prefix else part
        if where is None or not part.isidentifier():
            return False
        spec = _find(prefix, where, top=prefix == part)
        if spec is None:
            return False
        where = spec.submodule_search_locations
    return True


def _find(name: str, path: Sequence[str], *, top: bool) -> importlib.machinery.ModuleSpec | None:
    saved = sys.path
    try:
        if top:
            sys.path = list(path)
        for finder in sys.meta_path:
            # A finder of some installed package may do anything.
            with contextlib.suppress(Exception):
                spec = finder.find_spec(name, None if top else path)
                if spec is not None:
                    return spec
        return None
    finally:
        sys.path = saved


def _children() -> Iterator[int]:
    """The children of this process that are alive or not yet reaped, where the system can tell."""
    me = os.getpid()
    listed = Path(f"/proc/self/task/{me}/children")
    with contextlib.suppress(OSError):
        yield from map(int, listed.read_text().split())
        return
    with contextlib.suppress(OSError):
        for entry in Path("/proc").iterdir():
            with contextlib.suppress(OSError, ValueError, IndexError):
                # The name, in parentheses, may hold anything; the parent is the second field after.
                if int((entry / "stat").read_text().rpartition(")")[2].split()[1]) == me:
                    yield int(entry.name)


def _report(
    end: Literal["missing", "unstartable"],
    *,
    status: int = 0,
    missing: list[str] | None = None,
    stderr: str = "",
) -> Report:
    return {
        "end": end,
        "status": status,
        "seconds": 0.0,
        "missing": missing or [],
        "stdout": 0,
        "stderr": len(stderr.encode()),
    }


def remove_folder(folder: str) -> None:
    """Remove a script's temporary folder, also where it took away its own permissions."""
    shutil.rmtree(folder, ignore_errors=True)
    if Path(folder).exists():
        with contextlib.suppress(OSError):
            for parent, _, _ in os.walk(folder):
                Path(parent).chmod(0o700)
        shutil.rmtree(folder, ignore_errors=True)


def _receive(fd: int) -> bytes | None:
    """The next message; `None` when there are no more."""
    header = _read_exactly(fd, LENGTH.size)
    return None if header is None else _read_exactly(fd, LENGTH.unpack(header)[0])


def _read_exactly(fd: int, count: int) -> bytes | None:
    data = b""
    while len(data) < count:
        chunk = os.read(fd, count - len(data))
        if not chunk:
            return None
        data += chunk
    return data


def _send(fd: int, header: bytes, *blobs: bytes) -> None:
    rest = memoryview(b"".join((LENGTH.pack(len(header)), header, *blobs)))
    while rest:
        rest = rest[os.write(fd, rest) :]


if __name__ == "__main__":
    main()
