"""Watching the course's files, by `watchfiles`.

Entry point: `FolderWatcher`. Caches and editors' own files do not count.

The course's folders are watched with everything in them, including folders that are made later,
and so are those that its scripts import from. Pages may be elsewhere (`docs/guide.md`,
`README.md`): these files are polled.
"""

from __future__ import annotations

import contextlib
import queue
import stat
import threading
from collections.abc import Iterable, Iterator
from pathlib import Path

from coursebuild.core.files.course_root import FOLDERS, is_dropping
from coursebuild.core.files.errors import EffectError, reason

LOOK = 0.200
"""Seconds between two looks for new and removed folders, and at files elsewhere."""
_PROBE = "4913"
"""A file that vim makes for a moment, to see whether it can."""
_STEP = 2
"""Milliseconds between two looks for events: a save is noticed within two of them."""


class FolderWatcher:
    """Tells of saves, also of those while the caller does something else."""

    def __init__(self, root: Path) -> None:
        self._root = root
        self._stop = threading.Event()
        self._watched: tuple[str, ...] = FOLDERS
        self._others: dict[str, tuple[int, ...]] = {}
        """Files elsewhere, and their state at the last look."""
        self._events: queue.SimpleQueue[frozenset[str] | OSError] = queue.SimpleQueue()
        self._begun = threading.Event()
        self._thread = threading.Thread(target=self._run, name="watch", daemon=True)

    def start(self) -> None:
        """Begin to watch; from then on no change is missed."""
        self._thread.start()
        self._begun.wait()

    @property
    def stopped(self) -> bool:
        """Whether it was stopped."""
        return self._stop.is_set()

    def stop(self) -> None:
        """Watch no longer."""
        self._stop.set()
        self._events.put(frozenset())
        if self._thread.is_alive():
            self._thread.join(1.0)

    def watch_also(self, paths: frozenset[str], folders: Iterable[str] = ()) -> None:
        """Files and folders elsewhere that count as well, by POSIX path below the course's folder.

        The whole of the course's folder cannot: what the tool itself writes lies in it.
        """
        self._watched = (*FOLDERS, *(folder for folder in folders if folder != "."))
        inside = tuple(f"{folder}/" for folder in self._watched)
        others = {path for path in paths if not path.startswith(inside)}
        self._others = {path: self._others.get(path, self._state(path)) for path in others}

    def get(self, seconds: float) -> frozenset[str]:
        """Paths that changed, POSIX and relative to the root; empty where there is nothing new.

        Waits for so long.

        Raises:
            EffectError: changes cannot be watched.
        """
        try:
            found = self._events.get(timeout=max(seconds, 0.0))
        except queue.Empty:
            return frozenset()
        if isinstance(found, OSError):
            raise EffectError(
                f"changes of files cannot be watched: {reason(found)}",
                help="the system's limit of watched files may be reached (fs.inotify on Linux)",
            )
        return found

    def _run(self) -> None:
        try:
            self._follow()
        except OSError as error:
            self._events.put(error)
        finally:
            self._begun.set()

    def _follow(self) -> None:
        before: frozenset[str] | None = None
        while not self._stop.is_set():
            folders = self._folders()
            # Folders that are new, or were not watched for a moment, are told as changed once they
            # are watched: files may have been put into them before.
            news = frozenset() if before is None else before | folders.keys()
            for changed in self._watch(tuple(self._root / f for f in folders)):
                self._begun.set()
                found = changed | news | self._changed_others()
                if found:
                    self._events.put(found)
                news = frozenset()
                if self._folders() != folders:
                    break
            before = frozenset(folders)

    def _folders(self) -> dict[str, tuple[int, ...]]:
        """The folders of the course that there are, and which they are: device and inode."""
        found: dict[str, tuple[int, ...]] = {}
        for name in self._watched:
            with contextlib.suppress(OSError):
                status = (self._root / name).stat()
                if stat.S_ISDIR(status.st_mode):
                    found[name] = (status.st_dev, status.st_ino)
        return found

    def _changed_others(self) -> set[str]:
        """The files elsewhere that are others than at the last look."""
        others = self._others  # another dictionary where more are watched from now on
        found = {path for path, before in others.items() if self._state(path) != before}
        others.update((path, self._state(path)) for path in found)
        return found

    def _state(self, path: str) -> tuple[int, ...]:
        """What is another after a save of a file."""
        try:
            status = (self._root / path).stat()
        except OSError:
            return ()
        return status.st_mtime_ns, status.st_size, status.st_ino, status.st_mode

    def _watch(self, folders: tuple[Path, ...]) -> Iterator[frozenset[str]]:
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
        ):
            yield frozenset(Path(path).relative_to(self._root).as_posix() for _, path in batch)

    def _is_source(self, path: str) -> bool:
        """Whether a path is one of the course, and none of an editor's or of Python's."""
        file = Path(path)
        return file.is_relative_to(self._root) and not any(
            name == _PROBE or is_dropping(name) for name in file.relative_to(self._root).parts
        )
