"""Where a line of text may break, and where it must not: inline formulas, numbers and their units.

A browser never breaks a line inside a `math` element, but may do so on either side. Therefore

1. a long formula is split into several elements where TeX would break it too: after the relations
   and binary operators of its outermost level;
2. a piece that may be wider than a narrow window scrolls inside a box;
3. pieces are isolated as text from the left, or text from the right would turn their order;
4. a formula is kept together with adjacent punctuation, and with a unit after a no-break space;
5. an operator at an end of a formula, next to a space of the text, gets no space of its own, as in
   TeX.

In numbers and their units

1. a no-break space replaces each space between a number and its unit, and inside a unit (`kg m²`);
2. a sign or a unit would end up on the wrong side of its number in text from the right, since
   neither has a direction of its own. Such quantities are isolated as text from the left.

Units are those of the SI, those used with it, and a few of computing. If a word or a label (`Figure
2 A`) is taken for a unit, the no-break space does no harm.

A straight apostrophe inside a word is drawn as a curly one, which is right in every language that
is written from the left. All other straight quotes stay as they are: `'` at an end of a word may
open or close a quotation or stand for minutes, and which marks do so is the author's choice.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Iterator
from html import escape, unescape
from typing import Literal

from markupsafe import Markup

from coursebuild.core.text.regex import regex
from coursebuild.core.text.units import UNIT_PATTERN

LONG = 20
"""Characters; a shorter formula is not split."""
WIDE = 22
"""Characters; a shorter piece fits into the narrowest window."""

FORMULA = regex(r"(<math\b.*?</math>)", re.DOTALL)
"""A formula of any kind; splitting a page by it gives texts and formulas in turn."""

_CACHE_SIZE = 2048

_ROW = regex(r"<(/?)mrow\b[^>]*>")
_WHOLE = regex(r"<math>(?:<semantics>)?(.*?)(?:<annotation\b.*)?</math>", re.DOTALL)
_ANNOTATION = regex(r"<annotation\b.*?</annotation>", re.DOTALL)
_TAG = regex(r"<[^>]*>")
_PIECE = regex(r"<math>.*?</math>", re.DOTALL)
_BOX = '<span class="formula-inline"[^>]*>'
_WHOLE_PIECE = f"(?>{_PIECE.pattern})"
_PIECES = regex(rf"(?:{_BOX}{_WHOLE_PIECE}</span>|{_WHOLE_PIECE}){{2,}}", re.DOTALL)
_GLUE_START, _GLUE_END = '<span class="held">', "</span>"
_FORMULAS = regex(r"(<math>.*?</math>(?:<math>.*?</math>)*)", re.DOTALL)
_OPENING = "([“‘\"'\u2066"
_CLOSING = regex(r"""\u2069?(?:\u00a0[^\s<&]{1,16}){0,4}[,.;:!?)\]’”"'…%]*""")

_LETTER = r"[^\W\d_]"
_APOSTROPHE = regex(rf"(?<={_LETTER})'(?={_LETTER}|\ue000)|(?<=\ue000)'(?={_LETTER})")

_RELATIONS = frozenset("=<>≤≥≠≈≡∼≃≅∝→←↔⇒⇐⇔↦⟶⟹∈∉⊂⊆⊃⊇≪≫≔:")
_BINARY = frozenset("+-−±∓×·⋅∗∘⊗⊕∧∨∪∩")
_SIGN = "|".join(re.escape(escape(sign)) for sign in sorted(_RELATIONS | _BINARY))
_FIRST = regex(rf"<math>(?<=\s<math>)(?:<semantics>)?(?>(?:<mrow>)*)<mo(?=>(?:{_SIGN})</mo>)")
_LAST = regex(
    rf"""<mo(?: lspace="0em")?(?=>(?:{_SIGN})</mo>(?>(?:</mrow>)*)"""
    r"""(?:<annotation\b[^<]*</annotation></semantics>)?</math>\s)"""
)
_OPEN, _CLOSE, _BAR = frozenset("([{⟨⌊⌈"), frozenset(")]}⟩⌋⌉"), frozenset("|‖∥∣")


@functools.lru_cache(maxsize=_CACHE_SIZE)
def inline_formula(mathml: str, label: str) -> str:
    """An inline formula, split and with wide pieces in boxes (steps 1 and 2)."""
    return wrap_wide_pieces(split_formula(mathml), label)


def split_formula(mathml: str) -> str:
    """An inline formula, split at its outermost level if it is long (step 1)."""
    whole = _WHOLE.fullmatch(mathml)
    if whole is None or _length(mathml) < LONG:
        return mathml
    inner = whole[1]
    rows: list[str] = []
    depth = start = 0
    for match in _ROW.finditer(inner):
        depth += -1 if match[1] else 1
        if depth == 0:
            rows.append(inner[start : match.end()])
            start = match.end()
    if "".join(rows) != inner:
        return mathml
    if len(rows) == 1:
        start, end = inner.index(">") + 1, inner.rindex("<")
        rows = [inner[:start] + piece + inner[end:] for piece in _pieces(inner[start:end])]
    return "".join(f"<math>{row}</math>" for row in rows) if len(rows) > 1 else mathml


def _length(mathml: str) -> int:
    return len(unescape(_TAG.sub("", _ANNOTATION.sub("", mathml))))


