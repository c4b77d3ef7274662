"""Writes pictures as PNG files, still and moving, with the same bytes each time.

A moving one is an animated PNG (PNG specification, third edition, W3C 2025): each frame after the
first holds only the rectangle that has changed. A browser that does not know it shows its first
frame.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

_LEVEL = 8
"""Of the compression; 9 takes twice as long, for 4 % less."""
_KEEP, _REPLACE = 0, 0
"""What a frame leaves behind, and how it is put over the one before."""


def png(pixels: NDArray[np.uint8]) -> bytes:
    """Write an RGBA picture, rows x columns x 4."""
    opaque = bool((pixels[..., 3] == 255).all())
    return _file(pixels, opaque, [(b"IDAT", _compressed(pixels, opaque))])


def moving_png(frames: Sequence[NDArray[np.uint8]], rate: int, rounds: int) -> bytes:
    """Write RGBA pictures of one size, `rate` a second; they are shown `rounds` times."""
    opaque = all(bool((frame[..., 3] == 255).all()) for frame in frames)
    chunks = [(b"acTL", struct.pack(">II", len(frames), rounds))]
    number = 0  # of a chunk that belongs to the animation
    for index, frame in enumerate(frames):
        top, left, part = _changed_part(frames[index - 1], frame) if index else (0, 0, frame)
        height, width = part.shape[:2]
        place = (number, width, height, left, top, 1, rate, _KEEP, _REPLACE)
        chunks.append((b"fcTL", struct.pack(">IIIIIHHBB", *place)))
        number += 1
        data = _compressed(part, opaque)
        if index == 0:
            chunks.append((b"IDAT", data))
            continue
        chunks.append((b"fdAT", struct.pack(">I", number) + data))
        number += 1
    return _file(frames[0], opaque, chunks)


def _changed_part(
    before: NDArray[np.uint8], after: NDArray[np.uint8]
) -> tuple[int, int, NDArray[np.uint8]]:
    """Return the smallest rectangle that holds all changes: its top, its left and its pixels."""
    changed = (before != after).any(axis=2)
    if not changed.any():
        return 0, 0, after[:1, :1]
    top, bottom = _ends(changed.any(axis=1))
    left, right = _ends(changed.any(axis=0))
    return top, left, after[top:bottom, left:right]


def _ends(marks: NDArray[np.bool_]) -> tuple[int, int]:
    places = np.flatnonzero(marks)
    return int(places[0]), int(places[-1]) + 1


def _compressed(pixels: NDArray[np.uint8], opaque: bool) -> bytes:
    rows = pixels[..., : 3 if opaque else 4].reshape(len(pixels), -1)
    # PNG's filter 0: flat colours repeat; as differences from the row above they take a third more.
    filtered_rows = np.column_stack((np.zeros(len(rows), np.uint8), rows))
    return zlib.compress(filtered_rows.tobytes(), _LEVEL)


def _file(pixels: NDArray[np.uint8], opaque: bool, chunks: Sequence[tuple[bytes, bytes]]) -> bytes:
    height, width = pixels.shape[:2]
    header = struct.pack(">IIBBBBB", width, height, 8, 2 if opaque else 6, 0, 0, 0)
    parts = [b"\x89PNG\r\n\x1a\n"]
    for name, data in ((b"IHDR", header), *chunks, (b"IEND", b"")):
        check = zlib.crc32(name + data)
        parts += struct.pack(">I", len(data)), name, data, struct.pack(">I", check)
    return b"".join(parts)
