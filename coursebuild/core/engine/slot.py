"""The slot: a folder that is filled with the files of a new site, beside the site's place.

Entry points: `new_site`, whose `fill` fills a slot; `open_slot`, `put_away` and `remove`.

A slot holds the site before the last one, or nothing. A file stays in it, or is linked from the old
site, if the manifest lists it under the same key and it has not changed; all others are made.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import re
import shutil
from collections.abc import Callable, Container, Iterable, Mapping, Sequence
from contextlib import AbstractContextManager
from pathlib import Path

from msgspec import Struct

from coursebuild.core.engine.manifest import KIND, MARKER, Manifest, ManifestEntry, holds, marker
from coursebuild.core.engine.workers import Workers, can_fork
from coursebuild.core.files.trust import find_store
from coursebuild.core.model.results import FileFacts, FileList, OutputFile, SiteFile

_NO_PATH = re.compile(r"(?:\A|/)\.{0,2}(?:/|\Z)|[\x00-\x1f\\]")
"""What no path may have: an empty part, `.` or `..`, a control character, a backslash."""
_MIN_FOR_COPIES = 128
"""How many files make it worth starting copies of this process."""
_TASK_SIZE = 16
"""How many files a copy writes for one request."""
_MAX_COPIES = 4
"""The most copies: more would wait for the disk."""


class NewSite(Struct, frozen=True):
    """The site to be published, and the manifest of the one that is there."""

    old: Manifest
    files: Mapping[str, SiteFile]
    """By path, without the file list."""
    file_list: FileList | None
    keys: Mapping[str, str]
    """The key of each file by its path, that of the file list included."""

    def is_there(self) -> bool:
        """Whether the published site is already this one, whole and without other files."""
        if self.keys != {path: entry.key for path, entry in self.old.entries.items()}:
            return False  # the usual case after an edit, found without looking at any file
        place = self.old.place
        try:
            return (
                all(self.old.is_whole(path, key) for path, key in self.keys.items())
                and holds(place, self.keys)
                and (place / MARKER).read_bytes() == marker(self.keys)
            )
        except OSError:
            return False

    def fill(
        self, slot: Path, jobs: int, stage: Callable[[], AbstractContextManager[None]]
    ) -> tuple[dict[str, ManifestEntry], list[str]]:
        """Fill the slot with the site; return its entries and the paths that were written."""
        folders = _folders(self.keys)
        old_entries = {p: e for p, k in self.keys.items() if (e := self.old.entry(p, k))}
        entries = _remove_stale(f"{slot}/", "", old_entries, frozenset(folders))
        for folder in folders:
            (slot / folder).mkdir(exist_ok=True)
            (slot / folder).chmod(0o755)  # whatever the umask is
        for path, entry in old_entries.items():
            if path not in entries and self._link(path, entry, slot):
                entries[path] = entry
        new_paths = [path for path in self.keys if path not in entries]
        new_files = [self.files[path] for path in new_paths if path in self.files]
        entries |= self._write_all(slot, new_files, jobs, stage)
        if self.file_list is not None and self.file_list.path not in entries:
            facts = [FileFacts(path, e.digest, e.size) for path, e in sorted(entries.items())]
            path = self.file_list.path
            entries[path] = self._write(slot, OutputFile(path, self.file_list.make(facts)))
        _write_file(f"{slot}/{MARKER}", marker(entries))
        return entries, new_paths

    def _link(self, path: str, entry: ManifestEntry, slot: Path) -> bool:
        """Link a file of the old site into the slot, if it has not changed."""
        target = f"{slot}/{path}"
        try:
            os.link(f"{self.old.place}/{path}", target, follow_symlinks=False)
        except (OSError, NotImplementedError):  # it is gone, or nothing more can be linked there
            return False
        # Look at the link, not at the old file, which may have been replaced meanwhile.
        if entry.fits(os.lstat(target)):
            return True
        Path(target).unlink()
        return False

    def _write_all(
        self,
        slot: Path,
        files: Sequence[SiteFile],
        jobs: int,
        stage: Callable[[], AbstractContextManager[None]],
    ) -> dict[str, ManifestEntry]:
        """Make files and write them, whose folders are there already; return their entries."""

        def share(start: int) -> list[ManifestEntry]:
            return [self._write(slot, file) for file in files[start : start + _TASK_SIZE]]

        can_share = jobs > 1 and len(files) >= _MIN_FOR_COPIES and can_fork()
        with Workers(share, min(jobs, _MAX_COPIES) if can_share else 0) as workers, stage():
            parts = workers.map((None, start) for start in range(0, len(files), _TASK_SIZE))
            entries = (entry for part, _ in parts for entry in part)
            return {file.path: entry for file, entry in zip(files, entries, strict=True)}

    def _write(self, slot: Path, file: SiteFile) -> ManifestEntry:
        target = f"{slot}/{file.path}"
        Path(target).unlink(missing_ok=True)  # half a file, if a copy died
        digest = _write_file(target, file.make())
        return ManifestEntry.of(self.keys[file.path], digest, os.lstat(target))


def _write_file(path: str, data: bytes) -> str:
    """Write a new file; return the hash of its bytes."""
    with open(path, "xb") as file:  # noqa: PTH123 - thousands of them
        file.write(data)
        os.fchmod(file.fileno(), 0o644)  # whatever the umask is
    return hashlib.sha256(data).hexdigest()


def new_site(old: Manifest, files: Iterable[SiteFile], file_list: FileList | None) -> NewSite:
    """The site of these files, to be published over the one of a manifest.

    Raises:
        ValueError: a path is not valid in a site, or two files have the same.
    """
    by_path: dict[str, SiteFile] = {}
    for file in files:
        path = file.path
        if _NO_PATH.search(path) or path == MARKER:
            raise ValueError(f"{path!r} is not a path that a site may have")
        if path in by_path or (file_list is not None and path == file_list.path):
            raise ValueError(f"the site has two files {path}")
        by_path[path] = file
    keys = {path: _key(file) for path, file in by_path.items()}
    if file_list is not None:
        # Of the keys of all files, since the list names all of them.
        text = "\n".join((file_list.key, *(f"{key} {path}" for path, key in keys.items())))
        keys[file_list.path] = hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()
    return NewSite(old, by_path, file_list, keys)


def _key(file: SiteFile) -> str:
    if isinstance(file, OutputFile):
        return f"={hashlib.sha256(file.data).hexdigest()}"
    return file.key


def _folders(paths: Iterable[str]) -> list[str]:
    """The folders that files need, each after its parent."""
    folders = {path.rpartition("/")[0] for path in paths}
    for folder in list(folders):
        while folder := folder.rpartition("/")[0]:
            folders.add(folder)
    return sorted(folders - {""})


def open_slot(root: Path, slot: Path) -> None:
    """Make the slot ready: the one that the last build put away, or an empty folder."""
    if not os.path.lexists(slot):
        with contextlib.suppress(OSError):  # none was put away, or it is on another file system
            _spare(root).rename(slot)
    if not slot.is_dir() or slot.is_symlink():
        with contextlib.suppress(FileNotFoundError):
            slot.unlink()
        slot.mkdir()
    slot.chmod(0o700)


def put_away(root: Path, slot: Path) -> None:
    """Keep the slot for the next build, in the store."""
    with contextlib.suppress(OSError):
        slot.chmod(0o700)  # a folder that may not be written cannot be moved
        with contextlib.suppress(OSError):
            slot.rename(_spare(root))
            return
        remove(slot)


def _spare(root: Path) -> Path:
    return Path(find_store(str(root))[0], KIND, "spare")


def _remove_stale(
    folder: str, prefix: str, old_entries: Mapping[str, ManifestEntry], folders: Container[str]
) -> dict[str, ManifestEntry]:
    """Remove everything from a folder but intact files and needed folders; return these files.

    Args:
        folder: its path, with a slash behind it.
        prefix: its path in the site, likewise.
        old_entries: the entries of the files that may stay, by path.
        folders: the folders that may stay.
    """
    intact: dict[str, ManifestEntry] = {}
    with os.scandir(folder) as entries:
        contents = list(entries)
    for entry in contents:
        path = prefix + entry.name
        expected = old_entries.get(path)
        if not entry.is_dir(follow_symlinks=False):
            if expected is not None and expected.fits(entry.stat(follow_symlinks=False)):
                intact[path] = expected
            else:
                os.unlink(entry.path)  # noqa: PTH108 - thousands of them
        elif path in folders:
            os.chmod(entry.path, 0o755)  # noqa: PTH101
            intact |= _remove_stale(f"{entry.path}/", f"{path}/", old_entries, folders)
        else:
            remove(Path(entry.path))
    return intact


def remove(folder: Path) -> None:
    """Remove a folder as far as possible."""
    with contextlib.suppress(OSError):
        folder.chmod(0o700)
    shutil.rmtree(folder, ignore_errors=True)
