"""The cover of the e-book: the course's title, drawn as SVG.

Entry point: `cover(title, direction)`.
"""

from __future__ import annotations

import unicodedata
from html import escape

_WIDTH, _HEIGHT = 1200, 1600
_EDGE = 120
_SIZES = (120, 100, 84, 68, 54)
"""Of type; the largest is taken in which the title has few lines."""
_LINES = 6


def cover(title: str, direction: str) -> str:
    """The picture."""
    title = " ".join(title.split())
    for size in _SIZES:
        lines = _broken(title, (_WIDTH - 2 * _EDGE) / size)
        if len(lines) <= _LINES:
            break
    lines = lines[: 2 * _LINES]
    right = direction == "rtl"
    x = _WIDTH - _EDGE if right else _EDGE
    texts = "".join(
        f'<text x="{x}" y="{430 + round(1.2 * size * at)}">{escape(line)}</text>\n'
        for at, line in enumerate(lines)
    )
    return (
        '<?xml version="1.0" encoding="utf-8"?>\n'
        f'<svg xmlns="http://www.w3.org/2000/svg" version="1.1" width="{_WIDTH}"'
        f' height="{_HEIGHT}" viewBox="0 0 {_WIDTH} {_HEIGHT}">\n'
        f"<title>{escape(title)}</title>\n"
        f'<rect width="{_WIDTH}" height="{_HEIGHT}" fill="#fcfbf8"/>\n'
        f'<rect x="{_EDGE}" y="250" width="{_WIDTH - 2 * _EDGE}" height="6" fill="#17487a"/>\n'
        f'<g font-family="Georgia, serif" font-size="{size}" fill="#1e1e1c"'
        f' direction="{direction}">\n'
        f"{texts}</g>\n"
        "</svg>\n"
    )


def _broken(text: str, width: float) -> list[str]:
    """Lines of at most about `width` ems; a word that is wider is cut."""
    lines = [""]
    for word in text.split(" "):
        longer = f"{lines[-1]} {word}".strip()
        if _ems(longer) <= width:
            lines[-1] = longer
            continue
        if lines[-1]:
            lines.append("")
        for character in word:
            if _ems(lines[-1] + character) > width:
                lines.append("")
            lines[-1] += character
    return lines


def _ems(text: str) -> float:
    return sum(
        0.0
        if unicodedata.combining(c)
        else 1.0
        if unicodedata.east_asian_width(c) in "WF"
        else 0.7
        if c.isupper()
        else 0.52
        for c in text
    )
