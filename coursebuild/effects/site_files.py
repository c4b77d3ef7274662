"""The files of a site made and written, on several cores where there are many.

Entry points: `writing`; `write_file`, for one.

1. Copies of this process make files and write them, some at a time; of what they did comes back
   what the record of the site holds.
2. What was put aside can be read in this process only: files that are made of that are made here.
3. What a copy did not finish, because it died, is written here anew.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from coursebuild.effects.aside import AsideError
from coursebuild.effects.published import Entry
from coursebuild.results import OutputFile, SiteFile

_MANY = 128
"""Files for which copies of this process are worth their start."""
_AT_ONCE = 12
"""Files that are written for one request."""
_MOST = 4
"""Copies: more would wait for the disk."""


@contextmanager
def writing(
    folder: Path, files: Sequence[tuple[SiteFile, str]], jobs: int
) -> Iterator[Callable[[], dict[str, Entry]]]:
    """Gives what writes files with their keys into a folder; its own folders are there.

    What that gives is the record of the files, by path.
    """
    here = os.getpid()

    def one(file: SiteFile, key: str, again: bool) -> Entry | None:
        target = f"{folder}/{file.path}"
        if again:
            Path(target).unlink(missing_ok=True)
        try:
            digest = write_file(target, _pieces(file))
        except AsideError:
            Path(target).unlink(missing_ok=True)
            return None
        return Entry.of(key, digest, os.lstat(target))

    def some(start: int) -> list[Entry | None]:
        again = os.getpid() == here
        return [one(*file, again) for file in files[start : start + _AT_ONCE]]

    def alone() -> dict[str, Entry]:
        return {file.path: _sure(one(file, key, False)) for file, key in files}

    if jobs == 1 or len(files) < _MANY:
        yield alone
        return
    from coursebuild.effects.pool import Pool, can_fork

    if not can_fork():
        yield alone
        return
    with Pool(some, min(jobs, _MOST)) as pool:

        def together() -> dict[str, Entry]:
            requests = [(None, start) for start in range(0, len(files), _AT_ONCE)]
            answers, _ = pool.run(requests)
            found = [entry for answer in answers for entry in answer]
            return {
                file.path: _sure(one(file, key, True) if entry is None else entry)
                for (file, key), entry in zip(files, found, strict=True)
            }

        yield together


def _sure(entry: Entry | None) -> Entry:
    assert entry is not None, "what was put aside here can be read here"
    return entry


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
