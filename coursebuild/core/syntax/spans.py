"""Where markdown-it's tokens stand: tokens, parser states and excerpts that keep positions.

Entry points: `BlockState`, `InlineState` (markdown-it's parser states, whose tokens are
`PositionedToken`s), `locate` (content rows into an `Excerpt`).

1. Block rules cut lines out of the text by `getLines`; `BlockState` notes where each of those rows
   began.
2. `locate` joins such rows of what was parsed, a whole file or a text in JSON, to an excerpt.
3. Inline rules work on one block's content; `InlineState` notes from where to where each token
   reaches in it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal, NamedTuple

from markdown_it import MarkdownIt
from markdown_it.common.utils import MD_TRIM_CHARS
from markdown_it.rules_block import StateBlock
from markdown_it.rules_inline import StateInline
from markdown_it.token import Token
from markdown_it.utils import EnvType

from coursebuild.core.text.source import Excerpt, Source


class SourceSlice(NamedTuple):
    """The stretch `[start, end)` of the parsed text, which became part of a block's content."""

    start: int
    end: int
    padding: int = 0
    """How many spaces stand before it, for a part of the tab before `start`."""


@dataclass(slots=True)
class PositionedToken(Token):
    """A token that knows its place: in the parsed text, or for inline tokens in the content."""

    start: int = -1
    end: int = -1
    rows: Sequence[SourceSlice] = ()
    """What a block's content was made of, a row a line."""


class BlockState(StateBlock):
    """The state of the block rules; notes the rows that the last rule cut out."""

    def __init__(self, src: str, md: MarkdownIt, env: EnvType) -> None:
        super().__init__(src, md, env, [])
        self.rows: Sequence[SourceSlice] = ()
        self.lines_left = 0
        """How many lines containers may still read."""

    def push(self, ttype: str, tag: str, nesting: Literal[-1, 0, 1]) -> Token:
        """Add a token; that of an item of a list, which has no rule of its own, gets its place."""
        if nesting < 0:
            self.level -= 1
        token = PositionedToken(ttype, tag, nesting, level=self.level, block=True)
        if nesting > 0:
            self.level += 1
        if ttype == "list_item_open":
            token.start = self.bMarks[self.line] + self.tShift[self.line]
        self.tokens.append(token)
        return token

    def getLines(self, begin: int, end: int, indent: int, keepLastLF: bool) -> str:  # noqa: N802
        """The lines from `begin` to `end` without `indent` columns of their indentation."""
        self.rows = rows = [
            self._row(line, indent, keepLastLF or line + 1 < end) for line in range(begin, end)
        ]
        return "".join([" " * row.padding + self.src[row.start : row.end] for row in rows])

    def _row(self, line: int, indent: int, line_end: bool) -> SourceSlice:
        src, first = self.src, self.bMarks[line]
        last = self.eMarks[line] + 1 if line_end else self.eMarks[line]
        shift = self.tShift[line]
        begin, column = first, 0
        while column < indent and first < last:
            char = src[first] if first < len(src) else ""
            if char == "\t":
                column += 4 - (column + self.bsCount[line]) % 4
            elif char == " " or first - begin < shift:
                column += 1
            else:
                break
            first += 1
        return SourceSlice(first, last, max(0, column - max(0, indent)))


class InlineState(StateInline):
    """The state of the inline rules; `mark` is where the text that is not yet a token began."""

    def __init__(self, src: str, md: MarkdownIt, env: EnvType) -> None:
        super().__init__(src, md, env, [])
        self.mark = 0
        self.last_bracket, self.last_braced = src.rfind("]"), src.rfind("]{")
        """Where the last `]` and the last `]{` stand."""
        self.last_runs: dict[int, int] = {}
        """Where the last run of each number of backticks begins."""
        self.literal = ""
        """In a text that is HTML: the open element in which a dollar is a dollar."""

    def pushPending(self) -> Token:  # noqa: N802
        """Make the pending text a token."""
        token = PositionedToken("text", "", 0, level=self.pendingLevel, content=self.pending)
        token.start, token.end = self.mark, self.mark + len(self.pending)
        self.tokens.append(token)
        self.pending = ""
        return token

    def push(self, ttype: str, tag: str, nesting: Literal[-1, 0, 1]) -> Token:
        """Add a token that begins here; the tokenizer sets its end when the rule is through."""
        if self.pending:
            self.pushPending()
        meta = None
        if nesting < 0:
            self.level -= 1
            self.delimiters = self._prev_delimiters.pop()
        token = PositionedToken(ttype, tag, nesting, level=self.level, start=self.pos)
        if nesting > 0:
            self.level += 1
            self._prev_delimiters.append(self.delimiters)
            self.delimiters = []
            meta = {"delimiters": self.delimiters}
            self.mark = self.pos
        self.pendingLevel = self.level
        self.tokens.append(token)
        self.tokens_meta.append(meta)
        return token


def locate(base: Excerpt, rows: Sequence[SourceSlice]) -> Excerpt:
    """The rows joined, each character with its place in the source of `base`."""
    follows = all(row.end == after.start for row, after in pairwise(rows))
    if rows and follows and not any(row.padding for row in rows):  # as most are
        return base.slice(rows[0].start, rows[-1].end)
    parts: list[Excerpt] = []
    for start, end, padding in rows:
        for _ in range(padding):
            parts.append(Excerpt(base.source, " ", ((0, base.offset(start - 1)),)))
        parts.append(base.slice(start, end))
    return Excerpt.join(parts)


def trim(excerpt: Excerpt, chars: str = MD_TRIM_CHARS) -> Excerpt:
    """The excerpt without white space at its ends."""
    given = excerpt.text
    if not given or (given[0] not in chars and given[-1] not in chars):
        return excerpt
    text = given.lstrip(chars)
    lead = len(given) - len(text)
    return excerpt.slice(lead, lead + len(text.rstrip(chars)))


def read_markdown(source: Source) -> Excerpt:
    """All of a file as Markdown sees it: LF, U+FFFD for NUL, no byte order mark."""
    excerpt = source.excerpt()
    return normalize(excerpt.slice(1) if excerpt.text.startswith("\ufeff") else excerpt)


def normalize(excerpt: Excerpt) -> Excerpt:
    """An excerpt with CommonMark's line ends and without NUL, each character where it was."""
    text = excerpt.text.replace("\r\n", " \n").replace("\r", "\n").replace("\0", "\ufffd")
    return excerpt if text == excerpt.text else Excerpt(excerpt.source, text, excerpt.pieces)
