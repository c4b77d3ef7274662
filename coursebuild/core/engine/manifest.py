"""The manifest of the last published site: the key and the stat of each file.

It is an entry of the course's store, not a file of the site, since it changes from build to build.
It is believed only of a file that is, by size, modification time and inode, the one that was
written. Where it is missing or damaged, everything is made again.
"""

from __future__ import annotations

import hashlib
import os
import stat
from collections.abc import Collection, Iterable, Mapping
from pathlib import Path

from msgspec import Struct

from coursebuild.core.engine.store import Store
from coursebuild.core.files.course_root import read_regular
from coursebuild.core.files.errors import lacking

KIND = "published"
"""The kind of a manifest's entry."""
MARKER = ".coursebuild-site"
"""A file in every site: a line that says what it is, then the path of every file of the site."""
_HEADER = "site built by coursebuild; every file listed here may be replaced"
_JUNK = frozenset({".DS_Store", "Thumbs.db", "desktop.ini"})
"""Files that file managers leave in folders."""


class ManifestEntry(Struct, frozen=True, array_like=True):
    """A published file."""

    key: str
    """A hash of everything that its bytes depend on."""
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
        """The manifest of the site at this place; an empty one where none can be read."""
        entries = Store(root).get_value(KIND, _key(root, place), dict[str, ManifestEntry])
        return cls(place, entries or {})

    def entry(self, path: str, key: str) -> ManifestEntry | None:
        """The entry of a path if it was published under this key."""
        entry = self.entries.get(path)
        return entry if entry is not None and entry.key == key else None

    def is_whole(self, path: str, key: str) -> bool:
        """Whether the file at the path was published under this key and has not changed since."""
        entry = self.entry(path, key)
        try:
            return entry is not None and entry.fits(os.lstat(f"{self.place}/{path}"))
        except OSError:
            return False

    def write(self, root: Path) -> None:
        """Keep the manifest for the next build; failing to write it only costs time."""
        Store(root).put_value(KIND, _key(root, self.place), self.entries)


def _key(root: Path, place: Path) -> str:
    """The key of the place's manifest; it stays when the project moves with the site in it."""
    name = place.relative_to(root) if place.is_relative_to(root) else place
    return hashlib.sha256(os.fsencode(name)).hexdigest()


# --- the files of a site


def marker(paths: Iterable[str]) -> bytes:
    """The content of the marker of a site with these files."""
    return "\n".join([_HEADER, *sorted(paths), ""]).encode()


def holds(folder: Path, paths: Collection[str]) -> bool:
    """Whether a folder has these files and the marker, and no others."""
    return set(_files(folder)) == {MARKER, *paths}


def foreign_files(place: Path) -> list[str]:
    """The files at the place that no build of ours put there, sorted."""
    if not os.path.lexists(place):
        return []
    own_paths: list[str] = []
    try:
        header, *own_paths = read_regular(place / MARKER).decode().split("\n")
        own_paths = [MARKER, *own_paths] if header == _HEADER else []
    except UnicodeDecodeError:
        pass
    except OSError as error:
        if lacking(error):
            raise
    return sorted(set(_files(place)).difference(own_paths))


def _files(folder: Path) -> list[str]:
    paths: list[str] = []
    folders = [""]
    for prefix in folders:
        with os.scandir(f"{folder}/{prefix}") as entries:
            for entry in entries:
                if entry.is_dir(follow_symlinks=False):
                    folders.append(f"{prefix}{entry.name}/")
                elif entry.name not in _JUNK:
                    paths.append(prefix + entry.name)
    return paths
