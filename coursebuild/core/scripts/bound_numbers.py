"""The printed lines with their numbers, and which of these a bound number may mean."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from decimal import Decimal
from functools import cached_property

from msgspec import Struct

from coursebuild.core.model import Filter, Recording, Table
from coursebuild.core.scripts.lines import MappedText, Side, plain_text, replace_ranges
from coursebuild.core.scripts.table_cells import RowCell, table_rows
from coursebuild.core.text.numbers import (
    Number,
    has_groups,
    round_like,
    scan,
    scan_prose,
    within_half_unit,
)
from coursebuild.core.text.source import Excerpt, Source, Span
from coursebuild.core.text.units import units_at

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

    @cached_property
    def numbers(self) -> tuple[Number, ...]:
        """The numbers in it; not computed until needed, as those of most lines never are."""
        return scan(self.text, self.is_grouped)


def lines_of_run(stdout: str, filters: Iterable[Filter] = ()) -> list[PrintedLine]:
    """The lines of an output that is not recorded."""
    lines = Side.of(stdout, filters).lines
    is_grouped = has_groups("\n".join(lines))
    return [PrintedLine(line, None, is_grouped) for line in lines]


def printed_lines(recording: Recording, filters: Iterable[Filter] = ()) -> tuple[PrintedLine, ...]:
    """The lines of a recorded output; without filters, as the author sees them."""
    if isinstance(recording.body, Table):
        rows = [_join_cells(row) for row in table_rows(recording.body)]
        is_grouped = has_groups("\n".join(row.text for row in rows))
        source = recording.body.span.source
        return tuple(
            PrintedLine(row.text, _locator_in_row(row, source), is_grouped) for row in rows
        )
    side = Side.of(recording.body.text, filters)
    is_grouped = has_groups("\n".join(side.lines))
    return tuple(
        PrintedLine(line, _locator_in_fence(recording.body, side, index), is_grouped)
        for index, line in enumerate(side.lines)
    )


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

    @classmethod
    def of(cls, text: str) -> BoundText:
        """The numbers and the plain text of a binding."""
        numbers = scan_prose(text)
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
            places.append((number.start, number.end, rounded))
        return replace_ranges(self.text, places)

    def is_in(self, lines: Sequence[PrintedLine]) -> bool:
        """Whether printed numbers that may be meant, rounded, are those of the binding."""
        return bool(self.candidates(lines))

    def candidates(self, lines: Sequence[PrintedLine], following: str = "") -> list[Window]:
        """The printed numbers that it may show, each place once; `following` stands behind it."""
        windows = [window for window in self.windows(lines) if self.shows(window)]
        if self.stray:
            windows = list(filter(self.has_context, windows))
        units = frozenset() if self.after else units_at(following)

        def has_unit(window: Window) -> bool:
            return not units.isdisjoint(units_at(window.line.text, window.numbers[-1].end))

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

    def wrong_unit(self, lines: Sequence[PrintedLine], following: str) -> tuple[str, str] | None:
        """A printed number with its unit, and the text beside it here, if that is another unit.

        `following` is what stands behind the binding.
        """
        if not self.numbers:
            return None
        ends = [*(number.start for number in self.numbers[1:]), len(self.text)]
        texts = [self.text[n.end : end] for n, end in zip(self.numbers, ends, strict=True)]
        texts[-1] = texts[-1] if texts[-1].strip() else following
        shown_units = list(map(units_at, texts))
        difference: tuple[str, str] | None = None
        for window in filter(self.shows, self.windows(lines) if any(shown_units) else ()):
            line = window.line.text
            printed_units = [units_at(line, number.end) for number in window.numbers]
            pairs = zip(shown_units, printed_units, strict=True)
            at = [i for i, (a, b) in enumerate(pairs) if a and b and a.isdisjoint(b)]
            if not at:
                return None
            number = window.numbers[at[0]]
            unit_text = line[number.end :].split()[0].rstrip(".,;:)]")
            difference = f"{number.text} {unit_text}", texts[at[0]].split()[0].rstrip(".,;:!?)")
        return difference

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
    tail = r"(?!\w)" if text[-1:].isalnum() else ""
    return lead + r"\s+".join(re.escape(word) for word in text.split()) + tail


def text_places(text: str, lines: Iterable[PrintedLine]) -> Iterator[tuple[PrintedLine, int, int]]:
    """Where a text, if any, stands in printed lines: whole words, white space of any width."""
    pattern = re.compile(_whole_words(text))
    for line in lines if text else ():
        for match in pattern.finditer(line.text.replace("\u2212", "-")):
            yield line, match.start(), match.end()
