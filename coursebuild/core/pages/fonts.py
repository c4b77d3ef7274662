"""Fonts cut down to the characters that a site uses, and fallbacks of the same measure.

Entry points: `read_faces`, `font_jobs` (which files to make, from which characters), `subset_font`
(one job, bytes to bytes), `face_rules` (the `@font-face` rules).

1. A face is a font of the bundle with its family, style, range of weights and characters.
   `site/prepare_fonts.py` has done what does not depend on a course: of a font only the weights are
   there that the style sheet asks for, and it is not compressed.
2. A job keeps of a face what the pages use; a face of which they use nothing is left out. HarfBuzz
   chooses the glyphs, of a font for mathematics with all variants and pieces of brackets; fontTools
   compresses them.
3. While a font loads, text is set in a local one, scaled so that lines break and stand as they
   will: see `FALLBACKS`.

4. Fonts of the course's own come first: of the tool's only the characters are used that they lack.

A job's `key` names its result: who calls may keep results by it.
"""

from __future__ import annotations

import functools
import hashlib
import io
from collections.abc import Iterable

import msgspec
from msgspec import Struct

TEXT, CODE, MATH = "Source Serif 4 Variable", "Source Code Pro Variable", "STIX Two Math"
"""Families, as the bundle names them."""
COURSE = {"text": "Course Text", "interface": "Course Interface", "code": "Course Code"}
"""The families of a course's own fonts in the style sheet, by what is set in them."""
_OWN = {TEXT: COURSE["text"], CODE: COURSE["code"]}
"""Those that come before families of the bundle."""

BASE = frozenset("".join(map(chr, range(0x20, 0x7F))) + "\u00a0§°±²³µ·¹½×éöü–—‘’“”…•−")
"""Characters that are always kept, so that few edits change a font."""

_VERSION = 6
"""Part of a job's key: to be raised when the way of cutting changes."""


class Face(Struct, frozen=True):
    """A font file of the bundle, as `fonts.json` lists it."""

    family: str
    subset: str
    file: str
    style: str
    weight: tuple[int, int]
    unicode_range: str | None
    """CSS syntax; `None`: the whole font."""
    characters: str
    """Those that it has a glyph for, as a `unicode-range`."""
    measure: tuple[float, float, float, float] | None = None
    """Mean advance width of English text, ascent, descent and line gap, in em; nothing for a font
    without the letters."""


class FontJob(Struct, frozen=True):
    """One font to cut."""

    face: Face
    data: bytes
    characters: str
    """Sorted, each once."""

    @property
    def key(self) -> str:
        """A name for the result: the same key, the same bytes."""
        digest = hashlib.sha256(self.data)
        digest.update(f"{_VERSION}/{self.characters}".encode())
        return digest.hexdigest()


def read_faces(listing: bytes) -> tuple[Face, ...]:
    """The faces that `fonts.json` lists."""
    return msgspec.json.decode(listing, type=tuple[Face, ...])


def font_jobs(
    faces: Iterable[tuple[Face, bytes]],
    text: str,
    mathematics: str,
    own: Iterable[tuple[Face, bytes]] = (),
) -> tuple[FontJob, ...]:
    """What to cut for pages that use the characters of `text`, and of `mathematics` in formulas.

    `own` are the fonts of the course, which stand in the place of others of their families.
    """
    jobs: list[FontJob] = []
    letters = BASE | set(text)
    theirs: dict[str, set[str]] = {}
    for face, data in own:
        shown = letters & characters_in(face.characters)
        jobs.append(FontJob(face, data, "".join(sorted(shown))))
        theirs.setdefault(face.family, set()).update(shown)
    given: dict[tuple[str, str], set[str]] = {}
    for face, data in faces:
        lacking = letters - theirs.get(_OWN.get(face.family, ""), set())
        wanted = lacking if face.family != MATH else _mathematical(mathematics)
        taken = given.setdefault((face.family, face.style), set())
        kept = (wanted & characters_in(face.characters)) - taken
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
    wanted = {*characters, *map(chr, range(0x20, 0x7F)), RADICAL}
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


RADICAL = "√"
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