def _pieces(row: str) -> list[str]:
    """The inside of a row, split after relations and binary operators outside brackets."""
    pieces: list[str] = []
    start = end = inner = depth = 0
    bars = False
    operand = False
    for tag in _TAG.finditer(row):
        if tag[0].startswith("</"):
            inner -= 1
        elif not tag[0].endswith("/>"):
            inner += 1
        if inner:
            continue
        element, end = row[end : tag.end()], tag.end()  # the next of the outermost elements
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


def wrap_wide_pieces(html: str, label: str) -> str:
    """Put wide pieces of an inline formula into scrolling boxes with this label (step 2)."""
    start = f'<span class="formula-inline" tabindex="0" role="group" aria-label="{escape(label)}">'

    def boxed(piece: re.Match[str]) -> str:
        return f"{start}{piece[0]}</span>" if _length(piece[0]) >= WIDE else piece[0]

    return html if _length(html) < WIDE else _PIECE.sub(boxed, html)


def isolate_formulas(html: str) -> str:
    """Isolate the pieces of each formula, in a page from the right: they follow from the left."""
    return _PIECES.sub(lambda pieces: f"\u2066{pieces[0]}\u2069", html)


def glue_formulas(html: str) -> str:
    """Glue each inline formula of a page to its punctuation and unit (steps 4 and 5)."""
    html = _FIRST.sub(r'\g<0> lspace="0em"', html)
    html = _LAST.sub(r'\g<0> rspace="0em"', html)
    parts = _FORMULAS.split(html)
    for at in range(1, len(parts), 2):
        text = parts[at - 1].rstrip(_OPENING)
        before, closing = parts[at - 1][len(text) :], _CLOSING.match(parts[at + 1])
        after = closing[0] if closing else ""
        if before or after:
            formula = parts[at]
            first, last = formula.find("</math><math>"), formula.rfind("</math><math>")
            if first < 0:
                glued = _glued(before + formula + after)
            else:
                head, tail = first + len("</math>"), last + len("</math>")
                start = _glued(before + formula[:head]) if before else formula[:head]
                end = _glued(formula[tail:] + after) if after else formula[tail:]
                glued = start + formula[head:tail] + end
            parts[at - 1 : at + 2] = text, glued, parts[at + 1][len(after) :]
    return "".join(parts)


def _glued(html: str) -> str:
    return f"{_GLUE_START}{html}{_GLUE_END}"


# --- numbers and their units

_SPACE = "[ \u00a0\u202f]"
_NUMBER = (
    r"[0-9][0-9.,]*(?<![.,])(?:[eE][+-]?[0-9]+|[ \u00a0\u2009]?[×·][ \u00a0\u2009]?10"
    r"(?:\^[-−]?[0-9]+|[⁻¹²³⁰⁴-⁹]+)?)?"
)

_WITH_UNITS = regex(rf"(?<=[0-9]) {UNIT_PATTERN}")
_TITLE = regex(r"[0-9]+\.[0-9]+(?= [A-Z] [a-z])")
"""The number of a lesson before a title such as `A pendulum`: no amperes."""
_UNITS_FIRST = rf"{_SPACE}?{UNIT_PATTERN}"
_QUANTITY = rf"(?<![\w.,])(?:[-+−±~≈<>≤≥]{_NUMBER}(?:{_UNITS_FIRST})?|{_NUMBER}{_UNITS_FIRST})"
"""Compiled when it is needed, as few pages do: it takes longer than all others together."""
_LATIN_BEFORE = regex("[A-Za-z]\\s*(?:=\\s*)?$")
_LATIN_AFTER = regex("[ \u00a0][A-Za-z]")


def text_html(text: str, direction: Literal["ltr", "rtl"]) -> Markup:
    """Text as HTML, in text of this direction."""
    text = join_units(text)
    if direction == "ltr":
        return Markup.escape(curl_apostrophes(text))
    pieces = ((Markup.escape(piece), is_quantity) for piece, is_quantity in split_quantities(text))
    return Markup("").join(
        isolate_ltr(piece) if is_quantity else piece for piece, is_quantity in pieces
    )


def isolate_ltr(html: Markup) -> Markup:
    """Isolate HTML as running from the left in text of any direction."""
    return Markup('<bdi dir="ltr">') + html + Markup("</bdi>")


def curl_apostrophes(text: str, joined_before: bool = False, joined_after: bool = False) -> str:
    """Text from the left with a curly apostrophe wherever a straight one stands inside a word.

    Such a word may go on in what the text is joined to without a space, as in `l'*eau*`.
    """
    before, after = "\ue000" * joined_before, "\ue000" * joined_after
    curled = _APOSTROPHE.sub("’", f"{before}{text}{after}")
    return curled[len(before) : len(curled) - len(after)]


def join_units(text: str) -> str:
    """Put no-break spaces between numbers and their units, and inside units."""
    title = _TITLE.match(text)
    start = title.end() + 1 if title else 0
    return text[:start] + _WITH_UNITS.sub(lambda m: m[0].replace(" ", "\u00a0"), text[start:])


def unit_length(text: str) -> int:
    """The length of the unit at the start of a text that follows a number."""
    match = re.match(_UNITS_FIRST, text)
    return 0 if match is None else match.end()


def split_quantities(text: str) -> Iterator[tuple[str, bool]]:
    """Split a text into pieces, each with whether it is a quantity to isolate."""
    position = 0
    for match in re.finditer(_QUANTITY, text):
        if _LATIN_BEFORE.search(text, position, match.start()):
            continue
        if match[0][0].isdigit() and _LATIN_AFTER.match(text, match.end()):
            continue
        if match.start() > position:
            yield text[position : match.start()], False
        yield match[0], True
        position = match.end()
    if position < len(text):
        yield text[position:], False
