"""Formulas: the inline rule for `$…$` and `$$…$$`, and the block rule for `$$` on its own lines.

Entry points: `math_inline`, `math_block` (rules of the parsers).

A `$` opens a formula when something other than white space follows; the next `$` that no backslash
escapes must close it, with something other than white space before it and no digit after it. So
"costs $5 and $6" holds no formula. Code spans bind tighter than formulas, formulas tighter than
emphasis and links. A block of math ends at a `$$` with nothing but a label after it; an empty line
before that means that it was never closed.
"""

from __future__ import annotations

import re

from markdown_it.rules_block import StateBlock
from markdown_it.rules_inline import StateInline

from coursebuild.core.syntax.attributes import LABEL, SYMBOL
from coursebuild.core.syntax.spans import BlockState, InlineState

_TEX = re.compile(r"(?:[^\\`$]++|\\[\s\S])*+")
_BLOCK_TEX = re.compile(r"(?:[^\\$]++|\\[\s\S]|\$(?!\$))*+")
BACKTICKS = re.compile(r"`+")
_DOLLARS = re.compile(r"\$+")
_LABEL = re.compile(r"\{#[^{}$]*\}?")
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
        closing = _find_closing(state.src, start, state.eMarks[line])
        if closing is not None:
            rest = state.src[closing + 2 : state.eMarks[line]].strip(" \t")
            if rest and not _LABEL.fullmatch(rest):
                return False
            is_closed = True
            line += 1
            break
        line += 1
        if line >= end_line or state.isEmpty(line) or state.sCount[line] < state.blkIndent:
            break
        start = state.bMarks[line] + state.tShift[line]
    if silent:
        return True
    state.line = line
    token = state.push("math_block", "", 0)
    token.content = state.getLines(start_line, line, state.sCount[start_line], False)
    token.map = [start_line, line]
    token.info = "" if is_closed else "unclosed"
    return True


def _find_closing(src: str, start: int, end: int) -> int | None:
    """The offset of the first `$$` between two offsets that no backslash escapes."""
    if src.find("$$", start, end) < 0:
        return None
    tex_end = _BLOCK_TEX.match(src, start, end).end()  # type: ignore[union-attr]  # it matches nothing too
    return tex_end if src.startswith("$$", tex_end, end) else None
