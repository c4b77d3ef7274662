"""A folder that is filled with the files of a site, beside the place where the site goes.

Entry points: `NewSite`, whose `fill` makes a slot hold it, of files `with_keys`; `open_slot`,
`put_away` and `remove`.

A slot held the site before the last one, or is empty. A file stays in it, or is linked from the old
site, where the manifest knows it under the same key and it is as it was; all others are made.
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
from coursebuild.core.engine.memo import FOLDER
from coursebuild.core.engine.workers import Workers, can_fork
from coursebuild.core.model.results import FileFacts, FileList, OutputFile, SiteFile

_NO_PATH = re.compile(r"(?:\A|/)\.{0,2}(?:/|\Z)|[\x00-\x1f\\]")
"""A part of a path that is empty or stands for a folder, a control character, a backslash."""
_MANY = 128
"""Files for which copies of this process are worth their start."""
_SHARE = 16
"""Files that a copy writes for one request."""
_MOST = 4
"""Copies: more would wait for the disk."""


class NewSite(Struct, frozen=True):
    """The site that is to be, and what is known of the one that is there."""

    old: Manifest
    files: Mapping[str, tuple[SiteFile, str]]
    """By path, each with its key."""
    listed: FileList | None

    def is_there(self) -> bool:
        """Whether it is there already, whole and with nothing beside it."""
        keys = {path: key for path, (_, key) in self.files.items()}
        if self.listed is not None:
            keys[self.listed.path] = self._list_key(self.listed)
        if keys != {path: entry.key for path, entry in self.old.entries.items()}:
            return False  # as after every edit: no file is looked at for that
        place = self.old.place
        try:
            return (
                all(self.old.is_whole(path, key) for path, key in keys.items())
                and holds(place, keys)
                and (place / MARKER).read_bytes() == marker(keys)
            )
        except OSError:
            return False

    def fill(
        self, slot: Path, jobs: int, stage: Callable[[], AbstractContextManager[None]]
    ) -> tuple[dict[str, ManifestEntry], list[str]]:
        """Make the slot hold the site; gives what is in it, and the paths that are new."""
        folders = _folders([*self.files, *([self.listed.path] if self.listed else [])])
        known = {p: e for p, (_, k) in self.files.items() if (e := self.old.entry(p, k))}
        entries = _sift(f"{slot}/", "", known, frozenset(folders))
        for folder in folders:
            (slot / folder).mkdir(exist_ok=True)
            (slot / folder).chmod(0o755)  # whatever the umask is
        for path, entry in known.items():
            if path not in entries and self._link(path, entry, slot):
                entries[path] = entry
        new = [found for path, found in self.files.items() if path not in entries]
        entries |= _written(slot, new, jobs, stage)
        made = [file.path for file, _ in new]
        if self.listed is not None and self._add_list(self.listed, slot, entries):
            made.append(self.listed.path)
        _write_file(f"{slot}/{MARKER}", marker(entries))
        return entries, made

    def _add_list(self, listed: FileList, slot: Path, entries: dict[str, ManifestEntry]) -> bool:
        """Add the list of all files; whether it is a new one."""
        key = self._list_key(listed)
        entry = self.old.entry(listed.path, key)
        if entry is not None and self._link(listed.path, entry, slot):
            entries[listed.path] = entry
            return False
        facts = [FileFacts(path, e.digest, e.size) for path, e in sorted(entries.items())]
        target = f"{slot}/{listed.path}"
        digest = _write_file(target, listed.make(facts))
        entries[listed.path] = ManifestEntry.of(key, digest, os.lstat(target))
        return True

    def _list_key(self, listed: FileList) -> str:
        """What the list's bytes depend on: nothing of it is known before all files are."""
        lines = (f"{key} {path}" for path, (_, key) in self.files.items())
        text = "\n".join((listed.key, *lines))
        return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()

    def _link(self, path: str, entry: ManifestEntry, slot: Path) -> bool:
        """Link a file of the old site, if it is as it should be."""
        target = f"{slot}/{path}"
        try:
            os.link(f"{self.old.place}/{path}", target, follow_symlinks=False)
        except (OSError, NotImplementedError):  # it is gone, or nothing more can be linked there
            return False
        # What was linked is looked at, not what stands there: that may be another by now.
        if entry.fits(os.lstat(target)):
            return True
        Path(target).unlink()
        return False


