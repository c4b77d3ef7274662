"""Locks that vanish with the process that holds them, and temporary folders, which are locked.

A lock is an flock: killing its holder frees it at once, so no lock can be stale. Where a file
system has none, as on some network drives, it is filelock's file that names its holder; the next
run takes over that of a process which is gone from this machine. Where the folder cannot be
written, the work goes on without: every write of the tool is whole by itself. (filelock's own
flocks would leave a file beside a site, cannot hold a folder, and do not say who has them.)

1. A temporary folder is locked as long as the process that made it lives. So one that can be locked
   is abandoned; it is removed by the next command, if it is the same user's.
2. In a folder for temporary files others may put what they like. Only folders are removed that are
   private to this user and have a name as given here, and only where nobody else can have moved
   them there. Links are not followed.
3. A new folder may be taken for an abandoned one before it is locked; then another one is made.
"""

from __future__ import annotations

import contextlib
import errno
import fcntl
import os
import re
import shutil
import stat
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from coursebuild.core.files.errors import EffectError, reason
from coursebuild.core.files.trust import find_store, make_store

_BUSY = frozenset({errno.EWOULDBLOCK, errno.EAGAIN, errno.EACCES})
_LONG_AGO = 3600.0
"""Seconds after which a temporary file is abandoned where there are no locks."""
_MOMENT = 0.5
"""Seconds of waiting that nobody is told of: a preview holds the lock for each of its writes."""


def try_lock(fd: int) -> bool | None:
    """Try to lock an open file or folder; return whether it is ours, `None` without locks."""
    try:
        fcntl.flock(fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        return False if error.errno in _BUSY else None
    return True


def is_abandoned(fd: int) -> bool:
    """Whether the writer of a temporary file, who would hold it locked, is gone."""
    locked = try_lock(fd)
    return time.time() - os.fstat(fd).st_mtime > _LONG_AGO if locked is None else locked


@contextlib.contextmanager
def project_lock(
    root: Path, on_wait: Callable[[str], None] | None = None, *, name: str = "lock"
) -> Iterator[None]:
    """Hold a lock of a course folder, which is a file of this name in its store.

    `on_wait` is called once, with a message, if another run has the lock for more than a moment.
    """
    root = root.resolve()
    path = Path(find_store(str(root))[0], name)
    named_file = path.with_name(f"{name}-held")
    with _hold_if_possible(lambda: _lock_file(root, path, on_wait), named_file, on_wait):
        yield


def claim(folder: Path, key: str) -> bool:
    """Claim a piece of work, named by a hash; return `False` while another process does it.

    It is a lock of one byte of a file in the folder, at a place that the hash gives. Where there
    are no locks, everything can be claimed.
    """
    try:
        fcntl.lockf(_claims(folder), fcntl.LOCK_EX | fcntl.LOCK_NB, 1, int(key[:15], 16))
    except OSError as error:
        return error.errno not in _BUSY
    return True


def unclaim(folder: Path, key: str) -> None:
    """Let others claim a piece of work."""
    with contextlib.suppress(OSError):
        fcntl.lockf(_claims(folder), fcntl.LOCK_UN, 1, int(key[:15], 16))


def _claims(folder: Path) -> int:
    """The file of claims, open: closing it anywhere in this process would end all of them."""
    with contextlib.suppress(KeyError, OSError):
        if os.fstat(_open_claims[folder]).st_nlink:
            return _open_claims[folder]
    flags = os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW
    _open_claims[folder] = os.open(folder / "claims", flags, 0o600)
    return _open_claims[folder]


_open_claims: dict[Path, int] = {}


@contextlib.contextmanager
def folder_lock(folder: Path) -> Iterator[None]:
    """Hold a folder locked while something in it is replaced, without leaving a file there."""

    def lock() -> int:
        fd = os.open(folder, os.O_RDONLY | os.O_CLOEXEC)
        if try_lock(fd) is False:
            fcntl.flock(fd, fcntl.LOCK_EX)
        return fd

    with _hold_if_possible(lock, folder / ".coursebuild-lock"):
        yield


@contextlib.contextmanager
def _hold_if_possible(
    lock: Callable[[], int], named_file: Path, on_wait: Callable[[str], None] | None = None
) -> Iterator[None]:
    """Hold what `lock` opens and locks; if the file system refuses, go on without.

    Where there are no locks, hold a file that names this process.
    """
    with contextlib.ExitStack() as stack:
        with contextlib.suppress(OSError):
            fd = lock()
            stack.callback(os.close, fd)
            if not try_lock(fd):
                from filelock import SoftFileLock, Timeout

                named_lock = SoftFileLock(named_file)
                try:
                    named_lock.acquire(timeout=0)
                except Timeout:
                    if on_wait is not None:
                        message = _waiting_message(str(named_lock.pid))
                        on_wait(f"{message} (if there is none, remove {named_file})")
                    named_lock.acquire()
                stack.callback(named_lock.release)
        yield


def _lock_file(root: Path, path: Path, on_wait: Callable[[str], None] | None) -> int:
    """Open and lock a file, waiting if need be; where there are no locks, only open it."""
    while True:
        make_store(str(path.parent), str(root))
        fd = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW, 0o644)
        try:
            until = time.monotonic() + _MOMENT
            while (locked := try_lock(fd)) is False and time.monotonic() < until:
                time.sleep(0.01)
            if locked is False:
                if on_wait is not None:
                    on_wait(_waiting_message(os.pread(fd, 32, 0).decode("ascii", "replace")))
                    on_wait = None
                fcntl.flock(fd, fcntl.LOCK_EX)
            with contextlib.suppress(FileNotFoundError):
                if os.path.samestat(os.fstat(fd), path.stat()):
                    os.ftruncate(fd, 0)
                    os.pwrite(fd, f"{os.getpid()}\n".encode(), 0)
                    return fd
        except BaseException:
            os.close(fd)
            raise
        os.close(fd)  # .coursebuild was deleted while we waited


