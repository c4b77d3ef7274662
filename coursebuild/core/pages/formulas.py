"""Formulas in a line of text: where the line may break, and where it must not.

Entry points: `in_line(mathml, label)`, of which `breakable` and `contained` are the steps, for a
formula by itself; `glue(html)` for a whole page.

A browser takes a `math` element for one unbreakable box that the line may break on either side of.
So

1. a long formula is cut into several elements where TeX would break it too: after the relations and
   the binary operators of its outermost level;
2. a piece that may be wider than a narrow window scrolls inside itself;
3. a formula is held together with the punctuation that touches it, and with a unit behind a space
   that does not break;
4. an operator at an end of a formula, next to a space of the text, brings no space of its own, as
   in TeX.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Iterator
from html import escape, unescape

LONG = 20
"""Characters; a shorter formula stays whole."""
WIDE = 22
"""Characters; a shorter piece fits the narrowest window."""

_REMEMBERED = 256
"""Formulas: a text says the same ones again and again."""

_ROW = re.compile(r"<(/?)mrow\b[^>]*>")
_WHOLE = re.compile(r"<math>(?:<semantics>)?(.*?)(?:<annotation\b.*)?</math>", re.DOTALL)
_ANNOTATION = re.compile(r"<annotation\b.*?</annotation>", re.DOTALL)
_TAG = re.compile(r"<[^>]*>")
_PIECE = re.compile(r"<math>.*?</math>", re.DOTALL)
_OPENING = frozenset("([“‘\"'")
_HOLD, _LOOSE = '<span class="held">', "</span>"
_TOUCHING = re.compile(
    r"""((?:<math>.*?</math>)+)((?:\u00a0[^\s<&]{1,16}){0,4}[,.;:!?)\]’”"'…%]*)""", re.DOTALL
)

_RELATIONS = frozenset("=<>≤≥≠≈≡∼≃≅∝→←↔⇒⇐⇔↦⟶⟹∈∉⊂⊆⊃⊇≪≫≔:")
_BINARY = frozenset("+-−±∓×·⋅∗∘⊗⊕∧∨∪∩")
_SIGN = "|".join(re.escape(escape(sign)) for sign in sorted(_RELATIONS | _BINARY))
_FIRST = re.compile(rf"<math>(?<=\s<math>)(?:<semantics>)?(?:<mrow>)*+<mo(?=>(?:{_SIGN})</mo>)")
_LAST = re.compile(
    rf"""<mo(?: lspace="0em")?(?=>(?:{_SIGN})</mo>(?:</mrow>)*+"""
    r"""(?:<annotation\b[^<]*</annotation></semantics>)?</math>\s)"""
)
_END = re.compile(r"</math>(?=\s)")
_OPEN, _CLOSE, _BAR = frozenset("([{⟨⌊⌈"), frozenset(")]}⟩⌋⌉"), frozenset("|‖∥∣")


@functools.lru_cache(maxsize=_REMEMBERED)
def in_line(mathml: str, label: str) -> str:
    """An inline formula as it stands in its line: see 1 and 2."""
    return contained(breakable(mathml), label)


def breakable(mathml: str) -> str:
    """An inline formula that may break at its outermost level, if it is long; else as it is."""
    whole = _WHOLE.fullmatch(mathml)
    if whole is None or _length(mathml) < LONG:
        return mathml
    inner = whole[1]
    rows = _outer_rows(inner)
    if "".join(rows) != inner:
        return mathml
    if len(rows) == 1:
        start, end = inner.index(">") + 1, inner.rindex("<")
        rows = [inner[:start] + piece + inner[end:] for piece in _pieces(inner[start:end])]
    return "".join(f"<math>{row}</math>" for row in rows) if len(rows) > 1 else mathml


def _length(mathml: str) -> int:
    return len(unescape(_TAG.sub("", _ANNOTATION.sub("", mathml))))


def _outer_rows(text: str) -> list[str]:
    rows: list[str] = []
    depth = start = 0
    for match in _ROW.finditer(text):
        depth += -1 if match[1] else 1
        if depth == 0:
            rows.append(text[start : match.end()])
            start = match.end()
    return rows


def _pieces(row: str) -> list[str]:
    """The inside of a row, cut after relations and binary operators that no brackets enclose."""
    pieces: list[str] = []
    start = depth = 0
    bars = False
    operand = False
    for end, element in _elements(row):
        sign = unescape(_TAG.sub("", element)).strip() if element.startswith("<mo") else ""
        if sign in _OPEN and sign:
            depth += 1
        elif sign in _CLOSE and sign:
            depth -= 1
        elif sign in _BAR and sign:
            bars = not bars
        breaks = sign != "" and (sign in _RELATIONS or (operand and sign in _BINARY))
        if breaks and depth == 0 and not bars and end < len(row):
            pieces.append(row[start:end])
            start = end
        operand = not (sign in _RELATIONS or sign in _BINARY or sign in _OPEN) or not sign
    return [*pieces, row[start:]]


def _elements(row: str) -> Iterator[tuple[int, str]]:
    """The elements next to each other in a row, each with the offset of its end."""
    start = depth = 0
    for tag in _TAG.finditer(row):
        if tag[0].startswith("</"):
            depth -= 1
        elif not tag[0].endswith("/>"):
            depth += 1
        if depth == 0:
            yield tag.end(), row[start : tag.end()]
            start = tag.end()


def contained(html: str, label: str) -> str:
    """The pieces of an inline formula, the wide ones in boxes that scroll and have this label."""
    start = f'<span class="formula-inline" tabindex="0" role="group" aria-label="{escape(label)}">'

    def boxed(piece: re.Match[str]) -> str:
        return f"{start}{piece[0]}</span>" if _length(piece[0]) >= WIDE else piece[0]

    return html if _length(html) < WIDE else _PIECE.sub(boxed, html)


def glue(html: str) -> str:
    """The page with each inline formula set to what stands beside it: see 3 and 4."""
    html = _tight(html)
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


def _tight(html: str) -> str:
    """The page without the spaces of operators at the ends of formulas, next to a space: see 4."""
    html = _FIRST.sub(r'\g<0> lspace="0em"', html)
    parts: list[str] = []
    at = before = 0
    for end in _END.finditer(html):
        # No other than the last operator before it; one before an earlier end is not its own.
        start = html.rfind("<mo", before, end.start())
        found = _LAST.match(html, start) if start >= 0 else None
        before = end.end()
        if found is not None:
            parts += (html[at : found.end()], ' rspace="0em"')
            at = found.end()
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
    return f"{_HOLD}{html}{_LOOSE}"
