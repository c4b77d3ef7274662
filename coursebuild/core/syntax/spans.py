"""Tokens and parser states of markdown-it that keep positions."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

from markdown_it import MarkdownIt
from markdown_it.common.utils import MD_TRIM_CHARS
from markdown_it.rules_block import StateBlock
from markdown_it.rules_inline import StateInline
from markdown_it.token import Token
from markdown_it.utils import EnvType

from coursebuild.core.text.source import Excerpt, Source

NO_TEXT = Excerpt(Source("", ""), "", ((0, 0),))


@dataclass(slots=True)
class PositionedToken(Token):
    """A token that knows its place: in the parsed text, or for inline tokens in the content."""

    start: int = -1
    end: int = -1
    text: Excerpt = NO_TEXT

    def __post_init__(self) -> None:
        """Take the attributes as they are; a token of markdown-it would take lists of them, too."""


class BlockState(StateBlock):
    """The state of the block rules of the text `base`."""

    def __init__(self, base: Excerpt, md: MarkdownIt, env: EnvType) -> None:
        super().__init__(base.text, md, env, [])
        self.base = base
        self.text, self.text_end = NO_TEXT, 0
        """What the last rule cut out, and the line after it."""
        self.lines_left = 0
        """How many more lines containers may read."""

    def push(self, ttype: str, tag: str, nesting: Literal[-1, 0, 1]) -> Token:
        """Add a token; give its place to a list item, which has no rule that could do so."""
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
        rows = [self._row(line, indent, keepLastLF or line + 1 < end) for line in range(begin, end)]
        if all(row[1] == after[0] and not after[2] for row, after in pairwise(rows)):
            rows = [(rows[0][0], rows[-1][1], rows[0][2])] if rows else []
        parts: list[Excerpt] = []
        for start, stop, padding in rows:
            if padding:
                tab = self.base.offset(start - 1)
                pieces = tuple((i, tab) for i in range(padding))
                parts.append(Excerpt(self.base.source, " " * padding, pieces))
            parts.append(self.base.slice(start, stop))
        self.text, self.text_end = Excerpt.join(parts) if parts else NO_TEXT, end
        return self.text.text

    def _row(self, line: int, indent: int, line_end: bool) -> tuple[int, int, int]:
        """The offsets of a line, and the spaces in place of the rest of a tab before it."""
        src, first = self.src, self.bMarks[line]
        last = self.eMarks[line] + 1 if line_end else self.eMarks[line]
        shift = self.tShift[line]
        start, column = first, 0
        while column < indent and first < last:
            char = src[first] if first < len(src) else ""
            if char == "\t":
                column += 4 - (column + self.bsCount[line]) % 4
            elif char == " " or first - start < shift:
                column += 1
            else:
                break
            first += 1
        return first, last, max(0, column - max(0, indent))


class InlineState(StateInline):
    """The state of the inline rules; `text_start` is that of the text not yet in a token."""

    def __init__(self, src: str, md: MarkdownIt, env: EnvType) -> None:
        super().__init__(src, md, env, [])
        self.text_start = 0
        self.last_bracket, self.last_attribute = src.rfind("]"), src.rfind("]{")
        """The offsets of the last `]` and the last `]{`."""
        self.last_runs: dict[int, int] = {}
        """The offset of the last run of each number of backticks."""
        self.literal = ""
        """The open element of HTML in which a dollar is a dollar, or empty."""

    def pushPending(self) -> Token:  # noqa: N802
        """Make the pending text a token."""
        token = PositionedToken("text", "", 0, level=self.pendingLevel, content=self.pending)
        token.start, token.end = self.text_start, self.text_start + len(self.pending)
        self.tokens.append(token)
        self.pending = ""
        return token

    def push(self, ttype: str, tag: str, nesting: Literal[-1, 0, 1]) -> Token:
        """Add a token that begins here; its end is set when the rule has finished."""
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
            self.text_start = self.pos
        self.pendingLevel = self.level
        self.tokens.append(token)
        self.tokens_meta.append(meta)
        return token


def trim(excerpt: Excerpt, chars: str = MD_TRIM_CHARS) -> Excerpt:
    """The excerpt without white space at its ends."""
    text = excerpt.text
    if not text or (text[0] not in chars and text[-1] not in chars):
        return excerpt
    start = len(text) - len(text.lstrip(chars))
    return excerpt.slice(start, start + len(text.strip(chars)))


def read_markdown(source: Source) -> Excerpt:
    """All of a file as Markdown sees it: LF, U+FFFD for NUL, no byte order mark."""
    excerpt = source.excerpt()
    return normalize(excerpt.slice(1) if excerpt.text.startswith("\ufeff") else excerpt)


def normalize(excerpt: Excerpt) -> Excerpt:
    """An excerpt with CommonMark's line ends and without NUL; no character changes its place."""
    text = excerpt.text.replace("\r\n", " \n").replace("\r", "\n").replace("\0", "\ufffd")
    return excerpt if text == excerpt.text else Excerpt(excerpt.source, text, excerpt.pieces)
