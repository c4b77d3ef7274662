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
from coursebuild.core.text.quantities import (
    NO_UNIT,
    UnitText,
    are_different,
    is_same_unit,
    unit_behind,
    unit_of_header,
)
from coursebuild.core.text.source import Span

_PER = re.compile(r"/[^\W\d_]")
_WORD = re.compile(r"[^\W_]+")
HEADER_HELP = (
    "write the unit that is printed, or put the columns in order; where a unit is not meant, mark "
    'it: `` `s`{given="…"} ``'
)


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
            if unit_behind(line, at):
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
    unit: UnitText
    """None where its source is said, as in `` τ (`s`{given="a guess"}) ``."""
    unit_span: Span

    @classmethod
    def of(cls, cell: model.Cell) -> ColumnTitle:
        """The words and the unit of a cell of a header."""
        title = cell_text(cell, ())
        unit = unit_of_header(title.text)
        at = title.text.rfind(unit.text) if unit else -1
        if at < 0:
            return cls(cell.span, title.text, _words(title.text), unit, cell.span)
        inlines = model.walk_inlines(cell.children)
        is_given = any(isinstance(i, model.NumberBinding) and i.source is not None for i in inlines)
        unit_span = Span(cell.span.source, *title.origin(at, at + len(unit.text)))
        words = _words(title.text[:at])
        return cls(cell.span, title.text, words, NO_UNIT if is_given else unit, unit_span)

    def names(self, row: PrintedRow, number: Number, unit: UnitText) -> bool | None:
        """Whether a printed number with its unit is what the title says; `None`: nothing tells."""
        if are_different(self.unit, unit):
            return False
        if best := self.best_places(row):
            return row.numbers.index(number) in best
        return True if is_same_unit(self.unit, unit) else None

    def has(self, word: str) -> bool:
        """Whether a printed word is one of the title, or a mere sign."""
        return not _words(word) or _words(word) <= self.words

    def best_places(self, row: PrintedRow) -> list[int]:
        """The numbers, by index, whose words are most of the title's."""
        shared = [len(self.words & label) for label in row.labels]
        most = max(shared, default=0)
        return [at for at, count in enumerate(shared) if count == most] if most else []


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
