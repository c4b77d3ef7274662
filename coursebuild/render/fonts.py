"""Fonts cut down to the characters that a site uses, and fallbacks of the same measure.

Entry points: `read_faces`, `font_jobs` (which files to make, from which characters), `subset_font`
(one job, bytes to bytes), `face_rules` (the `@font-face` rules).

1. A face is a file of the bundle with its family, style, range of weights and range of characters.
2. A job keeps of a face what the pages use; a face of which they use nothing is left out. The
   weights outside the range that the style sheet asks for are cut away, the optical size axis
   stays. Of a font for mathematics the MATH table stays with all its variants and pieces of
   brackets.
3. While a font loads, text is set in a local one, scaled so that lines break and stand as they
   will: see `FALLBACKS`.

A job's `key` names its result: who calls may keep results by it.
"""

from __future__ import annotations

import functools
import hashlib
import io
import json
from collections.abc import Iterable

from coursebuild.values import dataclass

TEXT, CODE, MATH = "Source Serif 4 Variable", "Source Code Pro Variable", "STIX Two Math"
"""Families, as the bundle names them."""

WEIGHTS = {TEXT: (400, 700), CODE: (400, 700)}
"""The weights that the style sheet uses."""

BASE = frozenset("".join(map(chr, range(0x20, 0x7F))) + "\u00a0§°±²³µ·½×éöü–—‘’“”…•−")
"""Characters that are always kept, so that few edits change a font."""

VERSION = 1
"""Part of a job's key: to be raised when the way of cutting changes."""


@dataclass(frozen=True, slots=True)
class Face:
    """A font file of the bundle, as `fonts.json` lists it."""

    family: str
    subset: str
    file: str
    style: str
    weight: tuple[int, int]
    unicode_range: str | None
    """CSS syntax; `None`: the whole font."""


@dataclass(frozen=True, slots=True)
class FontJob:
    """One font to cut."""

    face: Face
    data: bytes
    characters: str
    """Sorted, each once."""

    @property
    def key(self) -> str:
        """A name for the result: the same key, the same bytes."""
        digest = hashlib.sha256(self.data)
        digest.update(f"{VERSION}/{WEIGHTS.get(self.face.family)}/{self.characters}".encode())
        return digest.hexdigest()


def read_faces(listing: bytes) -> tuple[Face, ...]:
    """The faces that `fonts.json` lists."""
    return tuple(Face(**{**face, "weight": tuple(face["weight"])}) for face in json.loads(listing))


def font_jobs(
    faces: Iterable[tuple[Face, bytes]], text: str, mathematics: str
) -> tuple[FontJob, ...]:
    """What to cut for pages that use the characters of `text`, and of `mathematics` in formulas."""
    jobs: list[FontJob] = []
    given: dict[tuple[str, str], set[str]] = {}
    for face, data in faces:
        wanted = BASE | set(text) if face.family != MATH else _mathematical(mathematics)
        taken = given.setdefault((face.family, face.style), set())
        kept = (wanted & covered(data)) - taken
        if face.unicode_range is not None:
            kept &= characters_in(face.unicode_range)
        if kept and (mathematics or face.family != MATH):
            taken |= kept
            jobs.append(FontJob(face, data, "".join(sorted(kept))))
    return tuple(jobs)


@functools.lru_cache(maxsize=64)
def characters_in(unicode_range: str) -> frozenset[str]:
    """The characters of a CSS `unicode-range`."""
    found: set[str] = set()
    for part in unicode_range.split(","):
        first, _, last = part.strip().upper().removeprefix("U+").partition("-")
        start = int(first.replace("?", "0"), 16)
        end = int(last or first.replace("?", "F"), 16)
        found.update(map(chr, range(start, end + 1)))
    return frozenset(found)


def unicode_range(characters: str) -> str:
    """The CSS `unicode-range` of sorted characters."""
    runs: list[list[int]] = []
    for code in map(ord, characters):
        if runs and code == runs[-1][1] + 1:
            runs[-1][1] = code
        else:
            runs.append([code, code])
    return ", ".join(f"U+{a:X}" if a == b else f"U+{a:X}-{b:X}" for a, b in runs)


def _mathematical(characters: str) -> set[str]:
    """Characters of formulas with the italics that a browser makes of single letters."""
    wanted = {*characters, *map(chr, range(0x20, 0x7F)), _RADICAL}
    return wanted | {italic for c in wanted if (italic := italic_letter(c))}


def italic_letter(character: str) -> str:
    """The italic that `<mi>` sets a letter in, or nothing (MathML Core, appendix C)."""
    code = ord(character)
    if character == "h":
        return "\u210e"
    if "A" <= character <= "Z":
        return chr(0x1D434 + code - ord("A"))
    if "a" <= character <= "z":
        return chr(0x1D44E + code - ord("a"))
    if "Α" <= character <= "Ω" and code != 0x3A2:
        return chr(0x1D6E2 + code - 0x391)
    if "α" <= character <= "ω":
        return chr(0x1D6FC + code - 0x3B1)
    return _ITALIC_SYMBOLS.get(character, "")


_RADICAL = "√"
"""Drawn for roots without standing in their text."""

