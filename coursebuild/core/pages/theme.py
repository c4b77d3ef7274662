"""The looks of pages: fonts; what a course changes of fonts, accent, and drawings on dark pages.

Fonts are cut down to the characters that a site uses, and have fallbacks with the same metrics:

1. A face is a font of the bundle with its family, style, range of weights and characters.
   `site/prepare_fonts.py` has done what does not depend on a course: it has left only the weights
   that the style sheet uses, and decompressed the font.
2. A job keeps the characters of a face that the pages use, and the usual ones: most courses need
   only these, whose fonts are cut when the tool is bundled, and few edits change a font. A face
   without used characters is left out. HarfBuzz chooses the glyphs (for mathematics with all
   variants and pieces of brackets), and fontTools compresses them.
3. While a font loads, text is set in a local one, scaled so that lines break in the same places.
4. The course's own fonts come first: the tool's are used only for the characters that they lack.
"""

from __future__ import annotations

import colorsys
import functools
import hashlib
import io
import re
from collections.abc import Iterable, Mapping
from typing import Any

import msgspec
from msgspec import Struct

from coursebuild.core.drawing.contrast import GROUNDS_DARK, RECOMMENDED_CONTRAST, legible
from coursebuild.core.model.course import Theme
from coursebuild.core.text.regex import regex

TEXT, INTERFACE = "Source Serif 4 Variable", "Source Sans 3 Variable"
CODE, MATH = "Source Code Pro Variable", "STIX Two Math"
"""Families, by their names in the bundle."""
COURSE = {"text": "Course Text", "interface": "Course Interface", "code": "Course Code"}
"""The families of a course's own fonts in the style sheet, by use."""
_COURSE_FAMILIES = {
    TEXT: COURSE["text"],
    INTERFACE: COURSE["interface"],
    CODE: COURSE["code"],
}
_CALM_FAMILIES = frozenset((TEXT, INTERFACE, COURSE["text"], COURSE["interface"]))
"""Families whose lines would break elsewhere when the font arrives: it is shown from the first line
on, or from the next page. Code keeps its columns, and formulas need their own font."""

BASE = frozenset("".join(map(chr, range(0x20, 0x7F))) + "\u00a0§°±²³µ·¹½×éöü–—‘’“”…•−")
"""Characters of text that every site keeps."""
GREEK = frozenset("".join(map(chr, range(0x391, 0x3CA))) + "ϑϕϖϰϱϵ") - {"\u03a2"}
"""Letters that are kept together: a page that has one of them may soon have another."""
MATHEMATICS = BASE.union(
    GREEK,
    map(chr, range(0x1D400, 0x1D434)),  # bold letters
    map(chr, range(0x1D736, 0x1D755)),  # bold italic Greek letters
    map(chr, range(0x1D7CE, 0x1D7D8)),  # bold digits
    "¨¬÷ˆ˙˜\u0302\u0303\u0307\u0308\u20d7‖†′″…⁡‾⋅⋮⋯⋱⌈⌉⌊⌋⏞⏟□⟂⟨⟩\ufe0e",
    "∀∂∃∅∆∇∈∉∏∑∓∗∘∙√∝∞∠∣∥∧∨∩∪∫∬∭∮∼≃≅≈≠≡≤≥≪≫⊂⊃⊆⊇⊕⊗⊤⊥",
    "ℏℐℑℒℓℕℚℜℝℤℂℋ𝒪𝛀←↑→↓↔⇐⇒⇔↦⟶⟹",
)
"""Signs that are kept together where a page has formulas. The sign of roots must be among them: it
is drawn, though it is not in their text."""

_VERSION = 6
"""Part of a job's key; increase it when the way of cutting changes."""


class Face(Struct, frozen=True):
    """A font file of the bundle, as `fonts.json` lists it."""

    family: str
    subset: str
    file: str
    style: str
    weight: tuple[int, int]
    unicode_range: str | None
    """In CSS syntax; `None` for the whole font."""
    characters: str
    """The characters that it has glyphs for, as a `unicode-range`."""
    measure: tuple[float, float, float, float] | None = None
    """Mean advance width of English text, ascent, descent and line gap, in em; `None` for a font
    without Latin letters."""


