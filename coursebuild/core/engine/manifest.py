"""What was published last: by its key and its stat, a file of the site that need not be made again.

Entry points: `Manifest.read(root, place)`, `Manifest.write`; `marker`, the list of its files that a
site itself has, `holds` and `foreign_files`, by which nobody's files are published over.

The manifest is an entry of the course's `Memo`, since a site holds nothing that changes from build
to build without need. It is only believed of a file that is, by size, time of change and inode, the
one that was written; where it is missing or damaged everything is made again.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import stat
from collections.abc import Collection, Iterable, Mapping
from pathlib import Path

from msgspec import Struct

from coursebuild.core.engine.memo import Memo

KIND = "published"
"""The kind of entry that a manifest is."""
MARKER = ".coursebuild-site"
"""A file in every site: a line that says what it is, then the path of every file of the site."""
_HEADER = "site built by coursebuild; every file listed here may be replaced"
_JUNK = frozenset({".DS_Store", "Thumbs.db", "desktop.ini"})
"""What file managers strew about."""


class ManifestEntry(Struct, frozen=True, array_like=True):
    """A published file."""

    key: str
    """A hash of all that its bytes depend on."""
    digest: str
    """SHA-256 of its bytes, in hexadecimal digits."""
    size: int
    """Bytes."""
    modified: int
    """ns."""
    inode: int

    @classmethod
    def of(cls, key: str, digest: str, status: os.stat_result) -> ManifestEntry:
        """The entry of a file that was just written."""
        return cls(key, digest, status.st_size, status.st_mtime_ns, status.st_ino)

    def fits(self, status: os.stat_result) -> bool:
        """Whether a file is the one that was written, as it was then."""
        return (
            status.st_ino == self.inode
            and status.st_mtime_ns == self.modified
            and status.st_size == self.size
            and stat.S_ISREG(status.st_mode)
        )


class Manifest(Struct, frozen=True):
    """The files of one site, by path."""

    place: Path
    entries: Mapping[str, ManifestEntry]

    @classmethod
    def read(cls, root: Path, place: Path) -> Manifest:
        """What is known of the site at this place: nothing, where there is no sound manifest."""
        found = Memo(root).get_value(KIND, _key(root, place), dict[str, ManifestEntry])
        return cls(place, found or {})

    def entry(self, path: str, key: str) -> ManifestEntry | None:
        """What was published at a path under a key."""
        found = self.entries.get(path)
        return found if found is not None and found.key == key else None

    def is_whole(self, path: str, key: str) -> bool:
        """Whether the file there was published under this key, and is as it was."""
        entry = self.entry(path, key)
        try:
            return entry is not None and entry.fits(os.lstat(f"{self.place}/{path}"))
        except OSError:
            return False

    def write(self, root: Path) -> None:
        """Keep it for the next build; one that cannot be written only costs time."""
        Memo(root).put_value(KIND, _key(root, self.place), self.entries)


def _key(root: Path, place: Path) -> str:
    """One for each place; it is the same when the project is moved with the site in it."""
    named = place.relative_to(root) if place.is_relative_to(root) else place
    return hashlib.sha256(os.fsencode(named)).hexdigest()


# --- the files of a site


def marker(paths: Iterable[str]) -> bytes:
    """What is in the marker of a site with these files."""
    return "\n".join([_HEADER, *sorted(paths), ""]).encode()


def holds(folder: Path, paths: Collection[str]) -> bool:
    """Whether a folder has these files and the marker, and no other."""
    return set(_files(folder)) == {MARKER, *paths}


def foreign_files(place: Path) -> list[str]:
    """Files at the place that no build of ours put there; sorted."""
    if not os.path.lexists(place):
        return []
    listed: list[str] = []
    with contextlib.suppress(FileNotFoundError, IsADirectoryError, UnicodeDecodeError):
        header, *listed = (place / MARKER).read_text(encoding="utf-8").split("\n")
        listed = [MARKER, *listed] if header == _HEADER else []
    return sorted(set(_files(place)).difference(listed))


def _files(folder: Path) -> list[str]:
    """The paths of all files in a folder, but for junk."""
    found: list[str] = []
    folders = [""]
    for prefix in folders:
        with os.scandir(f"{folder}/{prefix}") as entries:
            for entry in entries:
                if entry.is_dir(follow_symlinks=False):
                    folders.append(f"{prefix}{entry.name}/")
                elif entry.name not in _JUNK:
                    found.append(prefix + entry.name)
    return found
