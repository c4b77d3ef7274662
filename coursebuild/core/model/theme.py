"""The look of a course's site: what `[theme]` in its map says, with the files that it names.

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
    """Its name in the map."""
    data: bytes = b""
    """What it holds, once it was read."""

    @property
    def ending(self) -> str:
        """`svg`."""
        return self.path.rpartition(".")[2]

    @property
    def text(self) -> str:
        """What it holds, as text."""
        return self.data.decode("utf-8", "replace")


class FontFamily(Struct, frozen=True):
    """A typeface, and what is set in it."""

    use: Literal["text", "interface", "code"]
    files: tuple[ThemeFile, ...]
    licence: ThemeFile


class Theme(Struct, frozen=True):
    """Logo, icons, colours, style sheets, fonts and templates; the tool's where there is none."""

    logo: ThemeFile | None = None
    logo_dark: ThemeFile | None = None
    icon: ThemeFile | None = None
    touch_icon: ThemeFile | None = None
    accent: str = ""
    """The colour of links and of what can be pressed, as `#rrggbb`."""
    accent_dark: str = ""
    css: tuple[ThemeFile, ...] = ()
    fonts: tuple[FontFamily, ...] = ()
    templates: tuple[Source, ...] = ()
    """The files of `theme/templates/`, each in the place of the template of that name."""

    @property
    def pictures(self) -> tuple[ThemeFile, ...]:
        """Its logo and its icons."""
        named = (getattr(self, name) for name in PICTURES)
        return tuple(file for file in named if file is not None)

    @property
    def template_texts(self) -> tuple[tuple[str, str], ...]:
        """The names and texts of its templates."""
        return tuple((one.path.removeprefix(TEMPLATES), one.text) for one in self.templates)


PICTURES = ("logo", "logo_dark", "icon", "touch_icon")
"""The fields of its pictures."""
TEMPLATES = "theme/templates/"
