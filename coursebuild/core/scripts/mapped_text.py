"""Texts to compare: filtered, split into lines, every part with the place that it came from.

Entry points: `apply_filters`, `Side.of`, `plain_text`.

1. A `MappedText` knows where each character came from: a copied one from its own place, one that a
   filter wrote from all that the filter replaced.
2. `apply_filters` removes insignificant white space, then applies the course's filters one after
   the other, each to the whole text (`^` and `$` match at lines).
3. A `Side` is one side of a comparison: its lines without trailing white space, and without
   trailing empty lines.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from itertools import accumulate, chain

from msgspec import Struct

from coursebuild.core.model import Filter
from coursebuild.core.text.patterns import replacements

_LINE_END = re.compile(r"\r\n?|\n")
# Possessive, and only at the start of a run, so that long runs of white space take linear time; not
# where a line ends in LF alone, as nearly all do.
_END_OF_LINE = re.compile(r"(?<![^\S\r\n])(?!\n)[^\S\r\n]*+(?:\r\n?|\n|\Z)")
_EMPTY_LINES = re.compile(r"(?:\A|(?<=[^\n]\n))\n++\Z")


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
        """An output without insignificant white space.

        Line ends are LF, the last line has one too, no line ends in white space, no empty lines
        stand at the end.
        """
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
    """Without trailing white space."""
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

    def raw_line(self, line: int) -> int:
        """The number, from 1, of the raw line that a line begins on."""
        return 1 + len(_LINE_END.findall(self.raw[: self.origin(line, 0, 0)[0]]))

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
