"""Drawings for dark pages, from those for light ones.

Entry points: `dark_drawing`; `dark_colours`, the dark colours that a style sheet pairs with light
ones.
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


def dark_drawing(svg: str, paired_colours: Mapping[str, str]) -> str:
    """An SVG in the colours of a dark page.

    A colour without a pair keeps its hue, but its lightness is inverted.
    """

    def dark(match: re.Match[str]) -> str:
        return f"{match['name']}{match['is']}{_dark_colour(match['value'], paired_colours)}"

    return _COLOUR.sub(dark, _ROOT.sub(_with_fill, svg, count=1))


def _with_fill(root: re.Match[str]) -> str:
    """The root element, with the default colour of shapes made explicit."""
    return root[0] if " fill=" in root[0] else f'<svg fill="#000000"{root[0][4:]}'


def _dark_colour(value: str, paired_colours: Mapping[str, str]) -> str:
    from PIL import ImageColor

    try:
        red, green, blue = ImageColor.getrgb(value.strip())[:3]
    except ValueError:  # `none`, a reference, or an unknown name
        return value
    light = f"#{red:02x}{green:02x}{blue:02x}"
    return paired_colours.get(light) or _invert_lightness(red, green, blue)


def _invert_lightness(*channels: int) -> str:
    red, green, blue = channels
    shift = round(255 - 2 * (0.2126 * red + 0.7152 * green + 0.0722 * blue))
    return "#" + "".join(f"{min(max(channel + shift, 0), 255):02x}" for channel in channels)
