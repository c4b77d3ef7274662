"""The block parser: markdown-it's rules, and those for footnotes and formulas.

Entry point: `block_tokens`. CommonMark with tables, task lists, footnotes and formulas. Besides
what markdown-it does:

1. The first token of a block gets its place, and the rows that its content was cut from.
2. Link definitions know where they stand.
3. What is nested deeper than `MAX_NESTING` becomes paragraphs, which say so: nothing is lost, and
   nothing overflows. The same becomes of what is in containers where these hold far more lines
   together than the text has: each of them reads its lines again.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeAlias, cast

from markdown_it import MarkdownIt
from markdown_it.common.utils import MD_TRIM_CHARS
from markdown_it.parser_block import ParserBlock
from markdown_it.ruler import Ruler
from markdown_it.rules_block import StateBlock, paragraph, reference
from markdown_it.utils import EnvType
from mdit_py_plugins.footnote.index import footnote_def

from coursebuild.core.syntax.math import math_block
from coursebuild.core.syntax.spans import BlockState, PositionedToken, SourceSlice
from coursebuild.core.text.source import Excerpt

MAX_NESTING = 60
"""Containers inside each other; a list with its item counts as two."""
TOO_DEEP = "too deep"
"""The info of a paragraph that would be something else, did it not nest so deep."""
_READINGS = 5
_SPARE_LINES = 10_000
"""How often containers may read the lines of a text, on average, and how many lines more."""

BlockRule = Callable[[StateBlock, int, int, bool], bool]


References: TypeAlias = dict[str, dict[str, Any]]
"""The link definitions of a text by label, as markdown-it keeps them; `place` is an `Excerpt`."""


def block_tokens(base: Excerpt, references: References) -> list[PositionedToken]:
    """The block tokens of a text with LF line ends and no NUL.

    Its link definitions are added to `references`.
    """
    env: EnvType = {"references": references, "base": base}
    state = BlockState(base.text, _MARKDOWN, env)
    state.lines_left = _READINGS * state.lineMax + _SPARE_LINES
    _MARKDOWN.block.tokenize(state, 0, state.lineMax)
    return cast(list[PositionedToken], state.tokens)


def _footnote_definition(state: StateBlock, start: int, end: int, silent: bool) -> bool:
    """`[^label]: …`, whose opening token gets a place like any other."""
    before = len(state.tokens)
    if not footnote_def(state, start, end, silent):
        return False
    if not silent:
        for i in (before, -1):
            plain = state.tokens[i]
            placed = PositionedToken(plain.type, plain.tag, plain.nesting, level=plain.level)
            placed.map, placed.content = plain.map, str(plain.meta.get("label", ""))
            state.tokens[i] = placed
    return True


def _located_reference(state: StateBlock, start: int, end: int, silent: bool) -> bool:
    """A link definition, with which its place is kept."""
    known: References = state.env["references"]
    count = len(known)
    if not reference(state, start, end, silent):
        return False
    if not silent and len(known) > count:
        base: Excerpt = state.env["base"]
        starts = (state.bMarks[line] + state.tShift[line] for line in range(start, state.line))
        ends = state.eMarks[start : state.line]
        rows = [base.slice(at, end + 1) for at, end in zip(starts, ends, strict=True)]
        known[next(reversed(known))]["place"] = Excerpt.join(rows)
    return True


class _BlockParser(ParserBlock):
    """Counts the lines that containers read."""

    def tokenize(self, state: StateBlock, startLine: int, endLine: int) -> None:
        assert isinstance(state, BlockState)
        state.lines_left -= endLine - startLine
        super().tokenize(state, startLine, endLine)


def _too_deep(state: StateBlock, start: int, end: int, silent: bool) -> bool:
    """A paragraph, where containers nest deeper than anybody writes them."""
    assert isinstance(state, BlockState)
    deep = state.level >= MAX_NESTING or (state.level > 0 and state.lines_left < 0)
    if silent or not deep:
        return False
    at = len(state.tokens)
    paragraph(state, start, end, False)
    state.tokens[at].info = TOO_DEEP
    return True


_FIRST = {
    "fence": "`~",
    "heading": "#",
    "hr": "*-_",
    "blockquote": ">",
    "list": "*+-0123456789",
    "html_block": "<",
    "reference": "[",
    "footnote": "[",
    "math": "$",
}
"""What blocks begin with, so that most lines ask few rules."""


def _placed(rule: BlockRule, first: str | None) -> BlockRule:
    """A rule, for what begins with one of the characters `first`, whose tokens get their places."""

    def run(state: StateBlock, start: int, end: int, silent: bool) -> bool:
        begin = state.bMarks[start] + state.tShift[start]
        if first is not None and state.src[begin : begin + 1] not in first:
            return False
        assert isinstance(state, BlockState)
        before = len(state.tokens)
        found = rule(state, start, end, silent)
        if found and len(state.tokens) > before:
            _place(state, before, begin)
        return found

    return run


def _place(state: BlockState, before: int, begin: int) -> None:
    """Say where the block with its first token at `before` stands, while the state still knows."""
    opened = state.tokens[before]
    assert isinstance(opened, PositionedToken)
    last = state.line - 1
    first = opened.map[0] if opened.map else last
    while last > first and state.isEmpty(last):
        last -= 1
    opened.start, opened.end = begin, state.eMarks[last]
    if opened.type in ("fence", "code_block", "html_block", "paragraph_open"):
        opened.rows = state.rows
    elif opened.type == "heading_open":
        opened.rows = _atx_row(state, begin) if opened.markup[0] == "#" else state.rows
    elif opened.type == "table_open":
        for token in state.tokens[before:]:
            if token.type == "tr_open" and isinstance(token, PositionedToken) and token.map:
                row = token.map[0]
                token.start = state.bMarks[row] + state.tShift[row]
                token.end = state.eMarks[row]


def _atx_row(state: BlockState, begin: int) -> list[SourceSlice]:
    """The row that a `#` heading's content is; its rule trims it by itself."""
    content = state.tokens[-2].content
    at = state.skipCharsStr(begin, "#")
    while content and state.src[at] in MD_TRIM_CHARS:
        at += 1
    return [SourceSlice(at, at + len(content))]


def _configured() -> MarkdownIt:
    """The parser: markdown-it's rules and ours, each with the blocks that it may interrupt."""
    md = MarkdownIt("zero", {"html": True, "tasklists": True, "maxNesting": 2 * MAX_NESTING})
    md.block = _BlockParser()
    rules = {known.name: (known.fn, known.alt) for known in md.block.ruler.__rules__}
    interrupts = ["paragraph", "reference", "blockquote"]
    rules["reference"] = (_located_reference, [])
    ours: dict[str, tuple[BlockRule, list[str]]] = {
        "too deep": (_too_deep, []),
        "math": (math_block, [*interrupts, "list"]),
        "footnote": (_footnote_definition, interrupts),
    }
    md.block.ruler = Ruler()
    for name, (rule, alt) in (ours | rules).items():
        md.block.ruler.push(name, _placed(rule, _FIRST.get(name)), {"alt": alt})
    # Links with dangerous schemes stay links, so that they can be reported.
    md.validateLink = lambda url: True  # type: ignore[method-assign]
    return md


_MARKDOWN = _configured()
