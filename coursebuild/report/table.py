"""Tables for terminals: aligned, with the columns that have room.

Entry point: `table(columns, width)`.
"""

from __future__ import annotations

import unicodedata
from collections.abc import Sequence

from msgspec import Struct

from coursebuild.report.text import visible

_GAP = "  "


class Column(Struct, frozen=True):
    """A column with its cells from top to bottom."""

    title: str
    cells: tuple[str, ...]
    rank: int
    """Those of low rank come first where there is no room for all; 0 is always there."""
    left: bool = False
    """Words stand at the left, numbers at the right."""

    @property
    def width(self) -> int:
        """Cells of the terminal that it takes."""
        return max(cells_of(text) for text in (self.title, *self.cells))


def table(columns: Sequence[Column], width: int) -> list[str]:
    """The titles and the rows as lines, no wider than `width` where that can be.

    Columns without any text are left out.
    """
    shown = _fitting([_safe(c) for c in columns if any(cell.strip() for cell in c.cells)], width)
    count = max((len(column.cells) for column in shown), default=0)
    lines = [_GAP.join(_padded(column.title, column) for column in shown)]
    for n in range(count):
        lines.append(_GAP.join(_padded(column.cells[n], column) for column in shown))
    return [line.rstrip() for line in lines]


def _fitting(columns: Sequence[Column], width: int) -> list[Column]:
    """The columns of rank 0, and as many of the others as there is room for, low ranks first."""
    kept = {n for n, column in enumerate(columns) if column.rank == 0}
    order = sorted(range(len(columns)), key=lambda n: (columns[n].rank, n))
    for n in order:
        tried = [column for m, column in enumerate(columns) if m in kept or m == n]
        if _width(tried) <= width:
            kept.add(n)
    return [column for n, column in enumerate(columns) if n in kept]


def cells_of(text: str) -> int:
    """Cells of a terminal that a text takes."""
    wide = sum(2 if unicodedata.east_asian_width(c) in "WF" else 1 for c in text)
    return wide - sum(1 for c in text if unicodedata.combining(c))


def _safe(column: Column) -> Column:
    cells = tuple(visible(cell) for cell in column.cells)
    return Column(column.title, cells, column.rank, column.left)


def _width(columns: Sequence[Column]) -> int:
    return sum(column.width for column in columns) + len(_GAP) * (len(columns) - 1)


def _padded(text: str, column: Column) -> str:
    pad = " " * (column.width - cells_of(text))
    return text + pad if column.left else pad + text
