"""Titles of a recorded table's columns: the words and units by which printed numbers are named."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable, Iterator, Mapping, Sequence
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
_PARTS = re.compile(r"[,;|]|[:=](?=.*\w)")
"""Between the parts of what stands before a number."""
_SIGN = re.compile(r"[:=](?=\s*\Z)")
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


class PrintedName(NamedTuple):
    """What a printed number is called: by what stands before it in its line, or above it."""

    before: str
    """From the number before it, behind that one's unit."""
    above: str
    number: str
    unit: UnitText

    @property
    def label(self) -> str:
        """The last part of what stands before it."""
        return _PARTS.split(self.before)[-1].lstrip(" ([{")

    @property
    def text(self) -> str:
        """The title above it, or its label."""
        return self.above or self.label.rstrip(" :=")

    @property
    def reading(self) -> str:
        """It with its number, as printed."""
        return f"{self.above} {self.number}" if self.above else f"{self.label}{self.number}"

    @property
    def is_certain(self) -> bool:
        """Whether it is of this number alone: a word may also stand behind one, or name a list."""
        return bool(self.above or _SIGN.search(self.label))

    def may_follow(self, number: PrintedName) -> bool:
        """Whether it may be a word behind the number before it."""
        is_signed_alike = {*_SIGN.findall(self.label)} & {*_SIGN.findall(number.label)}
        is_word = self.before.lstrip()[:1].isalnum() and not _PARTS.search(self.before)
        return is_word and not is_signed_alike and not self.above


def misplaced_titles(
    titles: Sequence[ColumnTitle], numbers: Sequence[PrintedName], places: Mapping[int, int]
) -> Iterator[tuple[int, int, bool]]:
    """The columns whose title is the name of another number of the line, and of which one.

    `places`: the index in the line of the number of each column. Whether it is certain comes last:
    a name may be of what follows as well, and a word may stand behind its number; not so if
    another title of the line shows where its names stand.
    """
    verdicts: list[tuple[int, int, bool]] = []
    title_at = {place: titles[column] for column, place in places.items()}
    for column, place in places.items():
        title, own_name = titles[column], numbers[place]
        text = squeeze(title.text)
        matches = [at for at, name in enumerate(numbers) if text == squeeze(name.above)]
        matches = matches or [a for a, n in enumerate(numbers) if title.is_printed_as(n.text)]
        at = matches[0] if matches and place not in matches else place
        if at < place and (own_name.above or words_of(own_name.text)):
            are_titles = any(title.is_printed_as(own_name.text) for title in titles)
            is_certain = own_name.is_certain or are_titles
        elif at > place:
            is_next = not any(words_of(name.before) for name in numbers[place + 1 : at])
            is_certain = not (is_next and numbers[at].may_follow(own_name))
            own_words = title_at[at].words if at in title_at else frozenset()
            phrase = words_of(" ".join(name.before for name in numbers[:at]))
            if not is_certain and numbers[at].is_certain and own_words and own_words <= phrase:
                continue  # `rms error after 40 steps: 0.002`
        else:
            continue
        has_unit = is_same_unit(title.unit, numbers[at].unit)
        is_certain |= has_unit and not is_same_unit(title.unit, own_name.unit)
        verdicts.append((column, at, is_certain))
    any_certain = any(is_certain for *_, is_certain in verdicts)
    return ((column, at, any_certain) for column, at, _ in verdicts)


def squeeze(title: str) -> str:
    """A title without spaces: `t = 10 s` is `t=10 s`."""
    return "".join(title.split())


@lru_cache(maxsize=4096)
def words_of(text: str) -> frozenset[str]:
    """The words of a title, in one notation: `T\u2080` is `t0`, and `\u03c4` is `tau`.

    A letter alone keeps its case: `T` is not `t`.
    """
    words = _WORD.findall("".join(map(_spell, unicodedata.normalize("NFKD", text))))
    return frozenset(w.casefold() if len(w) > 1 else w for w in words if not w.isdecimal())


def _spell(character: str) -> str:
    name = unicodedata.name(character, "")
    return name.rpartition(" ")[2] if name.startswith("GREEK") else character
