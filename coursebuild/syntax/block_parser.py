"""The block parser: markdown-it's rules, chosen by the first character of a line.

Entry point: `Blocks`. Its rules are markdown-it's own, with those for footnotes and formulas; that
for tables is ours (`tables`).
Besides:

1. A line is only shown to the rules that can begin with its first character, and a paragraph only
   looks for its end where a rule could find one.
2. The first token of a block gets its place, and the rows that its content was cut from.
3. Link definitions keep the rows that hold them.
4. What is nested deeper than `MAX_NESTING` becomes paragraphs: nothing is lost, nothing overflows.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from markdown_it.common.utils import MD_TRIM_CHARS
from markdown_it.parser_block import ParserBlock
from markdown_it.rules_block import (
    StateBlock,
    blockquote,
    code,
    fence,
    heading,
    hr,
    html_block,
    lheading,
    list_block,
    paragraph,
    reference,
)
from markdown_it.utils import EnvType
from mdit_py_plugins.footnote.index import footnote_def
from msgspec import Struct, field

from coursebuild.source import Excerpt
from coursebuild.syntax.math import math_block
from coursebuild.syntax.spans import BlockState, Placed, Row
from coursebuild.syntax.tables import table

MAX_NESTING = 60
"""Containers inside each other; a list with its item counts as two."""

LOOK_AHEAD = 20
"""Lines of a paragraph that are searched for an underline before the rule itself is asked."""

BlockRule = Callable[[StateBlock, int, int, bool], bool]


class Definition(Struct):
    """A link definition as markdown-it keeps it, with the rows of `base` that hold it."""

    href: str
    title: str
    base: Excerpt
    rows: list[Row]


class Definitions(Struct):
    """What block parsing learns besides its tokens."""

    links: dict[str, Definition] = field(default_factory=dict)
    """By normalised label."""

    def environment(self) -> EnvType:
        """The environment that markdown-it's rules read."""
        return {
            "references": {k: {"href": d.href, "title": d.title} for k, d in self.links.items()}
        }


def _footnote_definition(state: StateBlock, start: int, end: int, silent: bool) -> bool:
    """`[^label]: …`, whose opening token gets a place like any other."""
    before = len(state.tokens)
    if not footnote_def(state, start, end, silent):
        return False
    if not silent:
        for i in (before, -1):
            plain = state.tokens[i]
            placed = Placed(plain.type, plain.tag, plain.nesting, level=plain.level)
            placed.map, placed.content = plain.map, str(plain.meta.get("label", ""))
            state.tokens[i] = placed
    return True


def _located_reference(state: StateBlock, start: int, end: int, silent: bool) -> bool:
    """A link definition; the rows that hold it are kept with it."""
    known = state.env.setdefault("references", {})
    count = len(known)
    if not reference(state, start, end, silent):
        return False
    if not silent and len(known) > count:
        label = next(reversed(known))
        rows = []
        for line in range(start, state.line):
            at = state.bMarks[line] + state.tShift[line]
            rows.append(Row(state.src[at : state.eMarks[line]] + "\n", at))
        definitions: Definitions = state.env["definitions"]
        definitions.links[label] = Definition(
            known[label]["href"], known[label]["title"], state.env["base"], rows
        )
    return True


def _paragraph(state: StateBlock, start: int, end: int, silent: bool) -> bool:
    """markdown-it's rule; most paragraphs are one line, whose end need not be looked for."""
    below = start + 1
    if below < state.lineMax and not state.isEmpty(below):
        return paragraph(state, start, end, silent)
    state.getLines(start, below, state.blkIndent, False)
    state.line = below
    state.push("paragraph_open", "p", 1).map = [start, below]
    state.push("inline", "", 0)
    state.push("paragraph_close", "p", -1)
    return True


_ANY: tuple[BlockRule, ...] = (lheading, _paragraph)
_MARKER = "*-_+0123456789"
_STARTS: dict[str, tuple[BlockRule, ...]] = {
    ">": (blockquote,),
    "#": (heading, *_ANY),
    "<": (html_block, *_ANY),
    "[": (_footnote_definition, _located_reference, *_ANY),
    "$": (math_block, *_ANY),
    "`": (fence, *_ANY),
    "~": (fence, *_ANY),
} | dict.fromkeys(_MARKER, (hr, list_block, *_ANY))
"""Which rules a line can start, by its first character; `table` comes before where the next line
allows it."""

