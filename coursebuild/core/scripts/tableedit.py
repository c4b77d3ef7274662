"""A recorded table, brought up to date number by number.

Entry point: `updated_table`.

The numbers of a row that fits a line but for them are replaced in place; a U+2212 minus stays one.
Under `digits` a number keeps as many decimals as the author showed. A row that fits no line is
refused: which line it was meant to show cannot be known.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import zip_longest

from msgspec.structs import replace

from coursebuild.core.model import Comparison, Filter, Mode, Recording, Table
from coursebuild.core.scripts.lines import canonical, same_number
from coursebuild.core.scripts.mapped_text import Side, replaced
from coursebuild.core.scripts.numbers import Number, round_like
from coursebuild.core.scripts.repeat import unstable
from coursebuild.core.scripts.tables import RowCell, RowMatch, TableMatcher, table_rows
from coursebuild.core.text.diagnostics import Diagnostic, Edit, diagnose
from coursebuild.core.text.source import Span

MINUS = "\u2212"
_BY_HAND = "bring the row up to date by hand"


def updated_table(
    recording: Recording,
    table: Table,
    comparison: Comparison,
    filters: tuple[Filter, ...],
    first: str,
    second: str,
) -> Edit | Diagnostic | None:
    """What to write into a recorded table; see `edit.updated_body`."""
    ran, again = Side.of(first, filters), Side.of(second, filters)
    if comparison.mode is Mode.VOLATILE:
        comparison = Comparison()
    matches = TableMatcher(table_rows(table, filters), ran, comparison).match()
    rows: list[tuple[RowCell, ...]] = []
    edits: list[Edit] = []
    for found in matches:
        row = _updated_row(found, comparison)
        if isinstance(row, Diagnostic):
            return row
        cells, changed = row
        rows.append(cells)
        edits += changed
    if TableMatcher(rows, ran, comparison).all_match() is None:
        where = table.span if not edits else edits[0].span
        return _refused(where, "the table cannot be made to match what the script prints")
    if TableMatcher(rows, again, comparison).all_match() is None:
        return unstable(recording, ran, again, comparison)
    return _joined(edits) if edits else None


def _updated_row(
    found: RowMatch, comparison: Comparison
) -> tuple[tuple[RowCell, ...], list[Edit]] | Diagnostic:
    """A row with the numbers of its line, and the edits that make it so."""
    if found.line < 0:
        span = found.row[0].cell.span.to(found.row[-1].cell.span)
        return _refused(span, "no line of this run has the cells of this row in order")
    edits: list[Edit] = []
    places: dict[int, list[tuple[int, int, str]]] = {id(cell): [] for cell in found.row}
    for cell, recorded, printed in found.pairs:
        if same_number(recorded, printed, comparison):
            continue
        span = cell.span(recorded)
        if span.text.replace(MINUS, "-") != recorded.text:
            return _refused(span, "a number written with an entity or an escape cannot be replaced")
        new = _written(recorded, printed, comparison)
        places[id(cell)].append((recorded.start, recorded.end, new))
        edits.append(Edit(span, _signed_like(span.text, new)))
    texts = ((cell, replaced(cell.mapped.text, places[id(cell)])) for cell in found.row)
    return tuple(replace(cell, canon=canonical(text)) for cell, text in texts), edits


def _signed_like(old: str, new: str) -> str:
    """The new number with the minus signs of the old one: before it, and in its exponent."""
    parts = zip_longest(*(re.split("(?=[eE])", text) for text in (old, new)), fillvalue="")
    return "".join(part.replace("-", MINUS) if MINUS in like else part for like, part in parts)


def _written(recorded: Number, printed: Number, comparison: Comparison) -> str:
    """A printed number as the table shows it."""
    if comparison.mode is Mode.DIGITS and recorded.inexact and printed.place < recorded.place:
        return round_like(recorded, printed.value) or printed.text
    return printed.text


def _joined(edits: Sequence[Edit]) -> Edit:
    """One edit that does what several do, in order."""
    whole = edits[0].span.to(edits[-1].span)
    at = whole.start
    places = ((edit.span.start - at, edit.span.end - at, edit.text) for edit in edits)
    return Edit(whole, replaced(whole.text, places))


def _refused(span: Span, message: str) -> Diagnostic:
    return diagnose("output-not-updatable", span, message, help=_BY_HAND)
