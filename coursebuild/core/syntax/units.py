"""Units: whether there are such, and which were likely meant.

Entry point: `check_unit`.

A library, Pint, knows the names of units. To import it takes longer than to build a page, so it is
asked only about words that are not among the common ones.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from coursebuild.core.text.diagnostics import Diagnostic, diagnose, nearest
from coursebuild.core.text.source import Excerpt
from coursebuild.core.text.units import pint_registry

COMMON = tuple(
    """
    m km cm mm μm nm g kg mg s ms μs min h d N kN mN J kJ W kW Pa kPa V mV A mA C F H T K mol Hz kHz
    rad mrad deg ° % Ω l L °C
    """.split()
)
"""Units of which nothing need be asked, and those that are proposed."""
_NAMES = {
    **{"meter": "m", "metre": "m", "second": "s", "gram": "g", "kilogram": "kg", "newton": "N"},
    **{"joule": "J", "watt": "W", "pascal": "Pa", "radian": "rad", "degree": "°", "hertz": "Hz"},
    **{"minute": "min", "hour": "h", "kelvin": "K", "volt": "V", "ampere": "A", "percent": "%"},
}
_JOINED = ("kg", "N", "J", "W", "A", "V", "K", "m", "s")
"""Units that are often written without the space between them."""

_WORD = r"(?:°C|[^\W\d_⁰¹²³⁴-⁹]+|[°%‰])"
_POWER = r"(?:\^?(?:[-−]?\d{1,2}|\{[-−]?\d{1,2}\}|\([-−]?\d{1,2}(?:/\d)?\))|[⁻⁰¹²³⁴-⁹]+)"
_BETWEEN = r"(?: ?[·⋅×*/.] ?| )"
_FACTOR = rf"(?:1|{_WORD}{_POWER}?)"
_PRODUCT = rf"{_FACTOR}(?:{_BETWEEN}{_FACTOR})*"
_GROUP = rf"(?:{_FACTOR}|\({_PRODUCT}\){_POWER}?)"
_UNIT = re.compile(rf"{_GROUP}(?:{_BETWEEN}{_GROUP})*")
_WORDS = re.compile(_WORD)


def check_unit(unit: Excerpt) -> Iterator[Diagnostic]:
    """What is wrong with a unit, which may be empty."""
    if len(unit.text) > 100 or not _UNIT.fullmatch(unit.text.strip() or "1"):
        message = f"`{unit.text.strip()}` cannot be read as a unit"
        help = "write it as in `kg m^2`, `m/s²` or `N m/rad`"
        yield diagnose("unit-unknown", unit.span(), message, help=help)
        return
    for found in _WORDS.finditer(unit.text):
        word = found[0].replace("\u2126", "Ω")
        if word in COMMON or (word != "rads" and pint_registry().parse_unit_name(word)):
            continue  # of rads Pint says that they are a dose of radiation
        likely = _likely(word)
        help = "leave it out, and say in words what is counted"
        help = f"did you mean `{likely}`?" if likely else help
        message = f"there is no unit `{word}`"
        yield diagnose("unit-unknown", unit.span(*found.span()), message, help=help)


def _likely(word: str) -> str:
    """The unit that a word was likely meant to be; empty where none is like it."""
    for known in COMMON:
        if known.casefold() == word.casefold():
            return known
    for left in _JOINED:
        rest = word.removeprefix(left)
        if rest != word and rest in _JOINED:
            return f"{left} {rest}"
    near = nearest(word, (*COMMON, *_NAMES), cutoff=0.7) or ""
    return _NAMES.get(near, near)
