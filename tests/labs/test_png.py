"""Pictures as PNG: read back by a decoder of our own."""

from __future__ import annotations

import struct
import zlib

import numpy as np
import pytest
from numpy.typing import NDArray

from coursebuild.labs.png import png

Pixels = NDArray[np.uint8]


def decoded(data: bytes) -> Pixels:
    """By hand: the chunks, the checksums and the filters of PNG."""
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    at, chunks = 8, []
    while at < len(data):
        (length,) = struct.unpack(">I", data[at : at + 4])
        name, body = data[at + 4 : at + 8], data[at + 8 : at + 8 + length]
        (checksum,) = struct.unpack(">I", data[at + 8 + length : at + 12 + length])
        assert checksum == zlib.crc32(name + body)
        chunks.append((name, body))
        at += 12 + length
    assert [name for name, _ in chunks] == [b"IHDR", b"IDAT", b"IEND"]
    width, height, depth, colour, *rest = struct.unpack(">IIBBBBB", chunks[0][1])
    assert (depth, rest) == (8, [0, 0, 0])
    channels = {2: 3, 6: 4}[colour]
    raw = zlib.decompress(chunks[1][1])
    assert len(raw) == height * (channels * width + 1)
    rows = [[0] * (channels * width)]
    for i in range(height):
        kind, *line = raw[i * (channels * width + 1) : (i + 1) * (channels * width + 1)]
        rows.append(unfiltered(kind, line, rows[-1], channels))
    pixels = np.array(rows[1:], np.uint8).reshape(height, width, channels)
    opaque = np.full((height, width, 4 - channels), 255, np.uint8)
    return np.concatenate((pixels, opaque), axis=2)


def unfiltered(kind: int, line: list[int], above: list[int], channels: int) -> list[int]:
    """A row, from what a filter has left of it."""
    row: list[int] = []
    for i, rest in enumerate(line):
        left = row[i - channels] if i >= channels else 0
        corner = above[i - channels] if i >= channels else 0
        guess = left + above[i] - corner
        paeth = min((left, above[i], corner), key=lambda value: abs(guess - value))
        row.append((rest + (0, left, above[i], (left + above[i]) // 2, paeth)[kind]) % 256)
    return row


@pytest.mark.parametrize("size", [(1, 1), (7, 3), (64, 48)])
@pytest.mark.parametrize("opaque", [True, False])
def test_it_is_read_back_as_it_was(size: tuple[int, int], opaque: bool) -> None:
    random = np.random.default_rng(0)
    pixels = random.integers(0, 256, (size[1], size[0], 4), dtype=np.uint8)
    if opaque:
        pixels[..., 3] = 255
    else:
        pixels[0, 0, 3] = 7
    assert np.array_equal(decoded(png(pixels)), pixels)


@pytest.mark.parametrize("slope", [(1, 0), (0, 1), (1, 1), (2, -1)])
def test_an_even_slope_takes_little_room(slope: tuple[int, int]) -> None:
    """Each of the filters has its use."""
    y, x = np.mgrid[:64, :64]
    grey = (100 + slope[0] * x + slope[1] * y) % 256
    pixels = np.dstack([grey, grey, grey, np.full_like(grey, 255)]).astype(np.uint8)
    data = png(pixels)
    assert np.array_equal(decoded(data), pixels)
    assert len(data) < 500
