"""Texts to compare, and whether a recorded line matches a printed line.

1. A `MappedText` knows where each character came from: a copied one from its own place, one that a
   filter wrote from all that the filter replaced.
2. `canonicalize` replaces each number of a line by a mark and folds the white space around it,
   because columns shift when a number gets wider. Two lines are alike when these skeletons are
   equal, and match when each pair of numbers does, by the rules of the comparison's mode.
3. With `ellipsis`, a recorded line is cut at its `...`; its parts must stand in the printed line,
   in order, the first at the start and the last at the end. A part has a fixed length in the
   skeleton, so taking each at its first place finds a match whenever there is one.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import lru_cache
from itertools import accumulate, chain

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core.model import Comparison, Filter, Mode
from coursebuild.core.text.numbers import (
    Number,
    scan,
    with_powers,
    within_half_unit,
    within_tolerance,
)
from coursebuild.core.text.patterns import replacements
from coursebuild.core.text.regex import regex

_LINE_END = regex(r"\r\n?|\n")
# Possessive, and only at the start of a run, so that long runs of white space take linear time; not
# where a line ends in LF alone, as nearly all do.
_END_OF_LINE = regex(r"(?<![^\S\r\n])(?!\n)[^\S\r\n]*+(?:\r\n?|\n|\Z)")
_EMPTY_LINES = regex(r"(?:\A|(?<=[^\n]\n))\n++\Z")


class MappedText(Struct, frozen=True):
    """A text whose characters know which range of the origin each of them stands for."""

    text: str
    starts: Sequence[int]
    """Where the range of each character begins."""
    ends: Sequence[int]

    @classmethod
    def copy(cls, text: str, start: int = 0) -> MappedText:
        """A text that stands in the origin, character by character, from `start` on."""
        return cls(text, range(start, start + len(text)), range(start + 1, start + len(text) + 1))

    @classmethod
    def substitute_for(cls, start: int, end: int, text: str) -> MappedText:
        """A text of which each character stands for all of a range of the origin."""
        return cls(text, [start] * len(text), [end] * len(text))

    @classmethod
    def join(cls, parts: Sequence[MappedText]) -> MappedText:
        """Texts put together."""
        starts = list(chain.from_iterable(part.starts for part in parts))
        ends = list(chain.from_iterable(part.ends for part in parts))
        return cls("".join([part.text for part in parts]), starts, ends)

    @classmethod
    def of_output(cls, text: str) -> MappedText:
        """An output with LF line ends, without white space at ends of lines and at its end."""
        return cls.copy(text).substitute(_END_OF_LINE, "\n").substitute(_EMPTY_LINES, "")

    def origin(self, start: int, end: int) -> tuple[int, int]:
        """The smallest range of the origin that `text[start:end]` came from; empty for no text."""
        if start < end:
            return self.starts[start], max(self.ends[start:end])
        places = self.starts[start:] or self.ends[-1:] or (0,)
        return places[0], places[0]

    def slice(self, start: int, end: int | None = None) -> MappedText:
        """The mapped text `text[start:end]`."""
        return MappedText(self.text[start:end], self.starts[start:end], self.ends[start:end])

    def substitute(self, pattern: re.Pattern[str], text: str) -> MappedText:
        """The text with each match replaced."""
        return self.replace_ranges({match.span(): text for match in pattern.finditer(self.text)})

    def replace_ranges(self, places: Mapping[tuple[int, int], str]) -> MappedText:
        """The text with ranges replaced; `places` maps each (start, end), in order, to its text."""
        parts: list[MappedText] = []
        at = 0
        for (start, end), new in places.items():
            if new != self.text[start:end]:
                parts.append(self.slice(at, start))
                parts.append(MappedText.substitute_for(*self.origin(start, end), new))
                at = end
        return MappedText.join([*parts, self.slice(at)]) if parts else self


def apply_filters(mapped: MappedText, filters: Iterable[Filter]) -> MappedText:
    """The text after the filters."""
    for rule in filters:
        if places := replacements(rule.pattern, rule.replacement, mapped.text):
            mapped = mapped.replace_ranges(places)
    return mapped


def replace_ranges(text: str, places: Iterable[tuple[int, int, str]]) -> str:
    """The text with ranges replaced; `places` holds start, end and new text of each, in order."""
    parts: list[str] = []
    at = 0
    for start, end, replacement in places:
        parts += (text[at:start], replacement)
        at = end
    return "".join((*parts, text[at:]))


def plain_text(text: str) -> str:
    """The text with ASCII minus signs and single spaces."""
    return " ".join(text.replace("\u2212", "-").split())


class Side(Struct, frozen=True):
    """One side of a comparison."""

    raw: str
    """Before the filters, its line ends as they came."""
    mapped: MappedText
    lines: tuple[str, ...]
    """Without white space at their ends, and without empty ones at the end."""
    starts: tuple[int, ...]
    """Where the lines begin in the mapped text."""

    @classmethod
    def of(cls, text: str, filters: Iterable[Filter] = ()) -> Side:
        """The lines of a text after the filters."""
        mapped = apply_filters(MappedText.of_output(text), filters)
        parts = mapped.text.split("\n")
        starts = accumulate((len(part) + 1 for part in parts), initial=0)
        lines = [part.rstrip() for part in parts]
        while lines and not lines[-1]:
            lines.pop()
        return cls(text, mapped, tuple(lines), tuple(starts))

    def origin(self, line: int, start: int, end: int) -> tuple[int, int]:
        """Where `lines[line].text[start:end]` stands in the raw text."""
        at = self.starts[line]
        return self.mapped.origin(at + start, at + end)

    def raw_lines(self, line: int) -> tuple[str, ...]:
        """The lines of raw text that a line came from, without trailing white space.

        There are several where a filter took line ends away. What a filter deleted before a line
        belongs to the line above it; the first line has all that was deleted before it.
        """
        start = 0 if line == 0 else self.origin(line, 0, 0)[0]
        last = line + 1 == len(self.lines)
        stop = len(self.raw) if last else max(start, self.origin(line + 1, 0, 0)[0])
        lines = [text.rstrip() for text in _LINE_END.split(self.raw[start:stop])]
        while len(lines) > 1 and not lines[-1]:
            lines.pop()
            if not last:
                break
        return tuple(lines)


MARK = "\x00"
ELLIPSIS = "..."

_SPACE = regex(rf"(?<={MARK})\s++|(?<!\s)\s++(?={MARK})")
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


@lru_cache(maxsize=8192)
def canonicalize(
    text: str, offset: int = 0, *, has_powers: bool = False, is_grouped: bool = False
) -> CanonicalText:
    """The skeleton and the numbers of a text that stands at `offset` of its line.

    `has_powers`: a person wrote it, with numbers such as `3.9 × 10⁻¹¹`; `is_grouped`: `1,234` is
    one number.
    """
    numbers = scan(text, is_grouped)
    numbers = with_powers(text, numbers) if has_powers else numbers
    places = ((number.start, number.end, MARK) for number in numbers)

    def fold_space(match: re.Match[str]) -> str:
        line, start, end = match.string, *match.span()
        before, after = line[max(start - 1, 0) : start], line[end : end + 1]
        if before == MARK:
            return " " if after and after not in _CLOSING else ""
        return " " if before.isalnum() else ""

    skeleton = _SPACE.sub(fold_space, replace_ranges(text.replace(MARK, "\ufffd"), places))
    if offset:
        numbers = tuple(replace(n, start=n.start + offset, end=n.end + offset) for n in numbers)
    return CanonicalText(skeleton, numbers)


def masked(text: str, is_grouped: bool = False) -> str:
    """A text with `#` for each of its numbers, white space folded."""
    skeleton = canonicalize(text, is_grouped=is_grouped).skeleton
    return plain_text(skeleton.replace(MARK, " # "))


def same_number(recorded: Number, printed: Number, comparison: Comparison) -> bool:
    """Whether a printed number matches the recorded one in this comparison."""
    if recorded.text == printed.text:
        return True
    if recorded.is_padded and not printed.is_padded:
        return False
    if comparison.mode is Mode.DIGITS:
        are_rounded = recorded.is_inexact and printed.is_inexact
        if recorded.place < printed.place and recorded.value == printed.value:
            return False  # its last zeros were not printed
        return are_rounded and within_half_unit(recorded, printed.value)
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
    """Matches lines for one comparison."""

    def __init__(self, comparison: Comparison) -> None:
        self.comparison = comparison

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
            parts = recorded.split(ELLIPSIS)
            lengths = list(map(len, parts))
            if find_in_order(lengths, len(printed), lambda i, at: printed.startswith(parts[i], at)):
                return True
        if self.comparison.mode is Mode.EXACT:
            return False
        return self._pair_numbers(recorded, printed, self.numbers_match) is not None

    def pairs(self, recorded: str, printed: str) -> tuple[tuple[Number, Number], ...] | None:
        """The numbers of two lines that are alike, pair by pair; `None` if they are not alike."""
        return self._pair_numbers(recorded, printed, always_match)

    def _pair_numbers(
        self, recorded: str, printed: str, numbers_match: SameNumber
    ) -> tuple[tuple[Number, Number], ...] | None:
        line = canonicalize(printed)
        if not self.elides(recorded):
            expected = canonicalize(recorded)
            if expected.skeleton != line.skeleton:
                return None
            number_pairs = tuple(zip(expected.numbers, line.numbers, strict=True))
            return number_pairs if all(numbers_match(a, b) for a, b in number_pairs) else None
        parts = _split_at_ellipses(recorded)
        places = find_in_order(
            [len(part.skeleton) for part in parts],
            len(line.skeleton),
            lambda i, at: (
                line.skeleton.startswith(parts[i].skeleton, at)
                and numbers_fit(parts[i], line, at, numbers_match)
            ),
        )
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


def find_in_order(
    lengths: Sequence[int], total: int, fits: Callable[[int, int], bool]
) -> list[int] | None:
    """Where parts between ellipses stand, if they do.

    The first stands at the start, the last at the end, each other one at the first place where it
    fits. `lengths` are those of the parts; `fits(part, place)` says whether one stands at a place.
    """
    last, stop = len(lengths) - 1, total - lengths[-1]
    if stop < lengths[0] or not (fits(0, 0) and fits(last, stop)):
        return None
    places, at = [0], lengths[0]
    for part in range(1, last):
        options = range(at, stop - lengths[part] + 1)
        place = next((place for place in options if fits(part, place)), None)
        if place is None:
            return None
        places.append(place)
        at = place + lengths[part]
    return [*places, stop]


def numbers_fit(
    part: CanonicalText, line: CanonicalText, place: int, numbers_match: SameNumber
) -> bool:
    """Whether the numbers of a part match those of a line in which its skeleton is at `place`."""
    return all(map(numbers_match, part.numbers, line.numbers_at(part, place)))
