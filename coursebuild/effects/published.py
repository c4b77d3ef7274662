"""What was published last: by its key and its stat, a file of the site that need not be made again.

Entry points: `Published.read(root, place)`, `Published.is_whole`,
`write_published`.

The record lies in `.coursebuild/`, since a site holds nothing that changes from build to build
without need. It is only ever believed of a file that is, by size, time of change and inode, the one
that was written; where it is missing or damaged everything is made again.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import stat
from collections.abc import Mapping
from pathlib import Path

from msgspec import Struct, field
from msgspec.structs import replace

from coursebuild.effects.locks import make_private_folder

RECORDS = ".coursebuild/published"
"""The folder in a course where the records are."""


class Entry(Struct, frozen=True):
    """A published file."""

    key: str
    """A hash of all that its bytes depend on; no white space."""
    digest: str
    """SHA-256 of its bytes, in hexadecimal digits."""
    size: int
    """Bytes."""
    modified: int
    """ns."""
    inode: int
    mode: int
    """Its kind and permissions when it was last looked at: they may be changed."""

    @classmethod
    def of(cls, key: str, digest: str, status: os.stat_result) -> Entry:
        """The entry of a file that was just written, or linked."""
        numbers = status.st_size, status.st_mtime_ns, status.st_ino, status.st_mode
        return cls(key, digest, *numbers)

    def fits(self, status: os.stat_result) -> bool:
        """Whether a file is the one that was written, as it was then."""
        return (
            status.st_ino == self.inode
            and status.st_mtime_ns == self.modified
            and status.st_size == self.size
            and stat.S_ISREG(status.st_mode)
        )

    def seen(self, status: os.stat_result) -> Entry | None:
        """The entry of a file that was just looked at, if it is the one that was written."""
        if not self.fits(status):
            return None
        return self if status.st_mode == self.mode else replace(self, mode=status.st_mode)


class Published(Struct, frozen=True):
    """The record of one site."""

    place: Path
    """Where it is."""
    entries: Mapping[str, Entry] = field(default_factory=dict)
    """By path in the site."""

    @classmethod
    def read(cls, root: Path, place: Path) -> Published:
        """What is known of the site at this place: nothing, where there is no sound record."""
        with contextlib.suppress(OSError, ValueError):
            digest, _, body = _file(root, place).read_text(encoding="utf-8").partition("\n")
            if digest == hashlib.sha256(body.encode()).hexdigest():
                return cls(place, dict(_parsed(line) for line in body.split("\n") if line))
        return cls(place)

    def is_whole(self, path: str, key: str) -> bool:
        """Whether the file there was published under this key, and is as it was."""
        entry = self.entries.get(path)
        if entry is None or entry.key != key:
            return False
        try:
            status = os.lstat(f"{self.place}/{path}")
        except OSError:
            return False
        return entry.fits(status)


def write_published(root: Path, place: Path, entries: Mapping[str, Entry]) -> None:
    """Keep a record; one that cannot be written only costs time."""
    body = "".join(
        f"{entry.key} {entry.digest} {entry.size} {entry.modified} {entry.inode} {entry.mode}"
        f" {path}\n"
        for path, entry in sorted(entries.items())
    )
    data = f"{hashlib.sha256(body.encode()).hexdigest()}\n{body}".encode()
    with contextlib.suppress(OSError):
        make_private_folder(root / ".coursebuild")
        path = _file(root, place)
        path.parent.mkdir(exist_ok=True)
        for left in path.parent.glob(".new-*"):  # by a run that was killed
            left.unlink(missing_ok=True)
        name = f"{path.parent}/.new-{os.urandom(8).hex()}"
        try:
            with open(name, "xb") as file:  # noqa: PTH123
                file.write(data)
            Path(name).replace(path)
        except BaseException:
            Path(name).unlink(missing_ok=True)
            raise


def _file(root: Path, place: Path) -> Path:
    """One for each place, which keeps its record when the project is moved with the site in it."""
    named = place.relative_to(root) if place.is_relative_to(root) else place
    return root / RECORDS / hashlib.sha256(os.fsencode(named)).hexdigest()


def _parsed(line: str) -> tuple[str, Entry]:
    key, digest, size, modified, inode, mode, path = line.split(" ", 6)
    return path, Entry(key, digest, int(size), int(modified), int(inode), int(mode))
