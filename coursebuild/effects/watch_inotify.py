"""Changes of a course's files, as Linux tells of them.

Entry point: `InotifyWatcher`, a `Watcher` (see `watch`).

1. Each folder is watched by itself. One that is made or moved here later is watched first and then
   looked through, so that a file put into it meanwhile is told of.
2. The kernel keeps what happens until it is asked for; where it had to drop something, everything
   is watched anew, and told of as changed.
3. A file that was written is whole when who wrote it has closed it. `get` waits for that, but not
   for long: a program may keep a file open that it does not write any more.

There is no thread: whoever calls `get` reads the messages, and is woken by the first of them.
"""

from __future__ import annotations

import contextlib
import ctypes
import errno
import os
import select
import stat
import struct
import time
from pathlib import Path
from typing import Final

from coursebuild.effects.errors import EffectError, reason
from coursebuild.effects.watch_paths import FOLDERS, LOOK, is_source

_MODIFY: Final = 0x2
_ATTRIB: Final = 0x4
_CLOSE_WRITE: Final = 0x8
_MOVED_FROM: Final = 0x40
_MOVED_TO: Final = 0x80
_CREATE: Final = 0x100
_DELETE: Final = 0x200
_OVERFLOW: Final = 0x4000
_IGNORED: Final = 0x8000
_ONLY_FOLDERS: Final = 0x0100_0000
_IS_FOLDER: Final = 0x4000_0000
_EVENTS = _MODIFY | _ATTRIB | _CLOSE_WRITE | _MOVED_FROM | _MOVED_TO | _CREATE | _DELETE
_HEAD = struct.Struct("iIII")
"""Of a message: the watch, what happened, what belongs together, the length of the name."""
_CHUNK = 1 << 16
_UNWATCHABLE = frozenset((errno.ENOENT, errno.ENOTDIR, errno.EACCES, errno.ELOOP))
"""Why a folder is not watched: it is none any more, or nobody here may read it."""
_OPEN = 0.010
"""Seconds for which `get` waits until a file that is being written is closed."""


