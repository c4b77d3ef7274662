"""A course that follows its files: events of the file system become saves, and saves pages.

An editor may save in several steps: empty the file, then fill it; or write a new file, then move it
to the place of the old one. They count as one save, which is complete when nothing has happened for
some milliseconds. For many files at once, as when a branch is switched, the wait is longer; so it
is for a file that is missing or empty, which may be so only between two steps.

The course's folders, and those that its scripts import from, are watched by `watchfiles` with
everything in them. Files elsewhere, such as pages in `docs/guide.md`, are polled.
"""

from __future__ import annotations

import contextlib
import os
import queue
import stat
import threading
import time
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NoReturn

from coursebuild.core.files.course_root import FOLDERS, is_dropping
from coursebuild.core.files.errors import EffectError, reason
from coursebuild.pipeline.options import Options
from coursebuild.preview.rebuild import BackgroundRebuild
from coursebuild.preview.session import MAX_SINGLE_READS, Session
from coursebuild.report import Style

LOOK = 0.200
"""Seconds between two looks for new and removed folders, and at polled files."""
_PROBE = "4913"
"""A file that vim makes for a moment, to see whether the folder can be written."""
_PASSING = (".swp", ".swx", "___jb_tmp___", "___jb_old___")
"""Ends of the names of files that editors make while they save."""
_STEP = 2
"""Milliseconds between two looks for events: a save is noticed within two of them."""


class FolderWatcher:
    """Reports saves, also those that happen while the caller does something else."""

    def __init__(self, root: Path) -> None:
        self._root = root
        self._stop = threading.Event()
        self._watched_folders: tuple[str, ...] = FOLDERS
        self._polled_files: dict[str, tuple[int, ...]] = {}
        """Files elsewhere, with their state at the last look."""
        self._events: queue.SimpleQueue[frozenset[str] | OSError] = queue.SimpleQueue()
        self._new_paths: set[str] = set()
        """What was made since the last save was taken."""
        self._ready = threading.Event()
        self._thread = threading.Thread(target=self._run, name="watch", daemon=True)

    def start(self) -> None:
        """Begin to watch; from its return on, no change is missed."""
        self._thread.start()
        self._ready.wait()

    @property
    def is_stopped(self) -> bool:
        return self._stop.is_set()

    def stop(self) -> None:
        """End watching."""
        self._stop.set()
        self._events.put(frozenset())
        if self._thread.is_alive():
            self._thread.join(1.0)

    def watch_also(self, paths: frozenset[str], folders: Iterable[str] = ()) -> None:
        """Set the files and folders elsewhere to watch, by POSIX path from the course's folder.

        The course's folder as a whole cannot be watched: the tool itself writes into it.
        """
        self._watched_folders = (*FOLDERS, *(folder for folder in folders if folder != "."))
        inside = tuple(f"{folder}/" for folder in self._watched_folders)
        files = {path for path in paths if not path.startswith(inside)}
        self._polled_files = {
            path: self._polled_files.get(path, self._file_state(path)) for path in files
        }

    def get(self, seconds: float) -> frozenset[str]:
        """Return the paths that changed, POSIX and relative to the root, if there are any.

        Wait for changes for so many seconds.

        Raises:
            EffectError: changes cannot be watched.
        """
        try:
            change = self._events.get(timeout=max(seconds, 0.0))
        except queue.Empty:
            return frozenset()
        if isinstance(change, OSError):
            raise EffectError(
                f"changes of files cannot be watched: {reason(change)}",
                help="the system's limit of watched files may be reached (fs.inotify on Linux)",
            )
        return change

    def drop_passing(self, paths: frozenset[str]) -> frozenset[str]:
        """The paths of a save without files that came and went, such as `sedXXXXXX`."""
        new_paths, self._new_paths = self._new_paths, set()
        return frozenset(p for p in paths if p not in new_paths or os.path.lexists(self._root / p))

    def _run(self) -> None:
        before: frozenset[str] | None = None
        try:
            while not self._stop.is_set():
                folders = self._folders()
                # Folders that are new, or were not watched for a moment, are reported once they are
                # watched: files may have been put into them before.
                unseen_folders = frozenset() if before is None else before | folders.keys()
                for paths in self._watch(tuple(self._root / f for f in folders)):
                    self._ready.set()
                    files = self._polled_files  # `watch_also` replaces the dictionary
                    changed_files = {
                        path for path, before in files.items() if self._file_state(path) != before
                    }
                    files.update((path, self._file_state(path)) for path in changed_files)
                    all_paths = paths | unseen_folders | changed_files
                    if all_paths:
                        self._events.put(all_paths)
                    unseen_folders = frozenset()
                    if self._folders() != folders:
                        break
                before = frozenset(folders)
        except OSError as error:
            self._events.put(error)
        finally:
            self._ready.set()

    def _folders(self) -> dict[str, tuple[int, ...]]:
        """The watched folders that exist, with their device and inode."""
        folders: dict[str, tuple[int, ...]] = {}
        for name in self._watched_folders:
            with contextlib.suppress(OSError):
                status = (self._root / name).stat()
                if stat.S_ISDIR(status.st_mode):
                    folders[name] = (status.st_dev, status.st_ino)
        return folders

    def _file_state(self, path: str) -> tuple[int, ...]:
        """What differs after a save of a file."""
        try:
            status = (self._root / path).stat()
        except OSError:
            return ()
        # With the time of the last change of any kind, as a tool may set the other one back.
        return status.st_mtime_ns, status.st_ctime_ns, status.st_size, status.st_ino

    def _watch(self, folders: tuple[Path, ...]) -> Iterator[frozenset[str]]:
        """Yield changes in these folders; an empty set at first, and now and then."""
        if not folders:
            while not self._stop.is_set():
                yield frozenset()
                self._stop.wait(LOOK)
            return
        from watchfiles import Change, watch

        for batch in watch(
            *folders,
            watch_filter=self._is_source,
            stop_event=self._stop,
            debounce=5 * _STEP,
            step=_STEP,
            rust_timeout=round(1000 * LOOK),
            yield_on_timeout=True,
        ):
            names = [(kind, Path(path).relative_to(self._root).as_posix()) for kind, path in batch]
            self._new_paths.update(name for kind, name in names if kind is Change.added)
            yield frozenset(name for _, name in names)

    def _is_source(self, _: object, path: str) -> bool:
        """Whether a path is a file of the course, and not one of an editor's or of Python's."""
        file = Path(path)
        return file.is_relative_to(self._root) and not any(
            name == _PROBE or name.endswith(_PASSING) or is_dropping(name)
            for name in file.relative_to(self._root).parts
        )


