"""Text for a terminal: its width, and tables that fit."""

from __future__ import annotations

import re
import textwrap
import unicodedata
from collections.abc import Iterable, Iterator, Sequence

from msgspec import Struct


class Style(Struct, frozen=True):
    """How wide a terminal is, and whether it shows colours."""

    width: int = 100
    colour: bool = False

    def strong(self, text: str) -> str:
        """A text that stands out."""
        return f"\x1b[1m{text}\x1b[0m" if self.colour else text

    def wrap(self, text: str, indent: str = "") -> list[str]:
        """A text in lines that fit, if its words do; further lines hang.

        Words are never broken: a path or a command is copied as it stands.
        """
        return textwrap.wrap(
            text,
            self.width,
            initial_indent=indent,
            subsequent_indent=f"{indent}  ",
            break_long_words=False,
            break_on_hyphens=False,
        )

    def inner(self, indent: int) -> Style:
        """The same for what is indented."""
        return Style(self.width - indent, self.colour)


def printable(text: str) -> str:
    """A text that cannot change the terminal, whatever the names in it are."""
    parts = _STYLED.split(text)
    return "".join(p if n % 2 else "".join(map(_visible, p)) for n, p in enumerate(parts))


_STYLED = re.compile(r"(\x1b\[[01]m)")
"""What `Style.strong` puts around a text."""


def _visible(character: str) -> str:
    if character == "\n" or not unicodedata.category(character).startswith("C"):
        return character
    return "\ufffd"


def indented(lines: Iterable[str]) -> list[str]:
    """Lines with spaces before them."""
    return [f"    {line}".rstrip() for line in lines]


def count_text(count: int, noun: str) -> str:
    """A number of things."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def fitted_table(columns: Sequence[tuple[str, Sequence[str]]], width: int) -> Iterator[str]:
    """Columns, titles first, as wide as their longest cell; those without any are left out.

    What has no room is named below.
    """
    filled = [(title, cells) for title, cells in columns if any(cell.strip() for cell in cells)]
    fitting: list[tuple[str, Sequence[str], int]] = []
    left: list[str] = []
    room = width
    for title, cells in filled:
        wide = max(len(title), *map(len, cells)) + 2
        if fitting and wide > room + 2:
            left.append(title)
            continue
        fitting.append((title, cells, wide))
        room -= wide
    for row in range(-1, len(fitting[0][1]) if fitting else -1):
        cells = [(title if row < 0 else cells[row]).ljust(wide) for title, cells, wide in fitting]
        yield "".join(cells).rstrip()
    if left:
        yield f"no room for: {'; '.join(left)}; the JSON has all"
