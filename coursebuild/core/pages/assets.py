"""The tool's own files: templates, interface texts, and the bundled files for browsers.

A file that a page refers to is published under a name with a hash of its content, so that a browser
may keep it for ever. Each one of a compressible kind gets `NAME.br` and `NAME.gz`, which a server
configured for it sends; pages change with every build, and are left to the server to compress.
"""

from __future__ import annotations

import functools
import gzip
import hashlib
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

from msgspec import Struct

from coursebuild.core.model.results import CachedFile, SiteFile

SCRIPTS = {
    "theme.js": "js/theme.js",
    "site.js": "js/site.js",
    "offline.js": "js/offline-page.js",
    "map.js": "js/map-page.js",
    "progress.js": "js/progress-page.js",
    "review.js": "js/review-page.js",
    "search.js": "js/search.js",
}
"""The published names of plain scripts of pages, with the bundled modules."""


class Assets(Struct, frozen=True):
    """Templates and bundled files, sorted by path."""

    templates: tuple[tuple[str, str], ...]
    """Path relative to `templates/`, and text."""
    dist: Mapping[str, bytes]
    """Path relative to the bundle (`css/site.css`, `js/site.js`, `fonts/fonts.json`, …), and
    bytes, perhaps read on access."""
    compiled_templates: Path | None = None
    """The folder of the compiled templates; see `templates_of`."""

    def template(self, path: str) -> str:
        """The text of a file of `templates/` (`KeyError` where there is none)."""
        return dict(self.templates)[path]

    def file(self, path: str) -> bytes:
        """The bytes of a bundled file (`KeyError` where there is none)."""
        return self.dist[path]

    def files(self, folder: str) -> tuple[tuple[str, bytes], ...]:
        """The bundled files of a folder."""
        paths = (path for path in self.dist if path.startswith(f"{folder}/"))
        return tuple((path, self.dist[path]) for path in paths)


class Names(Struct, frozen=True):
    """Site paths of the files that every page refers to."""

    style: str
    theme_script: str
    script: str
    icon: str
    credits: str
    touch_icon: str
    scripts: tuple[tuple[str, str], ...] = ()
    """The scripts of parts of pages, each after its mark (`PagePart`)."""
    fonts: tuple[tuple[str, str], ...] = ()
    """Those that a page fetches at once if it holds the mark before them."""
    logo: str = ""
    logo_dark: str = ""
    logo_width: int = 0
    """In pixels, at the height `frame.LOGO_HEIGHT`."""

    def paths(self) -> frozenset[str]:
        """All site paths."""
        values = (getattr(self, field) for field in self.__struct_fields__)
        single = (path for path in values if isinstance(path, str) and path)
        return frozenset((*single, *(path for _, path in self.scripts + self.fonts)))


def hashed_name(path: str, data: bytes) -> str:
    """`assets/site.css` with eight digits of its content's hash: `assets/site.1b4f0e98.css`."""
    stem, dot, suffix = path.rpartition(".")
    digest = hashlib.sha256(data).hexdigest()[:8]
    return f"{stem}.{digest}.{suffix}" if dot else f"{path}.{digest}"


def page_script(code: bytes) -> bytes:
    """A bundled module without imports or exports as a plain script in a scope of its own.

    Browsers refuse to load modules from a disk, and plain scripts of a page share top-level names.
    """
    return b'"use strict";(()=>{' + code.rstrip() + b"\n})();\n"


# --- compressed copies

_SUFFIXES = (".css", ".js", ".json", ".mjb", ".svg", ".wasm")
_SMALLEST = 8 << 10
"""Bytes; a copy of a smaller file saves too little to be a file, let alone two of each."""
_LARGE = 2 << 20
"""Bytes; for larger files, the best quality would take a quarter of a minute."""
Keep = Callable[[str, Callable[[], bytes]], bytes]
"""Returns what was made under a key before, or makes it."""


def compressed_files(files: Iterable[SiteFile], keep: Keep) -> tuple[CachedFile, ...]:
    """The copies of all assets among the files that are worth compressing."""
    import brotli  # needed only by a build

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
            "br": functools.partial(brotli.compress, data, quality=quality),
            "gz": functools.partial(gzip.compress, data, 9, mtime=0),
        }
        for suffix, compress in compressors.items():
            key = hashlib.sha256(f"{suffix}/{quality}\0".encode() + data).hexdigest()
            make = functools.partial(keep, key, compress)
            copies.append(CachedFile(f"{file.path}.{suffix}", key, make))
    return tuple(copies)
