"""The plain text of a table cell, every character with its place in the lesson.

Entry point: `cell_text`. Marks of Markdown are gone, a U+2212 minus is a hyphen-minus, runs of
white space are one space. A stretch that Markdown changed (entities, escapes) stands for all of
itself.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from coursebuild.core.model import (
    Cell,
    CodeSpan,
    Emphasis,
    Filter,
    FootnoteRef,
    HardBreak,
    Image,
    Inline,
    Link,
    Math,
    NumberBinding,
    RawInline,
    SoftBreak,
    Strikethrough,
    Strong,
    Term,
    Text,
)
from coursebuild.core.scripts.mapped_text import MappedText, MappingSegment, filtered
from coursebuild.core.text.patterns import pattern
from coursebuild.core.text.source import Span

_RUN = pattern(r"\s{2,}|[^\S ]")
_ENDS = pattern(r"\A\s+|\s+\Z")


def plain(text: str) -> str:
    """A text with its minus signs and its white space made plain."""
    return " ".join(text.replace("\u2212", "-").split())


def cell_text(cell: Cell, filters: Iterable[Filter] = ()) -> MappedText:
    """The plain text of a cell, filtered; origins are offsets in the lesson's source."""
    texts: list[str] = []
    pieces: list[MappingSegment] = []
    at = 0
    for text, span in _stretches(cell.children):
        if text:
            pieces.append(MappingSegment(at, span.start, span.end, span.text == text))
            texts.append(text)
            at += len(text)
    if not pieces:
        pieces.append(MappingSegment(0, cell.span.start, cell.span.end, False))
    mapped = filtered(MappedText("".join(texts), tuple(pieces)), filters)
    folded = mapped.substituted(_RUN, " ").substituted(_ENDS, "")
    return MappedText(folded.text.replace("\u2212", "-"), folded.pieces)


def _stretches(inlines: Iterable[Inline]) -> Iterator[tuple[str, Span]]:
    for inline in inlines:
        match inline:
            case Text():
                yield inline.text, inline.span
            case CodeSpan():
                yield inline.text, _inside_backticks(inline)
            case NumberBinding():
                yield inline.text, inline.text_span
            case Math():
                yield inline.tex.text, inline.tex.span()
            case Emphasis() | Strong() | Strikethrough() | Link() | Term():
                yield from _stretches(inline.children)
            case Image():
                yield inline.alt, inline.span
            case SoftBreak() | HardBreak():
                yield " ", inline.span
            case RawInline():
                yield (" " if inline.html.startswith("<br") else ""), inline.span
            case FootnoteRef():
                pass


def _inside_backticks(code: CodeSpan) -> Span:
    """The place of a code span's text: what stands between the backticks, without padding."""
    written = code.span.text
    ticks = len(written) - len(written.lstrip("`"))
    inner = written[ticks : len(written) - ticks]
    padding = 1 if len(inner) == len(code.text) + 2 else 0
    start = code.span.start + ticks + padding
    return Span(code.span.source, start, code.span.end - ticks - padding)
