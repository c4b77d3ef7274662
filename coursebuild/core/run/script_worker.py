"""The processes that run scripts, seen from the tool, and what their sandboxes take.

A limit of the system holds for one process only. So the tool adds up, many times a second, what
lies in the memory of all processes of a sandbox and in its folders in memory. Other memory can be
had by nobody in there: the filter of system calls refuses it (see `seccomp`). The processes are
those in the sandbox's own /proc, which shows no others. It is opened once, and nobody in there can
mount another one.
"""

from __future__ import annotations

import contextlib
import os
import re
import signal
import time
from collections.abc import Iterator, Mapping
from multiprocessing.connection import wait

import msgspec
from msgspec import Struct

from coursebuild.core.model.results import Outcome
from coursebuild.core.run import gate
from coursebuild.core.run.watching import LENGTH, PROGRAM, STARTED

_MAX_REPORT_SIZE = 256 << 20
"""Bytes that a report may have."""
START = 60.0
"""Seconds that a sandbox may take to start its script."""
_GRACE = 5.0
"""Seconds that it may take to report, after its script's time limit."""


class ChildReport(Struct, frozen=True):
    """What a script did, as its supervisor reports it."""

    outcome: str
    """The value of an `Outcome`."""
    status: int
    """Exit status; the signal's number where one ended it."""
    seconds: float
    missing: tuple[str, ...]
    parts: tuple[str | None, ...]
    """Bytes, as Latin-1: its output, the end of its error output, its trace (empty where nobody
    watched), and each figure of the job; `None` for one that it did not draw."""
    errno: int | None
    """The system's number for why it was not started, if the system refused that."""
    part_starts: tuple[int, ...] = ()
    """Where in its output each part begins that it reached, but the first."""


class Worker:
    """A supervisor process, which gets jobs and sends reports; it starts when this is made.

    `environment` is that of the scripts, `python` runs them, `fork` says whether they may run in
    copies of the supervisor, and `enclose` makes a command that runs in a sandbox.

    Raises:
        OSError: the process cannot be started.
    """

    def __init__(
        self,
        environment: Mapping[str, str],
        python: str,
        *,
        fork: bool,
        enclose: gate.Enclose | None,
    ) -> None:
        self.environment = environment
        self.job: int | None = None
        """The index of the job that it works on."""
        self.is_reused = False
        """Whether it comes from an earlier run and has reported nothing in this one."""
        self.excess: tuple[Outcome, str] | None = None
        """Why its sandbox was ended: how its script counts as ended, and the end of a sentence."""
        self._buffer = bytearray()
        job_reader, job_writer = os.pipe()
        self.reports, report_writer = os.pipe()
        self.jobs: int | None = job_writer
        command = [python, PROGRAM, str(job_reader), str(report_writer), str(int(fork))]
        try:
            self._process = gate.start(
                command,
                environment,
                stdout=gate.PIPE,
                stderr=gate.PIPE,
                pass_fds=(job_reader, report_writer),
                bound=False,  # it sees its input close, and then ends what it runs
                enclose=enclose,
            )
        except BaseException:
            os.close(job_writer)
            os.close(self.reports)
            raise
        finally:
            os.close(job_reader)
            os.close(report_writer)
        for pipe in (self._process.stdout, self._process.stderr):
            assert pipe is not None
            pipe.close()  # a script's streams are pipes too; the supervisor itself prints nothing
        self._watch = None if enclose is None else SandboxWatch(self._process.pid)
        self._start_time = time.monotonic()
        """When the script was started; until then, this process."""
        self._has_started = False

    def give(self, index: int, message: bytes) -> None:
        """Hand over a job."""
        self.job = index
        assert self.jobs is not None
        # The pipe is broken if the supervisor has died, which reading will show.
        with contextlib.suppress(BrokenPipeError), open(self.jobs, "wb", closefd=False) as pipe:
            pipe.write(LENGTH.pack(len(message)) + message)

    def enforce_limits(self, timeout: float, memory: int) -> None:
        """End its sandbox if that takes too many seconds, too many MiB, or too many processes.

        The supervisor ends its script at the first of these limits; but it is inside.
        """
        if self._watch is None or self.excess is not None:
            return
        seconds = time.monotonic() - self._start_time
        if self._has_started and seconds > timeout + _GRACE:
            self.excess = Outcome.TIMEOUT, "did not end at its time limit"
        elif seconds > START and not (self._has_started and self._watch.is_ready()):
            self.excess = Outcome.KILLED, f"did not start within {START:g} s"
        elif excess := self._watch.excess(memory):
            self.excess = Outcome.KILLED, excess
        if self.excess is not None:
            self._watch.kill()
            self.kill()

    def kill(self) -> None:
        """End it at once, on Linux with what it runs."""
        self._process.kill()

    def dismiss(self) -> None:
        """Close its input, so that it kills what it runs and ends."""
        if self.jobs is not None:
            os.close(self.jobs)
            self.jobs = None

    def read(self) -> bool:
        """Read what it has sent; `False` when it has ended."""
        data = os.read(self.reports, 1 << 16)
        self._buffer += data
        return bool(data)

    def take_report(self) -> ChildReport | None:
        """Take the next report if all of it has been read; a `ValueError` says that it is none."""
        size = LENGTH.size
        if not self._has_started and self._buffer.startswith(STARTED):
            del self._buffer[:size]
            self._start_time, self._has_started = time.monotonic(), True
        if len(self._buffer) < size:
            return None
        (length,) = LENGTH.unpack(self._buffer[:size])
        if length > _MAX_REPORT_SIZE:
            raise ValueError("too long")
        if len(self._buffer) < size + length:
            return None
        report = msgspec.json.decode(self._buffer[size:], type=ChildReport)
        self._buffer.clear()
        self._has_started = False
        return report

    def status(self) -> int:
        """Its exit status, or minus the number of the signal that ended it."""
        return self._process.wait()

    def close(self) -> None:
        """Dismiss it and wait until it has killed what it runs; end its sandbox at once."""
        self.dismiss()
        until = time.monotonic() + (10.0 if self._watch is None else 0.0)
        try:
            while (left := until - time.monotonic()) > 0 and wait([self.reports], left):
                if not os.read(self.reports, 1 << 16):
                    break
        finally:
            os.close(self.reports)
            self.kill()  # if it is still there
            self._process.wait()
            if self._watch is not None:
                self._watch.close()


