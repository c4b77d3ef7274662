"""Texts to compare: filtered, split into lines, every part with the place that it came from.

Entry points: `MappedText.of_text`, `filtered`, `Side.of`.

1. `MappedText` is a text with its origin: stretches that are copies know it character by character,
   a stretch that a filter wrote stands for all that it replaced.
2. `filtered` applies the course's filters, one after the other, each to the whole text (`^` and `$`
   match at lines), after white space that does not count has gone.
3. A `Side` is what one side of a comparison has: the lines without trailing white space and without
   trailing empty lines.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Iterable, Sequence
from functools import lru_cache

from msgspec import Struct

from coursebuild.core.model import Filter
from coursebuild.core.text.patterns import pattern

_LINE_END = pattern(r"\r\n?|\n")


class MappingSegment(Struct, frozen=True):
    """A stretch of a mapped text, up to the next piece."""

    at: int
    """Offset in the text."""
    start: int
    """Offset in the origin."""
    end: int
    """Offset in the origin."""
    verbatim: bool
    """Copied character by character; otherwise all of the stretch stands for `[start, end)`."""


class MappedText(Struct, frozen=True):
    """A text whose characters know where they came from; pieces are in order, without gaps."""

    text: str
    pieces: tuple[MappingSegment, ...]

    @classmethod
    def of_text(cls, text: str) -> MappedText:
        """A text that is its own origin."""
        return cls(text, (MappingSegment(0, 0, len(text), True),))

    @classmethod
    def of_output(cls, text: str) -> MappedText:
        """An output without what does not count.

        Line ends are LF, the last line has one too, no line ends in white space, no empty lines
        stand at the end.
        """
        lines = _bare_lines(text)
        pieces: list[MappingSegment] = []
        at = copied = copied_from = 0
        for line, start, end in lines:
            stop = start + len(line)
            at += len(line) + 1
            if end == stop + 1 and text[stop] == "\n":
                continue
            # The copy that began at `copied` ends before this line's end, which is made anew.
            if at - 1 > copied:
                pieces.append(MappingSegment(copied, copied_from, stop, True))
            pieces.append(MappingSegment(at - 1, stop, end, False))
            copied, copied_from = at, end
        if at > copied:
            pieces.append(MappingSegment(copied, copied_from, copied_from + at - copied, True))
        joined = "".join(line + "\n" for line, _, _ in lines)
        return cls(joined, tuple(pieces) or (MappingSegment(0, 0, 0, False),))

    def _piece(self, at: int) -> MappingSegment:
        return self.pieces[max(0, bisect_right(self.pieces, at, key=lambda piece: piece.at) - 1)]

    def origin(self, start: int, end: int) -> tuple[int, int]:
        """The smallest range of the origin that `text[start:end]` came from; empty for no text."""
        first, last = self._piece(start), self._piece(max(start, end - 1))
        low = first.start + start - first.at if first.verbatim else first.start
        high = last.start + end - last.at if last.verbatim else last.end
        return low, low if start == end else max(low, high)

    def substituted(self, pattern: re.Pattern[str], replacement: str) -> MappedText:
        """`pattern.sub(replacement, text)`, mapped."""
        parts: list[str] = []
        pieces: list[MappingSegment] = []
        length = copied = 0
        for found in pattern.finditer(self.text):
            self._copy(copied, found.start(), length, pieces)
            parts.append(self.text[copied : found.start()])
            length += found.start() - copied
            copied = found.end()
            written = found.expand(replacement)
            if written:
                pieces.append(
                    MappingSegment(length, *self._replaced(found.start(), found.end()), False)
                )
                parts.append(written)
                length += len(written)
        self._copy(copied, len(self.text), length, pieces)
        parts.append(self.text[copied:])
        return MappedText(
            "".join(parts), tuple(pieces) or (MappingSegment(0, 0, self.pieces[-1].end, False),)
        )

    def _replaced(self, start: int, end: int) -> tuple[int, int]:
        """What a replacement of `text[start:end]` stands for.

        Where nothing is replaced, inside or at the end of what was written by another replacement,
        that is what the other one stands for: there is no place between its characters.
        """
        piece = self._piece(start)
        if start == end and not piece.verbatim and start > piece.at:
            return piece.start, piece.end
        return self.origin(start, end)

    def _copy(self, start: int, end: int, at: int, into: list[MappingSegment]) -> None:
        """Append the pieces of `text[start:end]`, which will stand at offset `at`."""
        if start == end:
            return
        index = max(0, bisect_right(self.pieces, start, key=lambda piece: piece.at) - 1)
        for piece in self.pieces[index:]:
            if piece.at >= end:
                break
            skipped = max(0, start - piece.at)
            new_at = at + max(piece.at, start) - start
            if piece.verbatim:
                stop = min(piece.end, piece.start + end - piece.at)
                into.append(MappingSegment(new_at, piece.start + skipped, stop, True))
            else:
                into.append(MappingSegment(new_at, piece.start, piece.end, False))


def _bare_lines(text: str) -> list[tuple[str, int, int]]:
    """Lines without white space at their ends, where each begins, and where the next one does."""
    lines: list[tuple[str, int, int]] = []
    start = 0
    for found in _LINE_END.finditer(text):
        lines.append((text[start : found.start()].rstrip(), start, found.end()))
        start = found.end()
    lines.append((text[start:].rstrip(), start, len(text)))
    while lines and not lines[-1][0]:
        lines.pop()
    return lines


@lru_cache(maxsize=64)
def _compiled(pattern: str) -> re.Pattern[str]:
    return re.compile(pattern, re.MULTILINE)


def filtered(mapped: MappedText, filters: Iterable[Filter]) -> MappedText:
    """The text after the filters."""
    for rule in filters:
        pattern = _compiled(rule.pattern)
        if pattern.search(mapped.text):
            mapped = mapped.substituted(pattern, rule.replacement)
    return mapped


class Line(Struct, frozen=True):
    """A line: its text without trailing white space, and where it begins in its side's text."""

    at: int
    text: str


class Side(Struct, frozen=True):
    """One side of a comparison."""

    raw: str
    """Before the filters, its line ends as they came."""
    mapped: MappedText
    lines: tuple[Line, ...]

    @classmethod
    def of(cls, text: str, filters: Iterable[Filter] = ()) -> Side:
        """The lines of a text after the filters."""
        mapped = filtered(MappedText.of_output(text), filters)
        lines: list[Line] = []
        at = 0
        for line in mapped.text.split("\n"):
            lines.append(Line(at, line.rstrip()))
            at += len(line) + 1
        while lines and not lines[-1].text:
            lines.pop()
        return cls(text, mapped, tuple(lines))

    @property
    def texts(self) -> tuple[str, ...]:
        """The lines' texts."""
        return tuple(line.text for line in self.lines)

    def origin(self, line: int, start: int, end: int) -> tuple[int, int]:
        """Where `lines[line].text[start:end]` stands in the raw text."""
        at = self.lines[line].at
        return self.mapped.origin(at + start, at + end)

    def line_starts(self) -> list[int]:
        """Offsets in the raw text at which its lines begin."""
        return [0, *(found.end() for found in _LINE_END.finditer(self.raw))]

    def raw_line(self, line: int, line_starts: Sequence[int]) -> int:
        """The number, from 1, of the raw line that a line begins on."""
        return bisect_right(line_starts, self.origin(line, 0, 0)[0])

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
