"""Numbers and their units in running text: in one line, and in order in text from the right.

Entry points: `text_html(text, direction)`; its steps `joined` and `quantities`; `unit_length`;
`in_order(html)`; `number(value)`.

1. No line ends between a number and its unit, nor inside a unit (`kg m²`): the space becomes one
   that does not break.
2. In text from the right a sign, or a unit, would come to stand on the wrong side of its number,
   since neither belongs to the one direction or the other. Such a quantity is a text of its own.

Units are those of the SI, those used with it, and a few of computing; a single letter that is a
word or a label (`Figure 2 A`) loses nothing by a space that does not break.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Literal

from markupsafe import Markup, escape

_PREFIXED = (
    "(?:[YZEPTGMkhcdm\u00b5\u03bcunpf]|da)?"
    "(?:bar|cd|eV|Gy|Hz|kat|lm|lx|mol|Pa|rad|sr|Sv|Wb|[ACFgHJKLlmNSsTtVW\u03a9\u2126])"
)
_UNIT = (
    rf"(?:{_PREFIXED}|min|kgf?|rpm|rev|fps|px|pt|arcmin|arcsec|[kMGT]i?B|B|bit|[hd]|°[CF]?|[%‰′″])"
    r"(?:[²³⁻¹⁴⁶0-9]|\^-?[0-9])*"
)
_SPACES = "[ \u00a0\u202f]"
_END = r"(?![^\W_])"
_UNITS = rf"{_UNIT}(?:[/·⋅*]{_UNIT})*{_END}(?:{_SPACES}{_UNIT}(?:[/·⋅*]{_UNIT})*{_END}){{0,3}}"
_NUMBER = (
    r"[0-9][0-9.,]*(?<![.,])(?:[eE][+-]?[0-9]+|[ \u00a0\u2009]?[×·][ \u00a0\u2009]?10"
    r"(?:\^[-−]?[0-9]+|[⁻¹²³⁰⁴-⁹]+)?)?"
)

_WITH_UNITS = re.compile(rf"(?<=[0-9]) {_UNITS}")
_UNITS_FIRST = rf"{_SPACES}?{_UNITS}"
_QUANTITY = (
    rf"(?<![\w.,])(?:[-+−±~≈<>≤≥]{_NUMBER}(?:{_SPACES}?{_UNITS})?|{_NUMBER}{_SPACES}?{_UNITS})"
)
"""Compiled when it is needed, as few pages do: it takes longer than all others together."""
_LATIN_BEFORE = re.compile("[A-Za-z]\\s*$")


def text_html(text: str, direction: Literal["ltr", "rtl"]) -> Markup:
    """Text as HTML, where text runs in a direction."""
    text = joined(text)
    if direction == "ltr":
        return escape(text)
    pieces = ((escape(piece), kept) for piece, kept in quantities(text))
    return Markup("").join(in_order(piece) if kept else piece for piece, kept in pieces)


def in_order(html: Markup) -> Markup:
    """What runs from the left wherever it stands."""
    return Markup('<bdi dir="ltr">') + html + Markup("</bdi>")


def joined(text: str) -> str:
    """The text with no line end between a number and its unit, nor inside the unit."""
    return _WITH_UNITS.sub(lambda found: found[0].replace(" ", "\u00a0"), text)


def unit_length(text: str) -> int:
    """How many characters at the start of a text are the unit of a number that stands before it."""
    found = re.match(_UNITS_FIRST, text)
    return 0 if found is None else found.end()


def quantities(text: str) -> Iterator[tuple[str, bool]]:
    """The text in pieces, each with whether it is a quantity that must be kept in order.

    A number after a word in Latin letters is in its order already.
    """
    at = 0
    for found in re.finditer(_QUANTITY, text):
        if _LATIN_BEFORE.search(text, at, found.start()):
            continue
        if found.start() > at:
            yield text[at : found.start()], False
        yield found[0], True
        at = found.end()
    if at < len(text):
        yield text[at:], False


def number(value: float, digits: int | None = None) -> str:
    """A number as a reader writes it: no trailing zeros, a real minus sign."""
    text = f"{value:.{digits}f}" if digits is not None else f"{value:.12g}"
    return text.replace("-", "\u2212")
