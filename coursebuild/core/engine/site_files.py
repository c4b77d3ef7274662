"""The files of a site made and written, on several cores where there are many.

Entry points: `writing`; `write_file`, for one.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from coursebuild.core.engine.manifest import ManifestEntry
from coursebuild.core.model.results import OutputFile, SiteFile

if TYPE_CHECKING:
    from coursebuild.core.engine.workers import Workers

_MANY = 128
"""Files for which copies of this process are worth their start."""
_SHARE = 16
"""Files that a copy writes for one request."""
_MOST = 4
"""Copies: more would wait for the disk."""


@contextmanager
def writing(
    folder: Path, files: Sequence[tuple[SiteFile, str]], jobs: int
) -> Iterator[Callable[[], dict[str, ManifestEntry]]]:
    """Gives what writes files with their keys into a folder; its own folders are there.

    What that gives is the entries of the files, by path.
    """

    def write(file: SiteFile, key: str) -> ManifestEntry:
        target = f"{folder}/{file.path}"
        Path(target).unlink(missing_ok=True)  # half of it, by a copy that died
        digest = write_file(target, file.data if isinstance(file, OutputFile) else file.make())
        return ManifestEntry.of(key, digest, os.lstat(target))

    def share(start: int) -> list[ManifestEntry]:
        return [write(*found) for found in files[start : start + _SHARE]]

    starts = range(0, len(files), _SHARE)
    with _workers(share, jobs if len(files) >= _MANY else 1) as workers:

        def written() -> dict[str, ManifestEntry]:
            tasks = ((None, start) for start in starts)
            parts = (
                map(share, starts) if workers is None else (part for part, _ in workers.map(tasks))
            )
            entries = (entry for part in parts for entry in part)
            return {file.path: entry for (file, _), entry in zip(files, entries, strict=True)}

        yield written


@contextmanager
def _workers(
    share: Callable[[int], list[ManifestEntry]], jobs: int
) -> Iterator[Workers[int, list[ManifestEntry]] | None]:
    if jobs > 1:
        from coursebuild.core.engine.workers import Workers, can_fork

        if can_fork():
            with Workers(share, min(jobs, _MOST)) as workers:
                yield workers
            return
    yield None


def write_file(path: str, data: bytes) -> str:
    """Write a file that is not there; gives the hash of its bytes."""
    fd = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o644)
    try:
        rest = memoryview(data)
        while rest:
            rest = rest[os.write(fd, rest) :]
        os.fchmod(fd, 0o644)  # whatever the umask is
    finally:
        os.close(fd)
    return hashlib.sha256(data).hexdigest()
