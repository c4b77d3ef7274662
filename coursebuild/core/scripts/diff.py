"""How a recorded output differs from what its script prints now: inside a line, and line by line.

1. Lines that differ in their numbers only: each pair of numbers that does not match.
2. Other lines are cut into numbers, words and signs, and these are aligned: paired numbers are
   compared, the rest is text. White space that differs is reported only where nothing else does,
   because columns shift when a number gets wider.
3. A recorded line with an ellipsis that does not fit differs as a whole.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby
from typing import Literal, TypeAlias

from msgspec import Struct

from coursebuild.core.model import Table
from coursebuild.core.model.results import Change, DriftKind, Verdict
from coursebuild.core.scripts.align import MATCH, StepKind, align, pair
from coursebuild.core.scripts.lines import LineMatcher, Side
from coursebuild.core.text.diagnostics import Note
from coursebuild.core.text.numbers import (
    Number,
    agreeing_digits,
    difference,
    relative_error,
    scan,
    unit,
)
from coursebuild.core.text.regex import regex
from coursebuild.core.text.source import Span

_PART = regex(r"\w+|[^\w\s]")
_NUMBER = 4


class Difference(Struct, frozen=True):
    """A stretch of a recorded line, and the stretch of the printed line in its place."""

    start: int
    end: int
    printed_start: int
    printed_end: int
    numbers: tuple[Number, Number] | None = None
    """Recorded and printed, where both are a number."""


def number_change(
    span: Span, recorded: str, printed: str, numbers: tuple[Number, Number]
) -> Change:
    """The change of a number that stands at `span` in the lesson.

    It is rounding where a number with a point or an exponent is off by at most one unit of its last
    recorded place; a count that is off by one is not. The same value in another notation is text.
    """
    old, new = numbers
    kind = DriftKind.NUMERIC
    if old.is_finite and new.is_finite:
        gap = difference(old.value, new.value)
        if gap == 0:
            kind = DriftKind.TEXT
        elif old.is_inexact and gap <= unit(old.place):
            kind = DriftKind.ROUNDING
    error = relative_error(old.value, new.value)
    size = None if error is None else float(error)
    return Change(
        kind,
        span,
        recorded,
        printed,
        None if size == float("inf") else size,
        None if error is None else agreeing_digits(error),
    )


def find_differences(recorded: str, printed: str, matcher: LineMatcher) -> tuple[Difference, ...]:
    """Where a printed line differs from the recorded one; at least one difference."""
    pairs = matcher.pairs(recorded, printed)
    if pairs is not None:
        numeric = tuple(
            Difference(a.start, a.end, b.start, b.end, (a, b))
            for a, b in pairs
            if not matcher.numbers_match(a, b)
        )
        if numeric:
            return numeric
    if not matcher.elides(recorded):
        token_differences = _token_differences(recorded, printed, matcher)
        if token_differences:
            return token_differences
    return (Difference(0, len(recorded), 0, len(printed)),)


class _Token(Struct, frozen=True):
    start: int
    end: int
    text: str
    number: Number | None = None


def _tokens(text: str) -> Iterator[_Token]:
    """The numbers, words and signs of a line, and its end."""
    at = 0
    for number in scan(text):
        yield from (
            _Token(*part.span(), part[0]) for part in _PART.finditer(text, at, number.start)
        )
        yield _Token(number.start, number.end, number.text, number)
        at = number.end
    yield from (_Token(*part.span(), part[0]) for part in _PART.finditer(text, at))
    yield _Token(len(text), len(text), "")


def _token_differences(recorded: str, printed: str, matcher: LineMatcher) -> tuple[Difference, ...]:
    *left, left_end = _tokens(recorded)
    *right, right_end = _tokens(printed)

    def weight(i: int, j: int) -> int:
        a, b = left[i], right[j]
        if a.number is not None and b.number is not None:
            return MATCH if matcher.numbers_match(a.number, b.number) else _NUMBER
        return MATCH if a.text == b.text else 0

    differences: list[Difference] = []
    spaces: list[Difference] = []
    at = printed_at = 0
    pairs = pair([t.text for t in left], [t.text for t in right], weight)
    for a, b in (*((left[i], right[j]) for i, j in pairs), (left_end, right_end)):
        start, end = _without_spaces(recorded, at, a.start)
        printed_start, printed_end = _without_spaces(printed, printed_at, b.start)
        if start < end or printed_start < printed_end:
            differences.append(Difference(start, end, printed_start, printed_end))
        elif recorded[at : a.start] != printed[printed_at : b.start]:
            spaces.append(Difference(at, a.start, printed_at, b.start))
        if a.number is not None and b.number is not None:
            numbers = (a.number, b.number)
            if not matcher.numbers_match(*numbers):
                differences.append(Difference(a.start, a.end, b.start, b.end, numbers))
        at, printed_at = a.end, b.end
    return tuple(differences or spaces)


def _without_spaces(text: str, start: int, end: int) -> tuple[int, int]:
    """A range of a text without the white space at both ends."""
    part = text[start:end]
    lead = len(part) - len(part.lstrip())
    return start + lead, start + max(lead, len(part.rstrip()))


Mark: TypeAlias = Literal[" ", "-", "+"]
_LINES, _WIDTH = 12, 120


DiffRow: TypeAlias = tuple[Mark, list[tuple[str, bool]]]
"""A line as recorded (`-`), as printed (`+`), or both (a space): its parts, and which changed."""


def shorten(text: str, width: int) -> str:
    """The text, cut to a width with an ellipsis sign at its end."""
    return text if len(text) <= width else text[: width - 1] + "…"


def quote(text: str, width: int) -> str:
    """A line of output as a message shows it: cut, without white space at its ends."""
    return f"`{shorten(text.strip(), width)}`"


def limit_notes(notes: Sequence[Note], most: int, noun: str = "more") -> list[Note]:
    """So many notes, and one that counts the rest."""
    rest = len(notes) - most
    return [*notes[:most], *([Note(f"and {rest} {noun}")] if rest > 0 else [])]


def text_diff(before: str, now: str) -> str:
    """The lines that two texts do not share, at most twelve of them."""
    diff = difflib.unified_diff(before.splitlines(), now.splitlines(), n=0, lineterm="")
    lines = [line for line in diff if not line.startswith(("---", "+++", "@@"))]
    rest = f"\n… and {len(lines) - _LINES} more lines" if len(lines) > _LINES else ""
    return "\n".join(shorten(line, _WIDTH) for line in lines[:_LINES]) + rest


def diff_rows(verdict: Verdict, stdout: str) -> tuple[DiffRow, ...]:
    """The rows of a recording that a run differs from; of a table the changed cells only."""
    body = verdict.recording.body
    if isinstance(body, Table):
        cells: list[DiffRow] = []
        for change in verdict.changes:
            cells += [_row("-", text) for text in change.recorded.split("\n") if change.recorded]
            cells += [_row("+", text) for text in change.printed.split("\n") if change.printed]
        return tuple(cells)
    matcher, filters = LineMatcher(verdict.comparison), verdict.comparison.filters
    recorded, printed = Side.of(body.text, filters), Side.of(stdout, filters)
    rows: list[DiffRow] = []  # one for each line of either side, none for elided lines
    for step in align(recorded, printed, matcher):
        match step.kind:
            case StepKind.SAME | StepKind.ELLIPSIS:
                rows += (_row(" ", text) for text in recorded.raw_lines(step.recorded))
            case StepKind.DIFFERS:
                old, new = recorded.lines[step.recorded], printed.lines[step.printed]
                places = find_differences(old, new, matcher)
                rows.append(("-", _parts(old, ((d.start, d.end) for d in places))))
                ranges = ((d.printed_start, d.printed_end) for d in places)
                rows.append(("+", _parts(new, ranges)))
            case StepKind.MISSING:
                rows.append(_row("-", recorded.lines[step.recorded]))
            case StepKind.EXTRA:
                rows.append(_row("+", printed.lines[step.printed]))
            case StepKind.ELIDED:
                pass
    # Between two common lines, all removed lines come before all added ones.
    hunks = (list(group) for _, group in groupby(rows, key=lambda row: row[0] == " "))
    return tuple(row for hunk in hunks for row in sorted(hunk, key=lambda r: r[0], reverse=True))


def _row(mark: Mark, text: str) -> DiffRow:
    return mark, [(text, mark != " ")]


def _parts(text: str, ranges: Iterable[tuple[int, int]]) -> list[tuple[str, bool]]:
    parts: list[tuple[str, bool]] = []
    at = 0
    for start, end in ranges:
        parts += ((text[at:start], False), (text[start:end], True))
        at = end
    return [part for part in (*parts, (text[at:], False)) if part[0]]
