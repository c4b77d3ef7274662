"""Files that models are made of, and pictures as PNG, read back by Pillow."""

from __future__ import annotations

import io

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageSequence

TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"


def png(level: int = 0) -> bytes:
    """A picture, another for each level."""
    pixels = bytes(value for y in range(4) for x in range(4) for value in (level, y, x))
    data = io.BytesIO()
    Image.frombytes("RGB", (4, 4), pixels).save(data, "PNG")
    return data.getvalue()


def read_png(data: bytes) -> NDArray[np.uint8]:
    """Rows of pixels in red, green, blue and opacity; there is nothing else in the file."""
    with Image.open(io.BytesIO(data), formats=["PNG"]) as picture:
        assert picture.info == {}, "no time, no text"
        return np.asarray(picture.convert("RGBA"))


def read_moving_png(data: bytes) -> tuple[list[NDArray[np.uint8]], set[int], int]:
    """The frames of an animated PNG, how long they are shown, ms, and how often they go round."""
    frames, durations = [], set()
    with Image.open(io.BytesIO(data)) as film:
        for frame in ImageSequence.Iterator(film):
            durations.add(film.info["duration"])
            frames.append(np.asarray(frame.convert("RGBA")))
        return frames, durations, film.info["loop"]
