"""The table `[theme]` of course.toml: logo, icons, accent, style sheets, fonts.

Entry points: `ThemeTable`; `theme`, its value, with files not read yet; `check_contrast`.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any, Literal, TypeAlias

from msgspec import Meta, Struct

from coursebuild.core.drawing.contrast import (
    GROUNDS_DARK,
    GROUNDS_LIGHT,
    REQUIRED_CONTRAST,
    contrast,
    legible,
)
from coursebuild.core.model.fields import matching
from coursebuild.core.model.theme import PICTURES, FontFamily, Theme, ThemeFile
from coursebuild.core.syntax.nodes import ObjectNode
from coursebuild.core.text.diagnostics import Diagnostic, diagnose


def _file_field(noun: str, endings: str, example: str) -> Meta:
    """The field of a file in `theme/` with one of these endings."""
    return matching(
        rf"^theme(/[\w-][\w.-]*)+\.({endings})$", f"{noun} in `theme/`, as in `theme/{example}`"
    )


Picture: TypeAlias = Annotated[str, _file_field("an SVG or PNG", "svg|png", "logo.svg")]
Png: TypeAlias = Annotated[str, _file_field("a PNG", "png", "icon.png")]
StyleSheet: TypeAlias = Annotated[str, _file_field("a style sheet", "css", "style.css")]
Font: TypeAlias = Annotated[str, _file_field("a font", "ttf|otf|woff2?", "Vollkorn.ttf")]
Licence: TypeAlias = Annotated[str, _file_field("a text", "txt|md", "OFL.txt")]
Colour: TypeAlias = Annotated[str, matching("^#[0-9A-Fa-f]{6}$", "a colour as in `#17487a`")]


class FontTable(Struct, frozen=True, forbid_unknown_fields=True):
    """A typeface of the course's own."""

    use: Annotated[Literal["text", "interface", "code"], Meta(description="what is set in it")]
    files: Annotated[tuple[Font, ...], Meta(min_length=1, description="its styles, upright first")]
    licence: Annotated[Licence, Meta(description="by which it may be published")]


class ThemeTable(Struct, frozen=True, forbid_unknown_fields=True):
    """The face of the site."""

    logo: Annotated[Picture | None, Meta(description="beside the title of every page")] = None
    logo_dark: Annotated[Picture | None, Meta(description="the same on dark pages")] = None
    icon: Annotated[Picture | None, Meta(description="of the browser's tab, square")] = None
    touch_icon: Annotated[
        Png | None, Meta(description="of an installed course, square; 512 pixels are enough")
    ] = None
    accent: Annotated[Colour | None, Meta(description="of links and buttons")] = None
    accent_dark: Annotated[
        Colour | None, Meta(description="the same on dark pages; without it, a lighter `accent`")
    ] = None
    css: Annotated[tuple[StyleSheet, ...], Meta(description="read after the tool's own")] = ()
    font: tuple[FontTable, ...] = ()


def theme(node: ObjectNode, fields: ThemeTable) -> Theme:
    """The theme that the table describes."""

    def file(name: str, path: str | None) -> ThemeFile | None:
        return None if path is None else ThemeFile(path, node.place(name))

    pictures: dict[str, Any] = {name: file(name, getattr(fields, name)) for name in PICTURES}
    return Theme(
        **pictures,
        accent=(fields.accent or "").lower(),
        accent_dark=(fields.accent_dark or "").lower(),
        css=_theme_files(node, "css", fields.css),
        fonts=tuple(
            FontFamily(
                font.use,
                _theme_files(table, "files", font.files),
                ThemeFile(font.licence, table.place("licence")),
            )
            for table, font in zip(node.objects("font"), fields.font, strict=True)
        ),
    )


def check_contrast(node: ObjectNode, theme: Theme) -> Iterator[Diagnostic]:
    """Warn of accents that cannot be read on the grounds of a page."""
    for name, colour, grounds in (
        ("accent", theme.accent, GROUNDS_LIGHT),
        ("accent_dark", theme.accent_dark, GROUNDS_DARK),
    ):
        if colour and (ratio := contrast(colour, grounds)) < REQUIRED_CONTRAST:
            scheme = "light" if grounds is GROUNDS_LIGHT else "dark"
            message = f"on {scheme} pages `{colour}` has a contrast of {ratio:.2f} : 1"
            nearest = legible(colour, grounds)
            help = f"text needs {REQUIRED_CONTRAST} : 1; `{nearest}` is the nearest that reaches it"
            yield diagnose("theme-contrast", node.place(name), message, help=help)


def _theme_files(node: ObjectNode, name: str, paths: tuple[str, ...]) -> tuple[ThemeFile, ...]:
    return tuple(map(ThemeFile, paths, (item.span for item in node.items(name))))
