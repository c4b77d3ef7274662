"""What a sandbox takes, counted from outside: its memory and its processes, all together.

Entry point: `SandboxWatch`.

A limit of the system holds for one process only. So the tool adds up, many times a second, what
lies in the memory of all processes and in the sandbox's folders in memory. Other memory can be had
by nobody in there: the filter of system calls refuses it (see `seccomp`).

The processes are those in the sandbox's own /proc, which shows no others. It is opened once, and
nobody in there can mount another one.
"""

from __future__ import annotations

import contextlib
import os
import re
import signal
from collections.abc import Iterator

PROCESSES = 256
"""Processes and threads that a script may have, with all that it starts."""
_MANY = f"had more than {PROCESSES} processes and threads"
_FIELD = re.compile(rb"^(?:RssAnon|VmSwap|VmPTE|HugetlbPages):\s*(\d+) kB$", re.MULTILINE)
"""What a process takes for itself; files, and memory that is a file's, are counted elsewhere."""
_SHARE = re.compile(rb"^(?:Pss_Anon|SwapPss):\s*(\d+) kB$", re.MULTILINE)
_THREADS = re.compile(rb"^Threads:\s*(\d+)$", re.MULTILINE)
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
            self._folders = [_open_mount(root, at, dev) for at, dev in self._mounts_in_memory()]
        except OSError:
            self.close()
            return False
        return True

    def excess(self, memory: int) -> str:
        """The limit that the sandbox exceeds, as the end of a sentence; empty while it does not.

        `memory` is in MiB.
        """
        if not self.is_ready():
            return ""
        most = memory + SUPERVISOR_MEMORY << 10
        names = [name for name in os.listdir(self._proc) if name.isdigit()]  # noqa: PTH208
        if len(names) > PROCESSES:  # to read them all would give time for more
            return _MANY
        processes, threads, size = [], 0, self._size_of_files()
        for name in names:
            status = self._read(f"{name}/status")
            threads += _sum(_THREADS, status)
            size += _sum(_FIELD, status)
            processes.append((name, status))
        if threads > PROCESSES:
            return _MANY
        if size > most:  # what copies of a process still share was counted for each
            shares = ((self._read(f"{name}/smaps_rollup"), status) for name, status in processes)
            size = self._size_of_files() + sum(
                _sum(_SHARE, share) if share else _sum(_FIELD, status) for share, status in shares
            )
        return f"took more than {memory} MiB of memory" if size > most else ""

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
        """The mount points of file systems in memory, each with its device."""
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


def _open_mount(root: str, point: str, device: int) -> int:
    """Open a mount point, which a script may have put something else in place of."""
    fd = os.open(f"{root}{point}", os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
    if os.fstat(fd).st_dev != device:
        os.close(fd)
        raise OSError("not mounted there any more")
    return fd


def _sum(pattern: re.Pattern[bytes], text: bytes) -> int:
    return sum(map(int, pattern.findall(text)))
