"""The rows of recorded tables, cell by cell, as plain text with its places in the lesson."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

from msgspec import Struct

from coursebuild.core import model
from coursebuild.core.model.lesson_record import ShownValue, shown_values
from coursebuild.core.scripts.lines import (
    CanonicalText,
    MappedText,
    SameNumber,
    apply_filters,
    canonicalize,
    numbers_fit,
    same_number,
)
from coursebuild.core.text.numbers import Number, only_number, point_decimals, round_like
from coursebuild.core.text.source import Span

_RUN = re.compile(r"\s{2,}|[^\S ]")
_ENDS = re.compile(r"\A\s+|\s+\Z")


class LineLayout(NamedTuple):
    """What is left of a line without the cells of a row."""

    heading: str
    parts: tuple[str, ...]
    """Before, between and after the cells."""
    columns: tuple[int, ...]


class Fit(NamedTuple):
    """A way to find a row in a line: where its cells begin there."""

    line: int
    places: tuple[int, ...]
    layout: LineLayout
    is_right: bool
    """Whether its numbers match, too."""


class RowCell(Struct, frozen=True):
    """A cell of a recorded table."""

    cell: model.Cell
    column: int
    mapped: MappedText
    canonical: CanonicalText

    def span(self, number: Number) -> Span:
        """Where a number of the cell stands in the lesson."""
        return Span(self.cell.span.source, *self.mapped.origin(number.start, number.end))


ELISIONS = ("\u2026", "...")
"""A cell that is left out; a row of such cells stands for any printed rows."""


def table_rows(
    table: model.Table, filters: Iterable[model.Filter] = ()
) -> tuple[tuple[RowCell, ...], ...]:
    """The body rows of a table; cells without text, or left out, and rows of such are not there."""
    rules = tuple(filters)
    with_point = point_decimals if table.comma else str
    rows = (
        tuple(
            RowCell(cell, column, mapped, canonicalize(with_point(mapped.text), has_powers=True))
            for column, cell in enumerate(row)
            if (mapped := cell_text(cell, rules)).text not in ("", *ELISIONS)
        )
        for row in table.rows
    )
    return tuple(row for row in rows if row)


def elides_rows(table: model.Table) -> bool:
    """Whether a row of a table stands for printed rows that it does not show."""
    return any(all(cell_text(c, ()).text in ELISIONS for c in row) for row in table.rows)


def row_text(row: Iterable[RowCell]) -> str:
    """The cells of a row as one line."""
    return "  ".join(cell.mapped.text for cell in row)


def row_values(
    document: model.Document, recording: model.Recording, filters: Iterable[model.Filter] = ()
) -> tuple[ShownValue, ...]:
    """The rows of a recorded table as values that a lesson shows."""
    if not isinstance(recording.body, model.Table) or recording.script is None:
        return ()
    number = model.output_numbers(document)[recording.span.start]
    path, before = document.source.path, f"row of output {number}"
    rows = table_rows(recording.body, filters)
    return tuple(shown_values((path, recording.script, before, row_text(row)) for row in rows))


def cell_text(cell: model.Cell, filters: Iterable[model.Filter]) -> MappedText:
    """The plain text of a cell, filtered; origins are offsets in the lesson's source.

    Marks of Markdown are gone, minus signs are hyphens, runs of white space are one space. A
    stretch that Markdown changed (entities, escapes) stands for all of itself.
    """
    stretches: list[MappedText] = []
    for inline in model.walk_inlines(cell.children):
        span = inline.span
        match inline:
            case model.Text():
                text = inline.text
            case model.CodeSpan():
                # Between the backticks, without padding
                markdown, text = span.text, inline.text
                edge = len(markdown) - len(markdown.lstrip("`"))
                if len(markdown) - 2 * edge == len(text) + 2:
                    edge += 1
                span = Span(span.source, span.start + edge, span.end - edge)
            case model.NumberBinding():
                text, span = inline.text, inline.text_span
            case model.Math():
                text, span = inline.tex.text, inline.tex.span()
            case model.Image():
                text = inline.alt
            case model.SoftBreak() | model.HardBreak():
                text = " "
            case model.RawInline():
                text = " " if inline.html.startswith("<br") else ""
            case _:
                continue
        stretches.append(
            MappedText.copy(text, span.start)
            if span.text == text
            else MappedText.substitute_for(span.start, span.end, text)
        )
    mapped = apply_filters(MappedText.join(stretches), filters)
    folded = mapped.substitute(_RUN, " ").substitute(_ENDS, "")
    return MappedText(folded.text.replace("\u2212", "-"), folded.starts, folded.ends)


def cell_matches(recorded: Number, printed: Number, comparison: model.Comparison) -> bool:
    """Whether a number in a cell is the printed one: also a `2` for `2.0`."""
    is_exact = comparison.mode is model.Mode.EXACT or recorded.is_padded or printed.is_padded
    is_equal = not is_exact and recorded.value == printed.value
    return is_equal or same_number(recorded, printed, comparison)


def number_text(old: Number, new: Number, comparison: model.Comparison) -> str:
    """A printed number as it replaces a recorded one."""
    has_more = new.place < old.place or only_number(old.text) is None  # `3.9 × 10⁻¹¹`
    if comparison.mode is model.Mode.DIGITS and old.is_inexact and has_more:
        return round_like(old, new.value) or new.text
    return new.text


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


def find_rows(
    row: Sequence[RowCell], line: CanonicalText, start: int, numbers_match: SameNumber
) -> Iterator[tuple[int, ...]]:
    """The ways in which the cells stand in a line in order, each after the one before."""
    if not row:
        yield ()
        return
    cell = row[0].canonical
    for place in _find_places(cell, line, start, numbers_match):
        for rest in find_rows(row[1:], line, place + len(cell.skeleton), numbers_match):
            yield (place, *rest)
