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

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core.model import Comparison, Mode
from coursebuild.core.scripts.numbers import Number, scan, within_half_unit, within_tolerance

MARK = "\x00"
ELLIPSIS = "..."

_CLOSING = frozenset(")]},;|")
_PATIENCE = 2_000_000
"""Numbers compared before a line with ellipses is taken for one that does not match."""
_SEARCH = 32
"""Characters searched for at the cost of comparing one number."""

SameNumber = Callable[[Number, Number], bool]


class Canon(Struct, frozen=True):
    """A line, or a part of one between two ellipses, with its numbers marked."""

    skeleton: str
    numbers: tuple[Number, ...]
    """Their offsets count in the whole line."""
    marks: tuple[int, ...]
    """Offsets of the numbers' marks in the skeleton."""
    cut_before: bool = False
    """Begins with a number whose front may be elided."""
    cut_after: bool = False
    """Ends with a number whose rest may be elided."""


def canonical(text: str, offset: int = 0, *, after_cut: bool = False) -> Canon:
    """The skeleton and the numbers of a text that stands at `offset` of its line."""
    numbers = scan(text)
    if not numbers:
        return Canon(text.replace(MARK, "\ufffd"), (), ())
    safe = text.replace(MARK, "\ufffd")
    parts: list[str] = []
    marks: list[int] = []
    length = previous = 0
    for index, number in enumerate(numbers):
        between = _folded(safe[previous : number.start], after_number=index > 0, before_number=True)
        parts += (between, MARK)
        marks.append(length + len(between))
        length += len(between) + 1
        previous = number.end
    parts.append(_folded(safe[previous:], after_number=True, before_number=False))
    if offset:
        numbers = tuple(
            replace(number, start=number.start + offset, end=number.end + offset)
            for number in numbers
        )
    cut_before = after_cut and parts[0] == "" and text[:1].strip() != ""
    return Canon("".join(parts), numbers, tuple(marks), cut_before)


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
        return (recorded.value.is_nan() and ran.value.is_nan()) or (
            recorded.value.is_infinite() and recorded.value == ran.value
        )
    return False


def any_number(recorded: Number, ran: Number) -> bool:
    """Takes every pair: for lines that are alike, whatever their numbers."""
    return True


class LineMatcher:
    """Matches lines for one comparison; remembers what it has worked out about each line."""

    def __init__(self, comparison: Comparison) -> None:
        self.comparison = comparison
        self._canons: dict[str, Canon] = {}
        self._parts: dict[str, tuple[Canon, ...]] = {}

    def canon(self, text: str) -> Canon:
        """A line's skeleton and numbers."""
        found = self._canons.get(text)
        if found is None:
            found = self._canons[text] = canonical(text)
        return found

    def elides_lines(self, recorded: str) -> bool:
        """Whether a recorded line is a `...` that stands for any lines."""
        return self.comparison.ellipsis and recorded.strip() == ELLIPSIS

    def elides(self, recorded: str) -> bool:
        """Whether a recorded line has a `...` that stands for anything."""
        return self.comparison.ellipsis and ELLIPSIS in recorded

    def parts(self, recorded: str) -> tuple[Canon, ...]:
        """The parts of a recorded line between its ellipses."""
        found = self._parts.get(recorded)
        if found is None:
            found = self._parts[recorded] = _cut(recorded)
        return found

    def same(self, recorded: Number, ran: Number) -> bool:
        """Whether two numbers match."""
        return same_number(recorded, ran, self.comparison)

    def matches(self, recorded: str, ran: str) -> bool:
        """Whether a line that ran is what was recorded."""
        if recorded == ran:
            return True
        if self.elides(recorded) and _wildcard(recorded.split(ELLIPSIS), ran):
            return True
        if self.comparison.mode is Mode.EXACT:
            return False
        return self._paired(recorded, ran, self.same) is not None

    def alike(self, recorded: str, ran: str) -> bool:
        """Whether two lines differ in their numbers (and the white space around them) only."""
        return self._paired(recorded, ran, any_number) is not None

    def pairs(self, recorded: str, ran: str) -> tuple[tuple[Number, Number], ...] | None:
        """The numbers of two lines that are alike, pair by pair; `None` if they are not alike."""
        return self._paired(recorded, ran, any_number)

    def _paired(
        self, recorded: str, ran: str, same: SameNumber
    ) -> tuple[tuple[Number, Number], ...] | None:
        line = self.canon(ran)
        if not self.elides(recorded):
            wanted = self.canon(recorded)
            if wanted.skeleton != line.skeleton or len(wanted.numbers) != len(line.numbers):
                return None
            pairs = tuple(zip(wanted.numbers, line.numbers, strict=True))
            return pairs if all(same(a, b) for a, b in pairs) else None
        parts = self.parts(recorded)
        places = find_parts(parts, line, same)
        if places is None:
            return None
        return tuple(
            pair
            for part, place in zip(parts, places, strict=True)
            for pair in zip(part.numbers, numbers_at(part, line, place), strict=True)
        )


