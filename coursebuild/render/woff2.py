"""Fonts in WOFF2, the form in which browsers load them.

Entry point: `woff2(font, quality)`.

Source: WOFF File Format 2.0, W3C Recommendation, 8 August 2024 (section numbers are its own).

1. The outlines of a TrueType font are taken apart (5.1): the counts of contours and of points, the
   steps from point to point, and what kind of point it is lie in streams of their own, and boxes
   are left out where they are those of the points. That is a seventh of the compressed bytes.
2. All tables go through Brotli as one (5, 4.1).

fontTools does the same in a tenth of the speed, most of it in the import of what it needs to change
outlines. Its reader is what the tests hold this to: it must give back the font, glyph by glyph.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Sequence
from itertools import accumulate

from msgspec import Struct

_TAGS = """
cmap head hhea hmtx maxp name OS/2 post cvt fpgm glyf loca prep CFF VORG EBDT EBLC gasp hdmx kern
LTSH PCLT VDMX vhea vmtx BASE GDEF GPOS GSUB EBSC JSTF MATH CBDT CBLC COLR CPAL SVG sbix acnt avar
bdat bloc bsln cvar fdsc feat fmtx fvar gvar hsty just lcar mort morx opbd prop trak Zapf Silf Glat
Gloc Feat Sill
"""
TAGS = {tag.ljust(4).encode(): index for index, tag in enumerate(_TAGS.split())}
"""Tables with a number instead of a name (4.1)."""
_NO_NUMBER = 63
_CHANGED = 1 << 11
"""A bit of the flags in `head`: the font went through a compression that keeps what it shows."""
_SIGNATURE = b"DSIG"
"""A signature would not hold any more (5.4)."""

_WORDS, _SCALE, _MORE, _TWO_SCALES, _MATRIX, _INSTRUCTED = 1, 8, 0x20, 0x40, 0x80, 0x100
"""Flags of a component (OpenType, `glyf`)."""
_ON, _X_SHORT, _Y_SHORT, _REPEAT, _X_SAME, _Y_SAME, _OVERLAP = 1, 2, 4, 8, 16, 32, 64
"""Flags of a point (OpenType, `glyf`)."""


def woff2(font: bytes, quality: int) -> bytes:
    """A TrueType or OpenType font as WOFF2; the same bytes give the same.

    Args:
        font: one font, no collection.
        quality: of Brotli's compression, up to 11.
    """
    import brotli

    tables = _tables(font)
    parts, sizes = _changed(tables)
    entries = b"".join(_entry(tag, sizes[tag], parts[tag], tables[tag]) for tag in parts)
    stream = b"".join(tables[tag] if part is None else part for tag, part in parts.items())
    packed: bytes = brotli.compress(stream, mode=brotli.MODE_FONT, quality=quality)
    whole = 12 + sum(16 + size + -size % 4 for size in sizes.values())
    length = 48 + len(entries) + len(packed)
    padding = bytes(-length % 4)
    head = (0x774F4632, font[:4], length + len(padding), len(parts), 0, whole, len(packed), 1, 0)
    header = struct.pack(">L4sLHHLLHHLLLLL", *head, 0, 0, 0, 0, 0)
    return header + entries + packed + padding


def _tables(font: bytes) -> dict[bytes, bytes]:
    """Tables by name, in the order in which they go out: `loca` follows `glyf` (5)."""
    (count,) = struct.unpack_from(">H", font, 4)
    records = [struct.unpack_from(">4sLLL", font, 12 + 16 * i) for i in range(count)]
    found = {tag: font[start : start + size] for tag, _, start, size in records}
    found.pop(_SIGNATURE, None)
    last = b"glyf\xff"
    return {tag: found[tag] for tag in sorted(found, key=lambda t: last if t == b"loca" else t)}


def _changed(
    tables: dict[bytes, bytes],
) -> tuple[dict[bytes, bytes | None], dict[bytes, int]]:
    """What stands for tables that are written in another way; nothing for the others.

    Gives also how long each table is when a reader has rebuilt it.
    """
    parts: dict[bytes, bytes | None] = dict.fromkeys(tables)
    sizes = {tag: len(data) for tag, data in tables.items()}
    head = bytearray(tables[b"head"])
    (flags,) = struct.unpack_from(">H", head, 16)
    struct.pack_into(">H", head, 16, flags | _CHANGED)
    if b"glyf" in tables:
        (wide,) = struct.unpack_from(">h", head, 50)
        outlines = _Outlines(tables[b"glyf"], tables[b"loca"], wide)
        struct.pack_into(">h", head, 50, outlines.wide)
        sizes[b"loca"] = (outlines.count + 1) * (4 if outlines.wide else 2)
        parts[b"glyf"], parts[b"loca"] = outlines.written(), b""
    tables[b"head"] = bytes(head)
    return parts, sizes


def _entry(tag: bytes, size: int, part: bytes | None, table: bytes) -> bytes:
    """A table's entry in the directory (4.1)."""
    number = TAGS.get(tag, _NO_NUMBER)
    start = bytes([number]) + (tag if number == _NO_NUMBER else b"") + _base_128(size)
    return start if part is None else start + _base_128(len(part))


