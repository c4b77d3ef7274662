"""Does a recorded line match a line that ran?

Entry point: `LineMatcher`.

1. `canonical` replaces each number of a line by a mark and folds the white space around it, because
   columns shift when a number gets wider. Two lines are alike when these skeletons are equal.
2. Lines that are alike match when each pair of numbers does, by the rules of the comparison's mode.
3. With `ellipsis`, a recorded line is cut at its `...`; its parts must stand in the line that ran,
   in order, the first at the start and the last at the end. A part has a fixed length in the
   skeleton, so that taking each at its first place finds a match whenever there is one.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Sequence
from functools import cache, lru_cache

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core.model import Comparison, Mode
from coursebuild.core.scripts.numbers import Number, scan, within_half_unit, within_tolerance

MARK = "\x00"
ELLIPSIS = "..."

_CLOSING = frozenset(")]},;|")

SameNumber = Callable[[Number, Number], bool]


class Canon(Struct, frozen=True):
    """A line, or a part of one between two ellipses, with its numbers marked."""

    skeleton: str
    numbers: tuple[Number, ...]
    """Their offsets count in the whole line."""
    marks: tuple[int, ...]
    """Offsets of the numbers' marks in the skeleton."""

    def numbers_at(self, part: Canon, place: int) -> tuple[Number, ...]:
        """The numbers of this line that those of a part stand for, the part standing at `place`."""
        first = bisect_left(self.marks, place)
        return self.numbers[first : first + len(part.numbers)]


def canonical(text: str, offset: int = 0) -> Canon:
    """The skeleton and the numbers of a text that stands at `offset` of its line."""
    numbers = scan(text)
    safe = text.replace(MARK, "\ufffd")
    if not numbers:
        return Canon(safe, (), ())
    marks: list[int] = []
    parts: list[str] = []
    length = previous = 0
    for index, number in enumerate(numbers):
        between = _folded(safe[previous : number.start], after_number=index > 0, before_number=True)
        parts += (between, MARK)
        marks.append(length + len(between))
        length += len(between) + 1
        previous = number.end
    parts.append(_folded(safe[previous:], after_number=True, before_number=False))
    if offset:
        moved = ((number, number.start + offset, number.end + offset) for number in numbers)
        numbers = tuple(replace(number, start=start, end=end) for number, start, end in moved)
    return Canon("".join(parts), numbers, tuple(marks))


def _folded(between: str, *, after_number: bool, before_number: bool) -> str:
    """The text between two numbers with the white space at its ends folded."""
    body = between.strip()
    if not body:
        return " " if between and after_number and before_number else ""
    if before_number:
        body = between.rstrip()
        if len(body) < len(between) and (body[-1].isalnum() or body[-1] == "_"):
            body += " "
    else:
        body = between
    if after_number:
        inner = body.lstrip()
        body = inner if len(inner) == len(body) or inner[0] in _CLOSING else " " + inner
    return body


def same_number(recorded: Number, ran: Number, comparison: Comparison) -> bool:
    """Whether a printed number is what was recorded, in a mode of comparison."""
    if recorded.text == ran.text:
        return True
    if comparison.mode is Mode.DIGITS:
        return recorded.inexact and ran.inexact and within_half_unit(recorded, ran.value)
    if comparison.mode is Mode.TOLERANCE:
        if recorded.finite and ran.finite:
            return within_tolerance(recorded.value, ran.value, comparison.rtol, comparison.atol)
        return (recorded.value.is_nan() and ran.value.is_nan()) or recorded.value == ran.value
    return False


def any_number(recorded: Number, ran: Number) -> bool:
    """Takes every pair: for lines that are alike, whatever their numbers."""
    return True


class LineMatcher:
    """Matches lines for one comparison; remembers what it has worked out about each line."""

    def __init__(self, comparison: Comparison) -> None:
        self.comparison = comparison
        self._canonical = cache(canonical)

    def elides_lines(self, recorded: str) -> bool:
        """Whether a recorded line is a `...` that stands for any lines."""
        return self.comparison.ellipsis and recorded.strip() == ELLIPSIS

    def elides(self, recorded: str) -> bool:
        """Whether a recorded line has a `...` that stands for anything."""
        return self.comparison.ellipsis and ELLIPSIS in recorded

    def same(self, recorded: Number, ran: Number) -> bool:
        """Whether two numbers match."""
        return same_number(recorded, ran, self.comparison)

    def matches(self, recorded: str, ran: str) -> bool:
        """Whether a line that ran is what was recorded."""
        if recorded == ran:
            return True
        if self.elides(recorded):
            parts = [Canon(part, (), ()) for part in recorded.split(ELLIPSIS)]
            if _find_parts(parts, Canon(ran, (), ()), any_number) is not None:
                return True
        if self.comparison.mode is Mode.EXACT:
            return False
        return self._paired(recorded, ran, self.same) is not None

    def alike(self, recorded: str, ran: str) -> bool:
        """Whether two lines differ in their numbers (and the white space around them) only."""
        return self.pairs(recorded, ran) is not None

    def pairs(self, recorded: str, ran: str) -> tuple[tuple[Number, Number], ...] | None:
        """The numbers of two lines that are alike, pair by pair; `None` if they are not alike."""
        return self._paired(recorded, ran, any_number)

    def _paired(
        self, recorded: str, ran: str, same: SameNumber
    ) -> tuple[tuple[Number, Number], ...] | None:
        line = self._canonical(ran)
        if not self.elides(recorded):
            wanted = self._canonical(recorded)
            if wanted.skeleton != line.skeleton:
                return None
            pairs = tuple(zip(wanted.numbers, line.numbers, strict=True))
            return pairs if all(same(a, b) for a, b in pairs) else None
        parts = _cut(recorded)
        places = _find_parts(parts, line, same)
        if places is None:
            return None
        return tuple(
            pair
            for part, place in zip(parts, places, strict=True)
            for pair in zip(part.numbers, line.numbers_at(part, place), strict=True)
        )


@lru_cache(maxsize=256)
def _cut(recorded: str) -> tuple[Canon, ...]:
    """The parts of a recorded line between its ellipses."""
    parts: list[Canon] = []
    offset = 0
    for text in recorded.split(ELLIPSIS):
        parts.append(canonical(text, offset))
        offset += len(text) + len(ELLIPSIS)
    return tuple(parts)


def _find_parts(parts: Sequence[Canon], line: Canon, same: SameNumber) -> list[int] | None:
    """Where the parts of a recorded line stand in the skeleton of a line that ran, if they do."""
    first, *inner, last = parts
    stop = len(line.skeleton) - len(last.skeleton)
    ends = line.skeleton.startswith(first.skeleton) and line.skeleton.endswith(last.skeleton)
    if not (ends and fits(first, line, 0, same) and fits(last, line, stop, same)):
        return None
    places = [0]
    at = len(first.skeleton)
    for part in inner:
        place = line.skeleton.find(part.skeleton, at, stop)
        while place >= 0 and not fits(part, line, place, same):
            place = line.skeleton.find(part.skeleton, place + 1, stop)
        if place < 0:
            return None
        places.append(place)
        at = place + len(part.skeleton)
    return [*places, stop] if at <= stop else None


def fits(part: Canon, line: Canon, place: int, same: SameNumber) -> bool:
    """Whether the numbers of a part match those of a line in which its skeleton is at `place`."""
    return all(map(same, part.numbers, line.numbers_at(part, place)))