def _cut(recorded: str) -> tuple[Canon, ...]:
    parts: list[Canon] = []
    texts = recorded.split(ELLIPSIS)
    offset = 0
    for index, text in enumerate(texts):
        last = index == len(texts) - 1
        part = canonical(text, offset, after_cut=index > 0)
        ends = part.numbers and part.numbers[-1].end == offset + len(text)
        parts.append(replace(part, cut_after=bool(ends) and not last))
        offset += len(text) + len(ELLIPSIS)
    return tuple(parts)


def _wildcard(parts: Sequence[str], line: str) -> bool:
    first, last = parts[0], parts[-1]
    end = len(line) - len(last)
    if not (line.startswith(first) and line.endswith(last)) or end < len(first):
        return False
    at = len(first)
    for part in parts[1:-1]:
        found = line.find(part, at, end)
        if found < 0:
            return False
        at = found + len(part)
    return True


def numbers_at(part: Canon, line: Canon, place: int) -> tuple[Number, ...]:
    """The numbers of a line that those of a part stand for, the part's skeleton at `place`."""
    first = bisect_left(line.marks, place)
    return line.numbers[first : first + len(part.numbers)]


def find_parts(parts: Sequence[Canon], line: Canon, same: SameNumber) -> tuple[int, ...] | None:
    """Where the parts of a recorded line stand in a line that ran: offsets in its skeleton.

    The first part stands at the start and the last at the end. `None` where they don't fit, or
    when finding out takes too long.
    """
    ends = {0, len(parts) - 1}
    stop = len(line.skeleton) - len(parts[-1].skeleton)
    places: list[int] = []
    at = 0
    budget = _PATIENCE
    for index, part in enumerate(parts):
        place = stop if index == len(parts) - 1 else at
        limit = place + len(part.skeleton) if index in ends else stop
        while True:
            if place < at or budget < 0:
                return None
            place = line.skeleton.find(part.skeleton, place, limit)
            if place < 0:
                return None
            misfit = first_misfit(part, line, place, same)
            if misfit is None:
                break
            if index in ends:
                return None
            budget -= misfit + 1 + len(part.skeleton) // _SEARCH
            place += 1
        places.append(place)
        at = place + len(part.skeleton)
    return tuple(places)


def first_misfit(part: Canon, line: Canon, place: int, same: SameNumber) -> int | None:
    """The index of the first number of a part that does not match the one of the line.

    The part's skeleton stands in the line's at offset `place`.
    """
    first = bisect_left(line.marks, place)
    for index, recorded in enumerate(part.numbers):
        ran = line.numbers[first + index]
        if same(recorded, ran):
            continue
        elided_after = part.cut_after and index == len(part.numbers) - 1
        if elided_after and ran.text.startswith(recorded.text):
            continue
        if not (part.cut_before and index == 0 and ran.text.endswith(recorded.text)):
            return index
    return None