def _waiting_message(holder: str) -> str:
    process = f" (process {holder.strip()})" if holder.strip().isdigit() else ""
    return f"another coursebuild{process} is at work on this course; waiting for it"


# --- temporary folders

_PREFIX = "coursebuild.tmp."
_NAME = re.compile(re.escape(_PREFIX) + r"[a-z0-9_]{8}")
_OPEN_FOLDER = os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW | os.O_CLOEXEC
_OTHERS_WRITE = stat.S_IWGRP | stat.S_IWOTH


@contextlib.contextmanager
def temporary_folder() -> Iterator[str]:
    """A new folder, removed at the end with all in it; an `EffectError` without a place."""
    import tempfile  # not above: processes that run scripts import this module, and not that

    try:
        while True:
            folder = tempfile.mkdtemp(prefix=_PREFIX)
            with contextlib.suppress(FileNotFoundError):  # taken for abandoned, and removed
                fd = os.open(folder, _OPEN_FOLDER)
                if try_lock(fd) is not False and Path(folder).exists():
                    break
                os.close(fd)
    except OSError as error:
        raise EffectError(f"there is no place for temporary files: {reason(error)}") from None
    try:
        yield folder
    finally:
        remove_folder(folder)
        os.close(fd)


def remove_abandoned_folders() -> None:
    """Remove the temporary folders that this user's processes have left."""
    import tempfile

    # There may be no place for temporary files.
    with contextlib.suppress(OSError), os.scandir(place := tempfile.gettempdir()) as entries:
        status, me = os.stat(place), os.geteuid()  # noqa: PTH116
        is_shared = status.st_mode & _OTHERS_WRITE and not status.st_mode & stat.S_ISVTX
        if is_shared or status.st_uid not in (0, me):
            return  # others can move this user's folders
        for entry in entries:
            with contextlib.suppress(OSError), contextlib.ExitStack() as resources:
                if not _NAME.fullmatch(entry.name):
                    continue
                fd = os.open(entry.path, _OPEN_FOLDER)
                resources.callback(os.close, fd)
                status = os.fstat(fd)
                is_ours = status.st_uid == me and stat.S_IMODE(status.st_mode) == stat.S_IRWXU
                if is_ours and try_lock(fd):
                    remove_folder(entry.path)


def remove_folder(folder: str | Path) -> None:
    """Remove a folder, even if permissions are missing in it; of a link, the link alone."""
    if Path(folder).is_symlink():
        Path(folder).unlink()
    shutil.rmtree(folder, ignore_errors=True)
    with contextlib.suppress(OSError):
        for parent, _, _ in os.walk(folder):
            Path(parent).chmod(0o700)
    shutil.rmtree(folder, ignore_errors=True)
