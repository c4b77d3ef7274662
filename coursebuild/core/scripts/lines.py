"""Does a recorded line match a printed line?

Entry point: `LineMatcher`.

1. `canonicalize` replaces each number of a line by a mark and folds the white space around it,
   because columns shift when a number gets wider. Two lines are alike when these skeletons are
   equal.
2. Lines that are alike match when each pair of numbers does, by the rules of the comparison's mode.
3. With `ellipsis`, a recorded line is cut at its `...`; its parts must stand in the printed line,
   in order, the first at the start and the last at the end. A part has a fixed length in the
   skeleton, so taking each at its first place finds a match whenever there is one.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from functools import cache, lru_cache

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core.model import Comparison, Mode
from coursebuild.core.scripts.mapped_text import replace_ranges
from coursebuild.core.scripts.numbers import Number, scan, within_half_unit, within_tolerance

MARK = "\x00"
ELLIPSIS = "..."

_SPACE = re.compile(rf"(?<={MARK})\s++|(?<!\s)\s++(?={MARK})")
"""White space after a number, or before one."""
_CLOSING = frozenset(")]},;|")

SameNumber = Callable[[Number, Number], bool]


class CanonicalText(Struct, frozen=True):
    """A line, or a part of one between two ellipses, with its numbers marked."""

    skeleton: str
    numbers: tuple[Number, ...]
    """Their offsets count in the whole line."""

    def numbers_at(self, part: CanonicalText, place: int) -> tuple[Number, ...]:
        """The numbers of this line that pair with those of a part whose skeleton is at `place`."""
        first = self.skeleton.count(MARK, 0, place)
        return self.numbers[first : first + len(part.numbers)]


def canonicalize(text: str, offset: int = 0) -> CanonicalText:
    """The skeleton and the numbers of a text that stands at `offset` of its line."""
    numbers = scan(text)
    places = ((number.start, number.end, MARK) for number in numbers)
    skeleton = _SPACE.sub(_fold_space, replace_ranges(text.replace(MARK, "\ufffd"), places))
    if offset:
        numbers = tuple(replace(n, start=n.start + offset, end=n.end + offset) for n in numbers)
    return CanonicalText(skeleton, numbers)


def _fold_space(match: re.Match[str]) -> str:
    """What stays of white space beside a number: one space, or none."""
    text, start, end = match.string, *match.span()
    before, after = text[max(start - 1, 0) : start], text[end : end + 1]
    if before == MARK:
        return " " if after and after not in _CLOSING else ""
    return " " if before.isalnum() else ""


def same_number(recorded: Number, printed: Number, comparison: Comparison) -> bool:
    """Whether a printed number matches the recorded one in this comparison."""
    if recorded.text == printed.text:
        return True
    if recorded.is_padded and not printed.is_padded:
        return False
    if comparison.mode is Mode.DIGITS:
        return (
            recorded.is_inexact and printed.is_inexact and within_half_unit(recorded, printed.value)
        )
    if comparison.mode is Mode.TOLERANCE:
        if recorded.is_finite and printed.is_finite:
            return within_tolerance(recorded.value, printed.value, comparison.rtol, comparison.atol)
        return (
            recorded.value.is_nan() and printed.value.is_nan()
        ) or recorded.value == printed.value
    return False


def always_match(recorded: Number, printed: Number) -> bool:
    """Accept every pair: for lines that are alike, whatever their numbers."""
    return True


class LineMatcher:
    """Matches lines for one comparison; caches the skeleton of each line."""

    def __init__(self, comparison: Comparison) -> None:
        self.comparison = comparison
        self._canonical = cache(canonicalize)

    def elides_lines(self, recorded: str) -> bool:
        """Whether a recorded line is a `...` that stands for any lines."""
        return self.comparison.ellipsis and recorded.strip() == ELLIPSIS

    def elides(self, recorded: str) -> bool:
        """Whether a recorded line has a `...` that stands for anything."""
        return self.comparison.ellipsis and ELLIPSIS in recorded

    def numbers_match(self, recorded: Number, printed: Number) -> bool:
        """Whether two numbers match."""
        return same_number(recorded, printed, self.comparison)

    def matches(self, recorded: str, printed: str) -> bool:
        """Whether a printed line matches a recorded one."""
        if recorded == printed:
            return True
        if self.elides(recorded):
            parts = [CanonicalText(part, ()) for part in recorded.split(ELLIPSIS)]
            if _find_parts(parts, CanonicalText(printed, ()), always_match) is not None:
                return True
        if self.comparison.mode is Mode.EXACT:
            return False
        return self._pair_numbers(recorded, printed, self.numbers_match) is not None

    def alike(self, recorded: str, printed: str) -> bool:
        """Whether two lines differ in their numbers (and the white space around them) only."""
        return self.pairs(recorded, printed) is not None

    def pairs(self, recorded: str, printed: str) -> tuple[tuple[Number, Number], ...] | None:
        """The numbers of two lines that are alike, pair by pair; `None` if they are not alike."""
        return self._pair_numbers(recorded, printed, always_match)

    def _pair_numbers(
        self, recorded: str, printed: str, numbers_match: SameNumber
    ) -> tuple[tuple[Number, Number], ...] | None:
        line = self._canonical(printed)
        if not self.elides(recorded):
            expected = self._canonical(recorded)
            if expected.skeleton != line.skeleton:
                return None
            number_pairs = tuple(zip(expected.numbers, line.numbers, strict=True))
            return number_pairs if all(numbers_match(a, b) for a, b in number_pairs) else None
        parts = _split_at_ellipses(recorded)
        places = _find_parts(parts, line, numbers_match)
        if places is None:
            return None
        return tuple(
            pair
            for part, place in zip(parts, places, strict=True)
            for pair in zip(part.numbers, line.numbers_at(part, place), strict=True)
        )


@lru_cache(maxsize=256)
def _split_at_ellipses(recorded: str) -> tuple[CanonicalText, ...]:
    """The parts of a recorded line between its ellipses."""
    parts: list[CanonicalText] = []
    offset = 0
    for text in recorded.split(ELLIPSIS):
        parts.append(canonicalize(text, offset))
        offset += len(text) + len(ELLIPSIS)
    return tuple(parts)


def _find_parts(
    parts: Sequence[CanonicalText], line: CanonicalText, numbers_match: SameNumber
) -> list[int] | None:
    """Where the parts of a recorded line stand in the skeleton of a printed line, if they do."""
    first, *inner, last = parts
    stop = len(line.skeleton) - len(last.skeleton)
    ends = line.skeleton.startswith(first.skeleton) and line.skeleton.endswith(last.skeleton)
    if not (
        ends
        and numbers_fit(first, line, 0, numbers_match)
        and numbers_fit(last, line, stop, numbers_match)
    ):
        return None
    places = [0]
    at = len(first.skeleton)
    for part in inner:
        place = line.skeleton.find(part.skeleton, at, stop)
        while place >= 0 and not numbers_fit(part, line, place, numbers_match):
            place = line.skeleton.find(part.skeleton, place + 1, stop)
        if place < 0:
            return None
        places.append(place)
        at = place + len(part.skeleton)
    return [*places, stop] if at <= stop else None


def numbers_fit(
    part: CanonicalText, line: CanonicalText, place: int, numbers_match: SameNumber
) -> bool:
    """Whether the numbers of a part match those of a line in which its skeleton is at `place`."""
    return all(map(numbers_match, part.numbers, line.numbers_at(part, place)))
