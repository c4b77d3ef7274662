"""Smaller copies of a site's assets, which a server can send as they are.

Entry point: `compressed_files(files, keep)`.

Beside each asset of a kind that shrinks stand `NAME.br` and `NAME.gz`; a server that is told to
(nginx's `brotli_static` and `gzip_static`, Caddy's `precompressed`) chooses by what the browser
takes. Pages change with every build and are small, so that they are left to the server.

The same bytes give the same copies: they hold no time.
"""

from __future__ import annotations

import functools
import gzip
import hashlib
from collections.abc import Callable, Iterable, Iterator

from coursebuild.core.model.results import CachedFile, SiteFile

_SUFFIXES = (".css", ".js", ".json", ".mjb", ".svg", ".wasm")
_SMALLEST = 1024
"""Bytes: below, headers outweigh what is saved."""
_LARGE = 2 << 20
"""Bytes: from here on the last tenth would cost a quarter of a minute."""
Keep = Callable[[str, Callable[[], bytes]], bytes]
"""Gives what was made under a key before, or makes it."""


def compressed_files(files: Iterable[SiteFile], keep: Keep) -> tuple[CachedFile, ...]:
    """The copies of all assets among the files that are not compressed themselves."""
    return tuple(copy for file in files for copy in _copies(file, keep))


def _copies(file: SiteFile, keep: Keep) -> Iterator[CachedFile]:
    if not file.path.startswith("assets/") or not file.path.endswith(_SUFFIXES):
        return
    data = file.make()
    if len(data) < _SMALLEST:
        return
    # One more for small files would be two percent fewer bytes for twice the time.
    quality = 9 if len(data) >= _LARGE else 10
    ways = {
        "br": functools.partial(_brotli, data, quality),
        "gz": functools.partial(gzip.compress, data, 9, mtime=0),
    }
    for suffix, compress in ways.items():
        key = hashlib.sha256(f"{suffix}/{quality}\0".encode() + data).hexdigest()
        yield CachedFile(f"{file.path}.{suffix}", key, functools.partial(keep, key, compress))


def _brotli(data: bytes, quality: int) -> bytes:
    import brotli  # which a build without a new asset does not need

    packed: bytes = brotli.compress(data, quality=quality)
    return packed