class FontJob(Struct, frozen=True):
    """One font to cut."""

    face: Face
    data: bytes
    characters: str
    """Sorted, each once."""

    @property
    def key(self) -> str:
        """The key of the result: the same key means the same bytes."""
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
    course_faces: Iterable[tuple[Face, bytes]] = (),
) -> tuple[FontJob, ...]:
    """What to cut for pages that use the characters of `text`, and of `mathematics` in formulas.

    `course_faces` are the fonts of the course, which replace others of their families.
    """
    jobs: list[FontJob] = []
    letters = BASE | set(text)
    if letters & GREEK:
        letters |= GREEK
    course_characters: dict[str, set[str]] = {}
    for face, data in course_faces:
        used_characters = letters & characters_in(face.characters)
        jobs.append(FontJob(face, data, "".join(sorted(used_characters))))
        course_characters.setdefault(face.family, set()).update(used_characters)
    # Characters of formulas, with the italics that a browser replaces single letters by
    signs = MATHEMATICS.union(mathematics) if mathematics else frozenset[str]()
    signs |= {*map(italic_letter, signs)} - {""}
    assigned: dict[tuple[str, str], set[str]] = {}
    for face, data in faces:
        missing = letters - course_characters.get(_COURSE_FAMILIES.get(face.family, ""), set())
        needed_characters = missing if face.family != MATH else signs
        assigned_characters = assigned.setdefault((face.family, face.style), set())
        characters = (needed_characters & characters_in(face.characters)) - assigned_characters
        if face.unicode_range is not None:
            characters &= characters_in(face.unicode_range)
        if characters:
            assigned_characters |= characters
            jobs.append(FontJob(face, data, "".join(sorted(characters))))
    return tuple(jobs)


@functools.lru_cache(maxsize=64)
def characters_in(unicode_range: str) -> frozenset[str]:
    """The characters of a CSS `unicode-range`."""
    characters: set[str] = set()
    for part in unicode_range.split(","):
        first, _, last = part.strip().upper().removeprefix("U+").partition("-")
        start = int(first.replace("?", "0"), 16)
        end = int(last or first.replace("?", "F"), 16)
        characters.update(map(chr, range(start, end + 1)))
    return frozenset(characters)


def unicode_range(characters: str) -> str:
    """The CSS `unicode-range` of sorted characters."""
    runs: list[list[int]] = []
    for code in map(ord, characters):
        if runs and code == runs[-1][1] + 1:
            runs[-1][1] = code
        else:
            runs.append([code, code])
    return ", ".join(f"U+{a:X}" if a == b else f"U+{a:X}-{b:X}" for a, b in runs)


def italic_letter(character: str) -> str:
    """The italic that `<mi>` replaces a letter by; empty if none (MathML Core, appendix C)."""
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
    import uharfbuzz  # needed only by a run with a new font
    from fontTools.ttLib import TTFont

    subset = uharfbuzz.SubsetInput()
    subset.flags = uharfbuzz.SubsetFlags.NO_HINTING | uharfbuzz.SubsetFlags.NOTDEF_OUTLINE
    subset.unicode_set.update(map(ord, job.characters))
    for tags in (subset.layout_feature_tag_set, subset.name_id_set, subset.name_lang_id_set):
        tags.clear()
        tags.invert()
    part = subset.subset(uharfbuzz.Face(job.data)).blob.data
    out = io.BytesIO()
    with TTFont(io.BytesIO(part), recalcTimestamp=False) as font:
        font.flavor = "woff2"
        font.save(out)
    return out.getvalue()


# --- fallbacks


class Fallback(Struct, frozen=True):
    """Local fonts of equal widths that stand in for a face until it has loaded."""

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
    Fallback(INTERFACE, "normal", ("DejaVu Sans",), 0.50462),
    Fallback(INTERFACE, "normal", ("Roboto",), 0.44099),
    Fallback(INTERFACE, "normal", ("Arial", "Helvetica", "Liberation Sans", "Arimo"), 0.43948),
    Fallback(CODE, "normal", ("DejaVu Sans Mono",), 0.60205),
    Fallback(CODE, "normal", ("Courier New", "Liberation Mono", "Cousine"), 0.60010),
)
"""If several exist on a machine for one face, the last is used: browsers try later rules first.

The widths are measured as `site/prepare_fonts.py` measures those of the web fonts; Helvetica and
the Liberation fonts have the widths of the fonts listed with them.
"""


