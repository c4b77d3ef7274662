r"""Callouts and tables, each part with its place.

markdown-it finds the tables and their rows. A row is split here, at each `|` without a backslash
before it; `\|` is a `|` in the cell.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Sequence
from typing import Literal

from markdown_it.common.utils import MD_TRIM_CHARS
from msgspec import Struct

from coursebuild.core.model import Cell, Inline, Table
from coursebuild.core.syntax.spans import PositionedToken, trim
from coursebuild.core.text.diagnostics import (
    Diagnostic,
    Fix,
    Parsed,
    diagnose,
    did_you_mean,
)
from coursebuild.core.text.source import Excerpt, Span

_HEAD = re.compile(r"\[!([^\]\n]*)\](?![(\[])(-?)([^\n]*)(?:\n|$)")
FALLBACK = "note"
"""The kind that a callout of an unknown kind gets, so that its content is still checked."""


class Head(Struct, frozen=True):
    """The first line of a callout, and what follows it in its paragraph."""

    kind: str
    kind_span: Span
    title: Excerpt
    folded: bool
    rest: Excerpt


def read_head(paragraph: Excerpt, kinds: Collection[str]) -> Parsed[Head] | None:
    """The head of a callout, if a quotation's first paragraph begins with one of `kinds`."""
    match = _HEAD.match(paragraph.text)
    if match is None:
        return None
    name, kind, diagnostic = trim(paragraph.slice(*match.span(1))), FALLBACK, None
    if match[3][:1].strip():
        start = match.start(3)
        message = f"`{match[3][0]}` cannot follow the kind of a callout"
        help = "write `[!kind] Title`, or `[!kind]- Title` for a callout that starts folded"
        help = Fix(help, "" if match[3][0] == "+" else None, safe=True)  # it starts unfolded
        place = paragraph.span(start, start + 1)
        diagnostic = diagnose("callout-unknown", place, message, help=help)
    elif name.text.lower() in kinds:
        kind = name.text.lower()
    else:
        choice = ", ".join(f"`{kind}`" for kind in sorted(kinds))
        message = "the kind of this callout is missing"
        message = f"no callout kind `{name.text}`" if name.text else message
        help = did_you_mean(name.text.lower(), kinds) or f"known: {choice}"
        diagnostic = diagnose("callout-unknown", name.span(), message, help=help)
    title, rest = trim(paragraph.slice(*match.span(3))), trim(paragraph.slice(match.end()))
    head = Head(kind, name.span(), title, bool(match[2]), rest)
    return Parsed(head, () if diagnostic is None else (diagnostic,))


_PIPE = re.compile(r"\\?\|")
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
