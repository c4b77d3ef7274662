"""Units as authors write them: `kg m²`, `N*m/rad`, `mm`.

The units of mechanics are known here. Pint is asked about others only, as its import takes longer
than the build of a page.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Iterator
from fractions import Fraction
from typing import Any, TypeAlias

from msgspec import Struct

from coursebuild.core.text.diagnostics import Diagnostic, Fix, diagnose
from coursebuild.core.text.near import nearest
from coursebuild.core.text.source import Excerpt

Dimension: TypeAlias = tuple[tuple[str, Fraction], ...]
"""Powers of base quantities, as of length and time, in the order of their names."""

_PREFIXES = {"": 0, "k": 3, "M": 6, "G": 9, "c": -2, "m": -3, "µ": -6, "μ": -6, "n": -9}
_BASES = {"m": ("length", 0), "g": ("mass", -3), "s": ("time", 0)}
"""The quantity that each measures, and its size as a power of ten of the base unit."""
_DERIVED_UNITS = {"N": "kg*m/s^2", "J": "N*m", "W": "J/s", "Pa": "N/m^2", "Hz": "1/s", "rad": "1"}
_FACTOR = re.compile(r"(^|[*/])(1|[^\W\d_]+)(?:\^\(?(-?\d)\)?)?")
_SUPERSCRIPTS = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻−", "0123456789--")

COMMON = tuple(
    """
    m km cm mm μm nm g kg mg s ms μs min h d N kN mN J kJ W kW Pa kPa V mV A mA C F H T K mol Hz kHz
    rad mrad deg ° % Ω l L °C
    """.split()
)
"""Units that are valid without asking Pint; others are proposed from among these."""
_NAMES = dict(
    name.split("=")
    for name in """
    meter=m metre=m second=s sec=s gram=g kilogram=kg joule=J watt=W pascal=Pa radian=rad degree=°
    hertz=Hz newton=N minute=min hour=h kelvin=K volt=V ampere=A percent=%
    """.split()
)
_PLAIN_UNITS = frozenset(COMMON) - frozenset("min d h C F H T l L".split())
"""Without those that behind a number may well be a name, as in `0.2 min, 0.9 max`."""
_QUOTIENT = re.compile(r"[^\W\d_]+/[^\W\d_]+")
_PRODUCT_UNITS = ("kg", "N", "J", "W", "A", "V", "K", "m", "s")

_WORD = r"(?:°C|[^\W\d_⁰¹²³⁴-⁹]+|[°%‰])"
_POWER = r"(?:\^?(?:[-−]?\d{1,2}|\{[-−]?\d{1,2}\}|\([-−]?\d{1,2}(?:/\d)?\))|[⁻⁰¹²³⁴-⁹]+)"
_OPERATOR = r"(?: ?[·⋅×*/.] ?| )"
_FACTOR_TEXT = rf"(?:1|{_WORD}{_POWER}?)"
_PRODUCT = rf"{_FACTOR_TEXT}(?:{_OPERATOR}{_FACTOR_TEXT})*"
_GROUP = rf"(?:{_FACTOR_TEXT}|\({_PRODUCT}\){_POWER}?)"
_UNIT = re.compile(rf"{_GROUP}(?:{_OPERATOR}{_GROUP})*")
_UNIT_NAME = re.compile(_WORD)

_SI_UNIT = (
    "(?:[YZEPTGMkhcdm\u00b5\u03bcunpf]|da)?"
    "(?:bar|cd|eV|Gy|Hz|kat|lm|lx|mol|Pa|rad|sr|Sv|Wb|[ACFgHJKLlmNSsTtVW\u03a9\u2126])"
)
_SHOWN_UNIT = (
    rf"(?:{_SI_UNIT}|min|kgf?|rpm|rev|fps|px|pt|arcmin|arcsec|[kMGT]i?B|B|bit|[hd]|°[CF]?|[%‰′″])"
    r"(?:[²³⁻¹⁴⁶0-9]|\^-?[0-9])*"
)
_SHOWN_PRODUCT = rf"{_SHOWN_UNIT}(?:[/·⋅*]{_SHOWN_UNIT})*(?![^\W_])"
UNITS_SHOWN = rf"{_SHOWN_PRODUCT}(?:[ \u00a0\u202f]{_SHOWN_PRODUCT}){{0,3}}"
"""The pattern of the units right behind a number in prose."""


def with_unit(number: str, unit: str) -> str:
    """Return a number's text with its unit; only the degree stands at the digits."""
    return f"{number}{unit}" if unit in ("", "°") else f"{number} {unit}"


class Unit(Struct, frozen=True):
    """The size of a unit in base units of the SI, and its dimension."""

    size: Fraction
    dimension: Dimension = ()

    def times(self, factor: Unit, power: int) -> Unit:
        """The product with a power of another unit."""
        size = self.size * factor.size**power
        return Unit(size, multiply(self.dimension, factor.dimension, power))


