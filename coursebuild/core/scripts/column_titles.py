"""Titles of a recorded table's columns: the words and units by which printed numbers are named."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache
from typing import NamedTuple

from msgspec import Struct

from coursebuild.core import model
from coursebuild.core.scripts.table_cells import cell_text
from coursebuild.core.text.quantities import (
    NO_UNIT,
    UnitText,
    are_different,
    is_same_unit,
    unit_of_header,
)
from coursebuild.core.text.source import Span

_WORD = re.compile(r"[^\W_]+")
HEADER_HELP = (
    "write the unit that is printed, or put the columns in order; where a unit is not meant, mark "
    'it: `` `s`{given="…"} ``'
)


class ColumnTitle(Struct, frozen=True):
    """The title of a column."""

    span: Span
    text: str
    words: frozenset[str]
    unit: UnitText
    """None where its source is said, as in `` τ (`s`{given="a guess"}) ``; so with words."""
    unit_span: Span

    @classmethod
    def of(cls, cell: model.Cell) -> ColumnTitle:
        """The words and the unit of a cell of a header."""
        title = cell_text(cell, ())
        unit = unit_of_header(title.text)
        inlines = model.walk_inlines(cell.children)
        bindings = (i for i in inlines if isinstance(i, model.NumberBinding))
        excepted_text = " ".join(i.text for i in bindings if i.source is not None)
        text = title.text.replace(" ", "·")  # `J/(kg K)`
        at = text.rfind(unit.text.replace(" ", "·")) if unit else -1
        unit_span, words = cell.span, words_of(title.text)
        if at >= 0:
            unit_span = Span(cell.span.source, *title.origin(at, at + len(unit.text)))
            words = words_of(title.text[:at])
        words -= words_of(excepted_text)
        return cls(cell.span, title.text, words, NO_UNIT if excepted_text else unit, unit_span)

    def has(self, word: str) -> bool:
        """Whether a printed word is one of the title, or a mere sign."""
        return not words_of(word) or words_of(word) <= self.words

    def is_printed_as(self, printed: str) -> bool:
        """Whether a printed title has the same words, whatever its unit."""
        words, unit = words_of(printed), words_of(unit_of_header(printed).text)
        return bool(self.words) and self.words <= words and words - self.words <= unit

    def best_places(self, labels: Iterable[str]) -> list[int]:
        """The numbers of a line, by index, in whose labels most of the title's words are."""
        shared = [len(self.words & words_of(label)) for label in labels]
        most = max(shared, default=0)
        return [at for at, count in enumerate(shared) if count == most] if most else []

    def names(self, labels: Sequence[str], at: int, unit: UnitText) -> bool | None:
        """Whether number `at` of a line is what the title says; `None` where nothing tells.

        `labels` are those of all numbers of the line, and `unit` the unit of this one.
        """
        if are_different(self.unit, unit):
            return False
        if best := self.best_places(labels):
            return at in best
        return True if is_same_unit(self.unit, unit) else None


class PrintedNames(NamedTuple):
    """What a printed number is called: its label, the title above it, its unit."""

    label: str
    above: str
    unit: UnitText


def swapped_columns(
    titles: Sequence[ColumnTitle], labels: Sequence[str], places: Mapping[int, int]
) -> dict[int, int]:
    """For each column whose title names the number of another one, that column.

    `places`: the index in the line of the number of each column. Only where titles have changed
    places among themselves: words may also stand behind numbers.
    """
    columns = {place: column for column, place in places.items()}
    target: dict[int, int] = {}
    for column in places:
        best = titles[column].best_places(labels)
        if len(best) == 1 and best[0] in columns:
            target[column] = columns[best[0]]
    return {a: b for a, b in target.items() if a != b and _returns(target, a)}


def misnamed_columns(
    titles: Sequence[ColumnTitle], numbers: Sequence[PrintedNames], places: Mapping[int, int]
) -> list[int]:
    """The columns whose title is printed with a number of the line that is not shown.

    `places` as above. It is printed above that number, as another is above the one that is shown,
    or in its label beside the unit, which the one that is shown has not: labels alone may also
    stand behind numbers.
    """
    columns: list[int] = []
    for column, place in places.items():
        title, own_names = titles[column], numbers[place]
        candidates = [
            at
            for at, number in enumerate(numbers)
            if (own_names.above and title.is_printed_as(number.above))
            or (title.words <= words_of(number.label) and _has_unit_alone(title, number, own_names))
        ]
        is_told = len(candidates) == 1 and candidates[0] not in places.values()
        if is_told and title.words and not title.words & words_of(own_names.label):
            columns.append(column)
    return columns


def _has_unit_alone(title: ColumnTitle, number: PrintedNames, sibling: PrintedNames) -> bool:
    return is_same_unit(title.unit, number.unit) and not is_same_unit(title.unit, sibling.unit)


def _returns(target: Mapping[int, int], start: int) -> bool:
    at: int | None = start
    for _ in target:
        at = None if at is None else target.get(at)
        if at == start:
            return True
    return False


@lru_cache(maxsize=4096)
def words_of(text: str) -> frozenset[str]:
    """The words of a title, in one notation: `T\u2080` is `t0`, and `\u03c4` is `tau`."""
    plain = "".join(map(_spell, unicodedata.normalize("NFKD", text.casefold())))
    return frozenset(word for word in _WORD.findall(plain) if not word.isdecimal())


def _spell(character: str) -> str:
    name = unicodedata.name(character, "")
    return name.rpartition(" ")[2].lower() if name.startswith("GREEK SMALL LETTER") else character