def _base_128(value: int) -> bytes:
    """`UIntBase128` (4.1)."""
    digits = [value & 0x7F]
    while value := value >> 7:
        digits.append(value & 0x7F | 0x80)
    return bytes(reversed(digits))


def _short(value: int) -> bytes:
    """`255UInt16` (4.1)."""
    if value < 253:
        return bytes([value])
    if value < 506:
        return bytes([255, value - 253])
    if value < 762:
        return bytes([254, value - 506])
    return struct.pack(">BH", 253, value)


class _Steps(dict[tuple[int, int, int], tuple[int, bytes]]):
    """Steps from a point to the next: flag and coordinates (5.2), each found once.

    A key is whether the point is on the curve, and the step in x and in y.
    """

    def __missing__(self, key: tuple[int, int, int]) -> tuple[int, bytes]:
        on, dx, dy = key
        x, y = abs(dx), abs(dy)
        sign = (dx >= 0) + 2 * (dy >= 0)
        a, b = x - 1, y - 1
        if dx == 0 and y < 1280:
            flag, data = ((y & 0xF00) >> 7) + (dy >= 0), bytes([y & 0xFF])
        elif dy == 0 and x < 1280:
            flag, data = 10 + ((x & 0xF00) >> 7) + (dx >= 0), bytes([x & 0xFF])
        elif x < 65 and y < 65:
            flag = 20 + (a & 0x30) + ((b & 0x30) >> 2) + sign
            data = bytes([(a & 0xF) << 4 | b & 0xF])
        elif x < 769 and y < 769:
            flag = 84 + 12 * ((a & 0x300) >> 8) + ((b & 0x300) >> 6) + sign
            data = bytes([a & 0xFF, b & 0xFF])
        elif x < 4096 and y < 4096:
            flag, data = 120 + sign, bytes([x >> 4, (x & 0xF) << 4 | y >> 8, y & 0xFF])
        else:
            flag, data = 124 + sign, struct.pack(">HH", x, y)
        found = self[key] = flag if on else flag | 0x80, data
        return found


_SHORT_PLACES = 1 << 17
"""Bytes of glyphs whose places can be told in two bytes each, halved."""
_FORMAT = ">HHHHLLLLLLL"
"""The head of the table (5.1)."""


class _Simple(Struct, frozen=True):
    """A glyph of contours."""

    ends: Sequence[int]
    instructions: bytes
    flags: list[int]
    dx: list[int]
    dy: list[int]

    def box(self) -> tuple[int, int, int, int]:
        """That of its points."""
        x, y = list(accumulate(self.dx)), list(accumulate(self.dy))
        return min(x), min(y), max(x), max(y)


