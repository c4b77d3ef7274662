"""Text on a terminal: colours, paragraphs and tables.

Entry points: `Style`, `visible`, `clip`; `Column`, `table`.
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
        """Return a text in a colour, if colours are used."""
        return f"\x1b[{code}m{text}\x1b[0m" if self.colour and text and code else text

    def wrap(self, text: str, indent: str = "", code: str = "") -> list[str]:
        """Return the lines of a paragraph, no wider than the terminal if its words allow."""
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
    """Return a text with symbols for control characters, so that it cannot change the terminal."""
    return "".join(map(_show_char, text))


def visible_lines(text: str) -> str:
    """Do the same for a text of several lines."""
    return "\n".join(visible(line) for line in text.split("\n"))


def _show_char(char: str) -> str:
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


def clip(text: str, room: int) -> str:
    """Return the beginning of a text that fits into `room` cells."""
    width = 0
    for index, char in enumerate(text):
        width += cells(char)
        if width > room:
            return text[:index]
    return text


class Column(Struct, frozen=True):
    """A column of a table with its cells from top to bottom."""

    title: str
    cells: tuple[str, ...]
    rank: int = 0
    """Where there is no room for all, columns of higher rank are left out; 0 never is."""
    left: bool = False
    """Whether its cells are aligned left, as words are; numbers are aligned right."""


def table(columns: Sequence[Column], width: int | None = None) -> list[str]:
    """Return the titles and the rows as lines, no wider than `width` where that is possible.

    Columns without any text are left out.
    """
    filled_columns = [
        (column, [column.title, *map(visible, column.cells)])
        for column in columns
        if any(cell.strip() for cell in column.cells)
    ]
    widths = [max(map(cells, texts)) for _, texts in filled_columns]
    visible_columns = {
        n for n, (column, _) in enumerate(filled_columns) if width is None or column.rank == 0
    }
    for n in sorted(range(len(filled_columns)), key=lambda n: (filled_columns[n][0].rank, n)):
        candidate = visible_columns | {n}
        if width is None or sum(widths[m] + len(_GAP) for m in candidate) - len(_GAP) <= width:
            visible_columns = candidate
    padded_columns = [
        [_pad(text, widths[n], left=filled_columns[n][0].left) for text in filled_columns[n][1]]
        for n in sorted(visible_columns)
    ]
    return [_GAP.join(row).rstrip() for row in zip(*padded_columns, strict=True)]


def _pad(text: str, width: int, *, left: bool) -> str:
    pad = " " * (width - cells(text))
    return text + pad if left else pad + text