def _written(
    folder: Path,
    files: Sequence[tuple[SiteFile, str]],
    jobs: int,
    stage: Callable[[], AbstractContextManager[None]],
) -> dict[str, ManifestEntry]:
    """Make files and write them into a folder, which has their folders; gives their entries.

    `files` come with their keys.
    """

    def write(file: SiteFile, key: str) -> ManifestEntry:
        target = f"{folder}/{file.path}"
        Path(target).unlink(missing_ok=True)  # half of it, by a copy that died
        return ManifestEntry.of(key, _write_file(target, file.make()), os.lstat(target))

    def share(start: int) -> list[ManifestEntry]:
        return [write(*found) for found in files[start : start + _SHARE]]

    count = min(jobs, _MOST) if jobs > 1 and len(files) >= _MANY and can_fork() else 0
    with Workers(share, count) as workers, stage():
        parts = workers.map((None, start) for start in range(0, len(files), _SHARE))
        entries = (entry for part, _ in parts for entry in part)
        return {file.path: entry for (file, _), entry in zip(files, entries, strict=True)}


def _write_file(path: str, data: bytes) -> str:
    """Write a file that is not there; gives the hash of its bytes."""
    with open(path, "xb") as file:  # noqa: PTH123 - thousands of them
        file.write(data)
        os.fchmod(file.fileno(), 0o644)  # whatever the umask is
    return hashlib.sha256(data).hexdigest()


def with_keys(
    files: Iterable[SiteFile], listed: FileList | None
) -> dict[str, tuple[SiteFile, str]]:
    """Files by path, each with a hash of what its bytes depend on.

    Raises:
        ValueError: a path is none that a site may have, or two files have it.
    """
    found: dict[str, tuple[SiteFile, str]] = {}
    for file in files:
        path = file.path
        if _NO_PATH.search(path) or path == MARKER:
            raise ValueError(f"{path!r} is no path that a site may have")
        if path in found or (listed is not None and path == listed.path):
            raise ValueError(f"the site has two files {path}")
        if isinstance(file, OutputFile):
            found[path] = file, f"={hashlib.sha256(file.data).hexdigest()}"
        else:
            found[path] = file, file.key
    return found


def _folders(paths: Iterable[str]) -> list[str]:
    """The folders that files need, each after the one that it lies in."""
    found = {path.rpartition("/")[0] for path in paths}
    for folder in list(found):
        while folder := folder.rpartition("/")[0]:
            found.add(folder)
    return sorted(found - {""})


def open_slot(root: Path, slot: Path) -> None:
    """Have the folder that the site is filled into: one that is left, or an empty one."""
    if not os.path.lexists(slot):
        with contextlib.suppress(OSError):  # there is none, or it is on another file system
            (root / FOLDER / KIND / "spare").rename(slot)
    if not slot.is_dir() or slot.is_symlink():
        with contextlib.suppress(FileNotFoundError):
            slot.unlink()
        slot.mkdir()
    slot.chmod(0o700)


def put_away(root: Path, slot: Path) -> None:
    """Keep the slot for the next build, where it is in nobody's way."""
    with contextlib.suppress(OSError):
        slot.chmod(0o700)  # one that may not be written cannot be moved elsewhere
        with contextlib.suppress(OSError):
            slot.rename(root / FOLDER / KIND / "spare")
            return
        remove(slot)


def _sift(
    folder: str, prefix: str, known: Mapping[str, ManifestEntry], folders: Container[str]
) -> dict[str, ManifestEntry]:
    """Remove from a folder all but files that are as they should be; gives these.

    Args:
        folder: its path, with a slash behind it.
        prefix: its path in the site, likewise.
        known: what the files should be, by path.
        folders: those that may stay.
    """
    kept: dict[str, ManifestEntry] = {}
    with os.scandir(folder) as entries:
        found = list(entries)
    for entry in found:
        path = prefix + entry.name
        expected = known.get(path)
        if not entry.is_dir(follow_symlinks=False):
            if expected is not None and expected.fits(entry.stat(follow_symlinks=False)):
                kept[path] = expected
            else:
                os.unlink(entry.path)  # noqa: PTH108 - thousands of them
        elif path in folders:
            os.chmod(entry.path, 0o755)  # noqa: PTH101
            kept |= _sift(f"{entry.path}/", f"{path}/", known, folders)
        else:
            remove(Path(entry.path))
    return kept


def remove(folder: Path) -> None:
    """Remove a folder, as far as that can be done."""
    with contextlib.suppress(OSError):
        folder.chmod(0o700)
    shutil.rmtree(folder, ignore_errors=True)
