"""Text with positions: where each character of a course file stands.

Line ends are kept as on disk, so offsets serve edits byte for byte; lines and columns are worked
out only when a message is made. An `Excerpt` is what a parser of an inner language reads: prefixes,
indentation and escapes are gone from its text, and its pieces say where each part came from.
"""

from __future__ import annotations

import hashlib
import re
from bisect import bisect_left, bisect_right
from collections.abc import Container, Sequence
from functools import cached_property
from itertools import accumulate, chain, count
from operator import itemgetter

from msgspec import Struct

from coursebuild.core.text.regex import regex

_NEWLINE = regex(r"\r\n|\r|\n")


def text_digest(text: str) -> bytes:
    """SHA-256 of a text in UTF-8."""
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).digest()


def key_of(*texts: str) -> str:
    """The SHA-256 of some texts in hexadecimal digits: a name for what is made from them."""
    return text_digest("\0".join(texts)).hex()


def unique_name(name: str, used_names: Container[str], separator: str = "-") -> str:
    """A name that is not in use: the name itself, or with a number behind it, from 2."""
    numbered_names = (f"{name}{separator}{number}" for number in count(2))
    return next(n for n in chain([name], numbered_names) if n not in used_names)


class Source(Struct, frozen=True, dict=True):
    """One text file of a course."""

    path: str
    """POSIX path relative to the course's root."""
    text: str

    def __repr__(self) -> str:
        return f"Source({self.path!r})"

    @cached_property
    def digest(self) -> bytes:
        return text_digest(self.text)

    @cached_property
    def line_starts(self) -> list[int]:
        """Offsets at which lines begin; a line ends with LF, CRLF or CR, as in CommonMark."""
        if "\r" in self.text:
            return [0, *[m.end() for m in _NEWLINE.finditer(self.text)]]
        sizes = [len(line) + 1 for line in self.text.split("\n")]
        return list(accumulate(sizes[:-1], initial=0))

    def position(self, offset: int) -> tuple[int, int]:
        """Line and column of an offset, both from 1; columns count code points."""
        line = bisect_right(self.line_starts, offset)
        return line, offset - self.line_starts[line - 1] + 1

    def line_start(self, line: int) -> int:
        """Where a line (from 1) begins; the end of the text past the last one."""
        return self.line_starts[line - 1] if line <= len(self.line_starts) else len(self.text)

    def line_text(self, line: int) -> str:
        """The text of a line (from 1) without its line end; empty past the last line."""
        return self.text[self.line_start(line) : self.line_start(line + 1)].rstrip("\r\n")

    def span(self, start: int = 0, end: int | None = None) -> Span:
        """The span from `start` to `end` (default: the whole text)."""
        return Span(self, start, len(self.text) if end is None else end)

    def excerpt(self, line_end: str = r"\r\n|\r") -> Excerpt:
        """The whole text, with LF in place of each match of `line_end`."""
        whole = Excerpt.of_span(self.span())
        breaks = [match.span() for match in re.finditer(line_end, self.text)]
        starts, ends = (0, *(b for _, b in breaks)), (*(a for a, _ in breaks), len(self.text))
        return Excerpt.join([whole.slice(a, b) for a, b in zip(starts, ends, strict=True)], "\n")


class Span(Struct, frozen=True):
    """A half-open range `[start, end)` of offsets into a source."""

    source: Source
    start: int
    end: int

    @property
    def text(self) -> str:
        return self.source.text[self.start : self.end]

    @property
    def path(self) -> str:
        return self.source.path

    @property
    def line(self) -> int:
        """First line, from 1."""
        return self.source.position(self.start)[0]

    @property
    def column(self) -> int:
        """First column, from 1."""
        return self.source.position(self.start)[1]

    @property
    def end_line(self) -> int:
        """Line of the end, from 1."""
        return self.source.position(self.end)[0]

    @property
    def end_column(self) -> int:
        """Column just past the last character, from 1."""
        return self.source.position(self.end)[1]

    def to(self, last: Span) -> Span:
        """The span from the start of this one to the end of another."""
        return Span(self.source, self.start, max(self.end, last.end))

    def first_line(self) -> Span:
        """The part of this span that lies on its first line (for messages about long blocks)."""
        end = self.start + len(_NEWLINE.split(self.text, maxsplit=1)[0])
        return Span(self.source, self.start, end)

    def contains(self, inner: Span) -> bool:
        """Whether another span lies inside this one."""
        return self.source is inner.source and self.start <= inner.start and inner.end <= self.end


class Excerpt(Struct, frozen=True):
    """Text out of a source; its pieces say where each part of the text stands."""

    source: Source
    text: str
    pieces: tuple[tuple[int, int], ...]
    """(offset in the text, offset in the source), growing; the first is at text offset 0."""

    @property
    def digest(self) -> bytes:
        return text_digest(self.text)

    @classmethod
    def of_span(cls, span: Span) -> Excerpt:
        """A span's own text."""
        return cls(span.source, span.text, ((0, span.start),))

    @classmethod
    def join(cls, parts: Sequence[Excerpt], separator: str = "") -> Excerpt:
        """Excerpts of one source, at least one, put together."""
        pieces: list[tuple[int, int]] = []
        at, shift = 0, None
        for part in parts:
            for start, offset in part.pieces:
                if offset - at - start != shift:
                    shift = offset - at - start
                    pieces.append((at + start, offset))
            at += len(part.text) + len(separator)
        return cls(parts[0].source, separator.join([part.text for part in parts]), tuple(pieces))

    def offset(self, at: int) -> int:
        """Source offset of the character at text offset `at`."""
        text_at, source_at = self.pieces[-1]
        if at < text_at:
            i = bisect_right(self.pieces, at, key=itemgetter(0)) - 1
            text_at, source_at = self.pieces[max(i, 0)]
        return min(source_at + (at - text_at), len(self.source.text))

    def span(self, start: int = 0, end: int | None = None) -> Span:
        """The source span that `text[start:end]` came from, with what lies between its pieces."""
        end, first = len(self.text) if end is None else end, self.offset(start)
        last = self.offset(end - 1) + 1 if end > start else first
        return Span(self.source, first, max(first, min(last, len(self.source.text))))

    def slice(self, start: int, end: int | None = None) -> Excerpt:
        """The excerpt `text[start:end]`."""
        end = len(self.text) if end is None else end
        first = bisect_right(self.pieces, start, key=itemgetter(0))
        last = bisect_left(self.pieces, end, lo=first, key=itemgetter(0))
        pieces = ((t - start, s) for t, s in self.pieces[first:last])
        return Excerpt(self.source, self.text[start:end], ((0, self.offset(start)), *pieces))

    def lines(self) -> tuple[Excerpt, ...]:
        """The excerpt's lines, without their line ends."""
        lines: list[Excerpt] = []
        start = 0
        for text in self.text.split("\n"):
            lines.append(self.slice(start, start + len(text)))
            start += len(text) + 1
        return tuple(lines)
