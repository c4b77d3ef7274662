"""Smaller copies of assets: which get them, that they hold the same, and that they are kept."""

from __future__ import annotations

import gzip

import brotli

from coursebuild.core.model.results import OutputFile
from coursebuild.core.pages.assets import compressed_files

TEXT = b"function f(x) { return x * x + 1 }\n" * 300


def copies(path: str, data: bytes) -> list[OutputFile]:
    files = compressed_files([OutputFile(path, data)], lambda key, make: make())
    return [OutputFile(file.path, file.make()) for file in files]


def test_an_asset_gets_a_brotli_and_a_gzip_copy() -> None:
    for suffix in ("js", "css", "wasm", "json", "mjb", "svg"):
        path = f"assets/labs/x.1234abcd.{suffix}"
        first, second = copies(path, TEXT)
        assert (first.path, second.path) == (f"{path}.br", f"{path}.gz")
        assert brotli.decompress(first.data) == gzip.decompress(second.data) == TEXT
        assert second.data[4:8] == b"\0\0\0\0", "gzip's time"


def test_pages_pictures_fonts_and_archives_get_no_copy() -> None:
    for path in ("index.html", "lessons/x.js", "assets/x.png", "assets/fonts/x.woff2", "x.zip"):
        assert copies(path, TEXT) == []


def test_what_is_below_8_kib_gets_no_copy() -> None:
    assert copies("assets/x.js", TEXT[:8191]) == []
    assert len(copies("assets/x.js", TEXT[:8192])) == 2


def test_what_is_large_is_compressed_less_finely() -> None:
    """From 2 MiB on, where the finer way takes long."""
    large = (TEXT * 200)[: 2 << 20]
    for data, quality in ((large[:-1], 10), (large, 9)):
        brotli_copy, _ = copies("assets/x.js", data)
        assert brotli_copy.data == brotli.compress(data, quality=quality)
