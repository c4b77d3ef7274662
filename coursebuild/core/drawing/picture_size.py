"""How large a picture is shown, read from the head of its file.

A page that knows it keeps a place for each picture until it has arrived.
"""

from __future__ import annotations

import contextlib
import re
import struct
from xml.parsers import expat

WHOLE_COLUMN = 1600.0
"""The width given to a drawing without one, which is shown as wide as its column, in CSS pixels."""

_LENGTH = re.compile(
    r"\s*\+?(\d+\.?\d*(?:e[+-]?\d+)?|\.\d+)(px|pt|pc|in|cm|mm|q)?\s*", re.IGNORECASE
)
_UNITS = {"": 1.0, "px": 1.0, "pt": 4 / 3, "pc": 16.0, "in": 96.0, "cm": 96 / 2.54}
_UNITS |= {"mm": 96 / 25.4, "q": 96 / 101.6}
_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
_JPEG_FRAMES = frozenset({*range(0xC0, 0xD0)} - {0xC4, 0xC8, 0xCC})
_ORIENTATION = 0x0112


def picture_size(data: bytes) -> tuple[float, float] | None:
    """Width and height of a picture in CSS pixels, from the bytes of its file.

    It may be an SVG, a PNG, a JPEG, a WebP or a GIF; `None` where it is something else, is damaged,
    or does not say how large it is.
    """
    sides: tuple[float, float] | None = None
    with contextlib.suppress(struct.error):
        if data.startswith(b"\x89PNG\r\n\x1a\n"):
            sides = struct.unpack_from(">II", data, 16)
        elif data.startswith(b"\xff\xd8"):
            sides = _jpeg_size(data)
        elif data[:4] == b"RIFF" and data[8:12] == b"WEBP":
            sides = _webp_size(data)
        elif data.startswith((b"GIF87a", b"GIF89a")):
            sides = struct.unpack_from("<HH", data, 6)
        else:
            sides = _svg_size(data)
    return sides if sides is not None and all(1e-6 < side < 1e6 for side in sides) else None


def _svg_size(data: bytes) -> tuple[float, float] | None:
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
    width, height = (_length(root.get(side, "")) for side in ("width", "height"))
    box = [float(number) for number in _NUMBER.findall(root.get("viewBox", ""))]
    if width is not None and height is not None:
        return width, height
    if len(box) != 4 or not all(1e-6 < side < 1e6 for side in box[2:]):
        return None
    ratio = box[2] / box[3]
    if height is not None:
        return height * ratio, height
    width = WHOLE_COLUMN if width is None else width
    return width, width / ratio


def _length(text: str) -> float | None:
    """A length in CSS pixels; `None` for one that depends on where it stands, such as `100%`."""
    match = _LENGTH.fullmatch(text)
    return None if match is None else float(match[1]) * _UNITS[(match[2] or "").lower()]


def _jpeg_size(data: bytes) -> tuple[float, float] | None:
    """The size of a JPEG's frame, turned as its Exif orientation says."""
    at, is_turned = 2, False
    while True:
        marker, kind, length = struct.unpack_from(">BBH", data, at)
        if marker != 0xFF:
            return None
        if kind == 0xFF:  # padding before a marker
            at += 1
            continue
        if kind in _JPEG_FRAMES:
            height, width = struct.unpack_from(">HH", data, at + 5)
            return (height, width) if is_turned else (width, height)
        if kind == 0xE1 and data[at + 4 : at + 10] == b"Exif\0\0":
            is_turned = _exif_orientation(data[at + 10 : at + 2 + length]) in (5, 6, 7, 8)
        at += 2 + length


def _exif_orientation(exif: bytes) -> int:
    order = "<" if exif.startswith(b"II") else ">"
    (at,) = struct.unpack_from(f"{order}I", exif, 4)
    (count,) = struct.unpack_from(f"{order}H", exif, at)
    for entry in range(at + 2, at + 2 + 12 * count, 12):
        tag, _, _, value = struct.unpack_from(f"{order}HHIH", exif, entry)
        if tag == _ORIENTATION:
            return int(value)
    return 1


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