def subset_font(job: FontJob) -> bytes:
    """The font with the job's characters only, as WOFF2. The same job gives the same bytes."""
    import uharfbuzz  # which a run without a new font does not need
    from fontTools.ttLib import TTFont

    wanted = uharfbuzz.SubsetInput()
    wanted.flags = uharfbuzz.SubsetFlags.NO_HINTING | uharfbuzz.SubsetFlags.NOTDEF_OUTLINE
    wanted.unicode_set.update(map(ord, job.characters))
    for everything in (
        wanted.layout_feature_tag_set,
        wanted.name_id_set,
        wanted.name_lang_id_set,
    ):
        everything.clear()
        everything.invert()
    part = wanted.subset(uharfbuzz.Face(job.data)).blob.data
    out = io.BytesIO()
    with TTFont(io.BytesIO(part), recalcTimestamp=False) as font:
        font.flavor = "woff2"
        font.save(out)
    return out.getvalue()


# --------------------------------------------------------------------------------- fallbacks


class Fallback(Struct, frozen=True):
    """Local fonts, alike in their advance widths, that stand in for a face until it is there."""

    family: str
    """The web font."""
    style: str
    locals: tuple[str, ...]
    width: float
    """Their mean advance width of English text in em."""


FALLBACKS = (
    Fallback(TEXT, "normal", ("DejaVu Serif",), 0.51002),
    Fallback(TEXT, "normal", ("Noto Serif",), 0.47671),
    Fallback(TEXT, "normal", ("Times New Roman", "Liberation Serif", "Tinos"), 0.39831),
    Fallback(TEXT, "italic", ("DejaVu Serif Italic",), 0.51002),
    Fallback(TEXT, "italic", ("Noto Serif Italic",), 0.46265),
    Fallback(
        TEXT,
        "italic",
        ("Times New Roman Italic", "Liberation Serif Italic", "Tinos Italic"),
        0.39993,
    ),
    Fallback(CODE, "normal", ("Courier New", "Liberation Mono", "Cousine"), 0.60010),
)
"""Of several for one face the last that a machine has is taken: browsers try later rules first.

The widths are measured as `site/prepare_fonts.py` measures those of the web fonts; Liberation Serif
and Liberation Mono are made to match the others beside them.
"""


def face_rules(files: Iterable[tuple[FontJob, str]]) -> str:
    """The `@font-face` rules of cut fonts, each with its address, and of their fallbacks."""
    rules: list[str] = []
    files = tuple(files)
    for job, url in files:
        face = job.face
        low, high = face.weight
        weight = f"{low} {high}" if low != high else str(low)
        whole = face.unicode_range is None
        form = "woff2" if url.endswith(".woff2") else "truetype"
        rules.append(
            f'@font-face{{font-family:"{face.family}";font-style:{face.style};font-weight:{weight};font-display:swap;'
            f'src:url("{url}") format("{form}")'
            + ("}" if whole else f";unicode-range:{unicode_range(job.characters)}}}")
        )
    rules += [rule for fallback in FALLBACKS for rule in _fallback_rules(fallback, files)]
    return "\n".join(rules) + "\n"


def _fallback_rules(fallback: Fallback, files: Iterable[tuple[FontJob, str]]) -> tuple[str, ...]:
    """The rule of a fallback, scaled to the face with the Latin letters, where that is used."""
    families = fallback.family, _OWN[fallback.family]
    for job, _ in files:
        face = job.face
        if face.family in families and (face.style, face.subset) == (fallback.style, "latin"):
            measure = face.measure
            assert measure is not None, "a font with the Latin letters was measured"
            scale = measure[0] / fallback.width
            ascent, descent, gap = (x / scale for x in measure[1:])
            local = ",".join(f'local("{name}")' for name in fallback.locals)
            return (
                f'@font-face{{font-family:"{fallback.family} fallback";'
                f"font-style:{fallback.style};src:{local};size-adjust:{scale:.2%};"
                f"ascent-override:{ascent:.2%};descent-override:{descent:.2%};"
                f"line-gap-override:{gap:.2%}}}",
            )
    return ()
