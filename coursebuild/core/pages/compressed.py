"""Smaller copies of a site's assets, which a server can send as they are.

Entry points: `compressed_files(files, keep)`; `kept_copy`, one copy, and `copy_of`, one made now.

Beside each asset that shrinks stand `NAME.br` and `NAME.gz`; a server that is told to (nginx's
`brotli_static` and `gzip_static`, Caddy's `precompressed`) chooses by what the browser takes. Pages
change with every build and are small, so that they are left to the server.

The same bytes give the same copies: they hold no time.
"""

from __future__ import annotations

import gzip
import hashlib
from collections.abc import Callable, Iterable, Iterator

from coursebuild.core.model.results import OutputFile

SUFFIXES = (".css", ".js", ".json", ".mjb", ".svg", ".wasm")
_SMALLEST = 1024
"""Bytes: below, headers outweigh what is saved."""
_LARGE = 2 << 20
"""Bytes: from here on the last tenth would cost a quarter of a minute."""
COPIES = ("br", "gz")
"""What the names of copies end with."""
Keep = Callable[[str, Callable[[], bytes]], bytes]
"""Gives what was made under a key before, or makes it."""


def compressed_files(files: Iterable[OutputFile], keep: Keep) -> tuple[OutputFile, ...]:
    """The copies of all assets among the files, where they are smaller."""
    return tuple(copy for file in files for copy in _copies(file, keep))


def _copies(file: OutputFile, keep: Keep) -> Iterator[OutputFile]:
    compressible = file.path.startswith("assets/") and file.path.endswith(SUFFIXES)
    if not compressible or len(file.data) < _SMALLEST:
        return
    for suffix in COPIES:
        data = kept_copy(file.data, suffix, keep)
        if len(data) < len(file.data):
            yield OutputFile(f"{file.path}.{suffix}", data)


def kept_copy(data: bytes, suffix: str, keep: Keep) -> bytes:
    """A copy of one of `COPIES`, whether or not it is smaller."""
    quality = _quality(data)
    key = hashlib.sha256(f"{suffix}/{quality}\0".encode() + data)
    return keep(key.hexdigest(), lambda: copy_of(data, suffix, quality))


def copy_of(data: bytes, suffix: str, quality: int) -> bytes:
    """A copy of one of `COPIES`; `quality` is Brotli's."""
    return _brotli(data, quality) if suffix == "br" else _gzip(data)


def _quality(data: bytes) -> int:
    """Of Brotli; one more for small files would be two percent fewer bytes for twice the time."""
    return 9 if len(data) >= _LARGE else 10


def _brotli(data: bytes, quality: int) -> bytes:
    import brotli

    packed: bytes = brotli.compress(data, quality=quality)
    return packed


def _gzip(data: bytes) -> bytes:
    return gzip.compress(data, 9, mtime=0)
