"""Reading font files.

Entry points: `course_face`, for a font of the course's own; `measure_font`.
"""

from __future__ import annotations

import functools
import io
from typing import TYPE_CHECKING

from coursebuild.core.pages.fonts import COURSE, Face, unicode_range

if TYPE_CHECKING:
    from fontTools.ttLib import TTFont

PER_MILLE = "183 103 75 65 62 57 57 53 50 50 33 33 23 22 20 20 17 16 15 14 13 8 6 1 1 1 1"
FREQUENCY = dict(zip(" etaoinsrhldcumfwgpybvkxjqz", map(int, PER_MILLE.split()), strict=True))
"""The frequency of characters in English text, per thousand."""


@functools.lru_cache(maxsize=16)
def course_face(use: str, name: str, data: bytes) -> tuple[Face, bytes] | str:
    """The face of a font file and its uncompressed bytes, or words for what is wrong."""
    from fontTools.ttLib import TTFont

    try:
        with TTFont(io.BytesIO(data), recalcTimestamp=False) as font:
            measure, characters = measure_font(font), unicode_range("".join(map(chr, _codes(font))))
            italic = bool(font["OS/2"].fsSelection & 1 or font["post"].italicAngle)
            weight = _weights(font)
            font.flavor = None
            whole = io.BytesIO()
            font.save(whole)
    except Exception as error:  # fontTools raises many kinds for damaged files
        return f"cannot be read as a font: {error or type(error).__name__}"
    subset, style = "latin" if measure else "other", "italic" if italic else "normal"
    face = Face(COURSE[use], subset, name, style, weight, characters, characters, measure)
    return face, whole.getvalue()


def _codes(font: TTFont) -> list[int]:
    return sorted(font.getBestCmap())


def _weights(font: TTFont) -> tuple[int, int]:
    """The least and the greatest weight."""
    for axis in font["fvar"].axes if "fvar" in font else ():
        if axis.axisTag == "wght":
            return round(axis.minValue), round(axis.maxValue)
    weight = font["OS/2"].usWeightClass
    return weight, weight


def measure_font(font: TTFont) -> tuple[float, float, float, float] | None:
    """Mean advance width, weighted by `FREQUENCY`, ascent, descent and line gap of a font, in em.

    `None` for a font without the letters of `FREQUENCY`.
    """
    names, advances = font.getBestCmap(), font["hmtx"]
    if not all(ord(c) in names for c in FREQUENCY):
        return None
    em, head = font["head"].unitsPerEm, font["hhea"]
    total = sum(advances[names[ord(c)]][0] * weight for c, weight in FREQUENCY.items())
    width = total / sum(FREQUENCY.values()) / em
    return width, head.ascent / em, -head.descent / em, head.lineGap / em
