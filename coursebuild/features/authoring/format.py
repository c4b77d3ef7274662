"""A lesson or page formatted: another text that means the same.

Entry point: `format_document`.

1. JSON in fences, tables, white space, empty lines, and paragraphs if there is a width give edits.
2. The text with all edits is parsed again. If its meaning has changed, each half of the edits is
   tried by itself, down to single ones, and those that change it are left out.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from msgspec.structs import replace

from coursebuild.core import model
from coursebuild.core.registry import fence_names
from coursebuild.core.scripts.edit import apply_edits, whole_lines
from coursebuild.core.syntax.document import parse_document
from coursebuild.core.syntax.fence import Fence, line_prefix, read_fence
from coursebuild.core.syntax.json_text import parse_json
from coursebuild.core.syntax.markdown import block_tokens
from coursebuild.core.syntax.spans import PositionedToken, read_markdown
from coursebuild.core.text.diagnostics import Diagnostic, Edit, Parsed
from coursebuild.core.text.source import Excerpt, Source, Span
from coursebuild.core.values import fingerprint
from coursebuild.features.authoring.json_layout import lay_out
from coursebuild.features.authoring.text_layout import GAP, align_table, fill, split_words

WIDTH = 120
"""Columns of tables, and of JSON whose author left it in one line, where the course says none."""


def format_document(
    source: Source, callouts: frozenset[str], *, lesson: bool, width: int
) -> Parsed[str]:
    """The text of a document, formatted; one with mistakes stays as it is, and they are told.

    `width` is that of paragraphs; 0 leaves their lines as they are.
    """
    before = parse_document(source, callouts, lesson=lesson)
    if wrong := _errors(before):
        return Parsed(source.text, wrong)
    meaning = _meaning(before.value)

    def harmless(edits: Sequence[Edit]) -> bool:
        text = apply_edits(source.text, edits)
        after = parse_document(Source(source.path, text), callouts, lesson=lesson)
        return not _errors(after) and _meaning(after.value) == meaning

    tried = _Layout(source, width).edits(before.value)
    edits = sorted((e for e in tried if e.text != e.span.text), key=lambda e: e.span.start)
    return Parsed(apply_edits(source.text, _choose(edits, [], harmless)))


def _errors(parsed: Parsed[model.Document]) -> tuple[Diagnostic, ...]:
    return tuple(d for d in parsed.diagnostics if d.is_error)


def _choose(
    edits: list[Edit], kept: list[Edit], harmless: Callable[[Sequence[Edit]], bool]
) -> list[Edit]:
    """The edits that were kept, and as many of the others as are harmless together."""
    if not edits or harmless(kept + edits):
        return kept + edits
    if len(edits) == 1:
        return kept
    half = len(edits) // 2
    return _choose(edits[half:], _choose(edits[:half], kept, harmless), harmless)


def _meaning(document: model.Document) -> str:
    """A hash of what a document says, whatever its places and line breaks."""
    return fingerprint((document.blocks, document.footnotes), _SHOWN)


def _join_text(values: tuple[Any, ...]) -> tuple[Any, ...]:
    """Inlines with neighbouring texts joined, and each run of white space as one blank."""
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


_SHOWN: dict[type, Callable[[Any], object]] = {
    Span: lambda span: None,
    Excerpt: lambda excerpt: excerpt.text,
    Source: lambda source: source.path,
    tuple: _join_text,
    model.Math: lambda math: replace(math, tex=" ".join(math.tex.text.split())),
}

_VERBATIM = ("fence", "code_block", "html_block", "math_block")
_SOLID = (model.CodeSpan, model.Image, model.RawInline)
_LINE_END = re.compile(r"\r\n|\r|\n")
_DELIMITERS = re.compile(r"[-:|][-:| \t]*$")
_PARENTS = ("", "blockquote_open", "footnote_reference_open")
"""Tokens in which blocks are separated by empty lines."""


class _Layout:
    """Finds the edits that would format a document."""

    def __init__(self, source: Source, width: int) -> None:
        self.source, self.width = source, width
        self.base = read_markdown(source)
        self.tokens = block_tokens(self.base, {})
        self.lines = [source.line_text(n + 1) for n in range(len(source.line_starts))]
        self.done: set[int] = set()
        """Lines, from 0, that are verbatim, or in a table, or wrapped."""
        for token in self.tokens:
            if token.type in _VERBATIM and token.map:
                marks = token.type == "fence"
                self.done.update(range(token.map[0] + marks, token.map[1] - marks))

    def _line_end(self, line: int) -> str:
        """How a line ends, counted from 0; the last one as the one above it."""
        start = self.source.line_starts[line] + len(self.lines[line])
        found = _LINE_END.match(self.source.text, start)
        return found[0] if found else self._line_end(line - 1) if line else "\n"

    def edits(self, document: model.Document) -> Iterator[Edit]:
        """All of them; none overlap."""
        if self.width:
            for block in model.document_blocks(document):
                if isinstance(block, model.Paragraph) and block.span.line - 1 not in self.done:
                    yield from self._wrap(block)
        for at, token in enumerate(self.tokens):
            if token.type == "fence":
                yield from self._lay_out_json(read_fence(token, self.base, nested=False))
            elif token.type == "table_open":
                yield from self._align_table(at)
        yield from self._white_space()
        yield from self._separate()

    def _wrap(self, paragraph: model.Paragraph) -> Iterator[Edit]:
        """A paragraph in lines that are as full as can be; not one with forced line breaks."""
        span, inlines = paragraph.span, list(model.walk_inlines(paragraph.children))
        if any(isinstance(inline, model.HardBreak) for inline in inlines):
            return
        solid = [inline.span for inline in inlines if isinstance(inline, _SOLID)]
        solid += [inline.tex.span() for inline in inlines if isinstance(inline, model.Math)]
        solid += [inline.text_span for inline in inlines if isinstance(inline, model.NumberBinding)]
        prefix = next((gap[1] for gap in GAP.finditer(span.text) if gap[1] is not None), None)
        prefix = line_prefix(span) if prefix is None else prefix
        lines = fill(split_words(span, solid), self.width, span.column - 1, prefix)
        self.done.update(range(span.line - 1, span.end_line - 1))
        yield Edit(span, (self._line_end(span.line - 1) + prefix).join(lines))

    def _lay_out_json(self, fence: Fence) -> Iterator[Edit]:
        if fence.kind not in fence_names():
            return
        parsed = parse_json(fence.body, fence.head)
        if parsed.value is not None and not parsed.diagnostics:
            width = self.width or (sys.maxsize if "\n" in parsed.value.raw else WIDTH)
            lines = lay_out(parsed.value, width - len(fence.prefix)).split("\n")
            yield whole_lines(fence.body_span, fence.prefix, lines)

    def _align_table(self, at: int) -> Iterator[Edit]:
        """A table with its columns below each other, if its lines are then not too long."""
        rows: list[PositionedToken] = []
        for token in self.tokens[at:]:
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
        self.done.update(range(second - 1, second + len(rows)))
        span = self.base.span(rows[0].start, rows[-1].start + len(texts[-1]))
        yield Edit(span, (self._line_end(second) + prefix).join(lines))

    def _white_space(self) -> Iterator[Edit]:
        """None at line ends, single empty lines, one line end at the end of the text."""
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
            if n in self.done:
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

    def _separate(self) -> Iterator[Edit]:
        """An empty line between blocks, except beside HTML, between footnotes and below a title."""
        around: list[list[str]] = [["", ""]]
        for token in self.tokens:
            if token.nesting < 0:
                around.pop()
                continue
            parent, above = around[-1]
            if parent in _PARENTS and above and token.map:
                together = "html_block" in (above, token.type) or (
                    above == token.type == "footnote_reference_open"
                )
                line = token.map[0]
                before = self.lines[line - 1].strip(" \t>")
                if before and not together and not before.startswith("[!"):
                    at = self.source.line_starts[line]
                    prefix = self.source.text[at : self.base.offset(token.start)]
                    yield Edit(self.source.span(at, at), prefix.rstrip() + self._line_end(line - 1))
            around[-1][1] = token.type
            if token.nesting > 0:
                around.append([token.type, ""])
