"""Exports: a file or an archive, written in one step, without holding the archive in memory.

Entry points: `check_target`, which says early whether an export may be written somewhere;
`write_export`.

The same files give the same bytes: entries are sorted by path and have the same date. Files that
are compressed already are stored.
"""

from __future__ import annotations

import contextlib
import os
import zipfile
from collections.abc import Iterable
from pathlib import Path
from typing import BinaryIO

from coursebuild.core.engine.manifest import MARKER
from coursebuild.core.files.errors import EffectError, PublishRefusedError, reason
from coursebuild.core.model.results import SiteFile

_DATE = (1980, 1, 1, 0, 0, 0)
_LEVEL = 6
_MIMETYPE = "mimetype"
"""The file that an e-book must begin with, uncompressed."""
_UNCOMPRESSED_SUFFIXES = (".gz", ".jpeg", ".jpg", ".png", ".webp", ".woff2", ".zip", _MIMETYPE)
_AUTHOR_FOLDERS = ("features", "models", "examples", ".coursebuild", ".git")


def check_target(root: Path, out: Path, mark: str, *, archive: bool) -> None:
    """Check that an export may be written to `out`: nothing is there, or only an earlier export.

    An earlier archive holds a file called `mark`; any other export has `mark` near its beginning.

    Raises:
        PublishRefusedError: the file must not go there.
    """
    place = Path(os.path.realpath(out))
    for name in _AUTHOR_FOLDERS:
        if place.is_relative_to(os.path.realpath(root / name)):
            raise PublishRefusedError(f"{out} lies in {name}/ of the project, where no export goes")
    if any((folder / MARKER).is_file() for folder in place.parents):
        raise PublishRefusedError(
            f"{out} lies in a published site, which the next build replaces",
            help="write the file beside it",
        )
    if place.is_dir():
        raise PublishRefusedError(f"{out} is a folder", help="name a file, such as `course.zip`")
    is_export = _holds_file if archive else _begins_with
    if os.path.lexists(place) and not is_export(place, mark):
        raise PublishRefusedError(
            f"{out} exists and is not such an export", help="move it away, or name another file"
        )


def _holds_file(place: Path, name: str) -> bool:
    try:
        with zipfile.ZipFile(place) as archive:
            return name in archive.namelist()
    except (OSError, zipfile.BadZipFile, ValueError):
        return False


def _begins_with(place: Path, mark: str) -> bool:
    try:
        with place.open("rb") as file:
            return mark.encode() in file.read(1000)
    except OSError:
        return False


def write_export(out: Path, files: Iterable[SiteFile], *, archive: bool) -> int:
    """Write files into an archive, or a single file as it is; return the size in bytes.

    Raises:
        EffectError: it cannot be written; what was there stays.
    """
    place = Path(os.path.realpath(out))
    # Always the same name, so that the next command overwrites what a killed one left.
    temporary = place.with_name(f".{place.name}.part")
    try:
        try:
            place.parent.mkdir(parents=True, exist_ok=True)
            with temporary.open("wb") as target:
                if archive:
                    _pack(target, files)
                else:
                    (file,) = files
                    target.write(file.make())
            size = temporary.stat().st_size
            temporary.replace(place)
        finally:
            with contextlib.suppress(OSError):
                temporary.unlink()
    except OSError as error:
        raise EffectError(f"{out} cannot be written: {reason(error)}") from None
    return size


def _pack(target: BinaryIO, files: Iterable[SiteFile]) -> None:
    with zipfile.ZipFile(target, "w") as archive:
        for file in sorted(files, key=lambda file: (file.path != _MIMETYPE, file.path)):
            entry = zipfile.ZipInfo(file.path, _DATE)
            is_stored = file.path.lower().endswith(_UNCOMPRESSED_SUFFIXES)
            entry.compress_type = zipfile.ZIP_STORED if is_stored else zipfile.ZIP_DEFLATED
            entry.create_system = 3
            entry.external_attr = 0o100644 << 16
            archive.writestr(entry, file.make(), compresslevel=_LEVEL)
