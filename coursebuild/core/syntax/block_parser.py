"""The block parser: markdown-it's rules, and those for footnotes and formulas, also in lines.

CommonMark with tables, task lists, footnotes and formulas. The first token of a block gets its
place, and the rows from which its content was cut.
Blocks nested deeper than `MAX_NESTING` become paragraphs with a mark, so that nothing is lost and
nothing overflows. The same happens in containers that together hold far more lines than the text
has, since each of them reads its lines again.

A `$` opens a formula when something other than white space follows; the next `$` that no backslash
escapes must close it, with something other than white space before it and no digit after it. So
"costs $5 and $6" holds no formula. Words of a formula may hold others, as LaTeX's `text{for $i$}`.
Code spans bind tighter than formulas, formulas tighter than emphasis and links. A block of math
ends at a `$$` with nothing but a label after it; an empty line before that means that it was never
closed.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeAlias, cast

from markdown_it import MarkdownIt
from markdown_it.common.utils import MD_TRIM_CHARS
from markdown_it.parser_block import ParserBlock
from markdown_it.ruler import Ruler
from markdown_it.rules_block import StateBlock, paragraph, reference
from markdown_it.rules_inline import StateInline
from mdit_py_plugins.footnote.index import footnote_def

from coursebuild.core.syntax.attributes import LABEL, SYMBOL
from coursebuild.core.syntax.spans import BlockState, InlineState, PositionedToken
from coursebuild.core.text.regex import regex
from coursebuild.core.text.source import Excerpt

_PLAIN_TEX = r"(?:[^{}$`]|\{[^{}$`]*\})"
_WORDS = (
    r"\\(?:text\w*|[fhm]box|colorbox\{\w+\})"
    rf"\{{{_PLAIN_TEX}*+(?:\${_PLAIN_TEX}++\${_PLAIN_TEX}*+)+\}}"
)
"""Words in a formula that hold formulas themselves, as in `\\text{for all $i$}`."""
_TEX = regex(rf"(?>(?:{_WORDS}|[^\\`$]++|\\[\s\S])*)")
_BLOCK_TEX = regex(r"(?>(?:[^\\$]++|\\[\s\S]|\$(?!\$))*)")
BACKTICKS = regex(r"`+")
_DOLLARS = regex(r"\$+")
_AFTER_MATH = regex(r"[.,;:]?[ \t]*(?:\{#[^{}$]*\}?)?")
"""What may stand behind a formula of its own: a mark of the sentence that it ends, and a label."""
_SPACE = " \t\n"
_DIGITS = ("0", "1", "2", "3", "4", "5", "6", "7", "8", "9")


def _formula_end(state: InlineState, start: int, width: int) -> int | None:
    """The end of the TeX that begins at `start`, after `width` dollars; `None` if it is none."""
    text, limit = state.src, state.posMax
    if start >= limit or (width == 1 and text[start] in _SPACE):
        return None
    end = start
    while True:
        end = _TEX.match(text, end, limit).end()  # type: ignore[union-attr]  # it matches nothing too
        if text.startswith("`", end, limit):
            run = BACKTICKS.match(text, end, limit)
            assert run is not None
            if state.last_runs.get(len(run[0]), -1) > end:  # a code span begins
                return None
            end = run.end()
        elif not text.startswith("$", end, limit):  # a backslash may stand before the limit
            return None
        elif width == 1:
            closes = text[end - 1] not in _SPACE and text[end + 1 : end + 2] not in _DIGITS
            return end if closes else None
        elif text.startswith("$$", end, limit):
            return end
        else:
            end += 1


def math_inline(state: StateInline, silent: bool) -> bool:
    """The inline rule: a token `math`, or `math_unclosed` for a `$$` without end.

    `map` has the offsets of the TeX, `meta` those of the formula's attributes in braces.
    """
    assert isinstance(state, InlineState)
    run = _DOLLARS.match(state.src, state.pos, state.posMax)
    assert run is not None
    start, width = run.end(), len(run[0])
    end = _formula_end(state, start, width) if width <= 2 else None
    if end is None:
        if width > 2 and not silent:
            state.append_pending(run[0])
        elif width == 2 and not silent:
            state.push("math_unclosed", "", 0).content = run[0]
        state.pos = start if width > 1 else state.pos
        return width > 1
    braces = (LABEL if width == 2 else SYMBOL).match(state.src, end + width, state.posMax)
    if not silent:
        token = state.push("math", "", 0)
        token.content, token.map = state.src[start:end], [start, end]
        token.info = "display" if width == 2 else ""
        token.meta["braces"] = braces and braces.span(1)
    state.pos = braces.end() if braces else end + width
    return True


def math_block(state: StateBlock, start_line: int, end_line: int, silent: bool) -> bool:
    """The block rule: a token `math_block`, with the `info` "unclosed" if it has no end."""
    assert isinstance(state, BlockState)
    begin = state.bMarks[start_line] + state.tShift[start_line]
    run = _DOLLARS.match(state.src, begin, state.eMarks[start_line])
    if run is None or len(run[0]) != 2 or state.is_code_block(start_line):
        return False
    line, start, is_closed = start_line, run.end(), False
    while True:
        end = state.eMarks[line]
        closing = state.src.find("$$", start, end)
        if closing >= 0:  # the first one that no backslash escapes
            closing = _BLOCK_TEX.match(state.src, start, end).end()  # type: ignore[union-attr]  # it matches nothing too
        if closing >= 0 and state.src.startswith("$$", closing, end):
            rest = state.src[closing + 2 : end].strip(" \t")
            if not _AFTER_MATH.fullmatch(rest):
                return False
            is_closed = True
            line += 1
            break
        line += 1
        if line >= end_line or state.isEmpty(line) or state.sCount[line] < state.blkIndent:
            break
        start = state.bMarks[line] + state.tShift[line]
    if silent:  # without an end it may be that of a formula in the paragraph
        return is_closed
    state.line = line
    token = state.push("math_block", "", 0)
    token.content = state.getLines(start_line, line, state.sCount[start_line], False)
    token.map = [start_line, line]
    token.info = "" if is_closed else "unclosed"
    return True


MAX_NESTING = 60
"""How deep containers may nest; a list with its item counts as two."""
TOO_DEEP = "too deep"
"""The info of a paragraph that would be another block if it were not nested so deep."""
_MAX_READINGS = 5
_SPARE_LINES = 10_000
"""Containers may read so many times the lines of a text, and so many lines more."""

BlockRule = Callable[[StateBlock, int, int, bool], bool]


References: TypeAlias = dict[str, dict[str, Any]]
"""The link definitions of a text by label, as markdown-it keeps them; `place` is an `Excerpt`."""


def block_tokens(base: Excerpt, references: References) -> list[PositionedToken]:
    """The block tokens of a text with LF and no NUL, whose link definitions join `references`."""
    text = base.text
    if text[:1].isalpha() and "\n" not in text:  # as most texts of quizzes and labs
        opening = PositionedToken("paragraph_open", "p", 1, end=len(text), start=0, text=base)
        inline = PositionedToken("inline", "", 0, content=text)
        return [opening, inline, PositionedToken("paragraph_close", "p", -1)]
    state = BlockState(base, _MARKDOWN, {"references": references})
    state.lines_left = _MAX_READINGS * state.lineMax + _SPARE_LINES
    _MARKDOWN.block.tokenize(state, 0, state.lineMax)
    return cast(list[PositionedToken], state.tokens)


def _footnote_definition(state: StateBlock, start: int, end: int, silent: bool) -> bool:
    """The rule for `[^label]: …`; its tokens become positioned ones, as all others are."""
    token_count = len(state.tokens)
    if not footnote_def(state, start, end, silent):
        return False
    if not silent:
        for i in (token_count, -1):
            token = state.tokens[i]
            positioned = PositionedToken(token.type, token.tag, token.nesting, level=token.level)
            positioned.map, positioned.content = token.map, str(token.meta.get("label", ""))
            state.tokens[i] = positioned
    return True


def _link_definition(state: StateBlock, start: int, end: int, silent: bool) -> bool:
    assert isinstance(state, BlockState)
    references: References = state.env["references"]
    count = len(references)
    if not reference(state, start, end, silent):
        return False
    if not silent and len(references) > count:
        starts = (state.bMarks[line] + state.tShift[line] for line in range(start, state.line))
        ends = state.eMarks[start : state.line]
        rows = [state.base.slice(at, end + 1) for at, end in zip(starts, ends, strict=True)]
        references[next(reversed(references))]["place"] = Excerpt.join(rows)
    return True


class _BlockParser(ParserBlock):
    """markdown-it's block parser, which also counts the lines that containers read."""

    def tokenize(self, state: StateBlock, startLine: int, endLine: int) -> None:
        assert isinstance(state, BlockState)
        state.lines_left -= endLine - startLine
        super().tokenize(state, startLine, endLine)
        state.lines_left += endLine - state.line  # an item of a list leaves some to the next