class _Outlines:
    """The glyphs of a font, written stream by stream (5.1)."""

    def __init__(self, glyf: bytes, loca: bytes, wide: int) -> None:
        self._glyf = glyf
        size = 4 if wide else 2
        places = struct.unpack(f">{len(loca) // size}{'L' if wide else 'H'}", loca)
        self._places = places if wide else tuple(2 * place for place in places)
        self._counts: list[int] = []
        self._points = bytearray()
        self._flags = bytearray()
        self._glyphs = bytearray()
        self._composites = bytearray()
        self._boxes = bytearray()
        self._instructions = bytearray()
        self.count = count = len(places) - 1
        # Readers begin each glyph at a multiple of four, which short places may not reach.
        self.wide = int(bool(wide) or len(glyf) + 3 * count >= _SHORT_PLACES)
        self._boxed = bytearray((count + 31) // 32 * 4)
        self._overlaps = bytearray((count + 7) // 8)
        self._steps = _Steps()

    def written(self) -> bytes:
        """The table."""
        for index, (start, end) in enumerate(zip(self._places, self._places[1:], strict=False)):
            self._add(index, start, end)
        counts = struct.pack(f">{len(self._counts)}h", *self._counts)
        streams = (
            counts,
            self._points,
            self._flags,
            self._glyphs,
            self._composites,
            self._boxed + self._boxes,
            self._instructions,
        )
        overlaps = self._overlaps if any(self._overlaps) else b""
        sizes = (len(stream) for stream in streams)
        head = struct.pack(_FORMAT, 0, bool(overlaps), len(self._counts), self.wide, *sizes)
        return b"".join((head, *streams, overlaps))

    def _add(self, index: int, start: int, end: int) -> None:
        count = struct.unpack_from(">h", self._glyf, start)[0] if start < end else 0
        self._counts.append(count)
        if count == 0:
            return
        box = self._glyf[start + 2 : start + 10]
        if count < 0:
            self._add_composite(start + 10)
            keep = True
        else:
            glyph = self._simple(start + 10, count)
            self._add_simple(index, glyph)
            keep = struct.unpack(">4h", box) != glyph.box()
        if keep:
            self._boxed[index >> 3] |= 0x80 >> (index & 7)
            self._boxes += box

    def _simple(self, at: int, count: int) -> _Simple:
        glyf = self._glyf
        ends = struct.unpack_from(f">{count}H", glyf, at)
        at += 2 * count
        (size,) = struct.unpack_from(">H", glyf, at)
        at += 2
        instructions = glyf[at : at + size]
        at += size
        flags: list[int] = []
        while len(flags) <= ends[-1]:
            flag = glyf[at]
            at += 1
            if flag & _REPEAT:
                flags += [flag] * (glyf[at] + 1)
                at += 1
            else:
                flags.append(flag)
        dx, at = self._read(at, flags, _X_SHORT, _X_SAME)
        dy, at = self._read(at, flags, _Y_SHORT, _Y_SAME)
        return _Simple(ends, instructions, flags, dx, dy)

    def _read(self, at: int, flags: Iterable[int], short: int, same: int) -> tuple[list[int], int]:
        """The steps in one direction, and where they end."""
        glyf = self._glyf
        steps: list[int] = []
        for flag in flags:
            if flag & short:
                steps.append(glyf[at] if flag & same else -glyf[at])
                at += 1
            elif flag & same:
                steps.append(0)
            else:
                steps.append((glyf[at] << 8 | glyf[at + 1]) - (glyf[at] >> 7 << 16))
                at += 2
        return steps, at

    def _add_simple(self, index: int, glyph: _Simple) -> None:
        last = -1
        for end in glyph.ends:
            self._points += _short(end - last)
            last = end
        on = [flag & _ON for flag in glyph.flags]
        steps = [*map(self._steps.__getitem__, zip(on, glyph.dx, glyph.dy, strict=True))]
        self._flags += bytes([flag for flag, _ in steps])
        self._glyphs += b"".join([data for _, data in steps])
        self._glyphs += _short(len(glyph.instructions))
        self._instructions += glyph.instructions
        if glyph.flags[0] & _OVERLAP:
            self._overlaps[index >> 3] |= 0x80 >> (index & 7)

    def _add_composite(self, start: int) -> None:
        at, flags, instructed = start, _MORE, False
        while flags & _MORE:
            (flags,) = struct.unpack_from(">H", self._glyf, at)
            at += 8 if flags & _WORDS else 6
            at += 2 if flags & _SCALE else 4 if flags & _TWO_SCALES else 0
            at += 8 if flags & _MATRIX else 0
            instructed = instructed or bool(flags & _INSTRUCTED)
        self._composites += self._glyf[start:at]
        if instructed:
            (size,) = struct.unpack_from(">H", self._glyf, at)
            self._glyphs += _short(size)
            self._instructions += self._glyf[at + 2 : at + 2 + size]
