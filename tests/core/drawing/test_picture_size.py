"""How large pictures are, from the heads of their files."""

from __future__ import annotations

import struct

import pytest

from coursebuild.core.drawing.picture_size import WHOLE_COLUMN, picture_size

FRAME = b"\xff\xc2" + struct.pack(">HBHH", 17, 8, 22, 37)
TABLE = b"\xff\xc4" + struct.pack(">H", 6) + b"\xff\xc0\0\0"
"""A part of a JPEG that holds the mark of a frame."""


def exif(order: str, orientation: int) -> bytes:
    """The part of a JPEG that says how its picture is to be turned, after another entry."""
    entries = [(0x0100, 4, 1, 9, 0), (0x0112, 3, 1, orientation, 0)]
    head = (b"II*\0" if order == "<" else b"MM\0*") + struct.pack(f"{order}IH", 8, len(entries))
    data = head + b"".join(struct.pack(f"{order}HHIHH", *entry) for entry in entries)
    return b"\xff\xe1" + struct.pack(">H", len(data) + 8) + b"Exif\0\0" + data


SIZES: dict[str, tuple[bytes, tuple[int, int] | None]] = {
    "PNG": (b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR" + struct.pack(">II", 37, 22), (37, 22)),
    "JPEG": (b"\xff\xd8" + TABLE + FRAME, (37, 22)),
    "JPEG on its side": (b"\xff\xd8" + exif(">", 6) + FRAME, (22, 37)),
    "JPEG on its side, little endian": (b"\xff\xd8" + exif("<", 8) + FRAME, (22, 37)),
    "JPEG upside down": (b"\xff\xd8" + exif(">", 3) + FRAME, (37, 22)),
    "WebP with losses": (b"RIFF\0\0\0\0WEBPVP8 " + bytes(10) + b"\x25\x40\x16\x80", (37, 22)),
    "WebP without losses": (
        b"RIFF\0\0\0\0WEBPVP8L\0\0\0\0\x2f" + struct.pack("<I", 36 | 21 << 14 | 1 << 28),
        (37, 22),
    ),
    "WebP with parts": (b"RIFF\0\0\0\0WEBPVP8X" + bytes(8) + b"\x24\0\0\x15\0\0", (37, 22)),
    "SVG in points": (b'<?xml version="1.0"?><svg width="72pt" height=".5in"/>', (96, 48)),
    "SVG with a prefix": (b'<s:svg xmlns:s="http://www.w3.org/2000/svg" width="1cm" height="5mm"/>',
                          (38, 19)),
    "SVG with a view alone": (b'<svg viewBox="0,0 30 10"/>', (WHOLE_COLUMN, 533)),
    "SVG as wide as its column": (
        b'<svg width="100%" height="100%" viewBox="-3 0 3e1 10"/>', (WHOLE_COLUMN, 533),
    ),
    "SVG with one side": (b'<svg height="20" viewBox="0 0 30 10"/>', (60, 20)),
    "SVG that says nothing": (b'<svg xmlns="http://www.w3.org/2000/svg"/>', None),
    "SVG without height": (b'<svg width="30"/>', None),
    "SVG without area": (b'<svg viewBox="0 0 30 0"/>', None),
    "empty PNG": (b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR" + bytes(8), None),
    "web page": (b'<html width="30" height="20"><svg width="3" height="2"/></html>', None),
    "nothing": (b"", None),
}  # fmt: skip


@pytest.mark.parametrize("name", SIZES)
def test_size_of_a_picture(name: str) -> None:
    data, size = SIZES[name]
    assert picture_size(data, WHOLE_COLUMN) == size


@pytest.mark.parametrize("name", [name for name in SIZES if "SVG" not in name])
def test_a_file_cut_short_has_no_size(name: str) -> None:
    data, _ = SIZES[name]
    assert [n for n in range(len(data)) if picture_size(data[:n]) is not None] == []
