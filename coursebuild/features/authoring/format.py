"""Formats a lesson or page without changing its meaning.

The text with all edits is parsed again. If its meaning has changed, each half of the edits is tried
by itself, down to single ones, and those that change it are left out.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import pairwise
from typing import Any

from msgspec.structs import replace

from coursebuild.api import (
    Diagnostic,
    Edit,
    Excerpt,
    Fence,
    Parsed,
    Source,
    Span,
    model,
    parse_json,
    regex,
)
from coursebuild.core.model.course import ENGLISH, Words
from coursebuild.core.registry import fence_names
from coursebuild.core.scripts.edit import apply_edits, select_harmless, whole_lines
from coursebuild.core.syntax.block_parser import block_tokens
from coursebuild.core.syntax.document import parse_document
from coursebuild.core.syntax.fence import line_prefix, read_fence
from coursebuild.core.syntax.json_text import to_one_line
from coursebuild.core.syntax.nodes import ArrayNode, Member, Node, ObjectNode
from coursebuild.core.syntax.spans import PositionedToken, read_markdown
from coursebuild.core.text.characters import cells
from coursebuild.core.values import fingerprint

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
    return Parsed(apply_edits(source.text, select_harmless(edits, is_harmless)))


def _errors(document: Parsed[model.Document]) -> tuple[Diagnostic, ...]:
    return tuple(d for d in document.diagnostics if d.is_error)


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
_LINE_END = regex(r"\r\n|\r|\n")
_DELIMITERS = regex(r"[-:|][-:| \t]*$")
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
        # Remove spaces at line ends and repeated empty lines; end the text with a line end
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
        yield from self._separate_blocks()

    def _wrap(self, paragraph: model.Paragraph) -> Iterator[Edit]:
        span, inlines = paragraph.span, list(model.walk_inlines(paragraph.children))
        if any(isinstance(inline, model.HardBreak) for inline in inlines):
            return
        unbreakable = [inline.span for inline in inlines if isinstance(inline, _UNBREAKABLE)]
        formulas = [inline for inline in inlines if isinstance(inline, model.Math)]
        for formula in formulas:  # one with macros has more than what it shows
            inner = formula.tex.span()
            unbreakable.append(inner if inner.text == formula.tex.text else formula.span)
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


GAP = regex(r"[ \t]*(?:\r\n|\r|\n)([ \t>]*)|[ \t]+")
"""White space between words; group 1 is the prefix of the next line in a quote or list."""
_OPENING = regex(r"[-+*#=_|]+$|>|\d+[.)]$|`{3}|~{3}|\$\$")
"""Words that would begin another block if they began a line."""
_PIPE = regex(r"(?<!\\)\|")


def split_words(span: Span, unbreakable: Sequence[Span]) -> list[str]:
    """Split a text into words, except within unbreakable parts."""
    words, word_start = [""], 0
    for gap in GAP.finditer(span.text):
        place = span.start + gap.start()
        words[-1] += span.text[word_start : gap.start()]
        word_start = gap.end()
        if any(part.start < place < part.end for part in unbreakable):
            words[-1] += gap[0] if gap[1] is None else " "
        else:
            words.append("")
    words[-1] += span.text[word_start:]
    return words


def fill_lines(words: Sequence[str], width: int, column: int, prefix: str) -> list[str]:
    """Fill lines with words; the first line begins at a column, the others with a prefix."""
    lines = [words[0]]
    column += cells(words[0])
    for word in words[1:]:
        column += 1 + cells(word)
        if column > width and not _OPENING.match(word):
            lines.append(word)
            column = len(prefix) + cells(word)
        else:
            lines[-1] += f" {word}"
    return lines


def align_table(rows: Sequence[str], width: int) -> list[str]:
    """Align the columns of a table where it is not too wide; the second row are the delimiters."""
    table = [[cell.strip(" \t") for cell in _PIPE.split(row)] for row in rows]
    table = [row[not row[0] : len(row) - (not row[-1])] for row in table]
    marks = table.pop(1)
    if any(len(row) > len(marks) for row in table):
        return list(rows)
    table = [row + [""] * (len(marks) - len(row)) for row in table]
    min_widths = [3 + mark.count(":") for mark in marks]
    widths = [max(cells(cell) for cell in column) for column in zip(*table, strict=True)]
    widths = [max(pair) for pair in zip(widths, min_widths, strict=True)]
    fits = sum(widths) + 3 * len(widths) + 1 <= width
    for row in table if fits else ():
        for n, (cell, most, mark) in enumerate(zip(row, widths, marks, strict=True)):
            room = most - cells(cell)
            left = 0 if not mark.endswith(":") else room // 2 if mark.startswith(":") else room
            row[n] = " " * left + cell + " " * (room - left)
    table.insert(
        1,
        [
            re.sub("-+", "-" * (width - mark.count(":")), mark)
            for mark, width in zip(marks, widths if fits else min_widths, strict=True)
        ],
    )
    return ["|" + "".join(f" {cell} |" if cell else " |" for cell in row) for row in table]


# --- JSON


def layout_json(node: Node, width: int, column: int = 0, indent: int = 0) -> str:
    """Return the text of a value that begins at a column, inside a parent with this indent.

    Only white space between its values changes. An object or list keeps the line breaks of its
    author; one on a single line stays there where it fits. Members are indented by two columns more
    than their parent; those that begin on the line of the bracket are aligned after it.
    """
    line = to_one_line(node).text
    parts: list[Member] | list[Node] = node.items if isinstance(node, ArrayNode) else []
    if isinstance(node, ObjectNode):
        parts = list(node.members.values())
    if not parts or ("\n" not in node.raw and column + len(line) <= width):
        return line
    breaks = [1] * (len(parts) + 1)  # the line ends before each part and the closing bracket
    if "\n" in node.raw:
        places = [
            (p.key.start, p.value.end) if isinstance(p, Member) else (p.start, p.end) for p in parts
        ]
        places = [(0, node.start + 1), *places, (node.end - 1, 0)]
        breaks = [node.body.text.count("\n", a[1], b[0]) for a, b in pairwise(places)]
    inner = indent + 2 if breaks[0] else column + 1 if any(breaks) else indent
    text, at = line[0], column + 1
    for part, lines in zip(parts, breaks, strict=False):
        if lines:
            text, at = text + "\n" * min(lines, 2) + " " * inner, inner
        elif part is not parts[0]:
            text, at = text + " ", at + 1
        key = f"{part.key.raw}: " if isinstance(part, Member) else ""
        value = part.value if isinstance(part, Member) else part
        text += key + layout_json(value, width, at + len(key), inner)
        text += "" if part is parts[-1] else ","
        at = len(text) - text.rfind("\n") - 1 if "\n" in text else column + len(text)
    if breaks[-1]:
        text += "\n" + " " * (indent if breaks[0] else column)
    return text + line[-1]
