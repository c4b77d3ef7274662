"""Smaller copies of assets: which get them, that they hold the same, and that they are kept."""

from __future__ import annotations

import gzip
import random
from collections.abc import Callable

import brotli
import pytest

from coursebuild.core.model.results import OutputFile
from coursebuild.core.pages.compressed import compressed_files

TEXT = b"function f(x) { return x * x + 1 }\n" * 100


class Kept:
    """A store that counts what is made."""

    def __init__(self) -> None:
        self.entries: dict[str, bytes] = {}
        self.made = 0

    def __call__(self, key: str, make: Callable[[], bytes]) -> bytes:
        if key not in self.entries:
            self.entries[key] = make()
            self.made += 1
        return self.entries[key]


def copies(path: str, data: bytes, keep: Kept | None = None) -> list[OutputFile]:
    return list(compressed_files([OutputFile(path, data)], keep or Kept()))


@pytest.mark.parametrize("suffix", ["js", "css", "wasm", "json", "mjb", "svg"])
def test_an_asset_gets_a_brotli_and_a_gzip_copy(suffix: str) -> None:
    first, second = copies(f"assets/labs/x.1234abcd.{suffix}", TEXT)
    assert first.path == f"assets/labs/x.1234abcd.{suffix}.br"
    assert second.path == f"assets/labs/x.1234abcd.{suffix}.gz"
    assert brotli.decompress(first.data) == gzip.decompress(second.data) == TEXT


@pytest.mark.parametrize(
    "path",
    [
        "index.html",
        "lessons/x.js",
        "assets/x.png",
        "assets/fonts/x.woff2",
        "course.zip",
        "assets/js",
    ],
)
def test_pages_pictures_fonts_and_archives_get_no_copy(path: str) -> None:
    assert copies(path, TEXT) == []


def test_what_is_below_1024_bytes_or_does_not_shrink_gets_no_copy() -> None:
    assert copies("assets/x.js", TEXT[:1023]) == []
    assert len(copies("assets/x.js", TEXT[:1024])) == 2
    assert copies("assets/x.wasm", random.Random(0).randbytes(5000)) == []


def test_a_copy_has_the_same_bytes_each_time_and_no_date() -> None:
    first, again = copies("assets/x.js", TEXT), copies("assets/x.js", TEXT)
    assert first == again
    assert first[1].data[4:8] == b"\0\0\0\0", "gzip's time"


def test_each_content_is_compressed_once() -> None:
    keep = Kept()
    files = [OutputFile("assets/a.js", TEXT), OutputFile("assets/b.js", TEXT)]
    assert len(compressed_files(files, keep)) == 4
    assert keep.made == 2
    compressed_files(files, keep)
    assert keep.made == 2


def test_what_is_large_is_compressed_less_finely() -> None:
    """From 2 MiB on, where the finer way takes long."""
    large = (TEXT * 600)[: 2 << 20]
    for data, quality in ((large[:-1], 10), (large, 9)):
        brotli_copy, _ = copies("assets/x.js", data)
        assert brotli_copy.data == brotli.compress(data, quality=quality)
