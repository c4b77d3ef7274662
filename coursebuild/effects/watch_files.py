"""Changes of a course's files, as `watchfiles` tells of them on every system.

Entry point: `FilesWatcher`, a `Watcher` (see `watch`).
"""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

from coursebuild.effects.errors import EffectError, reason
from coursebuild.effects.watch_paths import FOLDERS, LOOK, is_source

_STEP = 2
"""Milliseconds from one look for events to the next: a save is told of within two of them."""


class FilesWatcher:
    """See `watch.Watcher`."""

    writing = False
    """Nobody says so here."""

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
        """See `watch.Watcher`."""
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
        before: tuple[Path, ...] | None = None
        while not self._stop.is_set():
            folders = self._present()
            if before is not None:
                # Told of once they are watched: a file may be put into a new one at any time, and
                # into any while none was.
                names = frozenset(path.name for path in {*folders, *before})
                self._events.put(names)
            for changed in self._watch(folders, recursive=True):
                begun()
                if changed:
                    self._events.put(changed)
                if self._present() != folders:
                    break
            before = folders

    def _present(self) -> tuple[Path, ...]:
        return tuple(self._root / name for name in FOLDERS if (self._root / name).is_dir())

    # --- files elsewhere

    def _files(self, begun: Callable[[], None]) -> None:
        begun()
        while not self._stop.is_set():
            others = self._others
            folders = {(self._root / path).parent for path in others}
            there = tuple(sorted(folder for folder in folders if folder.is_dir()))
            for changed in self._watch(there, recursive=False):
                if wanted := changed & others:
                    self._events.put(wanted)
                if self._others != others or any(not folder.is_dir() for folder in there):
                    break
                if len(there) < sum(folder.is_dir() for folder in folders):
                    break

    # --- both

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
