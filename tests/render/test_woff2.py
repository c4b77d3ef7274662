"""WOFF2 as it is written here is what fontTools reads back, glyph by glyph and table by table."""

from __future__ import annotations

import io
from collections.abc import Sequence
from typing import Any

import pytest
from fontTools.fontBuilder import FontBuilder
from fontTools.pens.ttGlyphPen import TTGlyphPen
from fontTools.ttLib import TTFont, newTable, woff2
from fontTools.ttLib.tables._g_l_y_f import GlyphCoordinates
from fontTools.ttLib.tables.DefaultTable import DefaultTable
from fontTools.ttLib.tables.ttProgram import Program
from hypothesis import given, settings
from hypothesis import strategies as st

from coursebuild.effects.prepared import prepared_source
from coursebuild.render import Assets
from coursebuild.render.cutting import covered
from coursebuild.render.fonts import VERSION, read_faces
from coursebuild.render.woff2 import TAGS
from coursebuild.render.woff2 import woff2 as packed

pytestmark = pytest.mark.site

Point = tuple[int, int, bool]
Contour = Sequence[Point]
QUALITY = 5


def built(
    outlines: Sequence[Sequence[Contour]],
    *,
    instructions: bytes = b"",
    composite: bool = False,
    overlap: bool = False,
) -> bytes:
    """A font of these glyphs, after an empty one."""
    names = [".notdef", *(f"g{i}" for i in range(len(outlines)))]
    glyphs: dict[str, Any] = {".notdef": TTGlyphPen(None).glyph()}
    for name, contours in zip(names[1:], outlines, strict=True):
        glyphs[name] = drawn(contours)
        if instructions and glyphs[name].numberOfContours:
            glyphs[name].program = Program()
            glyphs[name].program.fromBytecode(instructions)
        if overlap and glyphs[name].numberOfContours:
            glyphs[name].flags[0] |= 0x40
    if composite:
        names.append("twice")
        pen = TTGlyphPen(glyphs)
        pen.addComponent("g0", (1, 0, 0, 1, 10, 0))
        pen.addComponent("g0", (0.5, 0.25, -0.25, 0.5, 900, -300))
        pen.addComponent("g0", (0.5, 0, 0, 0.5, 3, 4))
        pen.addComponent("g0", (0.5, 0, 0, 0.25, 3, 4))
        glyphs["twice"] = pen.glyph()
        if instructions:
            glyphs["twice"].program = Program()
            glyphs["twice"].program.fromBytecode(instructions)
    builder = FontBuilder(1000, isTTF=True)
    builder.setupGlyphOrder(names)
    builder.setupCharacterMap({0x41 + i: name for i, name in enumerate(names[1:])})
    builder.setupGlyf(glyphs)
    builder.setupHorizontalMetrics(dict.fromkeys(names, (500, 0)))
    builder.setupHorizontalHeader(ascent=800, descent=-200)
    builder.setupPost()
    return saved(builder.font)


def drawn(contours: Sequence[Contour]) -> Any:
    """A glyph, point by point as it is given."""
    glyph = TTGlyphPen(None).glyph()
    if not contours:
        return glyph
    points = [point for contour in contours for point in contour]
    glyph.numberOfContours = len(contours)
    glyph.coordinates = GlyphCoordinates([(x, y) for x, y, _ in points])
    glyph.flags = bytearray(on for _, _, on in points)
    counts = [len(contour) for contour in contours]
    glyph.endPtsOfContours = [sum(counts[: i + 1]) - 1 for i in range(len(counts))]
    glyph.program = Program()
    glyph.program.fromBytecode(b"")
    return glyph


def saved(font: TTFont) -> bytes:
    out = io.BytesIO()
    font.save(out)
    return out.getvalue()


def assert_same(font: bytes) -> TTFont:
    """What is read back is the font; gives it."""
    made = packed(font, QUALITY)
    assert len(made) % 4 == 0
    before, after = TTFont(io.BytesIO(font)), TTFont(io.BytesIO(made))
    assert after.flavor == "woff2"
    assert set(after.keys()) == set(before.keys()) - {"DSIG"}
    assert after.getGlyphOrder() == before.getGlyphOrder()
    for tag in list(before.reader.keys()):
        if tag == "head":
            assert after["head"].flags == before["head"].flags | 0x800
        elif tag not in ("glyf", "loca", "DSIG"):
            assert after.reader[tag] == before.reader[tag], tag
    if "glyf" in before:
        for name in before.getGlyphOrder():
            one, two = before["glyf"][name], after["glyf"][name]
            assert one == two
            if one.numberOfContours:
                box = ("xMin", "yMin", "xMax", "yMax")
                assert [getattr(one, x) for x in box] == [getattr(two, x) for x in box]
    return after


steps = st.one_of(
    st.integers(-70, 70),
    st.integers(-800, 800),
    st.sampled_from([-1280, -1279, -769, -768, -65, -64, 0, 64, 65, 768, 769, 1279, 1280]),
    st.sampled_from([-4096, -4095, 4095, 4096, 5000]),
)
contours = st.lists(st.tuples(steps, steps, st.booleans()), min_size=1, max_size=12)


