"""Formulas in a line of text: where the line may break, and where it must not.

Entry points: `breakable(mathml)`, `glue(html)`.

A browser takes a `math` element for one unbreakable box that the line may break on either side of.
So

1. a long formula is cut into several elements where Temml marked that it may break: after the
   relations and operators of its outermost level;
2. a formula and the punctuation that touches it are held together.
"""

from __future__ import annotations

import re

LONG = 20
"""Characters; a shorter formula stays whole."""

_ROW = re.compile(r"<(/?)mrow\b[^>]*>")
_WHOLE = re.compile(r"<math>(.*)</math>", re.DOTALL)
_TAG = re.compile(r"<[^>]*>")
_OPENING = frozenset("([“‘\"'")
_TOUCHING = re.compile(r"""((?:<math>.*?</math>)+)([,.;:!?)\]’”"'…%]*)""", re.DOTALL)


def breakable(mathml: str) -> str:
    """An inline formula that may break after its outermost rows, if it is long; else as it is."""
    whole = _WHOLE.fullmatch(mathml)
    if whole is None or len(_TAG.sub("", mathml)) < LONG:
        return mathml
    rows = _outer_rows(whole[1])
    if len(rows) < 2 or "".join(rows) != whole[1]:
        return mathml
    return "".join(f"<math>{row}</math>" for row in rows)


def _outer_rows(text: str) -> list[str]:
    rows: list[str] = []
    depth = start = 0
    for match in _ROW.finditer(text):
        depth += -1 if match[1] else 1
        if depth == 0:
            rows.append(text[start : match.end()])
            start = match.end()
    return rows


def glue(html: str) -> str:
    """The page with each inline formula held together with the punctuation that touches it."""
    parts: list[str] = []
    at = 0
    start = html.find("<math>")
    while start >= 0:
        found = _TOUCHING.match(html, start)
        if found is None:
            break
        before = start
        while before > at and html[before - 1] in _OPENING:
            before -= 1
        if before < start or found[2]:
            parts += (html[at:before], _held(html[before:start], found[1], found[2]))
            at = found.end()
        start = html.find("<math>", found.end())
    return "".join((*parts, html[at:]))


def _held(before: str, formula: str, after: str) -> str:
    first, last = formula.find("</math><math>"), formula.rfind("</math><math>")
    if first < 0:
        return _hold(before + formula + after)
    head, tail = first + len("</math>"), last + len("</math>")
    start = _hold(before + formula[:head]) if before else formula[:head]
    end = _hold(formula[tail:] + after) if after else formula[tail:]
    return start + formula[head:tail] + end


def _hold(html: str) -> str:
    return f'<span class="held">{html}</span>'
