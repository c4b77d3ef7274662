"""Compressed copies of a site's assets, which a server can send as they are.

Entry point: `compressed_files(files, keep)`.

Each asset of a compressible kind gets `NAME.br` and `NAME.gz`. A server configured for it (nginx's
`brotli_static` and `gzip_static`, Caddy's `precompressed`) sends the one that the browser accepts.
Pages change with every build, and small files gain little, so compressing these is left to the
server.

The same bytes give the same copies, which hold no time.
"""

from __future__ import annotations

import functools
import gzip
import hashlib
from collections.abc import Callable, Iterable, Iterator

from coursebuild.core.model.results import CachedFile, SiteFile

_SUFFIXES = (".css", ".js", ".json", ".mjb", ".svg", ".wasm")
_SMALLEST = 8 << 10
"""Bytes; a copy of a smaller file saves too little to be a file, let alone two of each."""
_LARGE = 2 << 20
"""Bytes; for larger files, the best quality would take a quarter of a minute."""
Keep = Callable[[str, Callable[[], bytes]], bytes]
"""Returns what was made under a key before, or makes it."""


def compressed_files(files: Iterable[SiteFile], keep: Keep) -> tuple[CachedFile, ...]:
    """The copies of all assets among the files that are worth compressing."""
    return tuple(copy for file in files for copy in _copies(file, keep))


def _copies(file: SiteFile, keep: Keep) -> Iterator[CachedFile]:
    if not file.path.startswith("assets/") or not file.path.endswith(_SUFFIXES):
        return
    data = file.make()
    if len(data) < _SMALLEST:
        return
    # Quality 11 would save two percent more of small files in twice the time.
    quality = 9 if len(data) >= _LARGE else 10
    compressors = {
        "br": functools.partial(_brotli, data, quality),
        "gz": functools.partial(gzip.compress, data, 9, mtime=0),
    }
    for suffix, compress in compressors.items():
        key = hashlib.sha256(f"{suffix}/{quality}\0".encode() + data).hexdigest()
        yield CachedFile(f"{file.path}.{suffix}", key, functools.partial(keep, key, compress))


def _brotli(data: bytes, quality: int) -> bytes:
    import brotli  # needed only by a build with a new asset

    packed: bytes = brotli.compress(data, quality=quality)
    return packed