def multiply(left: Dimension, right: Dimension, power: Fraction | int = 1) -> Dimension:
    """The dimension of a product, whose second factor is raised to a power."""
    powers = dict(left)
    for name, exponent in right:
        powers[name] = powers.get(name, Fraction(0)) + exponent * power
    return tuple(sorted((name, power) for name, power in powers.items() if power))


@functools.lru_cache(maxsize=256)
def find_unit(text: str) -> Unit | None:
    """The unit of a text such as `N m/rad`; `None` if neither we nor Pint know it."""
    unit = _parse_product(_plain(text))
    if unit is not None:
        return unit
    try:
        base = _registry()(text.replace(" ", "*").replace("·", "*")).to_base_units()
        powers = sorted((str(n)[1:-1], Fraction(p)) for n, p in base.dimensionality.items())
        return Unit(Fraction(repr(float(base.magnitude))), tuple(powers))
    except Exception:  # Pint does not document what its parser raises
        return None


def _plain(text: str) -> str:
    plain = re.sub("[⁰¹²³⁴-⁹⁻]+", lambda m: "^" + m[0].translate(_SUPERSCRIPTS), text.strip())
    return re.sub(r"\s*[ ·⋅*]\s*", "*", plain)


def _parse_product(text: str) -> Unit | None:
    """The product of units of mechanics; `None` if a factor is another."""
    unit, end = Unit(Fraction(1)), 0
    for factor in _FACTOR.finditer(text):
        factor_unit = _find_known_unit(factor[2])
        if factor_unit is None or factor.start() != end:
            return None
        end = factor.end()
        unit = unit.times(factor_unit, int(factor[3] or 1) * (-1 if factor[1] == "/" else 1))
    return unit if end == len(text) and end else None


@functools.cache
def _find_known_unit(name: str) -> Unit | None:
    if name == "1":
        return Unit(Fraction(1))
    for prefix, power in _PREFIXES.items():
        rest = name.removeprefix(prefix)
        if rest in _BASES:
            measures, shift = _BASES[rest]
            return Unit(Fraction(10) ** (power + shift), ((measures, Fraction(1)),))
        if rest in _DERIVED_UNITS and (unit := _parse_product(_DERIVED_UNITS[rest])):
            return Unit(unit.size * Fraction(10) ** power, unit.dimension)
    return None


@functools.cache
def _registry() -> Any:
    """Pint's units; loading them takes a second."""
    import pint

    registry: Any = pint.UnitRegistry(cache_folder=None)
    registry.define("@alias turn = rev")
    return registry


def units_at(line: str, start: int = 0) -> frozenset[Unit | str]:
    """What the unit at a place of a line may be, of `N m, at rest` N or N m; nothing for others.

    In `l 2.0 T 2.8` and `m = 2 n = 3` it is a name.
    """
    name_sign = r"[=:\d.+-]" if line[:1].isalpha() else "[=:]"
    units: set[Unit | str] = set()
    product = ""
    for word in line[start:].split()[:4]:
        bare = word.rstrip(".,;:!?)]”")
        name = _NAMES.get(bare, bare).replace("deg", "°")
        product = f"{product}*{name}" if product else name
        unit = _parse_product(_plain(product)) or (name if product in _PLAIN_UNITS else None)
        unit = unit or (find_unit(product) if _QUOTIENT.fullmatch(product) else None)
        if unit is None:
            return frozenset() if re.match(name_sign, word) else frozenset(units)
        units.add(unit)
        if bare != word:
            break
    return frozenset(units)


def check_unit(unit: Excerpt) -> Iterator[Diagnostic]:
    """Yield what is wrong with a unit, which may be empty."""
    text = " ".join(unit.text.split())
    if len(text) > 100 or not _UNIT.fullmatch(text or "1"):
        message = f"`{text}` cannot be read as a unit"
        help = "write it as in `kg m^2`, `m/s²` or `N m/rad`"
        yield diagnose("unit-unknown", unit.span(), message, help=help)
        return
    for match in _UNIT_NAME.finditer(unit.text):
        word = match[0].replace("\u2126", "Ω")
        if word in COMMON or (word != "rads" and _registry().parse_unit_name(word)):
            continue  # Pint takes `rads` for a dose of radiation
        units = (unit for unit in COMMON if unit.casefold() == word.casefold())
        pairs = ((first, word.removeprefix(first)) for first in _PRODUCT_UNITS)
        products = (f"{a} {b}" for a, b in pairs if b != word and b in _PRODUCT_UNITS)
        likely = next(units, "") or next(products, "")
        likely = likely or nearest(word, (*COMMON, *_NAMES)) or ""
        likely = _NAMES.get(likely, likely)
        help = "leave it out, and name in words what is counted"
        if likely:
            help = Fix(f"did you mean `{likely}`?", likely, safe=_NAMES.get(word) == likely)
        message = f"there is no unit `{word}`"
        yield diagnose("unit-unknown", unit.span(*match.span()), message, help=help)
