r"""Tables: the rule that finds them, their rows and cells, each with its place.

Entry points: `table`, the block rule; `read_table`; `split_row`.

The rule takes what markdown-it's own takes, and makes a token for each row; that one makes three
for each cell, without places. A row is split where it is read: at each `|` that no backslash stands
before, while `\|` is a `|` in the cell.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Literal

from markdown_it.common.utils import MD_TRIM_CHARS
from markdown_it.rules_block import StateBlock
from markdown_it.rules_block.table import MAX_AUTOCOMPLETED_CELLS

from coursebuild.core.model import Cell, Inline, Table
from coursebuild.core.syntax.spans import PositionedToken, SourceSlice, locate, trimmed
from coursebuild.core.text.diagnostics import Diagnostic, diagnose
from coursebuild.core.text.patterns import pattern
from coursebuild.core.text.source import Excerpt

Align = Literal["left", "right", "center"]

_DELIMITERS = pattern(r"(?:[|:][|: \t-]|-[|:-])[|: \t-]*")
_COLUMN = pattern(r"(:?)-+(:?)")
_PIPE = pattern(r"(?<!\\)\|")
_ALIGN: dict[tuple[str, str], Align | None] = {
    ("", ""): None,
    (":", ""): "left",
    ("", ":"): "right",
    (":", ":"): "center",
}


def table(state: StateBlock, start_line: int, end_line: int, silent: bool) -> bool:
    """The block rule: `table_open`, whose `meta` has the columns, a `tr_open` a row, `table_close`.

    markdown-it's own, which follows https://github.github.com/gfm/#tables-extension-.
    """
    below = start_line + 1
    if below >= end_line or state.sCount[below] < state.blkIndent or state.is_code_block(below):
        return False
    align = _columns(_line(state, below))
    if align is None or state.is_code_block(start_line):
        return False
    head = _line(state, start_line).strip(MD_TRIM_CHARS)
    if "|" not in head or not align or _count(head) != len(align):
        return False
    if silent:
        return True
    before, state.parentType = state.parentType, "table"
    opened = state.push("table_open", "table", 1)
    opened.meta["align"] = align
    _add_row(state, start_line)
    line = _add_rows(state, start_line + 2, end_line, len(align))
    opened.map = [start_line, line]
    state.push("table_close", "table", -1)
    state.parentType, state.line = before, line
    return True


def _line(state: StateBlock, line: int) -> str:
    return state.src[state.bMarks[line] + state.tShift[line] : state.eMarks[line]]


def _columns(line: str) -> tuple[Align | None, ...] | None:
    """What a delimiter row says of each column; `None` where the line is none."""
    if _DELIMITERS.fullmatch(line) is None:
        return None
    parts = [part.strip(MD_TRIM_CHARS) for part in line.split("|")]
    parts = [part for i, part in enumerate(parts) if part or 0 < i < len(parts) - 1]
    found = [_COLUMN.fullmatch(part) for part in parts]
    align = tuple(_ALIGN[one[1], one[2]] for one in found if one is not None)
    return align if len(align) == len(found) else None


def _count(row: str) -> int:
    """How many cells a row has, without the pipes at its ends."""
    cells = _PIPE.split(row)
    if cells and not cells[0]:
        cells.pop(0)
    if cells and not cells[-1]:
        cells.pop()
    return len(cells)


def _add_rows(state: StateBlock, line: int, end: int, columns: int) -> int:
    """Add the rows from a line on; gives the line after them."""
    rules = state.md.block.ruler.getRules("blockquote")
    completed = 0
    while line < end and state.sCount[line] >= state.blkIndent:
        if any(rule(state, line, end, True) for rule in rules):
            break
        row = _line(state, line).strip(MD_TRIM_CHARS)
        if not row or state.is_code_block(line):
            break
        completed += columns - _count(row)
        if completed > MAX_AUTOCOMPLETED_CELLS:
            break
        _add_row(state, line)
        line += 1
    return line


def _add_row(state: StateBlock, line: int) -> None:
    state.push("tr_open", "tr", 0).map = [line, line + 1]


def read_table(
    tokens: Sequence[PositionedToken],
    at: int,
    base: Excerpt,
    inlines: Callable[[Excerpt], tuple[Inline, ...]],
    report: Callable[[Diagnostic], None],
) -> tuple[Table, int]:
    """The table whose opening token has the index `at`, and the index after its closing one."""
    opened = tokens[at]
    align: tuple[Align | None, ...] = opened.meta["align"]
    rows: list[tuple[Cell, ...]] = []
    at += 1
    while (row := tokens[at]).type == "tr_open":
        at += 1
        cells = split_row(base, row.start, row.end)
        if any(cell.text for cell in cells[len(align) :]):
            report(_too_many(cells, len(align)))
        cells = cells[: len(align)]
        if len(cells) < len(align):
            empty = Excerpt(base.source, "", ((0, base.offset(row.end)),))
            cells += [empty] * (len(align) - len(cells))
        rows.append(tuple([Cell(cell.span(), cell, inlines(cell)) for cell in cells]))
    span = base.span(opened.start, opened.end)
    return Table(span, align, rows[0], tuple(rows[1:])), at + 1


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
    cells: list[list[SourceSlice]] = []
    rows: list[SourceSlice] = []
    begin = 0
    i = text.find("|")
    while i >= 0:
        if i > 0 and text[i - 1] == "\\":
            rows.append(SourceSlice(text[begin : i - 1], at + begin))
            begin = i
        else:
            cells.append([*rows, SourceSlice(text[begin:i], at + begin)])
            rows, begin = [], i + 1
        i = text.find("|", i + 1)
    cells.append([*rows, SourceSlice(text[begin:], at + begin)])
    found = [locate(base, cell) for cell in cells]
    if found and not found[0].text:
        found.pop(0)
    if found and not found[-1].text:
        found.pop()
    return [trimmed(cell) for cell in found]
