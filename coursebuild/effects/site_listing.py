"""The files of a published site, and whether there are others.

Entry points: `marker`, which lists what a build puts there, `holds` and `foreign_files`.
"""

from __future__ import annotations

import errno
import os
import unicodedata
from collections.abc import Collection, Iterable
from pathlib import Path

MARKER = ".coursebuild-site"
"""A file in every site: a line that says what it is, then the path of every file of the site."""
_HEADER = "site built by coursebuild; every file listed here may be replaced"
_JUNK = frozenset({".DS_Store", "Thumbs.db", "desktop.ini"})
"""What file managers strew about."""
TRIES = 100
"""How often to start again when another build publishes to the same place."""


def marker(paths: Iterable[str]) -> bytes:
    """What is in the marker of a site with these files."""
    return "\n".join([_HEADER, *sorted(paths), ""]).encode()


def holds(folder: Path, paths: Collection[str]) -> bool:
    """Whether a folder has these files and the marker, and no other."""
    found, wanted = set(_files(folder)), {MARKER, *paths}
    if found == wanted:
        return True
    found, wanted = set(map(_normal, found)), set(map(_normal, wanted))
    return found <= wanted and all(p.rpartition("/")[2] in _JUNK for p in wanted - found)


def foreign_files(place: Path) -> list[str]:
    """Files at the place that no build of ours put there; sorted."""
    for _ in range(TRIES):
        try:
            before = place.stat()
            found = _foreign_once(place)
            if os.path.samestat(before, place.stat()):
                return found
        except FileNotFoundError:
            if not place.exists():
                return []
        # Another build swapped its site in while we looked.
    raise OSError(errno.EBUSY, os.strerror(errno.EBUSY))


def _foreign_once(place: Path) -> list[str]:
    missing: FileNotFoundError | None = None
    header, listed = "", list[str]()
    try:
        header, *listed = (place / MARKER).read_text(encoding="utf-8").split("\n")
    except FileNotFoundError as error:
        missing = error
    except (IsADirectoryError, UnicodeDecodeError):
        pass
    found = _files(place)
    if missing and MARKER in found:
        raise missing  # the site was away when its list was to be read
    if header != _HEADER:
        return sorted(found)
    other = set(found).difference(listed, (MARKER,))
    ours = {_normal(path) for path in listed} if other else set[str]()
    return sorted(path for path in other if _normal(path) not in ours)


def _normal(path: str) -> str:
    """The path with its letters composed: some file systems of macOS take them apart."""
    return path if path.isascii() else unicodedata.normalize("NFC", path)


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
