"""Folders beside a site's place: the one that is written, and what killed builds left there.

Entry points: `Staging.make`, `Staging.spare`, `keep_spare`, `clean`, `beside`, `is_alive`.

Of thousands of files an edit changes some. To link the others into a fresh folder, and to remove
the old one, takes longer than to make those that changed. So the folder that was swapped out is
kept, in `.coursebuild/`, and the next build puts into it what it lacks:

1. Nothing in it is believed that would not be believed in the site: a file stays that is by kind,
   size, time and inode the one that the record of the site has. (Both have the same file: who
   writes to one writes to the other, and neither is believed.) Everything else is unlinked first,
   and never written to.
2. It is taken by renaming it, by who has it locked, and it was locked before it was swapped out: so
   nobody can take it for abandoned, and be removing what is in it. Where there are no locks, no
   exchange, or another file system, there is no spare, and every folder is a fresh one.
3. It is used only beside a site, and kept only where it shares most of its files: it takes little
   room, and a site that somebody removed is made anew.
"""

from __future__ import annotations

import contextlib
import os
import shutil
from collections.abc import Container, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from msgspec import Struct

from coursebuild.effects.locks import is_abandoned, try_lock
from coursebuild.effects.published import RECORDS, Entry

_SPARE = f"{RECORDS}/spare"
"""Of a course, whatever the place: a course has one, most often."""
_FOLDER = os.O_RDONLY | os.O_CLOEXEC | os.O_DIRECTORY | os.O_NOFOLLOW


class Staging(Struct, frozen=True):
    """A folder beside the place; open and locked as long as its builder lives."""

    path: Path
    fd: int

    @classmethod
    def make(cls, place: Path) -> Staging:
        """A fresh one."""
        while True:
            path = _name(place)
            path.mkdir(0o700)
            try:
                fd = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
                try_lock(fd)
            except FileNotFoundError:  # another build took it for abandoned before it was locked
                continue
            if _is_at(fd, path):
                return cls(path, fd)
            os.close(fd)

    @classmethod
    def spare(cls, root: Path, place: Path) -> Staging | None:
        """The spare of the course, if it has one that can be had."""
        path = _name(place)
        try:
            fd = os.open(root / _SPARE, _FOLDER)
        except OSError:
            return None
        with contextlib.suppress(OSError):
            if try_lock(fd) and _is_at(fd, root / _SPARE):
                (root / _SPARE).rename(path)
                if _is_at(fd, path):
                    path.chmod(0o700)
                    return cls(path, fd)
        os.close(fd)
        return None


@contextmanager
def held(place: Path) -> Iterator[int | None]:
    """Hold the site that is there locked, so that no build takes it for abandoned; gives its fd."""
    try:
        fd = os.open(place, _FOLDER)
    except OSError:
        yield None
        return
    try:
        yield fd if try_lock(fd) else None
    finally:
        os.close(fd)


def keep_spare(root: Path, folder: Path, fd: int) -> None:
    """Make a folder the course's spare, if it is the one that is held, and there is none yet."""
    with contextlib.suppress(OSError):
        if _is_at(fd, folder):
            os.fchmod(fd, 0o700)  # one that may not be written cannot be moved elsewhere
            folder.rename(root / _SPARE)


def sift(
    folder: int, known: Mapping[str, Entry], folders: Container[str], prefix: str = ""
) -> tuple[dict[str, Entry], set[str]]:
    """Remove from a folder all but files that are as they should be.

    Args:
        folder: the open folder, or one in it. (What is in it is found from there: this takes less
            time than from the root, and no link that somebody puts in the way leads elsewhere.)
        known: what the files should be, by path.
        folders: those that may stay.
        prefix: the path of this folder, with a slash behind it.

    Returns:
        The files and folders that stay.

    Raises:
        OSError: something cannot be looked at, or removed.
    """
    kept: dict[str, Entry] = {}
    stay: set[str] = set()
    others: list[tuple[str, bool]] = []
    with os.scandir(folder) as entries:
        for entry in entries:
            path = prefix + entry.name
            expected = known.get(path)
            if expected is not None:
                expected = expected.seen(entry.stat(follow_symlinks=False))
            if expected is not None:
                kept[path] = expected
            else:
                others.append((entry.name, entry.is_dir(follow_symlinks=False)))
    for name, is_folder in others:
        path = prefix + name
        if not is_folder:
            os.unlink(name, dir_fd=folder)
        elif path not in folders:
            shutil.rmtree(name, dir_fd=folder)
        else:
            inner = os.open(name, _FOLDER, dir_fd=folder)
            try:
                os.fchmod(inner, 0o755)
                more, below = sift(inner, known, folders, f"{path}/")
            finally:
                os.close(inner)
            kept |= more
            stay |= {path, *below}
    return kept, stay


def beside(place: Path, kind: str) -> list[Path]:
    """Folders beside the place that a build made: `new` being written, `old` replaced."""
    start = f".{place.name}.{kind}-"
    try:
        with os.scandir(place.parent) as entries:
            return sorted(
                Path(entry.path)
                for entry in entries
                if entry.name.startswith(start)
                and len(entry.name) == len(start) + 8
                and entry.is_dir(follow_symlinks=False)
            )
    except OSError:
        return []


def is_alive(staging: Path) -> bool:
    """Whether the build that writes this folder still runs."""
    try:
        fd = os.open(staging, os.O_RDONLY | os.O_CLOEXEC)
    except OSError:
        return False
    try:
        return not is_abandoned(fd)
    finally:
        os.close(fd)


def clean(place: Path) -> None:
    """Remove what builds that are no more left beside the place."""
    for path in beside(place, "new"):
        if not is_alive(path):
            remove(path)
    if place.exists():  # else the old site may be all there is
        for path in beside(place, "old"):
            remove(path)


def remove(folder: Path) -> None:
    """Remove a folder, as far as that can be done."""
    with contextlib.suppress(OSError):
        fd = os.open(folder, _FOLDER)
        try:
            os.fchmod(fd, 0o700)  # that of a site may have been made read-only
        finally:
            os.close(fd)
    shutil.rmtree(folder, ignore_errors=True)


def _name(place: Path) -> Path:
    return place.with_name(f".{place.name}.new-{os.urandom(4).hex()}")


def _is_at(fd: int, path: Path) -> bool:
    try:
        return os.path.samestat(os.fstat(fd), os.lstat(path))
    except OSError:
        return False