def fonts_at_once(files: Iterable[tuple[FontJob, str]]) -> tuple[tuple[str, str], ...]:
    """The addresses of the fonts that a page needs for its first lines, each after a mark.

    A page needs those whose marks it holds; all hold the empty one.
    """
    return tuple(
        ("<math" if job.face.family == MATH else "", url)
        for job, url in files
        if job.face.family in {*_CALM_FAMILIES, MATH}
        and (job.face.style, job.face.subset) == ("normal", "latin")
    )


def face_rules(files: Iterable[tuple[FontJob, str]]) -> str:
    """The `@font-face` rules of fonts with their addresses, and of their fallbacks."""
    rules: list[str] = []
    files = tuple(files)
    for job, url in files:
        face = job.face
        low, high = face.weight
        weight = f"{low} {high}" if low != high else str(low)
        whole = face.unicode_range is None
        form = "woff2" if url.endswith(".woff2") else "truetype"
        display = "optional" if face.family in _CALM_FAMILIES else "swap"
        rules.append(
            f'@font-face{{font-family:"{face.family}";font-style:{face.style};font-weight:{weight};font-display:{display};'
            f'src:url("{url}") format("{form}")'
            + ("}" if whole else f";unicode-range:{unicode_range(job.characters)}}}")
        )
    for fallback in FALLBACKS:
        # It is scaled to the face with the Latin letters, if that is used.
        families = fallback.family, _COURSE_FAMILIES[fallback.family]
        faces = (job.face for job, _ in files if job.face.family in families)
        kind = (fallback.style, "latin")
        measures = (face.measure for face in faces if (face.style, face.subset) == kind)
        if (measure := next(measures, None)) is not None:
            scale = measure[0] / fallback.width
            ascent, descent, gap = (x / scale for x in measure[1:])
            local = ",".join(f'local("{name}")' for name in fallback.locals)
            rules.append(
                f'@font-face{{font-family:"{fallback.family} fallback";'
                f"font-style:{fallback.style};src:{local};size-adjust:{scale:.2%};"
                f"ascent-override:{ascent:.2%};descent-override:{descent:.2%};"
                f"line-gap-override:{gap:.2%}}}"
            )
    return "\n".join(rules) + "\n"


# --- what a course changes

PER_MILLE = "183 103 75 65 62 57 57 53 50 50 33 33 23 22 20 20 17 16 15 14 13 8 6 1 1 1 1"
FREQUENCY = dict(zip(" etaoinsrhldcumfwgpybvkxjqz", map(int, PER_MILLE.split()), strict=True))


@functools.lru_cache(maxsize=16)
def course_face(use: str, name: str, data: bytes) -> tuple[Face, bytes] | str:
    """The face of a font file and its uncompressed bytes, or words for what is wrong."""
    from fontTools.ttLib import TTFont

    try:
        with TTFont(io.BytesIO(data), recalcTimestamp=False) as font:
            measure = measure_font(font)
            characters = unicode_range("".join(map(chr, sorted(font.getBestCmap()))))
            italic = bool(font["OS/2"].fsSelection & 1 or font["post"].italicAngle)
            weight = font["OS/2"].usWeightClass, font["OS/2"].usWeightClass
            for axis in font["fvar"].axes if "fvar" in font else ():
                if axis.axisTag == "wght":
                    weight = round(axis.minValue), round(axis.maxValue)
            font.flavor = None
            whole = io.BytesIO()
            font.save(whole)
    except Exception as error:  # fontTools raises many kinds for damaged files
        return f"cannot be read as a font: {error or type(error).__name__}"
    subset, style = "latin" if measure else "other", "italic" if italic else "normal"
    face = Face(COURSE[use], subset, name, style, weight, characters, characters, measure)
    return face, whole.getvalue()


def measure_font(font: Any) -> tuple[float, float, float, float] | None:
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


_ACCENT = "#17487a", "#9fc6ef"
_BOLD = 600


