"""The files of a site made and written, on several cores where there are many.

Entry points: `writing`; `write_file`, for one.

1. Copies of this process make files and write them, some at a time; of what they did comes back
   what the record of the site holds.
2. What a copy did not finish, because it died, is written here anew.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TypeAlias

from coursebuild.effects.published import Entry
from coursebuild.results import KeptFile, OutputFile, SiteFile

_MANY = 128
"""Files for which copies of this process are worth their start."""
_FEWEST = 6
"""Files that are written for one request, where so many are left."""
_PARTS = 4
"""Of its part of all that is left, a copy is asked for one of so many."""
_MOST = 4
"""Copies: more would wait for the disk."""
_Facts: TypeAlias = tuple[str, int, int, int, int]
"""What the record of the site holds of a file besides its key; see `Entry`."""


@contextmanager
def writing(
    folder: Path, files: Sequence[tuple[SiteFile, str]], jobs: int
) -> Iterator[Callable[[], dict[str, Entry]]]:
    """Gives what writes files with their keys into a folder; its own folders are there.

    What that gives is the record of the files, by path.
    """
    here = os.getpid()

    def one(file: SiteFile, again: bool) -> _Facts:
        target = f"{folder}/{file.path}"
        if again:
            Path(target).unlink(missing_ok=True)
        digest = write_file(target, _pieces(file))
        status = os.lstat(target)
        return digest, status.st_size, status.st_mtime_ns, status.st_ino, status.st_mode

    # What takes longest comes first, lest one copy be at it when the others have no more to do.
    order = sorted(range(len(files)), key=lambda index: not _is_long(files[index][0]))
    long = sum(_is_long(file) for file, _ in files)

    def some(which: slice) -> list[_Facts]:
        again = os.getpid() == here
        return [one(files[index][0], again) for index in order[which]]

    def alone() -> dict[str, Entry]:
        return {file.path: Entry(key, *one(file, False)) for file, key in files}

    if jobs == 1 or len(files) < _MANY:
        yield alone
        return
    from coursebuild.effects.pool import Pool, can_fork

    if not can_fork():
        yield alone
        return
    with Pool(some, min(jobs, _MOST)) as pool:

        def together() -> dict[str, Entry]:
            shares = _shares(len(files), max(1, pool.count), long)
            answers, _ = pool.run((None, share) for share in shares)
            found = dict(zip(order, (facts for answer in answers for facts in answer), strict=True))
            return {file.path: Entry(key, *found[index]) for index, (file, key) in enumerate(files)}

        yield together


def _shares(count: int, copies: int, start: int = 0) -> Iterator[slice]:
    """What is asked for at once: less and less, so that no copy waits long for the others.

    Each that comes before `start` is asked for by itself.
    """
    yield from (slice(alone, alone + 1) for alone in range(start))
    while start < count:
        size = max(_FEWEST, (count - start) // (_PARTS * copies))
        yield slice(start, start + size)
        start += size


def _is_long(file: SiteFile) -> bool:
    """Whether it is put together of all lessons."""
    return isinstance(file, KeptFile) and file.pieces is not None


def _pieces(file: SiteFile) -> Iterable[bytes]:
    """The bytes of a file, at once or one after the other."""
    if isinstance(file, OutputFile):
        return (file.data,)
    return (file.make(),) if file.pieces is None else file.pieces()


def write_file(path: str, pieces: Iterable[bytes]) -> str:
    """Write a file that is not there; gives the hash of its bytes."""
    digest = hashlib.sha256()
    fd = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o644)
    try:
        for piece in pieces:
            digest.update(piece)
            rest = memoryview(piece)
            while rest:
                rest = rest[os.write(fd, rest) :]
        os.fchmod(fd, 0o644)  # whatever the umask is
    finally:
        os.close(fd)
    return digest.hexdigest()
