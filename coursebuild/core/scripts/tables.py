"""Recorded tables: does each row stand in a line of the output?

Entry points: `compare_table`, `table_rows`, `match_rows`, `rows_match`.

1. A body row's cells, as plain text, must stand in order in one line that ran, white space folded;
   the rows in order in lines further and further down. The header row and all other lines are free.
2. A cell stands only where whole words and whole numbers do: `4` not in `14`, `implicit` not in
   `implicitfast`. Numbers match by the comparison's mode.
3. Where a row has no such line, rows and lines are aligned; a row that fits a line but for its
   numbers has drifted, and each of its numbers is compared with the one that it is nearest to.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from msgspec import Struct

from coursebuild.core.model import Cell, Comparison, Filter, Recording, Table
from coursebuild.core.model.results import Change, DriftKind, Verdict
from coursebuild.core.scripts.celltext import cell_text, plain
from coursebuild.core.scripts.changes import number_change
from coursebuild.core.scripts.diff import shortened
from coursebuild.core.scripts.lines import (
    Canon,
    SameNumber,
    any_number,
    canonical,
    first_misfit,
    numbers_at,
    same_number,
)
from coursebuild.core.scripts.mapped_text import MappedText, Side
from coursebuild.core.scripts.numbers import Number, relative_error
from coursebuild.core.scripts.pairing import MATCH, Keys, pair
from coursebuild.core.text.source import Span

_ALIKE = 6
_CELLS = 40_000
_WINDOW = 1000
_PLACES = 64
_DIFF_ROWS = 20
_WIDTH = 160


class RowCell(Struct, frozen=True):
    """A cell of a recorded table."""

    cell: Cell
    mapped: MappedText
    canon: Canon

    def span(self, number: Number) -> Span:
        """Where a number of the cell stands in the lesson."""
        return Span(self.cell.span.source, *self.mapped.origin(number.start, number.end))


class RowMatch(Struct, frozen=True):
    """A row of a table and the line that it stands in; `line` is -1 where there is none.

    `pairs` are the numbers of the row, each with its cell and the printed one.
    """

    row: tuple[RowCell, ...]
    line: int
    pairs: tuple[tuple[RowCell, Number, Number], ...]


def table_rows(table: Table, filters: Iterable[Filter] = ()) -> tuple[tuple[RowCell, ...], ...]:
    """The body rows of a table; cells without text are left out."""
    rules = tuple(filters)
    rows = []
    for row in table.rows:
        cells = []
        for cell in row:
            mapped = cell_text(cell, rules)
            if mapped.text:
                cells.append(RowCell(cell, mapped, canonical(mapped.text)))
        rows.append(tuple(cells))
    return tuple(rows)


def match_rows(
    rows: Sequence[tuple[RowCell, ...]], ran: Side, comparison: Comparison
) -> tuple[RowMatch, ...]:
    """For each row the line that it stands in: with its numbers if it can be, else but for them."""
    return _Rows(rows, ran, comparison).match()


def rows_match(rows: Sequence[tuple[RowCell, ...]], ran: Side, comparison: Comparison) -> bool:
    """Whether every row stands in a line, in order, with its numbers."""
    return _Rows(rows, ran, comparison).all_match() is not None


def compare_table(
    recording: Recording,
    table: Table,
    comparison: Comparison,
    filters: tuple[Filter, ...],
    ran: Side,
) -> Verdict:
    """The verdict on a recorded table."""
    changes: list[Change] = []
    removed: list[str] = []
    line_starts = ran.line_starts()
    for found in match_rows(table_rows(table, filters), ran, comparison):
        differing = _row_changes(found, ran, comparison, line_starts)
        changes += differing
        if differing:
            removed.append("-" + shortened(_row_text(found.row), _WIDTH))
            if found.line >= 0:
                removed.append("+" + shortened(plain(ran.lines[found.line].text), _WIDTH))
    if not changes:
        return Verdict(recording, comparison, "verified")
    if len(removed) > 2 * _DIFF_ROWS:
        more = len(removed) - 2 * _DIFF_ROWS
        removed[2 * _DIFF_ROWS :] = [f"… and {more} more lines"]
    diff = "\n".join(("--- recorded", "+++ this run", *removed))
    return Verdict(recording, comparison, "drift", tuple(changes), diff)


def _row_text(row: Sequence[RowCell]) -> str:
    return "  ".join(cell.mapped.text for cell in row)


def _row_changes(
    found: RowMatch, ran: Side, comparison: Comparison, line_starts: Sequence[int]
) -> list[Change]:
    if found.line < 0:
        first, last = found.row[0].cell.span, found.row[-1].cell.span
        return [Change(DriftKind.MISSING, first.to(last), _row_text(found.row), "", 0)]
    ran_line = ran.raw_line(found.line, line_starts)
    changes = []
    for cell, recorded, printed in found.pairs:
        if not same_number(recorded, printed, comparison):
            span = cell.span(recorded)
            changes.append(
                number_change(span, span.text, printed.text, ran_line, (recorded, printed))
            )
    return changes


class _Rows:
    """Matches the rows of one table with the lines of one output."""

    def __init__(
        self, rows: Sequence[tuple[RowCell, ...]], ran: Side, comparison: Comparison
    ) -> None:
        self.rows = rows
        self.comparison = comparison
        self.lines = [plain(text) for text in ran.texts]
        self._canons: list[Canon | None] = [None] * len(self.lines)

    def match(self) -> tuple[RowMatch, ...]:
        lines = self.all_match() or self._aligned()
        return tuple(self._row_match(row, line) for row, line in zip(self.rows, lines, strict=True))

    def canon(self, line: int) -> Canon:
        found = self._canons[line]
        if found is None:
            found = self._canons[line] = canonical(self.lines[line])
        return found

    def same(self, recorded: Number, ran: Number) -> bool:
        return same_number(recorded, ran, self.comparison)

    def stands(self, row: int, line: int, same: SameNumber) -> bool:
        return _first_places(self.rows[row], self.canon(line), same) is not None

    def _next(self, row: int, start: int, stop: int, same: SameNumber) -> int:
        """The first line in `[start, stop)` that a row stands in, or -1."""
        lines = range(start, min(stop, len(self.lines)))
        return next((line for line in lines if self.stands(row, line, same)), -1)

    def all_match(self) -> list[int] | None:
        """A line for each row, if all of them match."""
        found: list[int] = []
        line = -1
        for row in range(len(self.rows)):
            if self.rows[row]:
                line = self._next(row, line + 1, len(self.lines), self.same)
                if line < 0:
                    return None
            found.append(line)
        return found

    def _aligned(self) -> list[int]:
        found = [-1] * len(self.rows)
        if len(self.rows) * len(self.lines) <= _CELLS:
            rows, lines = range(len(self.rows)), range(len(self.lines))
            free = [True] * (len(self.rows) + 1)
            for row, line in pair(Keys(rows, rows), Keys(lines, lines), self._weight, free):
                found[row] = line
            return found
        line = -1
        for row in range(len(self.rows)):
            for same in (self.same, any_number):
                place = self._next(row, line + 1, line + 1 + _WINDOW, same)
                if place >= 0:
                    found[row] = line = place
                    break
        return found

    def _weight(self, row: int, line: int) -> int:
        if not self.rows[row]:
            return 0
        if self.stands(row, line, self.same):
            return MATCH
        return _ALIKE if self.stands(row, line, any_number) else 0

    def _row_match(self, row: tuple[RowCell, ...], line: int) -> RowMatch:
        if line < 0 or not row:
            return RowMatch(row, 0 if not row else -1, ())
        canon = self.canon(line)
        places = _first_places(row, canon, self.same) or _nearest_places(row, canon, self.same)
        pairs = tuple(
            (cell, recorded, printed)
            for cell, place in zip(row, places, strict=True)
            for recorded, printed in zip(
                cell.canon.numbers, numbers_at(cell.canon, canon, place), strict=True
            )
        )
        return RowMatch(row, line, pairs)


def _is_word(character: str) -> bool:
    return character.isalnum() or character == "_"


def _places(cell: Canon, line: Canon, start: int, same: SameNumber) -> Iterable[int]:
    """Offsets from `start` on at which a cell stands in a line, whole words and numbers only."""
    text, wanted = line.skeleton, cell.skeleton
    place = text.find(wanted, start)
    while place >= 0:
        end = place + len(wanted)
        cuts = (place > 0 and _is_word(wanted[0]) and _is_word(text[place - 1])) or (
            end < len(text) and _is_word(wanted[-1]) and _is_word(text[end])
        )
        if not cuts and first_misfit(cell, line, place, same) is None:
            yield place
        place = text.find(wanted, place + 1)


def _first_places(row: Sequence[RowCell], line: Canon, same: SameNumber) -> list[int] | None:
    """Places of the cells in order, each the first after the one before."""
    found: list[int] = []
    at = 0
    for cell in row:
        place = next(iter(_places(cell.canon, line, at, same)), -1)
        if place < 0:
            return None
        found.append(place)
        at = place + len(cell.canon.skeleton)
    return found


def _nearest_places(row: Sequence[RowCell], line: Canon, same: SameNumber) -> list[int]:
    """Places of the cells in order such that their numbers are nearest to the line's.

    The row is known to stand in the line but for its numbers.
    """
    best: list[tuple[float, list[int], int]] = [(0.0, [], 0)]
    """For each place of the last cell: the cost so far, the places, the offset where it ends."""
    for cell in row:
        extended: list[tuple[float, list[int], int]] = []
        for place in _some_places(cell.canon, line, min(end for _, _, end in best)):
            fits = [way for way in best if way[2] <= place]
            if fits:
                cost, places, _ = min(fits, key=lambda way: way[0])
                total = cost + _cost(cell.canon, line, place, same)
                end = place + len(cell.canon.skeleton)
                extended.append((total, [*places, place], end))
        best = extended
    return min(best, key=lambda way: way[0])[1]


def _some_places(cell: Canon, line: Canon, start: int) -> list[int]:
    found: list[int] = []
    for place in _places(cell, line, start, any_number):
        found.append(place)
        if len(found) == _PLACES:
            break
    return found


def _cost(cell: Canon, line: Canon, place: int, same: SameNumber) -> float:
    """How far the numbers of a cell are from those of the line: relative errors, each at most 1."""
    cost = 0.0
    for recorded, ran in zip(cell.numbers, numbers_at(cell, line, place), strict=True):
        if not same(recorded, ran):
            error = relative_error(recorded.value, ran.value)
            cost += 0.01 + (1.0 if error is None else min(1.0, float(error)))
    return cost