def theme_faces(theme: Theme) -> list[tuple[Face, bytes]]:
    """The faces of its fonts, each with its file; checks report unreadable ones."""
    files = ((family.use, file) for family in theme.fonts for file in family.files)
    faces = (course_face(use, file.path.rpartition("/")[2], file.data) for use, file in files)
    return [face for face in faces if not isinstance(face, str)]


def theme_style(theme: Theme) -> str:
    """The rules at the end of the style sheet."""
    css = "".join(f"{file.text.rstrip()}\n" for file in theme.css)
    light, dark = accents(theme)
    accent = f"@media screen{{:root{{--accent:light-dark({light},{dark})}}}}\n"
    # The browser synthesizes bold or italics if a font lacks them.
    synthesis = "body{font-synthesis:weight style}math{font-synthesis:none}\n"
    families = [theme_faces(Theme(fonts=(family,))) for family in theme.fonts]
    is_whole = all(
        any(face.weight[1] >= _BOLD for face, _ in faces)
        and any(face.style == "italic" for face, _ in faces)
        for faces in families
    )
    return ("" if (light, dark) == _ACCENT else accent) + ("" if is_whole else synthesis) + css


def accents(theme: Theme) -> tuple[str, str]:
    """The accent on light and on dark pages."""
    if not theme.accent and not theme.accent_dark:
        return _ACCENT
    light = theme.accent or _ACCENT[0]
    return light, theme.accent_dark or legible(light, GROUNDS_DARK, RECOMMENDED_CONTRAST)


_PAIR = regex(r"light-dark\((#[0-9a-f]{6}), ?(#[0-9a-f]{6})\)")
_COLOUR = regex(
    r"""(?<![\w-])(?P<name>fill|stroke|color|stop-color)(?P<is>\s*[:=]\s*"?)(?P<value>[^;"{}<>]+)"""
)
_FUNCTION = regex(r"(?P<name>rgb|hsl)a?\((?P<numbers>[\d.,% ]+)\)")
_ROOT = regex(r"<svg\b[^>]*>")


def dark_colours(css: str) -> dict[str, str]:
    """The dark colour for each light one that a style sheet pairs; the first pair counts."""
    return dict(reversed(_PAIR.findall(css)))


def dark_drawing(svg: str, paired_colours: Mapping[str, str]) -> str:
    """An SVG in dark colours; one without a pair keeps its hue, with its lightness inverted."""

    def dark(match: re.Match[str]) -> str:
        value = match["value"]
        channels = _channels(value.strip().lower())
        if channels is None:
            return match[0]
        red, green, blue = channels
        light = f"#{red:02x}{green:02x}{blue:02x}"
        shift = round(255 - 2 * (0.2126 * red + 0.7152 * green + 0.0722 * blue))
        inverted = bytes(min(max(channel + shift, 0), 255) for channel in (red, green, blue))
        return f"{match['name']}{match['is']}{paired_colours.get(light) or f'#{inverted.hex()}'}"

    root = _ROOT.search(svg)
    if root is not None and " fill=" not in root[0]:  # the default colour of shapes
        at = root.start() + len("<svg")
        svg = f'{svg[:at]} fill="#000000"{svg[at:]}'
    return _COLOUR.sub(dark, svg)


def _channels(colour: str) -> tuple[int, int, int] | None:
    """Red, green and blue of a colour of CSS; `None` of `none`, a reference and unknown names."""
    import webcolors  # needed only by a site with drawings

    try:
        if (function := _FUNCTION.fullmatch(colour)) is None:
            is_hex, digits = colour.startswith("#"), 6 if len(colour) > 5 else 3
            parse = webcolors.hex_to_rgb if is_hex else webcolors.name_to_rgb
            return tuple(parse(colour[: 1 + digits] if is_hex else colour))
        numbers = [part.strip() for part in function["numbers"].split(",")[:3]]
        a, b, c = (
            min(float(number.rstrip("%")) / (100 if number.endswith("%") else 255), 1.0)
            for number in numbers
        )
        if function["name"] == "hsl":
            a, b, c = colorsys.hls_to_rgb(float(numbers[0]) / 360, c, b)
    except ValueError:
        return None
    return round(255 * a), round(255 * b), round(255 * c)