# --- what a sandbox takes

PROCESSES = 256
"""Processes and threads that a script may have, with all that it starts."""
_MANY = f"had more than {PROCESSES} processes and threads"
_LOOKS = 3
"""How often the processes are listed, at most, to tell those that have ended from the others."""
_FIELD = re.compile(rb"^(?:RssAnon|VmSwap|VmPTE|HugetlbPages):\s*(\d+) kB$", re.MULTILINE)
"""What a process takes for itself; files, and memory that is a file's, are counted elsewhere."""
_SHARE = re.compile(rb"^(?:Pss_Anon|SwapPss):\s*(\d+) kB$", re.MULTILINE)
_THREADS = re.compile(rb"^Threads:\s*(\d+)$", re.MULTILINE)
_ENDED = re.compile(rb"^State:\s*[ZX]", re.MULTILINE)
_SOCKETS = re.compile(rb"^sockets: used (\d+)$", re.MULTILINE)
SUPERVISOR_MEMORY = 32
"""MiB, at most, that the supervisor takes for itself, beside what its copy, the script, shares."""
_SOCKET_SIZE = 416
"""KiB that a socket may keep, unread."""
_INODE_SIZE = 1
"""KiB that an empty file takes."""
_CHUNK = 1 << 14


class SandboxWatch:
    """Counts what a sandbox takes, given the process of `bwrap`."""

    def __init__(self, bwrap: int) -> None:
        self._bwrap = bwrap
        self._first = 0
        """The first process in the sandbox, as it is numbered outside."""
        self._proc = -1
        """The sandbox's /proc."""
        self._folders: list[int] = []
        """Its file systems in memory."""

    def close(self) -> None:
        """Give the sandbox's folders back, so that the system frees them."""
        for fd in (self._proc, *self._folders):
            with contextlib.suppress(OSError):
                os.close(fd)
        self._proc, self._folders = -1, []

    def is_ready(self) -> bool:
        """Whether the sandbox stands, so that it can be watched from now on."""
        if self._proc >= 0:
            return True
        try:
            with open(f"/proc/{self._bwrap}/task/{self._bwrap}/children", "rb") as file:  # noqa: PTH123
                (self._first,) = map(int, file.read().split())
            root = f"/proc/{self._first}/root"
            proc = os.open(f"{root}/proc", os.O_RDONLY | os.O_DIRECTORY)
        except (OSError, ValueError):
            return False
        self._proc = proc
        if os.fstat(proc).st_dev == os.stat("/proc").st_dev:  # noqa: PTH116
            self.close()  # it still sees ours
            return False
        try:
            for point, device in self._mounts_in_memory():
                fd = os.open(f"{root}{point}", os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
                self._folders.append(fd)
                if os.fstat(fd).st_dev != device:  # a script may put something in its place
                    raise OSError("no longer mounted there")
        except OSError:
            self.close()
            return False
        return True

    def first_process(self) -> int:
        """The first process in the sandbox, as it is numbered outside; 0 before it stands."""
        return self._first if self.is_ready() else 0

    def excess(self, memory: int) -> str:
        """The limit that is exceeded (`memory` is in MiB), as the end of a sentence, or empty."""
        if not self.is_ready():
            return ""
        most = memory + SUPERVISOR_MEMORY << 10
        processes = self._processes()
        if processes is None:
            return _MANY
        size = self._size_of_files() + sum(_sum(_FIELD, status) for _, status in processes)
        if size > most:  # what copies of a process still share was counted for each
            shares = ((self._read(f"{name}/smaps_rollup"), status) for name, status in processes)
            size = self._size_of_files() + sum(
                _sum(_SHARE, share) if share else _sum(_FIELD, status) for share, status in shares
            )
        return f"took more than {memory} MiB of memory" if size > most else ""

    def _processes(self) -> list[tuple[str, bytes]] | None:
        """The processes, each with its status; `None` where they and their threads are too many.

        Those that have ended do not count, as on a busy machine the supervisor reaps them late. One
        is left out only if it had ended before the others were listed: among processes that fork
        and end without pause, each may have ended when it is read, with a child that is not listed.
        """
        zombies: set[str] = set()
        for _ in range(_LOOKS):
            names = {name for name in os.listdir(self._proc) if name.isdigit()}  # noqa: PTH208
            if len(names) > 2 * PROCESSES:  # to read them all would give time for more
                return None
            processes, threads, alive = [], 0, 0
            for name in names - zombies:
                name_of_thread, status = self._status(name)
                processes.append((name_of_thread, status))
                count = _sum(_THREADS, status)
                threads += count
                if count == 1 and _ENDED.search(status):  # with more, only its first thread has
                    zombies.add(name)
                    continue
                alive += count
                if alive > PROCESSES:
                    return None
            if max(threads, len(processes)) <= PROCESSES:
                return processes
        return None

    def _status(self, name: str) -> tuple[str, bytes]:
        """The status of a process, and the number of the thread that gives it.

        That of a first thread that has ended shows nothing of the memory that the others have.
        """
        status = self._read(f"{name}/status")
        if _ENDED.search(status) and _sum(_THREADS, status) > 1:
            with contextlib.suppress(OSError):
                fd = os.open(f"{name}/task", os.O_RDONLY | os.O_DIRECTORY, dir_fd=self._proc)
                try:
                    threads = os.listdir(fd)  # noqa: PTH208
                finally:
                    os.close(fd)
                for thread in threads:
                    other_status = self._read(f"{thread}/status")
                    if other_status and not _ENDED.search(other_status):
                        return thread, other_status
        return name, status

    def kill(self) -> None:
        """Kill the first process, and so all in the sandbox, without waiting for others if it may.

        Among thousands of processes that fork, its turn to end would come late.
        """
        with contextlib.suppress(OSError):
            os.setpriority(os.PRIO_PROCESS, self._bwrap, -20)
        if self._first:  # `bwrap` is its parent, so that no other can have its number yet
            with contextlib.suppress(OSError):
                os.setpriority(os.PRIO_PROCESS, self._first, -20)
            with contextlib.suppress(OSError):
                os.kill(self._first, signal.SIGKILL)

    def _size_of_files(self) -> int:
        """The KiB in files in memory, and at most in sockets."""
        size = _SOCKET_SIZE * _sum(_SOCKETS, self._read("1/net/sockstat"))
        for fd in self._folders:
            state = os.fstatvfs(fd)
            size += (state.f_blocks - state.f_bfree) * state.f_frsize >> 10
            size += (state.f_files - state.f_ffree) * _INODE_SIZE
        return size

    def _mounts_in_memory(self) -> Iterator[tuple[str, int]]:
        for line in self._read("1/mountinfo").splitlines():
            fields = line.split()
            kind, is_own = fields[fields.index(b"-") + 1], fields[3] == b"/"
            if kind == b"tmpfs" and is_own and fields[5].startswith(b"rw"):  # others are only shown
                major, minor = map(int, fields[2].split(b":"))
                point = re.sub(rb"\\(\d{3})", lambda match: bytes([int(match[1], 8)]), fields[4])
                yield os.fsdecode(point), os.makedev(major, minor)

    def _read(self, path: str) -> bytes:
        """A file of the sandbox's /proc; empty where there is none any more, or it is kept back."""
        data = b""
        with contextlib.suppress(OSError):
            fd = os.open(path, os.O_RDONLY, dir_fd=self._proc)
            try:
                while chunk := os.read(fd, _CHUNK):
                    data += chunk
            finally:
                os.close(fd)
        return data


def _sum(pattern: re.Pattern[bytes], text: bytes) -> int:
    return sum(map(int, pattern.findall(text)))
