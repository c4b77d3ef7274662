"""The printed lines with their numbers, and which of these a bound number may mean."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from decimal import Decimal
from functools import cached_property
from itertools import accumulate

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core.model import Filter, Recording, Table
from coursebuild.core.scripts.column_titles import ColumnTitle
from coursebuild.core.scripts.lines import MappedText, Side, plain_text, replace_ranges
from coursebuild.core.scripts.table_cells import RowCell, table_rows
from coursebuild.core.text.numbers import (
    Number,
    has_groups,
    point_decimals,
    round_like,
    scan,
    scan_prose,
    within_half_unit,
    write_comma,
)
from coursebuild.core.text.quantities import (
    NO_UNIT,
    UnitText,
    are_different,
    is_same_unit,
    numbers_of_quantities,
    unit_behind,
    unit_of_printed,
)
from coursebuild.core.text.source import Excerpt, Source, Span

Locate = Callable[[int, int], Span]
_STRAY = re.compile(r"[-+*/.,:;=_]+|-?[eE][-+]+\d*|[-+][eE]\d*")
"""What beside a number is neither a unit nor a word: `-9.81-` has a slip."""


class PrintedLine(Struct, frozen=True, dict=True):
    """A line of output, or a row of a recorded table with its cells joined."""

    text: str
    locate: Locate | None = None
    """Where `text[start:end]` stands in the lesson; `None` for what is not recorded."""
    is_grouped: bool = False
    """Whether commas between digits part thousands, as they all do in its output."""
    columns: tuple[tuple[int, UnitText], ...] = ()
    """Of a row of a table: the end of each cell, and the unit in the title of its column."""

    @cached_property
    def numbers(self) -> tuple[Number, ...]:
        """The numbers in it; not computed until needed, as those of most lines never are."""
        return numbers_of_quantities(self.text, scan(self.text, self.is_grouped))


def lines_of_run(stdout: str, filters: Iterable[Filter] = ()) -> list[PrintedLine]:
    """The lines of an output that is not recorded."""
    lines = Side.of(stdout, filters).lines
    is_grouped = has_groups("\n".join(lines))
    return [PrintedLine(line, None, is_grouped) for line in lines]


def printed_lines(recording: Recording, filters: Iterable[Filter] = ()) -> tuple[PrintedLine, ...]:
    """The lines of a recorded output; without filters, as the author sees them."""
    if isinstance(recording.body, Table):
        return tuple(_lines_of_table(recording.body))
    side = Side.of(recording.body.text, filters)
    is_grouped = has_groups("\n".join(side.lines))
    return tuple(
        PrintedLine(line, _locator_in_fence(recording.body, side, index), is_grouped)
        for index, line in enumerate(side.lines)
    )


def _lines_of_table(table: Table) -> Iterator[PrintedLine]:
    rows, source = table_rows(table), table.span.source
    units = [ColumnTitle.of(title).unit for title in table.header]
    joined_rows = [_join_cells(row) for row in rows]
    texts = [point_decimals(row.text) if table.comma else row.text for row in joined_rows]
    is_grouped = has_groups("\n".join(texts))
    for row, joined_row, text in zip(rows, joined_rows, texts, strict=True):
        ends = accumulate(len(cell.mapped.text) + 1 for cell in row)
        columns = tuple((end - 1, units[cell.column]) for end, cell in zip(ends, row, strict=True))
        yield PrintedLine(text, _locator_in_row(joined_row, source), is_grouped, columns)


def _locator_in_fence(body: Excerpt, side: Side, line: int) -> Locate:
    return lambda start, end: body.span(*side.origin(line, start, end))


def _join_cells(row: tuple[RowCell, ...]) -> MappedText:
    gap = MappedText.substitute_for(0, 0, " ")
    return MappedText.join([part for cell in row for part in (gap, cell.mapped)][1:])


def _locator_in_row(row: MappedText, source: Source) -> Locate:
    return lambda start, end: Span(source, *row.origin(start, end))


def shows(number: Number, printed: Number) -> bool:
    """Whether a number in prose is a printed one, rounded to the digits shown."""
    if number.is_padded and not printed.is_padded:
        return False
    if not (number.is_finite and printed.is_finite):
        return (number.value.is_nan() and printed.value.is_nan()) or number.value == printed.value
    if number.is_integer and printed.is_integer:
        return number.value == printed.value
    return within_half_unit(number, printed.value)


class Window(Struct, frozen=True):
    """Numbers of one printed line, one after the other."""

    line: PrintedLine
    numbers: tuple[Number, ...]

    def units(self, lines: Sequence[PrintedLine]) -> list[UnitText]:
        """The units that are printed with them, the lines being all of their output."""
        index = next((i for i, line in enumerate(lines) if line is self.line), 0)
        above = [line.text for line in lines[:index]]
        return [
            unit_of_printed(self.line.text, number, above) or self._unit_of_title(number)
            for number in self.numbers
        ]

    def _unit_of_title(self, number: Number) -> UnitText:
        units = (unit for end, unit in self.line.columns if number.end <= end)
        return next(units, NO_UNIT)

    @property
    def text(self) -> str:
        """The numbers as printed."""
        return ", ".join(number.text for number in self.numbers)

    @property
    def before(self) -> str:
        """What stands before them in their line."""
        return self.line.text[: self.numbers[0].start]

    @property
    def after(self) -> str:
        """What stands after them, without white space at its start."""
        return self.line.text[self.numbers[-1].end :].lstrip().replace("\u2212", "-")


class BoundText(Struct, frozen=True):
    """The text of a binding: its numbers and the text around; without numbers, `before` is all."""

    text: str
    before: str
    numbers: tuple[Number, ...]
    after: str

    comma: bool = False
    """Whether its numbers were written with a comma before the decimals; here it is a point."""

    @classmethod
    def of(cls, text: str, comma: bool = False) -> BoundText:
        """The numbers and the plain text of a binding, in a language that may have the comma."""
        pointed = point_decimals(text) if comma else text
        if pointed != text:
            return replace(cls.of(pointed), comma=True)
        numbers = numbers_of_quantities(text, scan_prose(text))
        if not numbers:
            return cls(text, plain_text(text), (), "")
        before, after = text[: numbers[0].start], text[numbers[-1].end :]
        return cls(text, plain_text(before), numbers, plain_text(after))

    def shows(self, window: Window) -> bool:
        """Whether the printed numbers, rounded, are those of the binding."""
        return all(map(shows, self.numbers, window.numbers))

    def rewrite(self, window: Window) -> str:
        """The binding's text with printed numbers in it, rounded to the digits that it shows.

        Empty where its notation is not that of a printed number, or one would be rounded to zero.
        """
        places: list[tuple[int, int, str]] = []
        for number, printed in zip(self.numbers, window.numbers, strict=True):
            rounded = round_like(number, printed.value) if printed.is_finite else None
            if rounded is None or (
                printed.value and not Decimal(plain_text(rounded).replace(",", ""))
            ):
                return ""
            rounded = write_comma(rounded) if self.comma else rounded
            places.append((number.start, number.end, rounded))
        return replace_ranges(self.text, places)

    def is_in(self, lines: Sequence[PrintedLine]) -> bool:
        """Whether printed numbers that may be meant, rounded, are those of the binding."""
        return bool(self.candidates(lines))

    def candidates(self, lines: Sequence[PrintedLine], following: str = "") -> list[Window]:
        """The printed numbers that it may show, each place once; `following` stands behind it."""
        windows = self.shown_windows(lines)
        if self.stray:
            windows = list(filter(self.has_context, windows))
        unit = NO_UNIT if self.after else unit_behind(following)

        def has_unit(window: Window) -> bool:
            return bool(unit) and is_same_unit(unit, window.units(lines)[-1])

        for test in (has_unit, self._is_verbatim):
            windows = list(filter(test, windows)) or windows
        unique = {(plain_text(w.line.text), w.numbers[0].start): w for w in reversed(windows)}
        return list(reversed(unique.values()))

    def _is_verbatim(self, window: Window) -> bool:
        """Whether the numbers are printed exactly as they are shown."""
        texts = (
            [plain_text(n.text) for n in numbers] for numbers in (self.numbers, window.numbers)
        )
        return next(texts) == next(texts)

    def shown_windows(self, lines: Sequence[PrintedLine]) -> list[Window]:
        """The printed numbers that may be meant, and are those of the binding."""
        return [window for window in self.windows(lines) if self.shows(window)]

    def wrong_unit(
        self, windows: Iterable[Window], lines: Sequence[PrintedLine], following: str
    ) -> tuple[Number, str, str] | None:
        """A printed number with its unit, and the unit that it has here, if that is another.

        `windows` are printed numbers, and `lines` all of their output; `following` is what stands
        behind the binding.
        """
        shown_units = self.units(following)
        difference: tuple[Number, str, str] | None = None
        for window in windows if any(shown_units) else ():
            pairs = zip(window.numbers, shown_units, window.units(lines), strict=True)
            mismatches = ((n, p.text, s.text) for n, s, p in pairs if are_different(s, p))
            difference = next(mismatches, None)
            if difference is None:
                return None
        return difference

    def units(self, following: str) -> list[UnitText]:
        """The units of its numbers, the last of which may have its own in what follows."""
        ends = [*(number.start for number in self.numbers), len(self.text)][1:]
        texts = [self.text[n.end : end] for n, end in zip(self.numbers, ends, strict=False)]
        if texts and not texts[-1].strip():
            texts[-1] = following
        return list(map(unit_behind, texts))

    @property
    def stray(self) -> str:
        """A sign beside the numbers that is neither a unit nor a word, as in `-9.81-`."""
        texts = (self.before.strip(), self.after.strip())
        return next(filter(_STRAY.fullmatch, texts), "")

    def _windows(self, lines: Iterable[PrintedLine]) -> Iterator[Window]:
        """All runs of as many printed numbers of one line."""
        count = len(self.numbers)
        for line in lines:
            for first in range(len(line.numbers) - count + 1):
                yield Window(line, line.numbers[first : first + count])

    def windows(self, lines: Iterable[PrintedLine]) -> list[Window]:
        """The printed numbers that may be meant: those with the same text around, if any."""
        windows = list(self._windows(lines))
        for test in self._context_tests():
            windows = [window for window in windows if test(window)] or windows
        return windows

    def has_context(self, window: Window) -> bool:
        """Whether the printed numbers have the same text around them."""
        return all(test(window) for test in self._context_tests())

    def _context_tests(self) -> Iterator[Callable[[Window], bool]]:
        """Tests of whether printed numbers have the same text after, and before, them."""
        if self.after:
            after = re.compile(_whole_words(self.after))
            yield lambda window: after.match(window.after) is not None
        if self.before:
            before = re.compile(_whole_words(self.before) + r"\Z")
            reach = 4 * len(self.before) + 200
            yield lambda window: before.search(plain_text(window.before[-reach:])) is not None


def _whole_words(text: str) -> str:
    """A pattern for a text with white space of any width, not starting or ending inside a word."""
    lead = r"(?<!\w)" if text[:1].isalnum() else ""
    tail = r"(?![\w/^·²³⁻])" if text[-1:].isalnum() else ""  # `m` is no part of `m/s`
    return lead + r"\s+".join(re.escape(word) for word in text.split()) + tail


def text_places(text: str, lines: Iterable[PrintedLine]) -> Iterator[tuple[PrintedLine, int, int]]:
    """Where a text, if any, stands in printed lines: whole words, white space of any width."""
    pattern = re.compile(_whole_words(text))
    for line in lines if text else ():
        for match in pattern.finditer(line.text.replace("\u2212", "-")):
            yield line, match.start(), match.end()
