"""Texts to compare: filtered, split into lines, every part with the place that it came from.

Entry points: `apply_filters`, `Side.of`, `plain_text`.

1. A `MappedText` knows where its text came from: copied stretches character by character, a stretch
   that a filter wrote as a whole.
2. `apply_filters` removes insignificant white space, then applies the course's filters one after
   the other, each to the whole text (`^` and `$` match at lines).
3. A `Side` is one side of a comparison: its lines without trailing white space, and without
   trailing empty lines.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Iterable, Mapping
from itertools import accumulate

from msgspec import Struct

from coursebuild.core.model import Filter
from coursebuild.core.text.patterns import replacements

_LINE_END = re.compile(r"\r\n?|\n")
# Possessive, and only at the start of a run, so that long runs of white space take linear time; not
# where a line ends in LF alone, as nearly all do.
_END_OF_LINE = re.compile(r"(?<![^\S\r\n])(?!\n)[^\S\r\n]*+(?:\r\n?|\n|\Z)")
_EMPTY_LINES = re.compile(r"(?:\A|(?<=[^\n]\n))\n++\Z")


class MappingSegment(Struct, frozen=True):
    """A stretch of a mapped text, up to the next segment."""

    at: int
    """Offset in the text."""
    start: int
    """Offset in the origin."""
    end: int
    """Offset in the origin."""
    is_verbatim: bool
    """Copied character by character; otherwise all of the stretch stands for `[start, end)`."""


class MappedText(Struct, frozen=True):
    """A text whose characters know where they came from; segments are in order, without gaps."""

    text: str
    segments: tuple[MappingSegment, ...]

    @classmethod
    def of_text(cls, text: str) -> MappedText:
        """A text that is its own origin."""
        return cls(text, (MappingSegment(0, 0, len(text), True),))

    @classmethod
    def of_output(cls, text: str) -> MappedText:
        """An output without insignificant white space.

        Line ends are LF, the last line has one too, no line ends in white space, no empty lines
        stand at the end.
        """
        mapped = cls.of_text(text).substitute(_END_OF_LINE, "\n")
        return mapped.substitute(_EMPTY_LINES, "")

    def _segment_index(self, at: int) -> int:
        """The index of the segment that an offset is in."""
        return max(0, bisect_right(self.segments, at, key=lambda segment: segment.at) - 1)

    def origin(self, start: int, end: int) -> tuple[int, int]:
        """The smallest range of the origin that `text[start:end]` came from; empty for no text."""
        first = self.segments[self._segment_index(start)]
        last = self.segments[self._segment_index(max(start, end - 1))]
        low = first.start + start - first.at if first.is_verbatim else first.start
        high = last.start + end - last.at if last.is_verbatim else last.end
        return low, low if start == end else max(low, high)

    def substitute(self, pattern: re.Pattern[str], text: str) -> MappedText:
        """The text with each match replaced."""
        return self.replace_ranges({match.span(): text for match in pattern.finditer(self.text)})

    def replace_ranges(self, places: Mapping[tuple[int, int], str]) -> MappedText:
        """The text with ranges replaced; `places` maps each (start, end), in order, to its text."""
        parts: list[str] = []
        segments: list[MappingSegment] = []
        length = copied_to = 0
        for (start, end), replacement in places.items():
            if replacement == self.text[start:end]:
                continue
            self._copy(copied_to, start, length, segments)
            parts += (self.text[copied_to:start], replacement)
            length += start - copied_to
            copied_to = end
            if replacement:
                origin = self._replaced_origin(start, end)
                segments.append(MappingSegment(length, *origin, False))
                length += len(replacement)
        self._copy(copied_to, len(self.text), length, segments)
        parts.append(self.text[copied_to:])
        empty_segment = MappingSegment(0, 0, self.segments[-1].end, False)
        return MappedText("".join(parts), tuple(segments) or (empty_segment,))

    def _replaced_origin(self, start: int, end: int) -> tuple[int, int]:
        """The range of the origin that a replacement of `text[start:end]` stands for.

        An insertion inside or at the end of an earlier replacement stands for the same range as
        that: no character of the origin lies between its characters.
        """
        segment = self.segments[self._segment_index(start)]
        if start == end and not segment.is_verbatim and start > segment.at:
            return segment.start, segment.end
        return self.origin(start, end)

    def _copy(self, start: int, end: int, at: int, segments: list[MappingSegment]) -> None:
        """Append the segments of `text[start:end]`, which will stand at offset `at`."""
        if start == end:
            return
        for index in range(self._segment_index(start), len(self.segments)):
            segment = self.segments[index]
            if segment.at >= end:
                break
            new_at = at + max(segment.at, start) - start
            if segment.is_verbatim:
                first = segment.start + max(0, start - segment.at)
                stop = min(segment.end, segment.start + end - segment.at)
                segments.append(MappingSegment(new_at, first, stop, True))
            else:
                segments.append(MappingSegment(new_at, segment.start, segment.end, False))


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
