"""Units as authors write them: `kg m²`, `N*m/rad`, `mm`.

Entry points: `find_unit`, how large a unit is; `check_unit`, what is wrong with one, and which was
likely meant. Units of mechanics are known here. Of others Pint is asked, whose import takes longer
than a page does to be built.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Callable, Iterator
from fractions import Fraction
from typing import Any, TypeAlias

from msgspec import Struct

from coursebuild.core.text.diagnostics import Diagnostic, diagnose, nearest
from coursebuild.core.text.source import Excerpt

Dimension: TypeAlias = tuple[tuple[str, Fraction], ...]
"""Powers of base quantities, as of length and time, in the order of their names."""

_PREFIXES = {"": 0, "k": 3, "M": 6, "G": 9, "c": -2, "m": -3, "µ": -6, "μ": -6, "n": -9}
_BASES = {"m": ("length", 0), "g": ("mass", -3), "s": ("time", 0)}
"""What they measure, and the power of ten by which they are base units."""
_DERIVED = {"N": "kg*m/s^2", "J": "N*m", "W": "J/s", "Pa": "N/m^2", "Hz": "1/s", "rad": "1"}
_FACTOR = re.compile(r"(^|[*/])(1|[^\W\d_]+)(?:\^\(?(-?\d)\)?)?")
_RAISED = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻−", "0123456789--")

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
_WRITTEN = rf"(?:1|{_WORD}{_POWER}?)"
_PRODUCT = rf"{_WRITTEN}(?:{_BETWEEN}{_WRITTEN})*"
_GROUP = rf"(?:{_WRITTEN}|\({_PRODUCT}\){_POWER}?)"
_UNIT = re.compile(rf"{_GROUP}(?:{_BETWEEN}{_GROUP})*")
_WORDS = re.compile(_WORD)


class Unit(Struct, frozen=True):
    """How large a unit is in base units of the SI, and what it measures."""

    size: Fraction
    dimension: Dimension = ()

    def times(self, other: Unit, power: int) -> Unit:
        """The product with a power of another unit."""
        size = self.size * other.size**power
        return Unit(size, multiply(self.dimension, other.dimension, power))


def multiply(left: Dimension, right: Dimension, power: Fraction | int = 1) -> Dimension:
    """The dimension of a product, whose second factor is raised to a power."""
    powers = dict(left)
    for name, exponent in right:
        powers[name] = powers.get(name, Fraction(0)) + exponent * power
    return tuple(sorted((name, found) for name, found in powers.items() if found))


@functools.lru_cache(maxsize=256)
def find_unit(text: str) -> Unit | None:
    """The unit of a name; `None` where nobody knows it."""
    raised = re.sub("[⁰¹²³⁴-⁹⁻]+", lambda found: "^" + found[0].translate(_RAISED), text.strip())
    return _read(re.sub(r"\s*[ ·⋅*]\s*", "*", raised), _common) or _ask_pint(text)


def _read(text: str, find: Callable[[str], Unit | None]) -> Unit | None:
    """A product of units; `None` where one of them is not found."""
    unit, at = Unit(Fraction(1)), 0
    for factor in _FACTOR.finditer(text):
        one = find(factor[2])
        if one is None or factor.start() != at:
            return None
        at = factor.end()
        unit = unit.times(one, int(factor[3] or 1) * (-1 if factor[1] == "/" else 1))
    return unit if at == len(text) and at else None


@functools.cache
def _common(name: str) -> Unit | None:
    if name == "1":
        return Unit(Fraction(1))
    for prefix, power in _PREFIXES.items():
        rest = name.removeprefix(prefix)
        if rest in _BASES:
            measures, shift = _BASES[rest]
            return Unit(Fraction(10) ** (power + shift), ((measures, Fraction(1)),))
        if rest in _DERIVED and (unit := _read(_DERIVED[rest], _common)):
            return Unit(unit.size * Fraction(10) ** power, unit.dimension)
    return None


def _ask_pint(text: str) -> Unit | None:
    try:
        base = _registry()(text.replace(" ", "*").replace("·", "*")).to_base_units()
        powers = sorted((str(n)[1:-1], Fraction(p)) for n, p in base.dimensionality.items())
        return Unit(Fraction(repr(float(base.magnitude))), tuple(powers))
    except Exception:  # what Pint's reader of expressions raises is not said anywhere
        return None


@functools.cache
def _registry() -> Any:
    """Pint's units, which take a second to be read."""
    import pint

    registry: Any = pint.UnitRegistry(cache_folder=None)
    registry.define("@alias turn = rev")
    return registry


def check_unit(unit: Excerpt) -> Iterator[Diagnostic]:
    """What is wrong with a unit, which may be empty."""
    text = " ".join(unit.text.split())
    if len(text) > 100 or not _UNIT.fullmatch(text or "1"):
        message = f"`{text}` cannot be read as a unit"
        help = "write it as in `kg m^2`, `m/s²` or `N m/rad`"
        yield diagnose("unit-unknown", unit.span(), message, help=help)
        return
    for found in _WORDS.finditer(unit.text):
        word = found[0].replace("\u2126", "Ω")
        if word in COMMON or (word != "rads" and _registry().parse_unit_name(word)):
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