def _deep_paragraph(state: StateBlock, start: int, end: int, silent: bool) -> bool:
    """The rule for containers nested deeper than anybody writes: they become a paragraph."""
    assert isinstance(state, BlockState)
    is_deep_paragraph = state.level >= MAX_NESTING or (state.level > 0 and state.lines_left < 0)
    if silent or not is_deep_paragraph:
        return False
    at = len(state.tokens)
    paragraph(state, start, end, False)
    state.tokens[at].info = TOO_DEEP
    return True


_WITH_TEXT = frozenset("fence code_block html_block paragraph_open math_block".split())
"""Types of tokens whose content is the text that the last rule cut out."""


def _with_places(rule: BlockRule) -> BlockRule:

    def run(state: StateBlock, start: int, end: int, silent: bool) -> bool:
        assert isinstance(state, BlockState)
        begin = state.bMarks[start] + state.tShift[start]
        token_count = len(state.tokens)
        applies = rule(state, start, end, silent)
        if applies and len(state.tokens) > token_count:
            opening = state.tokens[token_count]
            assert isinstance(opening, PositionedToken)
            last = state.line - 1
            first = opening.map[0] if opening.map else last
            while last > first and state.isEmpty(last):
                last -= 1
            opening.start, opening.end = begin, state.eMarks[last]
            if opening.type in _WITH_TEXT:
                opening.text = state.text
                opening.meta["closed"] = state.text_end < state.line  # by a line of its own
            elif opening.type == "heading_open" and opening.markup[0] != "#":
                opening.text = state.text
            elif (
                opening.type == "heading_open"
            ):  # whose rule does not cut its content by `getLines`
                at, length = state.skipCharsStr(begin, "#"), len(state.tokens[-2].content)
                while length and state.src[at] in MD_TRIM_CHARS:
                    at += 1
                opening.text = state.base.slice(at, at + length)
            elif opening.type == "table_open":
                for token in state.tokens[token_count:]:
                    if token.type == "tr_open" and isinstance(token, PositionedToken) and token.map:
                        row = token.map[0]
                        token.start = state.bMarks[row] + state.tShift[row]
                        token.end = state.eMarks[row]
        return applies

    return run


_MARKDOWN = MarkdownIt("zero", {"html": True, "tasklists": True, "maxNesting": 2 * MAX_NESTING})
# Links with dangerous schemes stay links, so that they can be reported.
_MARKDOWN.validateLink = lambda url: True  # type: ignore[method-assign]
_MARKDOWN.block = _BlockParser()
_INTERRUPTS = ["paragraph", "reference", "blockquote"]
_RULES: dict[str, tuple[BlockRule, list[str]]] = {
    "too deep": (_deep_paragraph, []),
    "math": (math_block, [*_INTERRUPTS, "list"]),
    "footnote": (_footnote_definition, _INTERRUPTS),
    **{rule.name: (rule.fn, rule.alt) for rule in _MARKDOWN.block.ruler.__rules__},
    "reference": (_link_definition, []),
}
"""Our rules and those of markdown-it, each with the blocks that it may interrupt."""
_MARKDOWN.block.ruler = Ruler()
for _name, (_rule, _alt) in _RULES.items():
    _MARKDOWN.block.ruler.push(_name, _with_places(_rule), {"alt": _alt})
