"""Recorded tables: does each row stand in a line of the output?

1. A body row's cells, as plain text, must stand in order in one printed line, white space folded;
   each row in a line further down than the row before. All other lines are free. A header is, too,
   but for a unit in brackets, which is not another one than is printed behind the numbers.
2. Cells match whole words and whole numbers only: `4` not in `14`. Numbers match by the
   comparison's mode.
3. Where a row has no such line, rows and lines are aligned; a row that fits a line except for its
   numbers has drifted, and each of its numbers is compared with the nearest printed one.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from functools import cache, partial
from itertools import islice

from msgspec import Struct

from coursebuild.core import model
from coursebuild.core.model.results import Change, DriftKind, Verdict
from coursebuild.core.scripts.align import MATCH, pair
from coursebuild.core.scripts.diff import number_change
from coursebuild.core.scripts.lines import (
    CanonicalText,
    SameNumber,
    Side,
    always_match,
    canonicalize,
    numbers_fit,
    plain_text,
    same_number,
)
from coursebuild.core.scripts.table_cells import RowCell, cell_text, table_rows
from coursebuild.core.text.numbers import Number, relative_error
from coursebuild.core.text.source import Span
from coursebuild.core.text.units import units_at

_HEADER_UNIT = re.compile(r"[(\[]([^()\[\]]+)[)\]]\Z")
HEADER_HELP = "write the unit that is printed, or put the columns in order"
_ALIKE_WEIGHT = 6
_PLACES = 64


class RowMatch(Struct, frozen=True):
    """A row of a table and the line that it stands in; `line` is -1 where there is none.

    Where some of its numbers differ from the line's, `pairs` holds each cell, its recorded number
    and the printed one.
    """

    row: tuple[RowCell, ...]
    line: int
    pairs: tuple[tuple[RowCell, Number, Number], ...]


def compare_table(
    recording: model.Recording, table: model.Table, comparison: model.Comparison, stdout: str
) -> Verdict:
    """The verdict on a recorded table."""
    rows, printed = table_rows(table, comparison.filters), Side.of(stdout, comparison.filters)
    changes: list[Change] = []
    matcher = TableMatcher(rows, printed, comparison)
    matches = matcher.match()
    for match in matches:
        if match.line < 0:
            first, last = match.row[0].cell.span, match.row[-1].cell.span
            changes.append(Change(DriftKind.MISSING, first.to(last), _row_text(match.row), ""))
        for cell, old, new in match.pairs:
            if not same_number(old, new, comparison):
                span = cell.span(old)
                changes.append(number_change(span, span.text, new.text, (old, new)))
    if not changes:
        changes += unit_changes(table, matches, matcher)
    return Verdict(recording, comparison, "drift" if changes else "verified", tuple(changes))


def unit_changes(
    table: model.Table, matches: Iterable[RowMatch], matcher: TableMatcher
) -> Iterator[Change]:
    """Units in the brackets of a header that are not those printed behind the column's numbers."""
    columns = {id(cell): at for row in table.rows for at, cell in enumerate(row)}
    printed: dict[int, list[tuple[str, int]]] = {}
    for match in matches:
        for cell, _, number in matcher.pairs(match.row, match.line):
            place = matcher.lines[match.line], number.end
            printed.setdefault(columns[id(cell.cell)], []).append(place)
    for column, places in sorted(printed.items()):
        header = cell_text(table.header[column], ())
        unit = _HEADER_UNIT.search(header.text)
        shown_units = frozenset() if unit is None else units_at(unit[1])
        units = [units_at(line, end) for line, end in places]
        if unit is not None and shown_units and all(u and u.isdisjoint(shown_units) for u in units):
            span = Span(table.span.source, *header.origin(*unit.span(1)))
            word = places[0][0][places[0][1] :].split()[0].rstrip(".,;:)]")
            yield Change(DriftKind.TEXT, span, unit[1], word)


def _row_text(row: Sequence[RowCell]) -> str:
    return "  ".join(cell.mapped.text for cell in row)