@settings(max_examples=150, deadline=None)
@given(st.lists(st.lists(contours, max_size=3), min_size=1, max_size=9), st.booleans())
def test_any_outlines_come_back(steps: list[list[Contour]], overlap: bool) -> None:
    outlines = [[walked(contour) for contour in glyph] for glyph in steps]
    assert_same(built(outlines, overlap=overlap))


def walked(steps: Contour) -> list[Point]:
    """The points that steps lead to, inside the coordinates that a font may have."""
    x = y = 0
    points: list[Point] = []
    for dx, dy, on in steps:
        x, y = max(-16000, min(16000, x + dx)), max(-16000, min(16000, y + dy))
        points.append((x, y, on))
    return points


SQUARE = [(0, 0, True), (600, 0, True), (600, 600, True), (0, 600, False)]


@pytest.mark.parametrize("count", [252, 253, 254, 505, 506, 507, 761, 762, 763, 1500])
def test_contours_of_many_points(count: int) -> None:
    """At these counts their encoding changes (`255UInt16`)."""
    wave = [(3 * i, (i * 37) % 91, i % 3 == 0) for i in range(count)]
    assert_same(built([[wave], [SQUARE, wave]]))


@pytest.mark.parametrize("size", [1, 252, 253, 700])
def test_instructions_and_composites(size: int) -> None:
    font = assert_same(built([[SQUARE]], instructions=b"\x4f" * size, composite=True))
    assert font["glyf"]["twice"].isComposite()
    assert len(font["glyf"]["twice"].program.getBytecode()) == size


def test_composites_without_instructions() -> None:
    assert_same(built([[SQUARE]], composite=True))


def test_that_outlines_overlap_is_kept() -> None:
    font = assert_same(built([[SQUARE], [], [SQUARE, SQUARE]], overlap=True))
    assert font["glyf"]["g0"].flags[0] & 0x40


def test_a_box_that_is_not_that_of_the_points_is_kept() -> None:
    font = TTFont(io.BytesIO(built([[SQUARE]])), recalcBBoxes=False)
    font["glyf"]["g0"].xMax = 777
    assert assert_same(saved(font))["glyf"]["g0"].xMax == 777


def test_large_fonts_have_wide_places() -> None:
    wave = [(7 * i % 1999, i * 1237 % 3001, True) for i in range(1500)]
    font = assert_same(built([[wave]] * 30))
    assert font["head"].indexToLocFormat == 1


def test_places_are_wide_where_readers_would_not_get_by_with_short_ones() -> None:
    """They begin each glyph at a multiple of four: what fits as it is need not fit then."""
    odd = [(0, 0, True), (600, 0, True), (600, 600, True)]
    one = TTFont(io.BytesIO(tight([[odd]])))
    count = ((1 << 17) - 1) // len(one.reader["glyf"])
    font = tight([[odd]] * count)
    before = TTFont(io.BytesIO(font))
    size = len(before.reader["glyf"])
    assert before["head"].indexToLocFormat == 0
    assert size < 1 << 17 <= size + 3 * len(before.getGlyphOrder())
    after = TTFont(io.BytesIO(packed(font, QUALITY)))
    assert after["head"].indexToLocFormat == 1
    entry = after.reader.tables["loca"]
    assert entry.origLength == 4 * (len(after.getGlyphOrder()) + 1)
    names = before.getGlyphOrder()
    assert all(before["glyf"][name] == after["glyf"][name] for name in names)


def tight(outlines: Sequence[Sequence[Contour]]) -> bytes:
    """A font whose glyphs begin at multiples of two."""
    font = TTFont(io.BytesIO(built(outlines)))
    font["glyf"].padding = 2
    return saved(font)


def test_tables_of_other_kinds_and_fonts_of_other_outlines() -> None:
    """A signature goes, what nobody knows stays, outlines that are no TrueType stay as they are."""
    font = TTFont(io.BytesIO(built([[SQUARE]])))
    font["QUUX"] = newTable("QUUX")
    font["QUUX"].data = b"anything" * 3
    font["DSIG"] = DefaultTable("DSIG")
    font["DSIG"].data = b"\x00\x00\x00\x01\x00\x00\x00\x00"
    for tag in ("glyf", "loca"):
        del font[tag]
    assert_same(saved(font))


def test_tables_are_numbered_as_the_standard_says() -> None:
    assert [tag.decode() for tag in TAGS] == list(woff2.woff2KnownTags)


def test_the_fonts_of_the_bundle(assets: Assets) -> None:
    for face in read_faces(assets.file("fonts/fonts.json")):
        if face.subset in ("greek", "vietnamese", "cyrillic"):
            data = assets.file(f"fonts/{face.file}")
            ready = prepared_source(data, "".join(sorted(covered(data))), VERSION)
            assert ready is not None
            assert_same(ready)
            assert packed(ready, QUALITY) == packed(ready, QUALITY)
            assert len(packed(ready, 11)) < 1.01 * len(as_fonttools(ready))


def as_fonttools(font: bytes) -> bytes:
    out = io.BytesIO()
    read = TTFont(io.BytesIO(font))
    read.flavor = "woff2"
    read.save(out)
    return out.getvalue()
