"""The width of text in columns, as on a terminal or in an editor.

Entry point: `cells`.
"""

from __future__ import annotations

import unicodedata

TAB = 4


def cells(text: str) -> int:
    """The number of columns that a text takes."""
    return sum(map(_cells, text))


def _cells(char: str) -> int:
    if char == "\t":
        return TAB
    if unicodedata.combining(char) or char == "\u200d":
        return 0
    return 2 if unicodedata.east_asian_width(char) in ("W", "F") else 1
