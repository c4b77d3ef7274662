"""Where markdown-it's tokens stand: tokens, parser states and excerpts that keep positions.

Entry points: `BlockState`, `InlineState` (markdown-it's parser states, whose tokens are
`PositionedToken`s), `locate` (content rows into an `Excerpt`).

1. Block rules cut lines out of the text by `getLines`; `BlockState` notes where each of those rows
   began.
2. `locate` joins such rows to an excerpt of the source, through the excerpt that was parsed (a
   whole file, or a text in JSON).
3. Inline rules work on one block's content; `InlineState` notes from where to where each token
   reaches in it.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

from markdown_it import MarkdownIt
from markdown_it.common.utils import MD_TRIM_CHARS
from markdown_it.rules_block import StateBlock
from markdown_it.rules_inline import StateInline
from markdown_it.token import Token
from markdown_it.utils import EnvType

from coursebuild.core.text.source import Excerpt, Source


class SourceSlice(NamedTuple):
    """A stretch of the parsed text that became part of a block's content."""

    text: str
    at: int
    """Offset of the first character that is not padding."""
    padding: int = 0
    """Leading spaces of `text` that stand for a part of the tab before `at`."""


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
        return "".join([row.text for row in rows])

    def _row(self, line: int, indent: int, line_end: bool) -> SourceSlice:
        src, first = self.src, self.bMarks[line]
        last = self.eMarks[line] + 1 if line_end else self.eMarks[line]
        if indent <= 0:
            return SourceSlice(src[first:last], first)
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
        padding = max(0, column - indent)
        return SourceSlice(" " * padding + src[first:last], first, padding)


class InlineState(StateInline):
    """The state of the inline rules; `mark` is where the text that is not yet a token began."""

    def __init__(self, src: str, md: MarkdownIt, env: EnvType) -> None:
        super().__init__(src, md, env, [])
        self.mark = 0
        self.last_bracket: int | None = None
        """Where the last `]` stands, once somebody asked."""
        self.last_braced: int | None = None
        """Where the last `]{` stands, once somebody asked."""
        self.last_runs: dict[int, int] | None = None
        """Where the last run of each number of backticks begins, once somebody asked."""
        self.literal = ""
        """In a text that is HTML: the open element in which a dollar is a dollar."""

    def pushPending(self) -> Token:  # noqa: N802
        """Make the pending text a token."""
        return self.push_text(self.pending)

    def push_text(self, content: str) -> Token:
        """Make this, which is all of the pending text, a token."""
        start = self.mark
        token = PositionedToken(
            "text", "", 0, level=self.pendingLevel, content=content, start=start
        )
        token.end = start + len(content)
        self.tokens.append(token)
        self.pending = ""
        return token

    def push(self, ttype: str, tag: str, nesting: Literal[-1, 0, 1]) -> Token:
        """Add a token that begins here; the tokenizer sets its end when the rule is through."""
        text = self.pending
        if text:
            self.push_text(text)
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
    texts: list[str] = []
    pieces: list[tuple[int, int]] = []
    at, shift = 0, None
    for text, offset, padding in rows:
        for i in range(padding):
            pieces.append((at + i, base.offset(offset - 1)))
            shift = None
        start = at + padding
        end = offset + len(text) - padding
        for inner, to in _pieces(base, offset, end):
            if to - start - inner != shift:
                shift = to - start - inner
                pieces.append((start + inner, to))
        texts.append(text)
        at += len(text)
    return Excerpt(base.source, "".join(texts), tuple(pieces) or ((0, 0),))


def _pieces(base: Excerpt, start: int, end: int) -> Iterable[tuple[int, int]]:
    """The pieces of `base` between two of its offsets, counted from the first."""
    first = bisect_right(base.pieces, start, key=lambda piece: piece[0])
    last = bisect_right(base.pieces, end - 1, key=lambda piece: piece[0])
    return ((0, base.offset(start)), *((t - start, s) for t, s in base.pieces[first:last]))


def joined(parts: Iterable[Excerpt], between: str = "") -> Excerpt | None:
    """Excerpts of one source put together; `None` where there are none."""
    texts: list[str] = []
    pieces: list[tuple[int, int]] = []
    source: Source | None = None
    at = 0
    for part in parts:
        source = part.source
        pieces += [(at + t, s) for t, s in part.pieces]
        texts.append(part.text)
        at += len(part.text) + len(between)
    return None if source is None else Excerpt(source, between.join(texts), tuple(pieces))


def trimmed(excerpt: Excerpt, chars: str = MD_TRIM_CHARS) -> Excerpt:
    """The excerpt without white space at its ends."""
    given = excerpt.text
    if not given or (given[0] not in chars and given[-1] not in chars):
        return excerpt
    text = given.lstrip(chars)
    lead = len(given) - len(text)
    return excerpt.slice(lead, lead + len(text.rstrip(chars)))


def whole(source: Source) -> Excerpt:
    """All of a file as Markdown sees it: LF, U+FFFD for NUL, no byte order mark."""
    excerpt = source.excerpt()
    return normalized(excerpt.slice(1) if excerpt.text.startswith("\ufeff") else excerpt)


def normalized(excerpt: Excerpt) -> Excerpt:
    """An excerpt with CommonMark's line ends and without NUL, each character where it was."""
    text = excerpt.text.replace("\r\n", " \n").replace("\r", "\n").replace("\0", "\ufffd")
    return excerpt if text == excerpt.text else Excerpt(excerpt.source, text, excerpt.pieces)
