"""Archives, the same bytes for the same content.

Entries are sorted by path, with one fixed date and one fixed compression.
"""

from __future__ import annotations

import hashlib
import io
import zipfile
from collections.abc import Iterable, Mapping
from typing import BinaryIO

from msgspec import Struct

from coursebuild.core.model.results import OutputFile, SiteFile

_DATE = (1980, 1, 1, 0, 0, 0)
_LEVEL = 6
_MIMETYPE = "mimetype"
"""The file that an e-book must begin with, uncompressed."""
_UNCOMPRESSED_SUFFIXES = (".gz", ".jpeg", ".jpg", ".png", ".webp", ".woff2", ".zip", _MIMETYPE)


class Archive(Struct, frozen=True):
    """An archive of scripts that run elsewhere, before it is packed."""

    path: str
    """Its path in the site."""
    files: Mapping[str, bytes]
    """Its content by path."""

    @property
    def key(self) -> str:
        digest = hashlib.sha256()
        for path, data in sorted(self.files.items()):
            digest.update(f"{path}\0".encode() + hashlib.sha256(data).digest())
        return digest.hexdigest()

    def pack(self) -> bytes:
        """The bytes of the archive."""
        return pack_files(self.files)


def pack_files(files: Mapping[str, bytes]) -> bytes:
    """Pack files, given by path, into an archive."""
    out = io.BytesIO()
    write_archive(out, (OutputFile(path, data) for path, data in files.items()))
    return out.getvalue()


def write_archive(target: BinaryIO, files: Iterable[SiteFile]) -> None:
    """Write an archive of files, each made when its turn comes."""
    with zipfile.ZipFile(target, "w") as archive:
        for file in sorted(files, key=lambda file: (file.path != _MIMETYPE, file.path)):
            entry = zipfile.ZipInfo(file.path, _DATE)
            if not file.path.lower().endswith(_UNCOMPRESSED_SUFFIXES):
                entry.compress_type = zipfile.ZIP_DEFLATED
            entry.create_system = 3
            entry.external_attr = 0o100644 << 16
            archive.writestr(entry, file.make(), compresslevel=_LEVEL)
