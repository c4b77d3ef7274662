"""Fonts read and cut, bytes to bytes.

Entry points: `covered`, `measured`, what a font has; `cut`, a font with some of its characters.

1. Of a whole font fontTools keeps the glyphs of the characters with all that they need, and cuts
   the weights.
2. In a font for mathematics the larger radicals become as narrow as the smallest: Chromium gives
   every root room for the widest of them, and leaves what is not needed as a gap behind the root.
3. What was cut so before without compression (a ready font) needs only its characters chosen, which
   takes HarfBuzz a millisecond.
4. fontTools writes WOFF2, at the finest level of Brotli; where another one is wanted, it gets a
   stand-in for the module.
"""

from __future__ import annotations

import contextlib
import functools
import io
import threading
from collections.abc import Iterator
from typing import Any

_PER_MILLE = "183 103 75 65 62 57 57 53 50 50 33 33 23 22 20 20 17 16 15 14 13 8 6 1 1 1 1"
FREQUENCY = dict(zip(" etaoinsrhldcumfwgpybvkxjqz", map(int, _PER_MILLE.split()), strict=True))
"""How often characters stand in English text, per thousand."""

_WOFF2 = b"wOF2"
_FINEST = 11
_RADICAL = 0x221A
_WIDEST = 1.07
"""A radical's advance width in those of the smallest: what is more than 1 stays as a thin space."""
_compressing = threading.RLock()


@functools.lru_cache(maxsize=64)
def covered(data: bytes) -> frozenset[str]:
    """The characters that a font has a glyph for."""
    from fontTools.ttLib import TTFont

    with TTFont(io.BytesIO(data), lazy=True) as font:
        return frozenset(map(chr, font.getBestCmap()))


@functools.lru_cache(maxsize=16)
def measured(data: bytes) -> tuple[float, float, float, float] | None:
    """Mean advance width, weighted by `FREQUENCY`, ascent, descent and line gap of a font, in em.

    Nothing for a font without the letters of `FREQUENCY`.
    """
    from fontTools.ttLib import TTFont

    with TTFont(io.BytesIO(data), lazy=True) as font:
        names, advances = font.getBestCmap(), font["hmtx"]
        if not all(ord(c) in names for c in FREQUENCY):
            return None
        em, head = font["head"].unitsPerEm, font["hhea"]
        total = sum(advances[names[ord(c)]][0] * weight for c, weight in FREQUENCY.items())
        width = total / sum(FREQUENCY.values()) / em
        return width, head.ascent / em, -head.descent / em, head.lineGap / em


def cut(
    data: bytes,
    characters: str,
    weights: tuple[int, int] | None,
    flavor: str | None = "woff2",
    quality: int = _FINEST,
) -> bytes:
    """The font with these characters only; the same input gives the same bytes.

    Args:
        data: WOFF2, or what this made without a flavor.
        characters: each once.
        weights: the range of the weight axis to keep; nothing for a font without one.
        flavor: `woff2`, or nothing for a font to cut smaller ones from.
        quality: of compression, up to 11.
    """
    if data[:4] == _WOFF2:
        return _cut_whole(data, characters, weights, flavor, quality)
    chosen = _chosen(data, characters)
    return chosen if flavor is None else _saved(chosen, flavor, quality)


def _chosen(data: bytes, characters: str) -> bytes:
    """The part of a ready font that shows these characters."""
    import uharfbuzz

    wanted = uharfbuzz.SubsetInput()
    wanted.flags = uharfbuzz.SubsetFlags.NO_HINTING | uharfbuzz.SubsetFlags.NOTDEF_OUTLINE
    wanted.unicode_set.update(map(ord, characters))
    for everything in (
        wanted.layout_feature_tag_set,
        wanted.name_id_set,
        wanted.name_lang_id_set,
    ):
        everything.clear()
        everything.invert()
    part: bytes = wanted.subset(uharfbuzz.Face(data)).blob.data
    return part


def _saved(font: bytes, flavor: str, quality: int) -> bytes:
    """A font in another form."""
    from fontTools.ttLib import TTFont

    out = io.BytesIO()
    with TTFont(io.BytesIO(font), recalcTimestamp=False) as parsed, _compression(quality):
        parsed.flavor = flavor
        parsed.save(out)
    return out.getvalue()


def _cut_whole(
    data: bytes,
    characters: str,
    weights: tuple[int, int] | None,
    flavor: str | None,
    quality: int,
) -> bytes:
    from fontTools import subset
    from fontTools.ttLib import TTFont

    options = subset.Options()
    options.hinting = False
    options.notdef_outline = True
    options.layout_features = ["*"]
    options.name_IDs = [0, 1, 2, 3, 4, 5, 6, 13, 14]
    options.recalc_timestamp = False
    with TTFont(io.BytesIO(data), recalcTimestamp=False) as font:
        subsetter = subset.Subsetter(options)
        subsetter.populate(text=characters)
        subsetter.subset(font)
        if weights is not None and "fvar" in font:
            from fontTools.varLib import instancer

            instancer.instantiateVariableFont(font, {"wght": weights}, inplace=True)
        _narrow_radicals(font)
        font.flavor = flavor
        out = io.BytesIO()
        with _compression(quality):
            font.save(out)
    return out.getvalue()


def _narrow_radicals(font: Any) -> None:
    """Press the larger radicals, and the pieces of the largest, together; done twice is done once.

    MathML Core: the preferred inline size of a stretched operator is that of its widest variant.
    """
    smallest = font.getBestCmap().get(_RADICAL)
    if smallest is None or "MATH" not in font or "glyf" not in font:
        return
    variants = font["MATH"].table.MathVariants
    drawn = dict(
        zip(variants.VertGlyphCoverage.glyphs, variants.VertGlyphConstruction, strict=True)
    ).get(smallest)
    if drawn is None:
        return
    names = {variant.VariantGlyph for variant in drawn.MathGlyphVariantRecord}
    if drawn.GlyphAssembly is not None:
        names |= {part.glyph for part in drawn.GlyphAssembly.PartRecords}
    advances, glyphs = font["hmtx"], font["glyf"]
    widest = round(_WIDEST * advances[smallest][0])
    for name in sorted(names):
        advance, _ = advances[name]
        glyph = glyphs[name]
        if advance > widest and glyph.numberOfContours > 0:
            glyph.coordinates.scale((widest / advance, 1))
            glyph.coordinates.toInt()
            glyph.recalcBounds(glyphs)
            advances[name] = (widest, glyph.xMin)


class _Brotli:
    """Stands for the module `brotli` where fontTools compresses."""

    def __init__(self, brotli: Any, quality: int) -> None:
        self._brotli, self._quality = brotli, quality

    def __getattr__(self, name: str) -> Any:
        return getattr(self._brotli, name)

    def compress(self, data: bytes, mode: int) -> bytes:
        made: bytes = self._brotli.compress(data, mode=mode, quality=self._quality)
        return made


@contextlib.contextmanager
def _compression(quality: int) -> Iterator[None]:
    from fontTools.ttLib import woff2

    with _compressing:
        whole = woff2.brotli
        woff2.brotli = _Brotli(whole, quality)
        try:
            yield
        finally:
            woff2.brotli = whole
