"""The differences between a recorded line and the line that ran, and their classes.

Entry points: `differences` (inside one line), `number_kind`.

1. Lines that differ in their numbers only: each pair of numbers that does not match.
2. Other lines are cut into numbers, words, signs and white space, and these are aligned: numbers
   that stand for each other are compared, the rest is text. White space that differs is named only
   where nothing else does: columns shift when a number gets wider.
3. A recorded line with an ellipsis that does not fit is different as a whole.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from msgspec import Struct

from coursebuild.core.model.results import Change, DriftKind
from coursebuild.core.scripts.align import MATCH, pair
from coursebuild.core.scripts.lines import LineMatcher
from coursebuild.core.scripts.numbers import (
    Number,
    agreeing_digits,
    difference,
    relative_error,
    scan,
    unit,
)
from coursebuild.core.text.source import Span

_PART = re.compile(r"\s+|\w+|[^\w\s]")
_SPACE, _NUMBER = 1, 4


class Difference(Struct, frozen=True):
    """A stretch of a recorded line, and the stretch of the line that ran which stands there."""

    start: int
    end: int
    ran_start: int
    ran_end: int
    numbers: tuple[Number, Number] | None = None
    """Recorded and ran, where both are a number."""


def number_kind(recorded: Number, ran: Number) -> DriftKind:
    """The class of a difference between two numbers.

    It is rounding where a number with a point or an exponent is off by no more than one unit of its
    last recorded place; a count that is off by one is not. The same value, written in another way,
    is text.
    """
    if not (recorded.finite and ran.finite):
        return DriftKind.NUMERIC
    gap = difference(recorded.value, ran.value)
    if gap == 0:
        return DriftKind.TEXT
    near = recorded.inexact and gap <= unit(recorded.place)
    return DriftKind.ROUNDING if near else DriftKind.NUMERIC


def number_change(span: Span, recorded: str, ran: str, numbers: tuple[Number, Number]) -> Change:
    """The change of a number at a place of the lesson."""
    error = relative_error(numbers[0].value, numbers[1].value)
    size = None if error is None else float(error)
    return Change(
        number_kind(*numbers),
        span,
        recorded,
        ran,
        None if size == float("inf") else size,
        None if error is None else agreeing_digits(error),
    )


def differences(recorded: str, ran: str, matcher: LineMatcher) -> tuple[Difference, ...]:
    """Where a line that ran differs from the recorded one; at least one difference."""
    pairs = matcher.pairs(recorded, ran)
    if pairs is not None:
        numeric = tuple(
            Difference(a.start, a.end, b.start, b.end, (a, b))
            for a, b in pairs
            if not matcher.same(a, b)
        )
        if numeric:
            return numeric
    if not matcher.elides(recorded):
        found = _token_differences(recorded, ran, matcher)
        if found:
            return found
    return (Difference(0, len(recorded), 0, len(ran)),)


class _Token(Struct, frozen=True):
    start: int
    end: int
    text: str
    number: Number | None = None


def _tokens(text: str) -> Iterator[_Token]:
    at = 0
    for number in (*scan(text), None):
        stop = len(text) if number is None else number.start
        for found in _PART.finditer(text, at, stop):
            yield _Token(found.start(), found.end(), found.group())
        if number is not None:
            yield _Token(number.start, number.end, number.text, number)
            at = number.end


def _token_differences(recorded: str, ran: str, matcher: LineMatcher) -> tuple[Difference, ...]:
    left, right = list(_tokens(recorded)), list(_tokens(ran))

    def weight(i: int, j: int) -> int:
        a, b = left[i], right[j]
        if a.number is not None and b.number is not None:
            return MATCH if matcher.same(a.number, b.number) else _NUMBER
        if a.text.isspace() and b.text.isspace():
            return _SPACE
        return MATCH if a.text == b.text else 0

    found: list[Difference] = []
    at = ran_at = 0
    pairs = pair([t.text for t in left], [t.text for t in right], weight)
    left.append(_Token(len(recorded), len(recorded), ""))
    right.append(_Token(len(ran), len(ran), ""))
    for i, j in (*pairs, (-1, -1)):
        a, b = left[i], right[j]
        if at < a.start or ran_at < b.start:
            found.append(Difference(at, a.start, ran_at, b.start))
        if a.number is not None and b.number is not None:
            if not matcher.same(a.number, b.number):
                both = (a.number, b.number)
                found.append(Difference(a.start, a.end, b.start, b.end, both))
        elif a.text != b.text:
            found.append(Difference(a.start, a.end, b.start, b.end))
        at, ran_at = a.end, b.end
    return _merged(found, recorded, ran)


def _merged(found: list[Difference], recorded: str, ran: str) -> tuple[Difference, ...]:
    """Without white space where there is more; texts with only white space between them as one."""

    def blank(d: Difference) -> bool:
        return not (recorded[d.start : d.end].strip() or ran[d.ran_start : d.ran_end].strip())

    visible = [d for d in found if not blank(d)] or found
    merged: list[Difference] = []
    for d in visible:
        last = merged[-1] if merged else None
        if (
            last is not None
            and last.numbers is None
            and d.numbers is None
            and not recorded[last.end : d.start].strip()
            and not ran[last.ran_end : d.ran_start].strip()
        ):
            merged[-1] = Difference(last.start, d.end, last.ran_start, d.ran_end)
        else:
            merged.append(d)
    return tuple(merged)
