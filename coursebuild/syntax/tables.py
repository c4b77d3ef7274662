r"""Tables: rows and cells, each with its place.

Entry points: `read_table`, `split_row`.

markdown-it's table rule keeps no positions in a row, so a row is split here again by its rules: at
each `|` that no backslash stands before, while `\|` is a `|` in the cell.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Literal, cast

from markdown_it.common.utils import MD_TRIM_CHARS

from coursebuild.diagnostics import Diagnostic, diagnose
from coursebuild.model import Cell, Inline, Table
from coursebuild.source import Excerpt
from coursebuild.syntax.spans import Placed, Row, locate, trimmed

Align = Literal["left", "right", "center"]


def read_table(
    tokens: Sequence[Placed],
    at: int,
    base: Excerpt,
    inlines: Callable[[Excerpt], tuple[Inline, ...]],
    report: Callable[[Diagnostic], None],
) -> tuple[Table, int]:
    """The table whose opening token has the index `at`, and the index after its closing one."""
    opened = tokens[at]
    rows: list[tuple[Cell, ...]] = []
    align: list[Align | None] = []
    row = opened
    while (token := tokens[at]).type != "table_close":
        at += 1
        if token.type == "th_open":
            style = str(token.attrs.get("style", ""))
            align.append(cast(Align, style.removeprefix("text-align:")) if style else None)
        elif token.type == "tr_open":
            row = token
        elif token.type == "tr_close":
            cells = split_row(base, row.start, row.end)
            if any(cell.text for cell in cells[len(align) :]):
                report(_too_many(cells, len(align)))
            cells = cells[: len(align)]
            empty = Excerpt(base.source, "", ((0, base.offset(row.end)),))
            cells += [empty] * (len(align) - len(cells))
            rows.append(tuple(Cell(cell.span(), cell, inlines(cell)) for cell in cells))
    span = base.span(opened.start, opened.end)
    return Table(span, tuple(align), rows[0], tuple(rows[1:])), at + 1


def _too_many(cells: Sequence[Excerpt], wanted: int) -> Diagnostic:
    """The mistake of cells that stand beyond the header's last one."""
    message = f"this row has {len(cells)} cells and the header {wanted}, so this is not shown"
    help = "write `\\|` for a `|` that is part of a cell, and `\\vert` for one in a formula"
    return diagnose("table-cells", cells[wanted].span().to(cells[-1].span()), message, help=help)


def split_row(base: Excerpt, start: int, end: int) -> list[Excerpt]:
    """The cells of the row that stands between two offsets of `base`."""
    line = base.text[start:end]
    at = start + len(line) - len(line.lstrip(MD_TRIM_CHARS))
    text = line.strip(MD_TRIM_CHARS)
    cells: list[list[Row]] = []
    rows: list[Row] = []
    begin = 0
    i = text.find("|")
    while i >= 0:
        if i > 0 and text[i - 1] == "\\":
            rows.append(Row(text[begin : i - 1], at + begin))
            begin = i
        else:
            cells.append([*rows, Row(text[begin:i], at + begin)])
            rows, begin = [], i + 1
        i = text.find("|", i + 1)
    cells.append([*rows, Row(text[begin:], at + begin)])
    found = [locate(base, cell) for cell in cells]
    if found and not found[0].text:
        found.pop(0)
    if found and not found[-1].text:
        found.pop()
    return [trimmed(cell) for cell in found]
