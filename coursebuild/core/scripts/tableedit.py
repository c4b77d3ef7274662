"""A recorded table, brought up to date number by number.

Entry point: `update_table`.

Where a row fits a line except for its numbers, these are replaced in place; a U+2212 minus stays.
Under `digits` a number keeps as many decimals as the author showed. A row that fits no line is
refused: which line it was meant to show cannot be known.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import zip_longest

from msgspec.structs import replace

from coursebuild.core.model import Comparison, Mode, Recording, Table
from coursebuild.core.scripts.lines import canonicalize, same_number
from coursebuild.core.scripts.mapped_text import Side, replace_ranges
from coursebuild.core.scripts.numbers import Number, round_like
from coursebuild.core.scripts.repeat import instability_diagnostic
from coursebuild.core.scripts.tables import RowCell, RowMatch, TableMatcher, table_rows
from coursebuild.core.text.diagnostics import Diagnostic, Edit, diagnose
from coursebuild.core.text.source import Span

MINUS = "\u2212"
_BY_HAND = "bring the row up to date by hand"


def update_table(
    recording: Recording,
    table: Table,
    comparison: Comparison,
    first: str,
    second: str,
) -> Edit | Diagnostic | None:
    """What to write into a recorded table; see `edit.update_body`."""
    filters = comparison.filters
    printed, repeated = Side.of(first, filters), Side.of(second, filters)
    if comparison.mode is Mode.VOLATILE:
        comparison = Comparison()
    matches = TableMatcher(table_rows(table, filters), printed, comparison).match()
    rows: list[tuple[RowCell, ...]] = []
    edits: list[Edit] = []
    for match in matches:
        row = _update_row(match, comparison)
        if isinstance(row, Diagnostic):
            return row
        cells, row_edits = row
        rows.append(cells)
        edits += row_edits
    if TableMatcher(rows, printed, comparison).find_matching_lines() is None:
        span = table.span if not edits else edits[0].span
        return _refuse(span, "the table cannot be made to match what the script prints")
    if TableMatcher(rows, repeated, comparison).find_matching_lines() is None:
        return instability_diagnostic(recording, printed, repeated, comparison)
    return _join_edits(edits) if edits else None


def _update_row(
    match: RowMatch, comparison: Comparison
) -> tuple[tuple[RowCell, ...], list[Edit]] | Diagnostic:
    """A row with the numbers of its line, and the edits that make it so."""
    if match.line < 0:
        span = match.row[0].cell.span.to(match.row[-1].cell.span)
        return _refuse(span, "no line of this run has the cells of this row in order")
    edits: list[Edit] = []
    places: dict[int, list[tuple[int, int, str]]] = {id(cell): [] for cell in match.row}
    for cell, recorded, printed in match.pairs:
        if same_number(recorded, printed, comparison):
            continue
        span = cell.span(recorded)
        if span.text.replace(MINUS, "-") != recorded.text:
            return _refuse(span, "a number written with an entity or an escape cannot be replaced")
        new = _format_like(recorded, printed, comparison)
        places[id(cell)].append((recorded.start, recorded.end, new))
        edits.append(Edit(span, _with_signs_of(span.text, new)))
    texts = ((cell, replace_ranges(cell.mapped.text, places[id(cell)])) for cell in match.row)
    return tuple(replace(cell, canonical=canonicalize(text)) for cell, text in texts), edits


def _with_signs_of(old: str, new: str) -> str:
    """The new number with the minus signs of the old one: before it, and in its exponent."""
    parts = zip_longest(*(re.split("(?=[eE])", text) for text in (old, new)), fillvalue="")
    return "".join(part.replace("-", MINUS) if MINUS in like else part for like, part in parts)


def _format_like(recorded: Number, printed: Number, comparison: Comparison) -> str:
    """A printed number as the table shows it."""
    if comparison.mode is Mode.DIGITS and recorded.is_inexact and printed.place < recorded.place:
        return round_like(recorded, printed.value) or printed.text
    return printed.text


def _join_edits(edits: Sequence[Edit]) -> Edit:
    """One edit that does what several do, in order."""
    whole = edits[0].span.to(edits[-1].span)
    at = whole.start
    places = ((edit.span.start - at, edit.span.end - at, edit.text) for edit in edits)
    return Edit(whole, replace_ranges(whole.text, places))


def _refuse(span: Span, message: str) -> Diagnostic:
    return diagnose("output-not-updatable", span, message, help=_BY_HAND)
