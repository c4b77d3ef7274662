"""How large a picture is shown, read from the head of its file, so that pages keep its place."""

from __future__ import annotations

import contextlib
import re
import struct
from xml.parsers import expat

WHOLE_COLUMN = 1600
"""The width given to a drawing without one, which is shown as wide as its column, in CSS pixels."""

_LENGTH = re.compile(r"\s*\+?(\d+\.?\d*(?:e[+-]?\d+)?|\.\d+)(px|pt|pc|in|cm|mm)?\s*", re.IGNORECASE)
_UNITS = {"": 1, "px": 1, "pt": 4 / 3, "pc": 16, "in": 96, "cm": 96 / 2.54, "mm": 96 / 25.4}
_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
_JPEG_FRAMES = frozenset({*range(0xC0, 0xD0)} - {0xC4, 0xC8, 0xCC})
_LIES_ON_SIDE = re.compile(
    rb"\x01\x12\0\x03\0\0\0\x01\0[\x05-\x08]|\x12\x01\x03\0\x01\0\0\0[\x05-\x08]\0"
)
"""The orientation in the Exif data of a JPEG, in either order of bytes."""


def picture_size(data: bytes, column: float | None = None) -> tuple[int, int] | None:
    """Width and height of a picture in CSS pixels, from the bytes of its file.

    It may be an SVG, a PNG, a JPEG or a WebP; `None` where it is something else, is damaged,
    or does not say how large it is. A drawing without a width is as wide as its `viewBox`, or as
    the `column` that it fills, in CSS pixels.
    """
    sides: tuple[float, float] | None = None
    with contextlib.suppress(struct.error):
        if data.startswith(b"\x89PNG\r\n\x1a\n"):
            sides = struct.unpack_from(">II", data, 16)
        elif data.startswith(b"\xff\xd8"):
            sides = _jpeg_size(data)
        elif data[:4] == b"RIFF" and data[8:12] == b"WEBP":
            sides = _webp_size(data)
        else:
            sides = _svg_size(data, column)
    if sides is None or not all(1e-6 < side < 1e6 for side in sides):
        return None
    return max(1, round(sides[0])), max(1, round(sides[1]))


def _svg_size(data: bytes, column: float | None) -> tuple[float, float] | None:
    """The size that the first element says; where sides are missing, the ratio of its `viewBox`."""
    root: dict[str, str] = {}

    def start(name: str, attributes: dict[str, str]) -> None:
        if name.rpartition(":")[2] == "svg":
            root.update(attributes)
        parser.StartElementHandler = None

    parser = expat.ParserCreate()
    parser.StartElementHandler = start
    with contextlib.suppress(expat.ExpatError):
        parser.Parse(data[: 1 << 16], False)
    # One that depends on where the drawing stands, such as `100%`, is as if it were missing.
    texts = (_LENGTH.fullmatch(root.get(side, "")) for side in ("width", "height"))
    width, height = (t and float(t[1]) * _UNITS[(t[2] or "").lower()] for t in texts)
    if width is not None and height is not None:
        return width, height
    box = [float(number) for number in _NUMBER.findall(root.get("viewBox", ""))]
    if len(box) != 4 or not all(1e-6 < side < 1e6 for side in box[2:]):
        return None
    ratio = box[2] / box[3]
    if height is not None:
        return height * ratio, height
    width = width or column or box[2]
    return width, width / ratio


def _jpeg_size(data: bytes) -> tuple[float, float] | None:
    """The size of a JPEG's frame, turned as its Exif data says."""
    at, on_side = 2, False
    while True:
        marker, kind, length = struct.unpack_from(">BBH", data, at)
        if marker != 0xFF:
            return None
        if kind in _JPEG_FRAMES:
            height, width = struct.unpack_from(">HH", data, at + 5)
            return (height, width) if on_side else (width, height)
        part = data[at + 4 : at + 2 + length]
        on_side |= part.startswith(b"Exif\0\0") and _LIES_ON_SIDE.search(part) is not None
        at += 2 + length


def _webp_size(data: bytes) -> tuple[float, float] | None:
    match data[12:16]:
        case b"VP8 ":
            width, height = struct.unpack_from("<HH", data, 26)
            return width & 0x3FFF, height & 0x3FFF
        case b"VP8L":
            (bits,) = struct.unpack_from("<I", data, 21)
            return (bits & 0x3FFF) + 1, (bits >> 14 & 0x3FFF) + 1
        case b"VP8X":
            width, wide, height, high = struct.unpack_from("<HBHB", data, 24)
            return (wide << 16 | width) + 1, (high << 16 | height) + 1
        case _:
            return None