QUIET = 0.008
"""Seconds without an event after which a save is complete."""
LONG_QUIET = 0.100
"""The same where more is to be expected: with many files, and with one that is gone or empty."""
LONGEST = 1.0
"""Seconds after which a save is taken in any case."""


class LiveCourse:
    """A course in memory that follows its files: what `serve` and `lsp` have in common."""

    def __init__(self, options: Options, style: Style, *, site: bool = True) -> None:
        """`style`: how mistakes are printed; `site`: whether pages are drawn."""
        self.session = Session(options, site=site)
        self._watcher = FolderWatcher(options.root)
        self._rebuild = BackgroundRebuild(self.session, style)

    def start(self) -> None:
        """Read the course, and follow its files from then on."""
        self.session.start()
        self._watcher.start()
        threading.Thread(target=self._take_saves, name="saves", daemon=True).start()

    def rebuild(self) -> NoReturn:
        """Do the rest of a build after each save; raise what fails, also while saves are taken."""
        self._rebuild.follow()

    def close(self) -> None:
        """End everything, the store included."""
        self._watcher.stop()
        self._rebuild.close()
        self.session.close()
        self.session.options.store.close()

    def _take_saves(self) -> None:
        while not self._watcher.is_stopped:
            try:
                self._watcher.watch_also(self.session.files_elsewhere(), self.session.packages())
                paths = self._watcher.get(1.0)
                if paths:
                    self._take_save(paths)
            except BaseException as error:  # raised again in the main thread
                self._rebuild.fail(error)

    def _take_save(self, paths: frozenset[str]) -> None:
        """Take a save that began with these paths.

        It is printed, with the milliseconds from its first event until it was taken.
        """
        began = time.monotonic()
        self.session.calm.clear()
        try:
            later = paths
            while later:
                paths |= later
                is_part = len(paths) > MAX_SINGLE_READS
                try:
                    files = (self.session.root / path for path in paths)
                    is_part |= any(file.stat().st_size == 0 for file in files)
                except OSError:
                    is_part = True
                remaining = began + LONGEST - time.monotonic()
                later = self._watcher.get(min(LONG_QUIET if is_part else QUIET, remaining))
            paths = self._watcher.drop_passing(paths)
            if not paths:
                return
            has_changed = self.session.edit(paths)
            if has_changed is None:  # more than documents changed
                self.session.take_other_saves()
        finally:
            self.session.calm.set()
        if has_changed is not False:
            names = ", ".join(sorted(paths)[:3]) + (" …" if len(paths) > 3 else "")
            milliseconds = 1e3 * (time.monotonic() - began)
            self.session.options.progress.say(f"changed: {names} ({milliseconds:.0f} ms)")
