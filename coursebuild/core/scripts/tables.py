"""Recorded tables: which printed line each row is, and whether its cells are printed there.

1. A row may be any line that has its cells in order: whole words and whole numbers, whatever the
   numbers are. What is left of the line is its layout. The rows of a table have one layout, under
   one heading, in the order of the lines; where there is none, each row is taken by itself.
2. If all numbers are right in one layout, it is that. Among several the table means the one that is
   better in something and worse in nothing: rows that are right, words and units of the header that
   are printed with the numbers; if these are alike, the share of the line's numbers that the row
   shows. Where there is no such layout, the table is ambiguous.
3. Addresses that are remembered decide before all of this.
4. Numbers match by the comparison's mode. In the header a unit, or a word that names a printed
   number, must not be that of another one.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from functools import cache, partial
from itertools import islice

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core import model
from coursebuild.core.model.lesson_record import Address
from coursebuild.core.model.results import Change, DriftKind
from coursebuild.core.scripts.align import MATCH, pair
from coursebuild.core.scripts.lines import (
    MARK,
    CanonicalText,
    Side,
    always_match,
    canonicalize,
    plain_text,
)
from coursebuild.core.scripts.printed_text import PrintedLine, PrintedPlace, PrintedText
from coursebuild.core.scripts.table_cells import (
    ColumnTitle,
    LineLayout,
    PrintedName,
    RowCell,
    cell_matches,
    find_rows,
    misplaced_titles,
    number_text,
    row_text,
    squeeze,
    table_rows,
    words_of,
)
from coursebuild.core.text.numbers import Number, has_groups, relative_error, scan
from coursebuild.core.text.quantities import UnitText, are_different, title_of_column
from coursebuild.core.text.source import Span

_ALIKE_WEIGHT = 6
_PLACES = 200
"""The most ways to find a row in a line that are looked at."""
RowAddresses = tuple[tuple[Address, ...], ...]
"""For each row of a table the addresses of its numbers; none where they are not known."""


class RowMatch(Struct, frozen=True):
    """A row of a table and the line that it may stand in; `line` is -1 where there is none."""

    row: tuple[RowCell, ...]
    line: int = -1
    layout: LineLayout = LineLayout("", (), ())
    pairs: tuple[tuple[RowCell, Number, Number], ...] = ()
    """Each of its numbers with its cell and the printed one."""
    is_right: bool = False
    """Whether these match, with their units."""
    certain: bool = True
    """Whether no other line can be meant."""


class TableMatch(Struct, frozen=True):
    """The rows of a table with their lines."""

    rows: tuple[RowMatch, ...]
    rivals: tuple[str, ...] = ()
    """Lines, each of another layout, of which the table may mean any."""
    printed: int = 0
    """How many lines have the layout of the table."""


class TableMatcher:
    """Matches the rows of one table with the lines of one output."""

    def __init__(
        self,
        table: model.Table,
        comparison: model.Comparison,
        stdout: str,
        addresses: RowAddresses = (),
    ) -> None:
        printed_lines = Side.of(stdout, comparison.filters).lines
        printed = "\n".join(printed_lines)
        is_grouped = has_groups(printed)
        self.rows = table_rows(table, comparison.filters, printed)
        self.titles = [ColumnTitle.of(cell) for cell in table.header]
        self._addresses = addresses if len(addresses) == len(self.rows) else [()] * len(self.rows)
        self._numbers_match = partial(cell_matches, comparison=comparison)
        self.lines = [line.replace("\u2212", "-") for line in printed_lines]
        self.text = PrintedText(PrintedLine(line, None, is_grouped) for line in self.lines)

        def read(at: int) -> CanonicalText:
            line = canonicalize(self.lines[at], is_grouped=is_grouped)
            return replace(line, skeleton=plain_text(line.skeleton))

        self._canonical_line = cache(read)
        self._fits_of_row = cache(self._fits_at_address)

    def match(self) -> TableMatch:
        """The line of each row."""
        layouts = self._common_layouts() if self.rows else []
        if not layouts:
            return TableMatch(tuple(self._match_rows(None)))
        is_right = any(self._right_rows(layout) == len(self.rows) for layout in layouts)
        rivals: tuple[str, ...] = ()
        if layouts[1:]:
            lines = ((at.heading, self.lines[self._fits_in(0, at)[0].line]) for at in layouts)
            rivals = tuple(dict.fromkeys(plain_text(" / ".join(filter(None, p))) for p in lines))
        if rivals and not is_right:
            fits_of_rows = (
                [fit for layout in layouts for fit in self._fits_in(row, layout)]
                for row in range(len(self.rows))
            )
            nearest = (min(fits, key=_distance) for fits in fits_of_rows)
            return TableMatch(tuple(replace(fit, certain=False) for fit in nearest), rivals)
        matches = tuple(self._match_rows(layouts[0]))
        return TableMatch(matches, rivals, self._count_lines(layouts[0]))

    def addresses(self, match: TableMatch) -> RowAddresses:
        """The addresses of the numbers of each row; none of a row that has not all."""
        rows, lines = [], self.text.lines
        for row in match.rows:
            at = [
                PrintedPlace(self.text, row.line, (number,)).address
                for _, _, number in row.pairs
                if number in lines[row.line].numbers  # the 1 of a unit such as `1/min` is none
            ]
            rows.append(tuple(a for a in at if a is not None) if None not in at else ())
        return tuple(rows)

    # --- layouts

    def _common_layouts(self) -> list[LineLayout]:
        """The layouts that all rows have and that are not worse than another; the likeliest first.

        Where the numbers of some are right, also those that the header names better than these.
        """
        layouts = [
            layout
            for layout in dict.fromkeys(fit.layout for fit in self._fits_of_row(0))
            if all(self._fits_in(row, layout) for row in range(len(self.rows)))
        ]
        right = [layout for layout in layouts if self._right_rows(layout) == len(self.rows)]
        scores = {layout: self._score(layout) for layout in layouts}
        best = [
            layout
            for layout in right or layouts
            if not any(_dominates(scores[rival], scores[layout]) for rival in right or layouts)
        ]
        doubts = (
            layout
            for layout in (layouts if right else ())
            if layout not in right and scores[layout][1:3] > scores[best[0]][1:3]
        )
        return [*best, *doubts]

    def _fits_in(self, row: int, layout: LineLayout) -> list[RowMatch]:
        return [fit for fit in self._fits_of_row(row) if fit.layout == layout]

    def _right_rows(self, layout: LineLayout) -> int:
        rows = range(len(self.rows))
        return sum(any(fit.is_right for fit in self._fits_in(row, layout)) for row in rows)

    def _score(self, layout: LineLayout) -> tuple[float, ...]:
        """How well a layout suits the table, in several respects."""
        fit = self._fits_in(0, layout)[0]
        pairs, numbers = fit.pairs, self.text.lines[fit.line].numbers
        names = self._names(fit.line)
        labels = [name.text for name in names]
        places = [(cell.column, numbers.index(n)) for cell, _, n in pairs if n in numbers]
        units = {cell.column: cell.unit for cell in self.rows[0]}
        verdicts = [self.titles[c].names(labels, at, names[at].unit, units[c]) for c, at in places]
        share = len(pairs) / max(1, len(numbers))
        return self._right_rows(layout), verdicts.count(True), -verdicts.count(False), share

    def _names(self, at: int) -> list[PrintedName]:
        """What the numbers of the first row's line are called, but for what its cells hold.

        Wide gaps tell the titles above them apart.
        """
        titles = [squeeze(title.text) for title in self.titles if scan(title.text)]
        above = self.lines[:at] if titles else []
        above = [line for line in above if all(title in squeeze(line) for title in titles)]
        header = "".join(above[-1:])  # such as `25%  75%`, which has the look of a row
        cells = (re.escape(c.mapped.text) for c in self.rows[0] if not c.canonical.numbers)
        cell_pattern = re.compile(rf"(?<!\w)(?:{'|'.join(cells) or '(?!)'})(?!\w)")
        text, row, numbers = self.text, self.lines[at], self.text.lines[at].numbers
        names = [text.title(at, n) or title_of_column(row, n.start, header) for n in numbers]
        return [
            PrintedName(cell_pattern.sub(",", lead), title, n.text, text.unit(at, n))
            for lead, title, n in zip(text.leads(at), names, numbers, strict=True)
        ]

    def _count_lines(self, layout: LineLayout) -> int:
        """How many printed lines have a layout, whatever text their cells hold."""
        cells = [cell.canonical.skeleton for cell in self.rows[0]]
        patterns = [re.escape(cell) if MARK in cell else r"\S.*?" for cell in cells]
        parts = [re.escape(part) for part in layout.parts]
        pattern = re.compile("".join(a + b for a, b in zip(parts, [*patterns, ""], strict=True)))
        return sum(
            self.text.heading(line) == layout.heading
            and pattern.fullmatch(self._canonical_line(line).skeleton) is not None
            for line in range(len(self.lines))
        )

    # --- rows

    def _fits_at_address(self, row: int) -> tuple[RowMatch, ...]:
        """The way to find a row at its addresses; where they are gone, those that are right."""
        fits, addresses = tuple(self._find_fits(row)), self._addresses[row]
        if not addresses:
            return fits
        places = [self.text.find(address, 1) for address in addresses]
        at = [(place.at, place.numbers[0]) for place in places if place is not None]
        for fit in fits:
            numbers = self.text.lines[fit.line].numbers
            if at == [(fit.line, n) for _, _, n in fit.pairs if n in numbers]:
                return (fit,)
        return tuple(fit for fit in fits if fit.is_right)

    def _match_rows(self, layout: LineLayout | None) -> Iterator[RowMatch]:
        """Each row with its line, in order; only lines of this layout where one is given."""
        fits = [
            self._fits_of_row(row) if layout is None else self._fits_in(row, layout)
            for row in range(len(self.rows))
        ]
        lines = sorted({fit.line for fits_of_row in fits for fit in fits_of_row})

        def best(row: int, at: int) -> RowMatch | None:
            fits_there = [fit for fit in fits[row] if fit.line == lines[at]]
            return max(fits_there, key=self._weight, default=None)

        def weight(row: int, at: int) -> int:
            fit = best(row, at)
            return 0 if fit is None else self._weight(fit)

        texts = list(map(row_text, self.rows))
        places = dict(pair(texts, [self.lines[line] for line in lines], weight))
        matches = [best(row, places[row]) if row in places else None for row in range(len(fits))]
        are_all = layout is not None and len(lines) == len(self.rows)
        are_only = [len({fit.line for fit in fits_of_row}) == 1 for fits_of_row in fits]
        are_named = all(
            fit is not None and (are_only[row] or self._is_named(fit, fits[row]))
            for row, fit in enumerate(matches)
        )
        for row, fit in enumerate(matches):
            if fit is None:
                yield RowMatch(self.rows[row])
            else:
                is_certain = fit.is_right or are_only[row] or are_all or are_named
                yield replace(fit, certain=is_certain)

    def _is_named(self, fit: RowMatch, fits: Iterable[RowMatch]) -> bool:
        """Whether the first number of a row is that of this line and of no other."""
        lines = {
            candidate.line
            for candidate in fits
            for _, old, new in candidate.pairs[:1]
            if self._numbers_match(old, new)
        }
        return lines == {fit.line}

    def _weight(self, fit: RowMatch) -> int:
        """Less for a row more of whose numbers differ."""
        if fit.is_right:
            return MATCH
        count = sum(self._numbers_match(old, new) for _, old, new in fit.pairs)
        return 2 + (_ALIKE_WEIGHT - 2) * count // max(1, len(fit.pairs))

    def _find_fits(self, row: int) -> Iterator[RowMatch]:
        """The ways to find a row, those first in which its numbers match."""
        cells = self.rows[row]
        for line in range(len(self.lines)):
            canonical = self._canonical_line(line)
            places = dict.fromkeys(find_rows(cells, canonical, 0, self._numbers_match), True)
            for way in islice(find_rows(cells, canonical, 0, always_match), _PLACES):
                places.setdefault(way, False)
            for way, is_right in places.items():
                parts, pairs, at = [], list[tuple[RowCell, Number, Number]](), 0
                for cell, place in zip(cells, way, strict=True):
                    numbers = canonical.numbers_at(cell.canonical, place)
                    matches = zip(cell.canonical.numbers, numbers, strict=True)
                    pairs += ((cell, old, new) for old, new in matches)
                    parts.append(canonical.skeleton[at:place])
                    at = place + len(cell.canonical.skeleton)
                parts.append(canonical.skeleton[at:])
                columns = tuple(cell.column for cell in cells)
                layout = LineLayout(self.text.heading(line), tuple(parts), columns)
                match = RowMatch(cells, line, layout, tuple(pairs))
                is_right = is_right and not any(self.unit_changes(match))
                yield replace(match, is_right=is_right)

    # --- the header

    def header_changes(self, match: TableMatch) -> Iterator[Change]:
        """Units of the header that are not those of its numbers, and titles of other numbers."""
        for column, units in sorted(self._column_units(match).items()):
            title = self.titles[column]
            unlike = next((unit for unit in units if are_different(title.unit, unit)), None)
            if unlike is not None:
                yield Change(DriftKind.TEXT, title.unit_span, title.unit.text, unlike.text)
        for title, reading, is_certain in self.misplaced_titles(match):
            if is_certain:
                yield Change(DriftKind.TEXT, title.span, title.text, reading)

    def unit_changes(self, match: RowMatch) -> Iterator[Change]:
        """Units of cells that are not those of their numbers."""
        for cell, unit in self._cell_units(match):
            if are_different(cell.unit, unit):
                yield Change(DriftKind.TEXT, cell.unit_span, cell.unit.text, unit.text)

    def _cell_units(self, match: RowMatch) -> Iterator[tuple[RowCell, UnitText]]:
        """The cells of a row that have units, with those that are printed."""
        pairs = {cell.column: (cell, new) for cell, _, new in match.pairs if cell.unit}
        for cell, new in pairs.values():  # with its last number
            yield cell, self.text.unit(match.line, new)

    def misplaced_titles(self, match: TableMatch) -> Iterator[tuple[ColumnTitle, str, bool]]:
        """The titles of other numbers, each with what is printed, and whether it is certain."""
        for row in (row for row in match.rows[:1] if row.pairs):
            line, numbers = self.lines[row.line], self.text.lines[row.line].numbers
            pairs = [(cell.column, n) for cell, _, n in reversed(row.pairs) if n in numbers]
            places = {column: numbers.index(number) for column, number in pairs}
            if not places:
                return
            names = self._names(row.line)
            # Where the first number has no name, and words stand behind the last, they all do.
            tail = line[numbers[-1].end :]
            are_behind = bool(words_of(tail)) and not names[0].text
            words = [name.above.rpartition("_")[0] for name in names]  # `mass_kg`
            words = [*(name.before for name in names[1:]), tail] if are_behind else words
            likely = [n._replace(above=w.strip(" ,;")) for n, w in zip(names, words, strict=True)]
            verdicts = [*misplaced_titles(self.titles, likely, places)]
            verdicts_before = [*misplaced_titles(self.titles, names, places)]
            is_unit = bool(names[-1].unit) and not verdicts_before  # no name stands behind the last
            if is_unit or len(verdicts) < 2:  # in one column alone it is a remark
                likely, verdicts = names, verdicts_before
            for column, at, is_certain in verdicts:
                if is_certain or not are_behind:
                    yield self.titles[column], likely[at].reading, is_certain

    def unprinted_units(self) -> Iterator[tuple[Span, str]]:
        """The titles and cells whose units nothing prints, and these."""
        match = self.match()
        for column, units in self._column_units(match).items():
            title = self.titles[column]
            if title.unit and not any(units):
                yield title.span, title.unit.text
        for row in match.rows:
            for cell, unit in self._cell_units(row):
                if not unit:
                    yield cell.unit_span, cell.unit.text

    def _column_units(self, match: TableMatch) -> dict[int, list[UnitText]]:
        """The units that are printed with the numbers of each column."""
        units: dict[int, list[UnitText]] = {}
        for row in match.rows:
            for cell, _, number in row.pairs:
                units.setdefault(cell.column, []).append(self.text.unit(row.line, number))
        return units


def _distance(fit: RowMatch) -> float:
    """How far the numbers of a row are from the printed ones."""
    errors = [relative_error(a.value, b.value) for _, a, b in fit.pairs]
    return sum(1.0 if error is None else min(1.0, float(error)) for error in errors)


def updated_row(match: RowMatch, comparison: model.Comparison) -> tuple[RowCell, ...]:
    """A row with the numbers that are printed now."""
    texts: dict[int, dict[tuple[int, int], str]] = {cell.column: {} for cell in match.row}
    for cell, old, new in match.pairs:
        if not cell_matches(old, new, comparison):
            texts[cell.column][old.start, old.end] = number_text(old, new, comparison)
    return tuple(
        replace(cell, mapped=cell.mapped.replace_ranges(texts[cell.column])) for cell in match.row
    )


def _dominates(rival: Sequence[float], score: Sequence[float]) -> bool:
    """Whether a layout is better in something and worse in nothing; its share counts last."""
    *respects, share = rival
    *least, least_share = score
    if respects == least:
        return share > least_share
    return all(a >= b for a, b in zip(respects, least, strict=True))
