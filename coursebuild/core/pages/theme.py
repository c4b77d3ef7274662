"""What a course changes of the looks of its pages: fonts, accent, drawings on dark pages."""

from __future__ import annotations

import colorsys
import functools
import io
import re
from collections.abc import Mapping
from typing import Any

from coursebuild.core.drawing.contrast import GROUNDS_DARK, RECOMMENDED_CONTRAST, legible
from coursebuild.core.drawing.safe_svg import read_svg
from coursebuild.core.model.course import Theme, ThemeFile
from coursebuild.core.pages.fonts import COURSE, Face, unicode_range

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
_SIDE = re.compile(r"\s*+(\d+(?:\.\d*)?|\.\d+)")


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


def picture_size(file: ThemeFile) -> tuple[float, float] | None:
    """Width and height of a picture, of which only the ratio counts; `None` if not given."""
    if file.ending == "png":
        width, height = (int.from_bytes(file.data[at : at + 4], "big") for at in (16, 20))
        return width, height
    root = read_svg(file.data)
    if isinstance(root, str):
        return None
    box = root.get("viewBox", "").replace(",", " ").split()
    sides = box[2:] if len(box) == 4 else [root.get("width", ""), root.get("height", "")]
    numbers = [float(match[1]) for side in sides if (match := _SIDE.match(side))]
    if len(numbers) < 2 or not 1e-6 < min(numbers) <= max(numbers) < 1e6:
        return None
    return numbers[0], numbers[1]


_PAIR = re.compile(r"light-dark\((#[0-9a-f]{6}), ?(#[0-9a-f]{6})\)")
_COLOUR = re.compile(
    r"""(?<![\w-])(?P<name>fill|stroke|color|stop-color)(?P<is>\s*[:=]\s*"?)(?P<value>[^;"{}<>]+)"""
)
_FUNCTION = re.compile(r"(?P<name>rgb|hsl)a?\((?P<numbers>[\d.,% ]+)\)")
_ROOT = re.compile(r"<svg\b[^>]*>")


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