class TableMatcher:
    """Matches the rows of one table with the lines of one output."""

    def __init__(
        self, rows: Sequence[tuple[RowCell, ...]], printed: Side, comparison: model.Comparison
    ) -> None:
        self.rows = rows
        self._numbers_match = partial(same_number, comparison=comparison)
        self.lines = [plain_text(text) for text in printed.lines]
        self._canonical_line = cache(lambda line: canonicalize(self.lines[line]))

    def match(self) -> tuple[RowMatch, ...]:
        """The line of each row: with its numbers if possible, else with the rest of it."""
        lines = self.find_matching_lines()
        if lines is None:
            lines = [-1] * len(self.rows)
            for number, line in pair([_row_text(r) for r in self.rows], self.lines, self._weight):
                lines[number] = line
        matches: list[RowMatch] = []
        for row, line in zip(self.rows, lines, strict=True):
            if line < 0 or self._matches(row, line):
                matches.append(RowMatch(row, line, ()))
            else:
                matches.append(RowMatch(row, line, self.pairs(row, line)))
        return tuple(matches)

    def pairs(
        self, row: tuple[RowCell, ...], line: int
    ) -> tuple[tuple[RowCell, Number, Number], ...]:
        """Each number of a row that fits a line, with its cell and the printed one."""
        canonical = self._canonical_line(line)
        places = _nearest_places(row, canonical, self._numbers_match)
        return tuple(
            (cell, recorded, printed)
            for cell, place in zip(row, places, strict=True)
            for recorded, printed in zip(
                cell.canonical.numbers, canonical.numbers_at(cell.canonical, place), strict=True
            )
        )

    def find_matching_lines(self) -> list[int] | None:
        """A line for each row, in order, if all of them match."""
        line_numbers: list[int] = []
        first_line = 0
        for row in self.rows:
            lines = range(first_line, len(self.lines))
            line = next((n for n in lines if self._matches(row, n)), None)
            if line is None:
                return None
            line_numbers.append(line)
            first_line = line + 1
        return line_numbers

    def _matches(self, row: Sequence[RowCell], line: int) -> bool:
        return _stands_in(row, self._canonical_line(line), self._numbers_match)

    def _weight(self, row: int, line: int) -> int:
        if self._matches(self.rows[row], line):
            return MATCH
        is_alike = _stands_in(self.rows[row], self._canonical_line(line), always_match)
        return _ALIKE_WEIGHT if is_alike else 0


def _is_word(character: str) -> bool:
    return character.isalnum() or character == "_"


def _find_places(
    cell: CanonicalText, line: CanonicalText, start: int, numbers_match: SameNumber
) -> Iterator[int]:
    """Offsets from `start` on at which a cell stands in a line, whole words and numbers only."""
    text, cell_text = line.skeleton, cell.skeleton
    place = text.find(cell_text, start)
    while place >= 0:
        end = place + len(cell_text)
        splits_word = (place > 0 and _is_word(cell_text[0]) and _is_word(text[place - 1])) or (
            end < len(text) and _is_word(cell_text[-1]) and _is_word(text[end])
        )
        if not splits_word and numbers_fit(cell, line, place, numbers_match):
            yield place
        place = text.find(cell_text, place + 1)


def _stands_in(row: Sequence[RowCell], line: CanonicalText, numbers_match: SameNumber) -> bool:
    """Whether the cells stand in a line in order, each after the one before."""
    at = 0
    for cell in row:
        place = next(_find_places(cell.canonical, line, at, numbers_match), None)
        if place is None:
            return False
        at = place + len(cell.canonical.skeleton)
    return True


def _nearest_places(
    row: Sequence[RowCell], line: CanonicalText, numbers_match: SameNumber
) -> list[int]:
    """Places in order for cells that fit the line, such that their numbers are nearest to its."""
    # For each place of the last cell: the cost so far, the places, the offset where it ends.
    best: list[tuple[float, list[int], int]] = [(0.0, [], 0)]
    for cell in row:
        extended: list[tuple[float, list[int], int]] = []
        start = min(end for _, _, end in best)
        for place in islice(_find_places(cell.canonical, line, start, always_match), _PLACES):
            before = [way for way in best if way[2] <= place]
            if before:
                cost, places, _ = min(before, key=lambda way: way[0])
                # The numbers' relative errors, each at most 1
                for recorded, printed in zip(
                    cell.canonical.numbers, line.numbers_at(cell.canonical, place), strict=True
                ):
                    if not numbers_match(recorded, printed):
                        error = relative_error(recorded.value, printed.value)
                        cost += 0.01 + (1.0 if error is None else min(1.0, float(error)))
                end = place + len(cell.canonical.skeleton)
                extended.append((cost, [*places, place], end))
        best = extended
    return min(best, key=lambda way: way[0])[1]