_IN_LIST: dict[str, tuple[BlockRule, ...]] = {
    ">": (blockquote,),
    "$": (math_block,),
    "`": (fence,),
    "~": (fence,),
    "*": (hr,),
    "-": (hr,),
    "_": (hr,),
}
_IN_PARAGRAPH: dict[str, tuple[BlockRule, ...]] = (
    _IN_LIST
    | {"#": (heading,), "<": (html_block,), "[": (_footnote_definition,)}
    | dict.fromkeys(_MARKER, (hr, list_block))
)
_ENDINGS = {
    "paragraph": _IN_PARAGRAPH,
    "reference": _IN_PARAGRAPH,
    "blockquote": _IN_PARAGRAPH,
    "list": _IN_LIST,
}
"""By chain of markdown-it's and by a line's first character: the rules that end a block there."""


def _ends(chain: str, state: StateBlock, line: int, end: int, silent: bool) -> bool:
    """Whether a line ends the block before it, by the rules of a chain."""
    at = state.bMarks[line] + state.tShift[line]
    in_paragraph = chain == "paragraph" or chain == "reference"
    if in_paragraph and _table_may_start(state, line, end) and table(state, line, end, True):
        return True
    for rule in _ENDINGS[chain].get(state.src[at : at + 1], ()):
        if rule(state, line, end, True):
            return True
    return False


def _table_may_start(state: StateBlock, line: int, end: int) -> bool:
    """Whether the line below can be the delimiter row of a table."""
    if line + 2 > end:
        return False
    at = state.bMarks[line + 1] + state.tShift[line + 1]
    return at < state.eMarks[line + 1] and state.src[at] in "|-:"


class Blocks(ParserBlock):
    """The block parser."""

    def __init__(self) -> None:
        super().__init__()
        for rule in self.ruler.__rules__:
            rule.alt = []
        for chain in _ENDINGS:
            self.ruler.push(f"ends {chain}", partial(_ends, chain), {"alt": [chain]})

    def tokenize(self, state: StateBlock, startLine: int, endLine: int) -> None:
        """Add the tokens of a range of lines; containers call it again for what they hold."""
        assert isinstance(state, BlockState)
        line, seen_empty = startLine, False
        while line < endLine:
            state.line = line = state.skipEmptyLines(line)
            if line >= endLine or state.sCount[line] < state.blkIndent:
                break
            self._block(state, line, endLine)
            state.tight = not seen_empty
            line = state.line
            starts, shifts, ends = state.bMarks, state.tShift, state.eMarks
            last = line - 1
            if last < endLine and starts[last] + shifts[last] >= ends[last]:
                seen_empty = True
            if line < endLine and starts[line] + shifts[line] >= ends[line]:
                seen_empty = True
                line += 1
                state.line = line

    def _block(self, state: BlockState, line: int, end: int) -> None:
        before = len(state.tokens)
        begin = state.bMarks[line] + state.tShift[line]
        if state.level >= MAX_NESTING:
            _paragraph(state, line, end, False)
        elif state.is_code_block(line):
            code(state, line, end, False)
        elif not (_table_may_start(state, line, end) and table(state, line, end, False)):
            for rule in _STARTS.get(state.src[begin], _ANY):
                if (rule is not lheading or _underlined(state, line, end)) and rule(
                    state, line, end, False
                ):
                    break
        if len(state.tokens) > before:
            _place(state, before, begin)


def _underlined(state: StateBlock, line: int, end: int) -> bool:
    """Whether a line of the paragraph that begins here may underline a heading."""
    for below in range(line + 1, min(end, line + LOOK_AHEAD)):
        at = state.bMarks[below] + state.tShift[below]
        if at >= state.eMarks[below]:
            return False
        if state.src[at] in "-=":
            return True
    return line + LOOK_AHEAD < end


def _place(state: BlockState, before: int, begin: int) -> None:
    """Say where the block with its first token at `before` stands, while the state still knows."""
    opened = state.tokens[before]
    assert isinstance(opened, Placed)
    last = state.line - 1
    first = opened.map[0] if opened.map else last
    while last > first and state.isEmpty(last):
        last -= 1
    opened.start, opened.end = begin, state.eMarks[last]
    if opened.type in ("fence", "code_block", "html_block", "paragraph_open"):
        opened.rows, opened.lines = state.rows, state.count
    elif opened.type == "heading_open":
        opened.rows = _atx_row(state, begin) if opened.markup[0] == "#" else state.rows
    elif opened.type == "table_open":
        for token in state.tokens[before:]:
            if token.type == "tr_open" and isinstance(token, Placed) and token.map:
                row = token.map[0]
                token.start = state.bMarks[row] + state.tShift[row]
                token.end = state.eMarks[row]


def _atx_row(state: BlockState, begin: int) -> list[Row]:
    """The row that a `#` heading's content is; its rule trims it by itself."""
    content = state.tokens[-2].content
    at = state.skipCharsStr(begin, "#")
    while content and state.src[at] in MD_TRIM_CHARS:
        at += 1
    return [Row(content, at)]
