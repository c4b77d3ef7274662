r"""Tables of pipes, each cell with its place.

markdown-it finds the tables and their rows. A row is split here, at each `|` without a backslash
before it; `\|` is a `|` in the cell.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Literal

from markdown_it.common.utils import MD_TRIM_CHARS

from coursebuild.core.model import Cell, Inline, Table
from coursebuild.core.syntax.spans import PositionedToken, trim
from coursebuild.core.text.diagnostics import Diagnostic, diagnose
from coursebuild.core.text.regex import regex
from coursebuild.core.text.source import Excerpt

_PIPE = regex(r"\\?\|")
_ALIGN: dict[object, Literal["left", "right", "center"]] = {
    "text-align:left": "left",
    "text-align:right": "right",
    "text-align:center": "center",
}


def read_table(
    tokens: Sequence[PositionedToken],
    at: int,
    base: Excerpt,
    inlines: Callable[[Excerpt], tuple[Inline, ...]],
    report: Callable[[Diagnostic], None],
) -> tuple[Table, int]:
    """The table whose opening token has the index `at`, and the index after its closing one."""
    opening = tokens[at]
    align: list[Literal["left", "right", "center"] | None] = []
    rows: list[PositionedToken] = []
    while (token := tokens[at]).type != "table_close":
        at += 1
        if token.type == "tr_open":
            rows.append(token)
        elif token.type == "th_open":
            align.append(_ALIGN.get(token.attrs.get("style")))
    cells = [_read_cells(base, row, len(align), inlines, report) for row in rows]
    span = base.span(opening.start, opening.end)
    return Table(span, tuple(align), cells[0], tuple(cells[1:])), at + 1


def _read_cells(
    base: Excerpt,
    row: PositionedToken,
    columns: int,
    inlines: Callable[[Excerpt], tuple[Inline, ...]],
    report: Callable[[Diagnostic], None],
) -> tuple[Cell, ...]:
    line = base.text[row.start : row.end]
    at = row.start + len(line) - len(line.lstrip(MD_TRIM_CHARS))
    end = row.start + len(line.rstrip(MD_TRIM_CHARS))
    parts: list[list[Excerpt]] = [[]]
    for pipe in _PIPE.finditer(base.text, at, end):
        parts[-1].append(base.slice(at, pipe.start()))
        if pipe[0] == "|":
            parts.append([])
            at = pipe.end()
        else:  # the pipe is text, without its backslash
            at = pipe.end() - 1
    parts[-1].append(base.slice(at, end))
    cells = [Excerpt.join(cell_parts) for cell_parts in parts]
    if not cells[0].text:
        del cells[0]
    if cells and not cells[-1].text:
        del cells[-1]
    cells = [trim(cell) for cell in cells]
    if any(cell.text for cell in cells[columns:]):
        message = f"this row has {len(cells)} cells and the header {columns}, so this is not shown"
        help = "write `\\|` for a `|` that is part of a cell, and `\\vert` for one in a formula"
        span = cells[columns].span().to(cells[-1].span())
        report(diagnose("table-cells", span, message, help=help))
    empty = Excerpt(base.source, "", ((0, base.offset(row.end)),))
    cells = [*cells, *[empty] * columns][:columns]
    return tuple([Cell(cell.span(), cell, inlines(cell)) for cell in cells])
