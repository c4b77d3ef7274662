"""Waiting for the author to save: changes of the course's files, as `watchfiles` tells of them.

Entry point: `FolderWatcher`. What reading a course leaves out (caches, editors' own files) is no
change.

The folders of the course are watched with all that is in them. Pages may lie elsewhere
(`docs/guide.md`, `README.md`): of their folders only these files count. Folders that are made later
are watched from then on.
"""

from __future__ import annotations

import contextlib
import posixpath
import queue
import stat
import threading
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

from coursebuild.core.files.errors import EffectError, reason

FOLDERS = ("content", "features", "models", "mjcourse")
LOOK = 0.200
"""Seconds from one look for new and removed folders to the next."""
_STEP = 2
"""Milliseconds from one look for events to the next: a save is told of within two of them."""


class FolderWatcher:
    """Tells of saves, also of those while the caller does something else."""

    def __init__(self, root: Path) -> None:
        self._root = root
        self._stop = threading.Event()
        self._others: frozenset[str] = frozenset()
        self._events: queue.SimpleQueue[frozenset[str] | OSError] = queue.SimpleQueue()
        self._begun = [threading.Event(), threading.Event()]
        self._threads = [
            threading.Thread(target=self._run, args=(watch, begun), name="watch", daemon=True)
            for watch, begun in zip((self._folders, self._files), self._begun, strict=True)
        ]

    def start(self) -> None:
        """Begin to watch; `wait` says when nothing is missed any more."""
        for thread in self._threads:
            thread.start()

    def wait(self) -> None:
        """Until no change is missed."""
        for begun in self._begun:
            begun.wait()

    @property
    def stopped(self) -> bool:
        """Whether it was stopped."""
        return self._stop.is_set()

    def stop(self) -> None:
        """Watch no longer."""
        self._stop.set()
        self._events.put(frozenset())
        for thread in self._threads:
            if thread.is_alive():
                thread.join(1.0)

    def watch_also(self, paths: frozenset[str]) -> None:
        """Files elsewhere that count as well, by POSIX path relative to the course's folder."""
        self._others = frozenset(path for path in paths if path.split("/")[0] not in FOLDERS)

    def get(self, seconds: float) -> frozenset[str]:
        """Paths that changed, POSIX and relative to the root; empty where there is nothing new.

        Waits for so long.

        Raises:
            EffectError: changes cannot be watched.
        """
        try:
            found = self._events.get(timeout=seconds) if seconds > 0 else self._events.get_nowait()
        except queue.Empty:
            return frozenset()
        if isinstance(found, OSError):
            raise EffectError(
                f"changes of files cannot be watched: {reason(found)}",
                help="the system's limit of watched files may be reached (fs.inotify on Linux)",
            )
        return found

    def _run(self, watch: Callable[[Callable[[], None]], None], begun: threading.Event) -> None:
        try:
            watch(begun.set)
        except OSError as error:
            self._events.put(error)
        finally:
            begun.set()

    # --- the course's own folders

    def _folders(self, begun: Callable[[], None]) -> None:
        before: frozenset[str] | None = None
        while not self._stop.is_set():
            folders = self._there(FOLDERS)
            # Told of once they are watched: a file may be put into a new one at any time, and into
            # any while none was.
            news = frozenset() if before is None else before | folders.keys()
            for changed in self._watch(tuple(self._root / f for f in folders), recursive=True):
                begun()
                if changed | news:
                    self._events.put(changed | news)
                news = frozenset()
                if self._there(FOLDERS) != folders:
                    break
            before = frozenset(folders)

    # --- files elsewhere

    def _files(self, begun: Callable[[], None]) -> None:
        others: frozenset[str] = frozenset()
        before: dict[str, tuple[int, int]] = {}
        while not self._stop.is_set():
            known, others = others, self._others
            parents = {path: posixpath.dirname(path) for path in others}
            folders = self._there(parents.values())
            # As above; of what was not asked for until now nobody has missed anything.
            moved = {f for f in parents.values() if folders.get(f) != before.get(f)}
            news = frozenset(path for path in known & others if parents[path] in moved)
            for changed in self._watch(tuple(self._root / f for f in folders), recursive=False):
                begun()
                if wanted := changed & others | news:
                    self._events.put(wanted)
                news = frozenset()
                if self._others != others or self._there(parents.values()) != folders:
                    break
            before = folders

    # --- both

    def _there(self, folders: Iterable[str]) -> dict[str, tuple[int, int]]:
        """The folders that there are, and which they are: device and inode."""
        found = {}
        for name in sorted(set(folders)):
            with contextlib.suppress(OSError):
                status = (self._root / name).stat()
                if stat.S_ISDIR(status.st_mode):
                    found[name] = status.st_dev, status.st_ino
        return found

    def _watch(self, folders: tuple[Path, ...], *, recursive: bool) -> Iterator[frozenset[str]]:
        """Changes in these folders; an empty set at first, and now and then."""
        if not folders:
            while not self._stop.is_set():
                yield frozenset()
                self._stop.wait(LOOK)
            return
        from watchfiles import watch

        for batch in watch(
            *folders,
            watch_filter=lambda _, path: self._is_source(path),
            stop_event=self._stop,
            debounce=5 * _STEP,
            step=_STEP,
            rust_timeout=round(1000 * LOOK),
            yield_on_timeout=True,
            recursive=recursive,
        ):
            yield frozenset(Path(path).relative_to(self._root).as_posix() for _, path in batch)

    def _is_source(self, path: str) -> bool:
        try:
            return is_source(Path(path).relative_to(self._root).as_posix())
        except ValueError:
            return False


def is_source(path: str) -> bool:
    """Whether a path, POSIX and relative to the course, is none of an editor's or of Python's."""
    return bool(path) and not any(map(_is_dropping, path.split("/")))


def _is_dropping(name: str) -> bool:
    return name.startswith((".", "#")) or name.endswith("~") or name in ("4913", "__pycache__")
