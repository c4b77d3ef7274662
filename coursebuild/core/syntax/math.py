"""Formulas: the inline rule for `$…$` and `$$…$$`, and the block rule for `$$` on its own lines.

Entry points: `math_inline`, `math_block` (rules of the parsers), `find_formula` (also for HTML in
quiz texts).

A `$` opens a formula when something other than white space follows; the next `$` that no backslash
escapes must close it, with something other than white space before it and no digit after it. So
"costs $5 and $6" holds no formula. Code spans bind tighter than formulas, formulas tighter than
emphasis and links. A block of math ends at a `$$` with nothing but a label after it; an empty line
before that means that it was never closed.
"""

from __future__ import annotations

import re
from typing import NamedTuple

from markdown_it.rules_block import StateBlock
from markdown_it.rules_inline import StateInline

from coursebuild.core.syntax.attributes import Braces
from coursebuild.core.syntax.spans import BlockState, InlineState, PositionedToken

_TEX = re.compile(r"(?:[^\\`$]++|\\[\s\S])*+")
_BLOCK_TEX = re.compile(r"(?:[^\\$]++|\\[\s\S]|\$(?!\$))*+")
_BACKTICKS = re.compile(r"`+")
_DOLLARS = re.compile(r"\$+")
_LABEL = re.compile(r"\{#[^{}$]*\}?")
_SPACE = " \t\n"
_DIGITS = ("0", "1", "2", "3", "4", "5", "6", "7", "8", "9")


class FormulaText(NamedTuple):
    """A formula found in a text: its TeX is at `[start, end)`; its dollars end at `after`."""

    start: int
    end: int
    after: int
    display: bool


def find_formula(
    text: str, at: int, limit: int, last_runs: dict[int, int] | None = None
) -> FormulaText | None:
    """The formula that begins with the `$` at `at` and closes before `limit`, if it is one.

    `last_runs` says where the last run of each number of backticks begins; by it a code span inside
    is recognised.
    """
    width = 2 if text.startswith("$$", at) else 1
    start = at + width
    if start >= limit or (width == 1 and text[start] in _SPACE):
        return None
    end = start
    while True:
        end = _TEX.match(text, end, limit).end()  # type: ignore[union-attr]  # it matches nothing too
        if text.startswith("`", end, limit):
            run = _BACKTICKS.match(text, end, limit)
            assert run is not None
            if last_runs is not None and last_runs.get(len(run[0]), -1) > end:
                return None
            end = run.end()
        elif not text.startswith("$", end, limit):  # a backslash may stand before the limit
            return None
        elif width == 1:
            closes = text[end - 1] not in _SPACE and text[end + 1 : end + 2] not in _DIGITS
            return FormulaText(start, end, end + 1, False) if closes else None
        elif text.startswith("$$", end, limit):
            return FormulaText(start, end, end + 2, True)
        else:
            end += 1


def math_inline(state: StateInline, silent: bool) -> bool:
    """The inline rule: a token `math`, or `math_unclosed` for a `$$` without end.

    The TeX stands where `map` says; `meta` has the braces after the formula that are its own.
    """
    assert isinstance(state, InlineState)
    at = state.pos
    run = _DOLLARS.match(state.src, at, state.posMax)
    assert run is not None
    if len(run[0]) > 2:
        if not silent:
            state.append_pending(run[0])
        state.pos = run.end()
        return True
    if state.last_runs is None:
        runs = _BACKTICKS.finditer(state.src) if "`" in state.src else ()
        state.last_runs = {len(m[0]): m.start() for m in runs}
    formula = find_formula(state.src, at, state.posMax, state.last_runs)
    if formula is None:
        if len(run[0]) == 2:
            if not silent:
                token = state.push("math_unclosed", "", 0)
                token.content = run[0]
            state.pos = run.end()
            return True
        return False
    if not silent:
        token = state.push("math", "", 0)
        token.content = state.src[formula.start : formula.end]
        token.map = [formula.start, formula.end]
        token.info = "display" if formula.display else ""
    state.pos = formula.after
    if "{" in state.src[formula.after : formula.after + 4]:
        find = Braces.of_label if formula.display else Braces.of_symbol
        braces = find(state.src, formula.after, state.posMax)
        if braces is not None:
            state.pos = braces.end
            if not silent:
                token.meta["braces"] = braces
    return True


def math_block(state: StateBlock, start_line: int, end_line: int, silent: bool) -> bool:
    """The block rule: a token `math_block`, with `info` "unclosed" where it has no end."""
    assert isinstance(state, BlockState)
    begin = state.bMarks[start_line] + state.tShift[start_line]
    run = _DOLLARS.match(state.src, begin, state.eMarks[start_line])
    if run is None or len(run[0]) != 2 or state.is_code_block(start_line):
        return False
    line, at, closed = start_line, run.end(), False
    while True:
        close = _closing(state.src, at, state.eMarks[line])
        if close is not None:
            rest = state.src[close + 2 : state.eMarks[line]].strip(" \t")
            if rest and not _LABEL.fullmatch(rest):
                return False
            closed = True
            line += 1
            break
        line += 1
        if line >= end_line or state.isEmpty(line) or state.sCount[line] < state.blkIndent:
            break
        at = state.bMarks[line] + state.tShift[line]
    if silent:
        return True
    state.line = line
    token = state.push("math_block", "", 0)
    assert isinstance(token, PositionedToken)
    token.content = state.getLines(start_line, line, state.sCount[start_line], False)
    token.rows = state.rows
    token.map = [start_line, line]
    token.info = "" if closed else "unclosed"
    return True


def _closing(src: str, at: int, end: int) -> int | None:
    """Where the first `$$` between two offsets stands that no backslash escapes."""
    if src.find("$$", at, end) < 0:
        return None
    found = _BLOCK_TEX.match(src, at, end).end()  # type: ignore[union-attr]  # it matches nothing too
    return found if src.startswith("$$", found, end) else None
