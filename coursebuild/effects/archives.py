"""Writing an archive for others, in one step, without holding it in memory.

Entry points: `check_archive`, which says early whether one may be written somewhere;
`write_archive`.

The same files give the same bytes: they stand in the order of their paths, with one date, and what
is compressed already is stored.
"""

from __future__ import annotations

import contextlib
import os
import zipfile
from collections.abc import Iterable
from pathlib import Path

from coursebuild.core.engine.manifest import MARKER
from coursebuild.effects.errors import EffectError, PublishRefusedError, reason
from coursebuild.results import OutputFile, SiteFile

_DATE = (1980, 1, 1, 0, 0, 0)
_LEVEL = 6
_STORED = (".gz", ".jpeg", ".jpg", ".png", ".webp", ".woff2", ".zip", ".epub")
_AUTHORED = ("content", "models", "examples", ".coursebuild", ".git")


def check_archive(root: Path, out: Path, within: str) -> Path:
    """Where the archive goes: `out`, or the file that it links to.

    An archive with a file named `within` may be there, and nothing else.

    Raises:
        PublishRefusedError: an archive must not go there.
    """
    place = Path(os.path.realpath(out))
    for name in _AUTHORED:
        if place.is_relative_to(os.path.realpath(root / name)):
            raise PublishRefusedError(
                f"{out} lies in {name}/ of the project, where no archive goes"
            )
    if any((folder / MARKER).is_file() for folder in place.parents):
        raise PublishRefusedError(
            f"{out} lies in a published site, which the next build replaces",
            help="write the archive beside it",
        )
    if place.is_dir():
        raise PublishRefusedError(f"{out} is a folder", help="name a file, such as `course.zip`")
    if os.path.lexists(place) and not _holds(place, within):
        raise PublishRefusedError(
            f"{out} is there, and is no such archive", help="move it away, or name another file"
        )
    return place


def _holds(place: Path, name: str) -> bool:
    try:
        with zipfile.ZipFile(place) as archive:
            return name in archive.namelist()
    except (OSError, zipfile.BadZipFile, ValueError):
        return False


def write_archive(out: Path, files: Iterable[SiteFile]) -> int:
    """Write the files, and put the archive in its place when it is whole; gives its size in bytes.

    Raises:
        EffectError: it cannot be written; what was there stays.
    """
    place = Path(os.path.realpath(out))
    # One name, so that what a killed command left is written over by the next.
    temporary = place.with_name(f".{place.name}.part")
    try:
        try:
            place.parent.mkdir(parents=True, exist_ok=True)
            with zipfile.ZipFile(temporary, "w") as archive:
                for file in sorted(files, key=lambda file: file.path):
                    _add(archive, file)
            size = temporary.stat().st_size
            temporary.replace(place)
        finally:
            with contextlib.suppress(OSError):
                temporary.unlink()
    except OSError as error:
        raise EffectError(f"{out} cannot be written: {reason(error)}") from None
    return size


def _add(archive: zipfile.ZipFile, file: SiteFile) -> None:
    data = file.data if isinstance(file, OutputFile) else file.make()
    entry = zipfile.ZipInfo(file.path, _DATE)
    stored = file.path.lower().endswith(_STORED)
    entry.compress_type = zipfile.ZIP_STORED if stored else zipfile.ZIP_DEFLATED
    entry.create_system = 3
    entry.external_attr = 0o100644 << 16
    archive.writestr(entry, data, compresslevel=_LEVEL)
