"""Files that features add to a site, and what exports are made from.

Entry points: `SiteContext` and `ExportContext`, what features make files from; `added_files`;
`page_notes`, what features note of a page when it is drawn, in order to make files later.

`compressed_files`: each asset of a compressible kind gets `NAME.br` and `NAME.gz`. A server
configured for it (nginx's `brotli_static` and `gzip_static`, Caddy's `precompressed`) sends the one
that the browser accepts. Pages change with every build, and small files gain little, so compressing
these is left to the server. The same bytes give the same copies, which hold no time.
"""

from __future__ import annotations

import functools
import gzip
import hashlib
from collections.abc import Callable, Iterable, Mapping

from msgspec import Struct

from coursebuild.core.model import Course, Document
from coursebuild.core.model.results import CachedFile, SiteFile
from coursebuild.core.pages.assets import Assets, Names
from coursebuild.core.pages.context import PageContext
from coursebuild.core.pages.library import Library
from coursebuild.core.pages.zips import Archive


class NotedPage(Struct, frozen=True):
    """A page that a feature has made a note of."""

    path: str
    """Its site path."""
    kind: str
    """See `PageHead`."""
    id: str
    """The id of its lesson, level, model or page."""
    title: str
    digest: str
    """The digest of the note."""


class SiteContext(Struct, frozen=True):
    """What a feature makes files of a site from."""

    library: Library
    assets: Assets
    names: Names
    """The names of the files that all pages share."""
    pages: tuple[NotedPage, ...]
    """The pages with a note of this feature, in the order of the site."""
    note: Callable[[str], bytes]
    """Returns the note of a page, by its site path."""
    get_or_make: Callable[[str, Callable[[], bytes]], bytes]
    """Returns what was made under a key before, or makes it."""
    archives: Mapping[str, Archive]
    """Archives of scripts by site path."""
    imports: Callable[[str], frozenset[str]]
    """Returns the modules that a Python text imports."""


class ExportContext(Struct, frozen=True):
    """A course without errors, and what an export can be made from."""

    library: Library
    """The course with its results, words and templates. Its documents are summaries."""
    assets: Assets
    site: Callable[[], Mapping[str, SiteFile]]
    """The files of its site by path, collected on the first call."""
    page: Callable[[Document], PageContext]
    """A document with its whole text on its page, ready to be drawn."""
    read: Callable[[str], bytes]
    """A file of the course, by its path."""

    @property
    def course(self) -> Course:
        return self.library.course


_SUFFIXES = (".css", ".js", ".json", ".mjb", ".svg", ".wasm")
_SMALLEST = 8 << 10
"""Bytes; a copy of a smaller file saves too little to be a file, let alone two of each."""
_LARGE = 2 << 20
"""Bytes; for larger files, the best quality would take a quarter of a minute."""
Keep = Callable[[str, Callable[[], bytes]], bytes]
"""Returns what was made under a key before, or makes it."""


def compressed_files(files: Iterable[SiteFile], keep: Keep) -> tuple[CachedFile, ...]:
    """The copies of all assets among the files that are worth compressing."""
    copies: list[CachedFile] = []
    for file in files:
        if not file.path.startswith("assets/") or not file.path.endswith(_SUFFIXES):
            continue
        data = file.make()
        if len(data) < _SMALLEST:
            continue
        # Quality 11 would save two percent more of small files in twice the time.
        quality = 9 if len(data) >= _LARGE else 10
        compressors = {
            "br": functools.partial(_brotli, data, quality),
            "gz": functools.partial(gzip.compress, data, 9, mtime=0),
        }
        for suffix, compress in compressors.items():
            key = hashlib.sha256(f"{suffix}/{quality}\0".encode() + data).hexdigest()
            make = functools.partial(keep, key, compress)
            copies.append(CachedFile(f"{file.path}.{suffix}", key, make))
    return tuple(copies)


def _brotli(data: bytes, quality: int) -> bytes:
    import brotli  # needed only by a build with a new asset

    packed: bytes = brotli.compress(data, quality=quality)
    return packed
