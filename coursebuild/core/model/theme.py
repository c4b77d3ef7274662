"""The look of a course's site: the table `[theme]` of its map, with the files that it names.

Entry point: `Theme`.
"""

from __future__ import annotations

from typing import Literal

from msgspec import Struct

from coursebuild.core.text.source import Source, Span


class ThemeFile(Struct, frozen=True):
    """A file in `theme/` that the map names."""

    path: str
    span: Span
    """Where the map names it."""
    data: bytes = b""
    """Its content, once it has been read."""

    @property
    def ending(self) -> str:
        """`svg`."""
        return self.path.rpartition(".")[2]

    @property
    def text(self) -> str:
        """Its content as text."""
        return self.data.decode("utf-8", "replace")


class FontFamily(Struct, frozen=True):
    """A typeface, and what it is used for."""

    use: Literal["text", "interface", "code"]
    files: tuple[ThemeFile, ...]
    licence: ThemeFile


class Theme(Struct, frozen=True):
    """Logo, icons, colours, style sheets, fonts and templates; empty ones are the tool's own."""

    logo: ThemeFile | None = None
    logo_dark: ThemeFile | None = None
    icon: ThemeFile | None = None
    touch_icon: ThemeFile | None = None
    accent: str = ""
    """The colour of links and buttons, as `#rrggbb`."""
    accent_dark: str = ""
    css: tuple[ThemeFile, ...] = ()
    fonts: tuple[FontFamily, ...] = ()
    templates: tuple[Source, ...] = ()
    """The files of `theme/templates/`, each replacing the template of that name."""

    @property
    def pictures(self) -> tuple[ThemeFile, ...]:
        """Its logo and its icons."""
        fields = (getattr(self, name) for name in PICTURES)
        return tuple(file for file in fields if file is not None)

    @property
    def template_texts(self) -> tuple[tuple[str, str], ...]:
        """The names and texts of its templates."""
        return tuple(
            (source.path.removeprefix(TEMPLATES), source.text) for source in self.templates
        )


PICTURES = ("logo", "logo_dark", "icon", "touch_icon")
"""The fields of its pictures."""
TEMPLATES = "theme/templates/"
