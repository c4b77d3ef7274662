"""The cover of the e-book: the title of the course, as a picture in SVG.

Entry point: `cover(title, direction, accent)`.
"""

from __future__ import annotations

import textwrap
import unicodedata
from html import escape

_WIDTH, _HEIGHT = 1200, 1600
_EDGE = 120
_SIZES = (120, 100, 84, 68, 54)
"""Of type; the largest is taken in which the title has few lines."""
_LINES = 6


def _mean_width(title: str) -> float:
    """The width of a character of the title, in ems, so far as it is known without a font."""
    widths = [
        1.0 if unicodedata.east_asian_width(c) in "WF" else 0.7 if c.isupper() else 0.52
        for c in title
    ]
    return sum(widths) / max(len(widths), 1) or 1.0


def cover(title: str, direction: str, accent: str) -> str:
    """The picture, with a bar in the accent."""
    title = " ".join(title.split())
    for size in _SIZES:
        characters = int((_WIDTH - 1.5 * _EDGE) / size / _mean_width(title))
        lines = textwrap.wrap(title, characters) or [""]
        if len(lines) <= _LINES:
            break
    x = _WIDTH - _EDGE if direction == "rtl" else _EDGE
    texts = "".join(
        f'<text x="{x}" y="{430 + round(1.2 * size * at)}">{escape(line)}</text>\n'
        for at, line in enumerate(lines[: 2 * _LINES])
    )
    return (
        '<?xml version="1.0" encoding="utf-8"?>\n'
        f'<svg xmlns="http://www.w3.org/2000/svg" version="1.1" width="{_WIDTH}"'
        f' height="{_HEIGHT}" viewBox="0 0 {_WIDTH} {_HEIGHT}">\n'
        f"<title>{escape(title)}</title>\n"
        f'<rect width="{_WIDTH}" height="{_HEIGHT}" fill="#fcfbf8"/>\n'
        f'<rect x="{_EDGE}" y="250" width="{_WIDTH - 2 * _EDGE}" height="6" fill="{accent}"/>\n'
        f'<g font-family="Georgia, serif" font-size="{size}" fill="#1e1e1c"'
        f' direction="{direction}">\n'
        f"{texts}</g>\n"
        "</svg>\n"
    )
