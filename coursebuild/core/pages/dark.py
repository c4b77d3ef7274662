"""Drawings for dark pages, from those for light ones.

Entry points: `dark_drawing`; `dark_colours`, what becomes of the colours of a style sheet.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

_PAIR = re.compile(r"light-dark\((#[0-9a-f]{6}), ?(#[0-9a-f]{6})\)")
_COLOUR = re.compile(
    r"""(?<![\w-])(?P<name>fill|stroke|color|stop-color)(?P<is>\s*[:=]\s*"?)(?P<value>[^;"{}<>]+)"""
)
_ROOT = re.compile(r"<svg\b[^>]*>")


def dark_colours(css: str) -> dict[str, str]:
    """The dark colour for each light one that a style sheet pairs; the first pair counts."""
    return dict(reversed(_PAIR.findall(css)))


def dark_drawing(svg: str, known: Mapping[str, str]) -> str:
    """An SVG in the colours of a dark page.

    A colour that is not known keeps its hue, and its lightness is turned round.
    """

    def dark(match: re.Match[str]) -> str:
        return f"{match['name']}{match['is']}{_dark_colour(match['value'], known)}"

    return _COLOUR.sub(dark, _ROOT.sub(_with_fill, svg, count=1))


def _with_fill(root: re.Match[str]) -> str:
    """The root, with the colour of what says none."""
    return root[0] if " fill=" in root[0] else f'<svg fill="#000000"{root[0][4:]}'


def _dark_colour(value: str, known: Mapping[str, str]) -> str:
    from PIL import ImageColor

    try:
        red, green, blue = ImageColor.getrgb(value.strip())[:3]
    except ValueError:  # none, another element's, or a name that is not known
        return value
    light = f"#{red:02x}{green:02x}{blue:02x}"
    return known.get(light) or _turned(red, green, blue)


def _turned(*channels: int) -> str:
    red, green, blue = channels
    shift = round(255 - 2 * (0.2126 * red + 0.7152 * green + 0.0722 * blue))
    return "#" + "".join(f"{min(max(channel + shift, 0), 255):02x}" for channel in channels)
