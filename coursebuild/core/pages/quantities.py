"""Numbers and their units in running text.

1. A no-break space replaces each space between a number and its unit, and inside a unit (`kg m²`).
2. In text from the right, a sign or a unit would end up on the wrong side of its number, since
   neither has a direction of its own. Such quantities are isolated as text from the left.

Units are those of the SI, those used with it, and a few of computing. If a word or a label (`Figure
2 A`) is taken for a unit, the no-break space does no harm.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Literal

from markupsafe import Markup, escape

_SI_UNIT = (
    "(?:[YZEPTGMkhcdm\u00b5\u03bcunpf]|da)?"
    "(?:bar|cd|eV|Gy|Hz|kat|lm|lx|mol|Pa|rad|sr|Sv|Wb|[ACFgHJKLlmNSsTtVW\u03a9\u2126])"
)
_UNIT = (
    rf"(?:{_SI_UNIT}|min|kgf?|rpm|rev|fps|px|pt|arcmin|arcsec|[kMGT]i?B|B|bit|[hd]|°[CF]?|[%‰′″])"
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
_LATIN_BEFORE = re.compile("[A-Za-z]\\s*(?:=\\s*)?$")


def text_html(text: str, direction: Literal["ltr", "rtl"]) -> Markup:
    """Text as HTML, in text of this direction."""
    text = join_units(text)
    if direction == "ltr":
        return escape(text)
    pieces = ((escape(piece), is_quantity) for piece, is_quantity in split_quantities(text))
    return Markup("").join(
        isolate_ltr(piece) if is_quantity else piece for piece, is_quantity in pieces
    )


def isolate_ltr(html: Markup) -> Markup:
    """Isolate HTML as running from the left in text of any direction."""
    return Markup('<bdi dir="ltr">') + html + Markup("</bdi>")


def join_units(text: str) -> str:
    """Put no-break spaces between numbers and their units, and inside units."""
    return _WITH_UNITS.sub(lambda match: match[0].replace(" ", "\u00a0"), text)


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
        if match.start() > position:
            yield text[position : match.start()], False
        yield match[0], True
        position = match.end()
    if position < len(text):
        yield text[position:], False


def number(value: float, digits: int | None = None) -> str:
    """A number as people write it: no trailing zeros, a real minus sign."""
    text = f"{value:.{digits}f}" if digits is not None else f"{value:.12g}"
    return text.replace("-", "\u2212")
