"""Titles of a recorded table's columns: the words and units by which printed numbers are named."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Mapping
from functools import cache

from msgspec import Struct

from coursebuild.core import model
from coursebuild.core.scripts.table_cells import cell_text
from coursebuild.core.text.numbers import Number, scan
from coursebuild.core.text.source import Span
from coursebuild.core.text.units import units_at

_UNIT = re.compile(r"[(\[]([^()\[\]]+)[)\]]\Z|(?<=\s)/\s?(\S.*)\Z")
"""`(s)`, `[s]` or `/ s` at the end of a title."""
_PER = re.compile(r"/[^\W\d_]")
_WORD = re.compile(r"[^\W_]+")
HEADER_HELP = "write the unit that is printed, or put the columns in order"


class PrintedRow(Struct, frozen=True):
    """A printed line, with the words that name each of its numbers."""

    line: str
    numbers: tuple[Number, ...]
    labels: tuple[frozenset[str], ...]

    @classmethod
    @cache
    def of(cls, line: str, heading: str) -> PrintedRow:
        """Words right before a number name it, and so do titles above a line of as many words."""
        numbers = scan(line)
        labels: list[frozenset[str]] = []
        titles, words, at = heading.split(), line.split(), 0
        shift = len(words) - len(titles)
        for number in numbers:
            column = line.count(" ", 0, number.start)
            title = titles[column - shift] if shift in (0, 1) and column - shift >= 0 else ""
            labels.append(_words(f"{line[at : number.start]} {title}"))
            at = number.end
            if units_at(line, at):
                at += len(line[at:]) - len(line[at:].lstrip().partition(" ")[2])
        return cls(line, numbers, tuple(labels))

    @property
    def count(self) -> int:
        """How many numbers it has; the 1 of a unit such as `1/min` is none."""
        return sum(not self.is_in_unit(number) for number in self.numbers)

    def is_in_unit(self, number: Number) -> bool:
        """Whether a number is the 1 of a unit such as `1/min`."""
        return number.text == "1" and _PER.match(self.line, number.end) is not None


class ColumnTitle(Struct, frozen=True):
    """The title of a column."""

    span: Span
    text: str
    words: frozenset[str]
    unit: str
    unit_span: Span

    @classmethod
    def of(cls, cell: model.Cell) -> ColumnTitle:
        """The words and the unit of a cell of a header."""
        title = cell_text(cell, ())
        match = _UNIT.search(title.text)
        if match is None:
            return cls(cell.span, title.text, _words(title.text), "", cell.span)
        group = match.lastindex or 1
        unit_span = Span(cell.span.source, *title.origin(*match.span(group)))
        words = _words(title.text[: match.start()])
        return cls(cell.span, title.text, words, match[group], unit_span)

    def names(self, row: PrintedRow, number: Number) -> bool | None:
        """Whether a printed number is what the title says; `None` where nothing tells."""
        at = row.numbers.index(number)
        if self.other_unit(row, number) is not None:
            return False
        if best := self.best_places(row):
            return at in best
        return True if units_at(self.unit) & units_at(row.line, number.end) else None

    def has(self, word: str) -> bool:
        """Whether a printed word is one of the title, or a mere sign."""
        return not _words(word) or _words(word) <= self.words

    def best_places(self, row: PrintedRow) -> list[int]:
        """The numbers, by index, whose words are most of the title's."""
        shared = [len(self.words & label) for label in row.labels]
        most = max(shared, default=0)
        return [at for at, count in enumerate(shared) if count == most] if most else []

    def other_unit(self, row: PrintedRow, number: Number) -> str | None:
        """The unit behind a printed number, if it is not that of the title."""
        units, printed_units = units_at(self.unit), units_at(row.line, number.end)
        if units and printed_units and units.isdisjoint(printed_units):
            return row.line[number.end :].split()[0].rstrip(".,;:)]")
        return None


def swapped_columns(
    titles: Mapping[int, ColumnTitle], row: PrintedRow, numbers: Mapping[int, Number]
) -> dict[int, int]:
    """For each column whose title names the number of another one, that column.

    Only where titles have changed places among themselves: words may also stand behind numbers.
    """
    columns = {row.numbers.index(number): column for column, number in numbers.items()}
    target: dict[int, int] = {}
    for column in numbers:
        best = titles[column].best_places(row)
        if len(best) == 1 and best[0] in columns:
            target[column] = columns[best[0]]
    return {a: b for a, b in target.items() if a != b and _returns(target, a)}


def _returns(target: Mapping[int, int], start: int) -> bool:
    at: int | None = start
    for _ in target:
        at = None if at is None else target.get(at)
        if at == start:
            return True
    return False


def _words(text: str) -> frozenset[str]:
    """The words of a title, in one notation: `T\u2080` is `t0`, and `\u03c4` is `tau`."""
    plain = "".join(map(_spell, unicodedata.normalize("NFKD", text.casefold())))
    return frozenset(word for word in _WORD.findall(plain) if not word.isdecimal())


def _spell(character: str) -> str:
    name = unicodedata.name(character, "")
    return name.rpartition(" ")[2].lower() if name.startswith("GREEK SMALL LETTER") else character
