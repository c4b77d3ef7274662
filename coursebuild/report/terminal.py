"""Text on a terminal: colours, paragraphs and tables.

Entry points: `Style`, `visible`, `clipped`; `Column`, `table`.
"""

from __future__ import annotations

import textwrap
import unicodedata
from collections.abc import Sequence

from msgspec import Struct

from coursebuild.core.text.cells import TAB, cells

BOLD, FAINT, GREEN, RED, YELLOW, BLUE = "1", "2", "32", "1;31", "1;33", "1;34"
_GAP = "  "
_NARROWEST = 40


class Style(Struct, frozen=True):
    """How text is shown: with ANSI colours or without, and in how many columns."""

    colour: bool = False
    width: int = 100

    def paint(self, text: str, code: str) -> str:
        """`text` in a colour, where there is colour."""
        return f"\x1b[{code}m{text}\x1b[0m" if self.colour and text and code else text

    def wrap(self, text: str, indent: str = "", code: str = "") -> list[str]:
        """A paragraph in a colour, no wider than the terminal where its words allow it."""
        lines = textwrap.wrap(
            visible(text),
            max(self.width, _NARROWEST),
            initial_indent=indent,
            subsequent_indent=indent + "  ",
            break_long_words=False,
            break_on_hyphens=False,
        )
        return [self.paint(line, code) for line in lines]


def visible(text: str) -> str:
    """Text with control characters shown as symbols, so that it cannot change the terminal."""
    return "".join(map(_shown, text))


def visible_lines(text: str) -> str:
    """The same for a text of several lines."""
    return "\n".join(visible(line) for line in text.split("\n"))


def _shown(char: str) -> str:
    code = ord(char)
    if char == "\t":
        return " " * TAB
    if code < 0x20:
        return chr(0x2400 + code)
    if code == 0x7F:
        return "\u2421"
    if unicodedata.category(char) in ("Cc", "Cf", "Cs", "Zl", "Zp") and char != "\u200d":
        return "\ufffd"
    return char


def clipped(text: str, room: int) -> str:
    """The beginning of a text that fits into so many cells."""
    used = 0
    for index, char in enumerate(text):
        used += cells(char)
        if used > room:
            return text[:index]
    return text


class Column(Struct, frozen=True):
    """A column of a table with its cells from top to bottom."""

    title: str
    cells: tuple[str, ...]
    rank: int = 0
    """Those of low rank come first where there is no room for all; 0 is always there."""
    left: bool = False
    """Words stand at the left, numbers at the right."""


def table(columns: Sequence[Column], width: int | None = None) -> list[str]:
    """The titles and the rows as lines, no wider than `width` where that can be.

    Columns without any text are left out.
    """
    filled = [
        (column, [column.title, *map(visible, column.cells)])
        for column in columns
        if any(cell.strip() for cell in column.cells)
    ]
    widths = [max(map(cells, texts)) for _, texts in filled]
    shown = {n for n, (column, _) in enumerate(filled) if width is None or column.rank == 0}
    for n in sorted(range(len(filled)), key=lambda n: (filled[n][0].rank, n)):
        tried = shown | {n}
        if width is None or sum(widths[m] + len(_GAP) for m in tried) - len(_GAP) <= width:
            shown = tried
    padded = [
        [_padded(text, widths[n], left=filled[n][0].left) for text in filled[n][1]]
        for n in sorted(shown)
    ]
    return [_GAP.join(row).rstrip() for row in zip(*padded, strict=True)]


def _padded(text: str, width: int, *, left: bool) -> str:
    pad = " " * (width - cells(text))
    return text + pad if left else pad + text