_ITALIC_SYMBOLS = {
    "ı": "\U0001d6a4",
    "ȷ": "\U0001d6a5",
    "ϴ": "\U0001d6f3",
    "∇": "\U0001d6fb",
    "∂": "\U0001d715",
    "ϵ": "\U0001d716",
    "ϑ": "\U0001d717",
    "ϰ": "\U0001d718",
    "ϕ": "\U0001d719",
    "ϱ": "\U0001d71a",
    "ϖ": "\U0001d71b",
}


@functools.lru_cache(maxsize=64)
def covered(data: bytes) -> frozenset[str]:
    """The characters that a font has a glyph for."""
    from fontTools.ttLib import TTFont

    with TTFont(io.BytesIO(data), lazy=True) as font:
        return frozenset(map(chr, font.getBestCmap()))


@functools.lru_cache(maxsize=64)
def subset_font(job: FontJob) -> bytes:
    """The font with the job's characters only, as WOFF2. The same job gives the same bytes."""
    from fontTools import subset
    from fontTools.ttLib import TTFont
    from fontTools.varLib import instancer

    options = subset.Options()
    options.hinting = False
    options.notdef_outline = True
    options.layout_features = ["*"]
    options.name_IDs = [0, 1, 2, 3, 4, 5, 6, 13, 14]
    options.recalc_timestamp = False
    with TTFont(io.BytesIO(job.data), recalcTimestamp=False) as font:
        subsetter = subset.Subsetter(options)
        subsetter.populate(text=job.characters)
        subsetter.subset(font)
        if "fvar" in font and job.face.family in WEIGHTS:
            instancer.instantiateVariableFont(
                font, {"wght": WEIGHTS[job.face.family]}, inplace=True
            )
        font.flavor = "woff2"
        out = io.BytesIO()
        font.save(out)
    return out.getvalue()


# --------------------------------------------------------------------------------- fallbacks

_PER_MILLE = "183 103 75 65 62 57 57 53 50 50 33 33 23 22 20 20 17 16 15 14 13 8 6 1 1 1 1"
_FREQUENCY = dict(zip(" etaoinsrhldcumfwgpybvkxjqz", map(int, _PER_MILLE.split()), strict=True))
"""How often characters stand in English text, per thousand."""


@dataclass(frozen=True, slots=True)
class Fallback:
    """Local fonts, alike in their advance widths, that stand in for a face until it is there."""

    family: str
    """The web font."""
    style: str
    locals: tuple[str, ...]
    width: float
    """Their mean advance width in em, weighted by `_FREQUENCY`."""


FALLBACKS = (
    Fallback(TEXT, "normal", ("Times New Roman", "Liberation Serif", "Tinos"), 0.39831),
    Fallback(
        TEXT,
        "italic",
        ("Times New Roman Italic", "Liberation Serif Italic", "Tinos Italic"),
        0.39993,
    ),
    Fallback(CODE, "normal", ("Courier New", "Liberation Mono", "Cousine"), 0.60010),
)
"""The widths are those of Liberation Serif and Liberation Mono, which are made to match the
others."""


@functools.lru_cache(maxsize=16)
def mean_width(data: bytes) -> float:
    """The mean advance width of a font in em, weighted by `_FREQUENCY`."""
    from fontTools.ttLib import TTFont

    with TTFont(io.BytesIO(data), lazy=True) as font:
        names, advances = font.getBestCmap(), font["hmtx"]
        total = sum(advances[names[ord(c)]][0] * weight for c, weight in _FREQUENCY.items())
        return float(total / sum(_FREQUENCY.values()) / font["head"].unitsPerEm)


def face_rules(files: Iterable[tuple[FontJob, str]]) -> str:
    """The `@font-face` rules of cut fonts, each with its address, and of their fallbacks."""
    rules: list[str] = []
    files = tuple(files)
    for job, url in files:
        face = job.face
        low, high = WEIGHTS.get(face.family, face.weight)
        weight = f"{low} {high}" if low != high else str(low)
        whole = face.unicode_range is None
        rules.append(
            f'@font-face{{font-family:"{face.family}";font-style:{face.style};font-weight:{weight};font-display:swap;'
            f'src:url("{url}") format("woff2")'
            + ("}" if whole else f";unicode-range:{unicode_range(job.characters)}}}")
        )
    rules += [rule for fallback in FALLBACKS for rule in _fallback_rules(fallback, files)]
    return "\n".join(rules) + "\n"


def _fallback_rules(fallback: Fallback, files: Iterable[tuple[FontJob, str]]) -> tuple[str, ...]:
    """The rule of a fallback, scaled to the face with the Latin letters, where that is used."""
    from fontTools.ttLib import TTFont

    for job, _ in files:
        if (job.face.family, job.face.style, job.face.subset) == (
            fallback.family,
            fallback.style,
            "latin",
        ):
            scale = mean_width(job.data) / fallback.width
            with TTFont(io.BytesIO(job.data), lazy=True) as font:
                em, head = font["head"].unitsPerEm, font["hhea"]
                ascent, descent, gap = (
                    x / em / scale for x in (head.ascent, -head.descent, head.lineGap)
                )
            local = ",".join(f'local("{name}")' for name in fallback.locals)
            return (
                f'@font-face{{font-family:"{fallback.family} fallback";'
                f"font-style:{fallback.style};src:{local};size-adjust:{scale:.2%};"
                f"ascent-override:{ascent:.2%};descent-override:{descent:.2%};"
                f"line-gap-override:{gap:.2%}}}",
            )
    return ()
