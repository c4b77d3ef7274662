"""A course's own look in the files that all pages share.

Entry points: `theme_faces`, its fonts; `theme_style`, the end of the style sheet; `picture_size`.
"""

from __future__ import annotations

import re

from coursebuild.core.drawing.contrast import GROUNDS_DARK, RECOMMENDED_CONTRAST, legible
from coursebuild.core.drawing.safe_svg import read_svg
from coursebuild.core.model.theme import Theme, ThemeFile
from coursebuild.core.pages.font_files import course_face
from coursebuild.core.pages.fonts import Face

_ACCENT = "#17487a", "#9fc6ef"
"""The accent of the style sheet, on light and dark pages."""
_BOLD = 600
"""The weight of headings."""
_SIDE = re.compile(r"\s*+(\d+(?:\.\d*)?|\.\d+)")


def theme_faces(theme: Theme) -> list[tuple[Face, bytes]]:
    """The faces of its fonts, each with its file; checks report unreadable ones."""
    files = ((family.use, file) for family in theme.fonts for file in family.files)
    faces = (course_face(use, file.path.rpartition("/")[2], file.data) for use, file in files)
    return [face for face in faces if not isinstance(face, str)]


def theme_style(theme: Theme) -> str:
    """The rules at the end of the style sheet."""
    css = (f"{file.text.rstrip()}\n" for file in theme.css)
    return "".join((_accent(theme), _synthesis(theme), *css))


def accents(theme: Theme) -> tuple[str, str]:
    """The accent on light and on dark pages."""
    if not theme.accent and not theme.accent_dark:
        return _ACCENT
    light = theme.accent or _ACCENT[0]
    return light, theme.accent_dark or legible(light, GROUNDS_DARK, RECOMMENDED_CONTRAST)


def _accent(theme: Theme) -> str:
    light, dark = accents(theme)
    if (light, dark) == _ACCENT:
        return ""
    return f"@media screen{{:root{{--accent:light-dark({light},{dark})}}}}\n"


def _synthesis(theme: Theme) -> str:
    """Let the browser synthesize bold or italics if a font lacks them."""
    for family in theme.fonts:
        faces = [face for face, _ in theme_faces(Theme(fonts=(family,)))]
        if not any(face.weight[1] >= _BOLD for face in faces) or not any(
            face.style == "italic" for face in faces
        ):
            return "body{font-synthesis:weight style}math{font-synthesis:none}\n"
    return ""


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
