"""Archives of scripts that run elsewhere, the same bytes for the same content.

Entries are sorted by path, with one fixed date and one fixed compression.
"""

from __future__ import annotations

import hashlib
import io
import zipfile
from collections.abc import Mapping

from msgspec import Struct

_DATE = (1980, 1, 1, 0, 0, 0)


class Archive(Struct, frozen=True):
    """An archive before it is packed."""

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
    with zipfile.ZipFile(out, "w") as archive:
        for path, data in sorted(files.items()):
            entry = zipfile.ZipInfo(path, _DATE)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.create_system = 3
            entry.external_attr = 0o100644 << 16
            archive.writestr(entry, data, compresslevel=9)
    return out.getvalue()