class InotifyWatcher:
    """See `watch.Watcher`."""

    exact = True
    """The kernel tells when a file is closed."""

    def __init__(self, root: Path) -> None:
        self._root = root
        self._others: frozenset[str] = frozenset()
        self._wake = os.eventfd(0, os.EFD_CLOEXEC | os.EFD_NONBLOCK)
        self._kernel = _Kernel()
        self._stopped = False
        self._paths: dict[int, tuple[str, ...]] = {}
        """The folders of each watch: several where links lead to the same one."""
        self._links: set[str] = set()
        """Links that there were: they may lead to folders."""
        self._tops: dict[str, tuple[int, int] | None] = {}
        """Folders that are to be watched, and which they were: device and inode."""
        self._changed: set[str] = set()
        """What `get` has not told of yet."""
        self._open: set[str] = set()
        """Files that were written and not closed since."""

    def __del__(self) -> None:
        """Give the descriptors back when nobody can wait for them any more."""
        os.close(self._wake)

    def start(self) -> None:
        """Begin to watch."""
        try:
            self._look()
        except OSError as error:
            raise _unwatchable(error) from None
        self._changed.clear()

    def wait(self) -> None:
        """Nothing is missed once `start` has returned."""

    @property
    def stopped(self) -> bool:
        """Whether it was stopped."""
        return self._stopped

    def stop(self) -> None:
        """Watch no longer."""
        self._stopped = True
        os.eventfd_write(self._wake, 1)

    def watch_also(self, paths: frozenset[str]) -> None:
        """Files elsewhere that count as well, by POSIX path relative to the course's folder."""
        self._others = frozenset(path for path in paths if path.split("/")[0] not in FOLDERS)

    @property
    def writing(self) -> bool:
        """Whether a file was written and is not closed yet."""
        return bool(self._open)

    def get(self, seconds: float) -> frozenset[str]:
        """See `watch.Watcher`."""
        until = time.monotonic() + seconds
        began: float | None = None
        """When something was first there to tell of."""
        try:
            while not self._stopped:
                self._look()
                self._take()
                now = time.monotonic()
                if self._changed and began is None:
                    began = now
                last = until if began is None else min(until, began + _OPEN)
                if now >= last or (self._changed and not self._open):
                    break
                self._sleep(min(last - now, LOOK))
        except OSError as error:
            raise _unwatchable(error) from None
        if not self._changed:
            self._open.clear()  # who has it open writes nothing
        told = frozenset(self._changed)
        self._changed.clear()
        return told

    def _sleep(self, seconds: float) -> None:
        poll = select.poll()
        poll.register(self._kernel.fd, select.POLLIN)
        poll.register(self._wake, select.POLLIN)
        poll.poll(max(1.0, seconds * 1000.0))

    # --- what happened

    def _take(self) -> None:
        """Read what the kernel has to tell."""
        for watch, what, name in self._kernel.messages():
            if what & _OVERFLOW:
                self._begin_anew()
                return
            if what & _IGNORED:
                self._paths.pop(watch, None)
                continue
            for folder in self._paths.get(watch, ()):
                path = f"{folder}/{name}" if folder else name
                if not name or not is_source(path):
                    continue
                if self._is_ours(folder):
                    self._happened(path, what)
                elif path in self._others:
                    self._file_happened(path, what)

    def _is_ours(self, folder: str) -> bool:
        return folder.split("/")[0] in FOLDERS

    def _happened(self, path: str, what: int) -> None:
        """Something in a folder of the course."""
        if not what & _IS_FOLDER:
            self._file_happened(path, what)
            if what & (_CREATE | _MOVED_TO) and (self._root / path).is_symlink():
                self._links.add(path)
                self._add(path)  # it may lead to a folder
            elif what & (_DELETE | _MOVED_FROM) and path in self._links:
                self._drop(path)
            return
        self._changed.add(path)
        if what & (_DELETE | _MOVED_FROM):
            self._drop(path)
        elif what & (_CREATE | _MOVED_TO):
            self._add(path)

    def _file_happened(self, path: str, what: int) -> None:
        self._changed.add(path)
        if what & (_CLOSE_WRITE | _DELETE | _MOVED_FROM | _MOVED_TO):
            self._open.discard(path)
        elif what & _MODIFY:
            self._open.add(path)

    # --- which folders are watched

    def _begin_anew(self) -> None:
        """Messages were lost: anything may have happened."""
        self._kernel = _Kernel()
        self._paths.clear()
        self._links.clear()
        self._open.clear()
        self._changed |= self._others | {name for name in FOLDERS if self._tops.get(name)}
        self._tops = dict.fromkeys(self._tops)
        self._look()

    def _look(self) -> None:
        """See to it that all folders are watched which are to be."""
        elsewhere = {path.rpartition("/")[0] for path in self._others}
        for folder in self._tops.keys() - elsewhere - {*FOLDERS}:
            del self._tops[folder]
            self._drop(folder, deep=False)
        for folder in (*FOLDERS, *sorted(elsewhere)):
            there, known = self._identity(folder), self._tops.get(folder)
            if folder in self._tops and there == known:
                continue
            deep = folder in FOLDERS
            self._drop(folder, deep=deep)
            if there is not None:
                self._add(folder, deep=deep)
            if deep and there != known:
                self._changed.add(folder)
            elif folder in self._tops:
                self._changed |= {p for p in self._others if p.rpartition("/")[0] == folder}
            self._tops[folder] = there

    def _identity(self, folder: str) -> tuple[int, int] | None:
        try:
            found = (self._root / folder).stat()
        except OSError:
            return None
        return (found.st_dev, found.st_ino) if stat.S_ISDIR(found.st_mode) else None

    def _add(self, folder: str, *, deep: bool = True) -> None:
        """Watch a folder, with all that is in it if `deep`, which is then told of as changed."""
        watch = self._kernel.watch(self._root / folder)
        if watch is None:
            return
        known = self._paths.get(watch, ())
        if any(folder == path or folder.startswith(f"{path}/") for path in known):
            return  # it is watched already, or is a link to a folder that it lies in
        self._paths[watch] = (*known, folder)
        if not deep:
            return
        with contextlib.suppress(OSError), os.scandir(self._root / folder) as entries:
            for entry in entries:
                path = f"{folder}/{entry.name}"
                if is_source(path):
                    self._changed.add(path)
                    if entry.is_symlink():
                        self._links.add(path)
                    if entry.is_dir():
                        self._add(path)

    def _drop(self, folder: str, *, deep: bool = True) -> None:
        """Watch a folder no longer, nor what is in it if `deep`."""
        for watch, paths in list(self._paths.items()):
            left = tuple(
                path
                for path in paths
                if path != folder and not (deep and path.startswith(f"{folder}/"))
            )
            if not left:
                del self._paths[watch]
                self._kernel.forget(watch)
            elif left != paths:
                self._paths[watch] = left
        for path in [p for p in self._open if deep and p.startswith(f"{folder}/")]:
            self._open.discard(path)


class _Kernel:
    """The system's calls, which Python has no names for."""

    fd = -1
    """Where messages are read."""

    def __init__(self) -> None:
        self._calls = ctypes.CDLL(None, use_errno=True)
        self.fd = self._calls.inotify_init1(os.O_NONBLOCK | os.O_CLOEXEC)
        if self.fd < 0:
            raise _unwatchable(_last_error())

    def __del__(self) -> None:
        if self.fd >= 0:
            os.close(self.fd)

    def watch(self, folder: Path) -> int | None:
        """Watch a folder; gives the watch's number, that of before where it is watched already."""
        path = os.fsencode(folder)
        watch: int = self._calls.inotify_add_watch(self.fd, path, _EVENTS | _ONLY_FOLDERS)
        if watch >= 0:
            return watch
        error = _last_error()
        if error.errno in _UNWATCHABLE:
            return None
        raise error

    def forget(self, watch: int) -> None:
        """Watch a folder no longer; it may be gone."""
        self._calls.inotify_rm_watch(self.fd, watch)

    def messages(self) -> list[tuple[int, int, str]]:
        """Of what happened since: the watch, what it was, and the name in the folder."""
        found: list[tuple[int, int, str]] = []
        while True:
            try:
                data = os.read(self.fd, _CHUNK)
            except BlockingIOError:
                return found
            at = 0
            while at < len(data):
                watch, what, _, length = _HEAD.unpack_from(data, at)
                at += _HEAD.size
                name = os.fsdecode(data[at : at + length].rstrip(b"\0"))
                found.append((watch, what, name))
                at += length


def _last_error() -> OSError:
    number = ctypes.get_errno()
    return OSError(number, os.strerror(number))


def _unwatchable(error: OSError) -> EffectError:
    return EffectError(
        f"changes of files cannot be watched: {reason(error)}",
        help="the system's limit of watched files may be reached (fs.inotify on Linux)",
    )
