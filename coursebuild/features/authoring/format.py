"""Formats a lesson or page without changing its meaning.

Entry point: `format_document`.

1. Edits are collected for JSON in fences, tables, white space, empty lines, and, if there is a
   width, for paragraphs.
2. The text with all edits is parsed again. If its meaning has changed, each half of the edits is
   tried by itself, down to single ones, and those that change it are left out.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any

from msgspec.structs import replace

from coursebuild.core import model
from coursebuild.core.model.vocabulary import ENGLISH, Words
from coursebuild.core.registry import fence_names
from coursebuild.core.scripts.edit import apply_edits, whole_lines
from coursebuild.core.syntax.block_parser import block_tokens
from coursebuild.core.syntax.document import parse_document
from coursebuild.core.syntax.fence import Fence, line_prefix, read_fence
from coursebuild.core.syntax.json_text import parse_json
from coursebuild.core.syntax.spans import PositionedToken, read_markdown
from coursebuild.core.text.diagnostics import Diagnostic, Edit, Parsed
from coursebuild.core.text.source import Excerpt, Source, Span
from coursebuild.core.values import fingerprint
from coursebuild.features.authoring.layout import (
    GAP,
    align_table,
    fill_lines,
    layout_json,
    split_words,
)

WIDTH = 120
"""The width of tables, and of JSON on one line, in a course that sets none."""


def format_document(
    source: Source, callouts: frozenset[str], *, lesson: bool, width: int, words: Words = ENGLISH
) -> Parsed[str]:
    """Format a document; one with mistakes stays as it is, and they are returned.

    `width` is that of paragraphs; 0 leaves their lines as they are.
    """
    read = partial(parse_document, callouts=callouts, lesson=lesson, words=words)
    before = read(source)
    if errors := _errors(before):
        return Parsed(source.text, errors)
    meaning = _meaning(before.value)

    def is_harmless(edits: Sequence[Edit]) -> bool:
        text = apply_edits(source.text, edits)
        after = read(Source(source.path, text))
        return not _errors(after) and _meaning(after.value) == meaning

    proposals = _Layout(source, width).edits(before.value)
    edits = sorted((e for e in proposals if e.text != e.span.text), key=lambda e: e.span.start)
    return Parsed(apply_edits(source.text, _select_harmless(edits, [], is_harmless)))


def _errors(document: Parsed[model.Document]) -> tuple[Diagnostic, ...]:
    return tuple(d for d in document.diagnostics if d.is_error)


def _select_harmless(
    edits: list[Edit], selection: list[Edit], is_harmless: Callable[[Sequence[Edit]], bool]
) -> list[Edit]:
    """Return the selection with as many further edits as are harmless together."""
    if not edits or is_harmless(selection + edits):
        return selection + edits
    if len(edits) == 1:
        return selection
    half = len(edits) // 2
    selection = _select_harmless(edits[:half], selection, is_harmless)
    return _select_harmless(edits[half:], selection, is_harmless)


def _meaning(document: model.Document) -> str:
    """Return a hash of what a document says, regardless of places and line breaks."""
    return fingerprint((document.blocks, document.footnotes), _MEANINGS)


def _join_text(values: tuple[Any, ...]) -> tuple[Any, ...]:
    """Join neighbouring texts of some inlines, and make each run of white space one blank."""
    out: list[Any] = []
    for value in values:
        if isinstance(value, model.SoftBreak):
            value = model.Text(value.span, " ")
        if isinstance(value, model.Text) and out and isinstance(out[-1], model.Text):
            value = model.Text(value.span, out.pop().text + value.text)
        if isinstance(value, model.Text):
            value = model.Text(value.span, re.sub("[ \t\n]+", " ", value.text))
        out.append(value)
    return tuple(out)


_MEANINGS: dict[type, Callable[[Any], object]] = {
    Span: lambda span: None,
    Excerpt: lambda excerpt: excerpt.text,
    Source: lambda source: source.path,
    tuple: _join_text,
    model.Math: lambda math: replace(math, tex=" ".join(math.tex.text.split())),
}

_VERBATIM = ("fence", "code_block", "html_block", "math_block")
_UNBREAKABLE = (model.CodeSpan, model.Image, model.RawInline)
_LINE_END = re.compile(r"\r\n|\r|\n")
_DELIMITERS = re.compile(r"[-:|][-:| \t]*$")
_PARENTS = ("", "blockquote_open", "footnote_reference_open")
"""Containers whose blocks are separated by empty lines; the first is the document itself."""


class _Layout:
    """Finds the edits that would format a document."""

    def __init__(self, source: Source, width: int) -> None:
        self.source, self.width = source, width
        self.base = read_markdown(source)
        self.tokens = block_tokens(self.base, {})
        self.lines = [source.line_text(n + 1) for n in range(len(source.line_starts))]
        self.fixed_lines: set[int] = set()
        """Lines, from 0, that white space is not removed from: verbatim, in a table, or wrapped."""
        for token in self.tokens:
            if token.type in _VERBATIM and token.map:
                has_marks = token.type == "fence"
                self.fixed_lines.update(range(token.map[0] + has_marks, token.map[1] - has_marks))

    def _line_end(self, line: int) -> str:
        """Return the line end of a line, counted from 0; for the last one that of the one above."""
        start = self.source.line_starts[line] + len(self.lines[line])
        line_end = _LINE_END.match(self.source.text, start)
        return line_end[0] if line_end else self._line_end(line - 1) if line else "\n"

    def edits(self, document: model.Document) -> Iterator[Edit]:
        """Yield all edits; none overlap."""
        if self.width:
            for block in model.document_blocks(document):
                if (
                    isinstance(block, model.Paragraph)
                    and block.span.line - 1 not in self.fixed_lines
                ):
                    yield from self._wrap(block)
        for index, token in enumerate(self.tokens):
            if token.type == "fence":
                yield from self._lay_out_json(read_fence(token, self.base, nested=False))
            elif token.type == "table_open":
                yield from self._align_table(index)
        yield from self._trim_white_space()
        yield from self._separate_blocks()

    def _wrap(self, paragraph: model.Paragraph) -> Iterator[Edit]:
        """Fill the lines of a paragraph, unless it has forced line breaks."""
        span, inlines = paragraph.span, list(model.walk_inlines(paragraph.children))
        if any(isinstance(inline, model.HardBreak) for inline in inlines):
            return
        unbreakable = [inline.span for inline in inlines if isinstance(inline, _UNBREAKABLE)]
        unbreakable += [inline.tex.span() for inline in inlines if isinstance(inline, model.Math)]
        unbreakable += [
            inline.text_span for inline in inlines if isinstance(inline, model.NumberBinding)
        ]
        prefix = next((gap[1] for gap in GAP.finditer(span.text) if gap[1] is not None), None)
        prefix = line_prefix(span) if prefix is None else prefix
        lines = fill_lines(split_words(span, unbreakable), self.width, span.column - 1, prefix)
        self.fixed_lines.update(range(span.line - 1, span.end_line - 1))
        yield Edit(span, (self._line_end(span.line - 1) + prefix).join(lines))

    def _lay_out_json(self, fence: Fence) -> Iterator[Edit]:
        if fence.kind not in fence_names():
            return
        json = parse_json(fence.body, fence.head)
        if json.value is not None and not json.diagnostics:
            width = self.width or (sys.maxsize if "\n" in json.value.raw else WIDTH)
            lines = layout_json(json.value, width - len(fence.prefix)).split("\n")
            yield whole_lines(fence.body_span, fence.prefix, lines)

    def _align_table(self, index: int) -> Iterator[Edit]:
        """Align the columns of a table, unless its lines would become too long."""
        rows: list[PositionedToken] = []
        for token in self.tokens[index:]:
            if token.type == "table_close":
                break
            rows += [token] if token.type == "tr_open" else []
        texts = [self.base.text[row.start : row.end].rstrip(" \t") for row in rows]
        assert rows[0].map
        second = rows[0].map[0] + 1
        delimiters = _DELIMITERS.search(self.lines[second])
        assert delimiters
        prefix = self.lines[second][: delimiters.start()]
        lines = align_table(
            [texts[0], delimiters[0], *texts[1:]], (self.width or WIDTH) - len(prefix)
        )
        self.fixed_lines.update(range(second - 1, second + len(rows)))
        span = self.base.span(rows[0].start, rows[-1].start + len(texts[-1]))
        yield Edit(span, (self._line_end(second) + prefix).join(lines))

    def _trim_white_space(self) -> Iterator[Edit]:
        """Remove spaces at line ends and repeated empty lines; end the text with a line end."""
        text, starts = self.source.text, self.source.line_starts
        end = len(text.rstrip(" \t\r\n"))
        inner = {
            n
            for t in self.tokens
            if t.type == "paragraph_open" and t.map
            for n in range(t.map[0], t.map[1] - 1)
        }
        empty: str | None = ""
        last = self.source.position(end)[0] - 1
        for n in range(last):
            line, bare = self.lines[n], self.lines[n].rstrip(" \t")
            if n in self.fixed_lines:
                empty = None
                continue
            if bare == empty:
                yield Edit(self.source.span(starts[n], starts[n + 1]), "")
            elif bare != line and not (n in inner and line.endswith("  ")):
                yield Edit(self.source.span(starts[n] + len(bare), starts[n] + len(line)), "")
            empty = None if bare.strip(" \t>") else bare
        line_end = self._line_end(last) if end else ""
        if text[end:] != line_end:
            yield Edit(self.source.span(end), line_end)

    def _separate_blocks(self) -> Iterator[Edit]:
        """Separate blocks by empty lines, except near HTML, between footnotes and below titles."""
        parents: list[list[str]] = [["", ""]]  # the type of each, and of the last block in it
        for token in self.tokens:
            if token.nesting < 0:
                parents.pop()
                continue
            parent, previous = parents[-1]
            if parent in _PARENTS and previous and token.map:
                belong_together = "html_block" in (previous, token.type) or (
                    previous == token.type == "footnote_reference_open"
                )
                line = token.map[0]
                before = self.lines[line - 1].strip(" \t>")
                if before and not belong_together and not before.startswith("[!"):
                    start = self.source.line_starts[line]
                    prefix = self.source.text[start : self.base.offset(token.start)]
                    yield Edit(
                        self.source.span(start, start), prefix.rstrip() + self._line_end(line - 1)
                    )
            parents[-1][1] = token.type
            if token.nesting > 0:
                parents.append([token.type, ""])
