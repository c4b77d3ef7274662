"""Units: one closed table, and the grammar in which they are written: `kg m²`, `N*m/rad`, `mm`.

What there are is in `unit_table`. A unit with several sizes is read as any of these.
"""

from __future__ import annotations

import functools
import re
import unicodedata
from collections.abc import Callable, Iterable, Iterator
from fractions import Fraction
from itertools import product
from typing import TypeAlias

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core.text.diagnostics import Diagnostic, Fix, diagnose
from coursebuild.core.text.near import nearest
from coursebuild.core.text.regex import regex
from coursebuild.core.text.source import Excerpt
from coursebuild.core.text.unit_table import LEVELS, NAMES, UNITS

Dimension: TypeAlias = tuple[tuple[str, Fraction], ...]
"""Powers of base quantities, as of length and time, in the order of their names."""

_BASES = {
    "m": "length",
    "kg": "mass",
    "s": "time",
    "A": "current",
    "K": "temperature",
    "mol": "substance",
    "cd": "luminosity",
    "bit": "information",
    "px": "pixels",
    "rad": "angle",
    "cycle": "cycle",
}
_TURNS = ("angle", "cycle")
"""Numbers by their dimension; they tell hertz from radians per second."""
_PREFIXES = {
    **dict(zip(("da", *"hkMGTPEZYRQ"), (1, 2, *range(3, 31, 3)), strict=True)),
    **dict(zip("dcmµnpfazyrq", (-1, -2, *range(-3, -31, -3)), strict=True)),
    **dict.fromkeys("μu", -6),
}
_PREFIX_NAMES = {
    **{"kilo": "k", "milli": "m", "micro": "µ", "mega": "M", "centi": "c", "giga": "G"},
    **{"nano": "n", "hecto": "h", "deci": "d", "mikro": "µ", "zenti": "c"},
    **{"tera": "T", "mili": "m", "pico": "p", "femto": "f", "peta": "P", "deca": "da"},
}
_MACRO_NAMES = {"degreeCelsius": "°C", "kilogram": "kg", "astronomicalunit": "au", "neper": "Np"}
"""Units of `siunitx` that have another name here."""
_BINARY_PREFIXES = {f"{letter}i": 2 ** (10 * n) for n, letter in enumerate("KMGTPE", 1)}

COMMON = tuple(
    """
    m km cm mm μm nm g kg mg s ms μs min h d N kN mN J kJ W kW Pa kPa V mV A mA C F H T K mol Hz kHz
    rad mrad deg ° % Ω l L °C
    """.split()
)
"""Those that are proposed for what is no unit."""

_SUPERSCRIPTS = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻−", "0123456789--")
_WORD = r"(?:°[ \u00a0\u202f]?[CF](?![^\W\d_])|[^\W\d_⁰¹²³⁴-⁹]+|[°%‰′″])"
_POWER = (
    r"(?:\^?[-−]?\d{1,2}|\^\{[-−]?\d{1,2}(?:/[1-9])?\}|\^\([-−]?\d{1,2}(?:/[1-9])?\)"
    "|⁻?[⁰¹²³⁴-⁹]{1,2})"
)
_GAP = "[ \u00a0\u202f]"
_TOKEN = (
    rf"(?P<word>{_WORD})(?P<power>{_POWER})?|(?P<one>1)(?![\d.])|(?P<open>\()"
    rf"|(?P<close>\))(?P<group_power>{_POWER})?|(?P<sign>{_GAP}*[·⋅*×/.]{_GAP}*|-(?=[^\W\d_])|{_GAP}+)"
)
"""Compiled when it is needed, as few pages do: it takes longer than the table."""
_TWO_UNITS = (
    rf"(?<![^\W\d_])(?:m(?=[^\W\d_m]{_POWER})"
    rf"|(?:kg|[kMGmµμunp]?(?:Pa|[NWVAJ]))(?=(?:[mc]?m|s|h|K|A)(?![^\W\d_²³⁻¹⁴-⁹])))"
    rf"|(?<=[^\W\d_]){_POWER}(?=[^\W\d_])"
)
"""After what a space may be missing: `ms⁻¹`, `kgm²`, `mPas`, `W/m2K`."""
PER = ("per", "pro", "par", "por")
_WORDS = (
    (regex(rf"\s+(?:{'|'.join(PER)})\s+(?!cent\b)"), "/"),
    (regex(r"(?:per|pour|por) ?cent\b|por ciento\b"), "%"),
    (regex(r"\b(?:square|sq\.?) ([^\W\d_]+)|\bQuadrat([^\W\d_]+)"), r"\1\2^2"),
    (regex(r"\b(?:cubic|cu\.?) ([^\W\d_]+)|\bKubik([^\W\d_]+)"), r"\1\2^3"),
    (regex(r"(?<=[^\W\d_]) (?:squared|carrés?|cuadrados?)\b"), "^2"),
    (regex(r"(?<=[^\W\d_]) (?:cubed|cubes?|cúbicos?)\b"), "^3"),
)
"""How units are written in words."""
_LONGEST = 100


class Unit(Struct, frozen=True):
    """The size of a unit in base units of the SI, times a power of π, and what it measures."""

    size: Fraction
    powers: Dimension = ()
    """With those of angles and cycles, which `dimension` lacks."""
    pi: int = 0
    zero: Fraction = Fraction(0)
    """How far above the zero of its quantity its scale begins."""

    @property
    def dimension(self) -> Dimension:
        """The dimension, in which angles and cycles are numbers."""
        return tuple(power for power in self.powers if power[0] not in _TURNS)

    def times(self, factor: Unit, power: Fraction | int = 1) -> Unit | None:
        """The product with a power of another unit, of differences on its scale.

        `None` where the size would be no rational number.
        """
        exponent = Fraction(power)
        if exponent.denominator == 1:
            size = factor.size ** int(exponent)
        else:
            size = Fraction(float(factor.size) ** float(exponent)).limit_denominator(10**12)
            if size**exponent.denominator != factor.size**exponent.numerator:
                return None
        pi = factor.pi * exponent
        if pi.denominator != 1:
            return None
        powers = multiply(self.powers, factor.powers, exponent)
        return Unit(self.size * size, powers, self.pi + int(pi))

    def in_radians(self) -> Unit:
        """The same unit, of 2π radians in place of each of its cycles."""
        cycles = dict(self.powers).get("cycle", Fraction(0))
        one_radian = Unit(Fraction(2), (("angle", Fraction(1)), ("cycle", Fraction(-1))), pi=1)
        return self.times(one_radian, cycles) or self

    def is_same(self, unit: Unit) -> bool:
        """Whether it has the size of another unit and measures the same; angles may be left out."""
        turns = [{name for name, _ in side.powers} & {*_TURNS} for side in (self, unit)]
        return (
            (self.size, self.pi, self.zero) == (unit.size, unit.pi, unit.zero)
            and self.dimension == unit.dimension
            and (not all(turns) or turns[0] == turns[1])
        )


ONE = Unit(Fraction(1))


def multiply(left: Dimension, right: Dimension, power: Fraction | int = 1) -> Dimension:
    """The dimension of a product, whose second factor is raised to a power."""
    powers = dict(left)
    for name, exponent in right:
        powers[name] = powers.get(name, Fraction(0)) + exponent * power
    return tuple(sorted((name, power) for name, power in powers.items() if power))


@functools.lru_cache(maxsize=512)
def find_units(text: str) -> tuple[Unit, ...]:
    """The units that a text such as `N m/rad` may be, an empty one being 1; none for another text.

    Of `J/kg K` one may divide by all that follows the solidus, or by the first factor; `ms⁻¹` is
    of milliseconds, or metres per second.
    """
    source = _with_signs(text.strip())
    if not source:
        return (ONE,)
    if len(source) > _LONGEST:
        return ()
    readings: tuple[Unit, ...] = ()
    for spaced in dict.fromkeys((source, re.sub(_TWO_UNITS, r"\g<0> ", source))):
        readings += _parse(spaced)
        if re.search(r"/[^()/]*[ ·⋅*.-]", spaced):
            readings += _parse(spaced, is_wide=True)
    return tuple(dict.fromkeys(readings))


def _with_signs(text: str) -> str:
    """A unit with signs and powers for words: `metres per second squared` is `metres/second^2`."""
    for pattern, sign in _WORDS:
        text = pattern.sub(sign, text)
    return text


_MACRO = regex(r"\\([A-Za-z]+)\s*(?:\{([^{}]*)\})?")
_POWER_MACROS = {"square": "2", "squared": "2", "cubic": "3", "cubed": "3"}


def _unit_of_macros(tex: str) -> str:
    r"""A unit of LaTeX's `siunitx`, as `\kilo\metre\per\second`, in symbols; others as they are."""
    units: list[list[str]] = []
    prefix = sign = power = ""
    for name, argument in _MACRO.findall(tex) if not _MACRO.sub("", tex).strip() else ():
        exponent = _POWER_MACROS.get(name, argument)
        if name in ("squared", "cubed", "tothe") and units:
            units[-1][2] = exponent
        elif name == "per":
            sign = "-"
        elif exponent:
            power = exponent
        elif name in _PREFIX_NAMES:
            prefix = _PREFIX_NAMES[name]
        else:
            is_known = name in _MACRO_NAMES or name in NAMES or find_symbol(name)
            symbol = _MACRO_NAMES.get(name, NAMES.get(name, name)) if is_known else f"\\{name}"
            units.append([prefix + symbol.replace("ohm", "Ω"), sign, power])
            prefix = sign = power = ""
    powers = ((symbol, sign + (power or "1" * bool(sign))) for symbol, sign, power in units)
    return " ".join(f"{s}^{{{power}}}" if power else s for s, power in powers) or tex


_ARGUMENT = r"\s*\{((?:[^{}]|\{[^{}]*\})*)\}"
QUANTITY = regex(
    r"\\(?:(?:num|(?P<of_unit>qty|SI))(?P<many>list|product|(?P<range>range))?|(?P<angle>ang)"
    rf"|(?P<bare>unit|si))(?![A-Za-z])(?:\s*\[[^\]]*\])?{_ARGUMENT}(?(range){_ARGUMENT})"
    rf"(?(of_unit){_ARGUMENT})"
)
_NEXT = regex(r"\s*(?:;|(?<=[\d\s])x(?=[\d\s]))\s*")
"""Between the numbers of one argument."""
_BETWEEN = {"list": r",\;", "range": r"\text{ – }"}
"""What is shown between numbers, which are factors otherwise; in no language."""
_DEFINITION = regex(r"\\(?:def|[a-z]*command\*?\s*\{?)\s*(\\[A-Za-z]+)")


def write_quantities(tex: str) -> str:
    r"""TeX without the commands of `siunitx`: `\qty{3}{\kilo\metre}` is `3\,\mathrm{km}`."""
    if any(QUANTITY.match(f"{name}{{}}{{}}") for name in _DEFINITION.findall(tex)):
        return tex

    def write(match: re.Match[str]) -> str:
        *_, number, last, unit = match.groups("")
        if match["angle"]:
            return "".join(map("".join, zip(number.split(";"), "°′″", strict=False)))
        if match["bare"]:
            number, unit = "", number
        symbols = _unit_of_macros(unit).replace(" ", r"\,").replace("%", r"\%")
        unit = rf"\mathrm{{{symbols}}}" if symbols else ""
        space = "" if symbols in "°′″" else r"\,"
        parts = _NEXT.split(f"{number};{last}".replace(",", "."))
        sign = _BETWEEN.get(match["many"], r"\times ")
        text = sign.join(f"{part}{space}{unit}" for part in parts if part) or unit
        text = re.sub(r"(?<=\d) (?=\d)", "", text).replace("+-", r"\pm ")
        return re.sub(r"(?<=[\d.])[eE]([-+]?\d+)", r"\\times10^{\1}", text)

    return QUANTITY.sub(write, tex)


def find_unit(text: str) -> Unit | None:
    """The unit that a text is, by its first reading."""
    return next(iter(find_units(text)), None)


def _parse(
    source: str,
    *,
    is_wide: bool = False,
    find: Callable[[str], tuple[Unit, ...]] | None = None,
) -> tuple[Unit, ...]:
    """The readings of a product of units; `is_wide`: all after a solidus is divided by."""
    stack: list[tuple[tuple[Unit, ...], int]] = []
    units: tuple[Unit, ...] = (ONE,)
    sign, end, expects_factor = 1, 0, True
    for token in re.finditer(_TOKEN, source):
        if token.start() != end:
            return ()
        end, kind = token.end(), token.lastgroup
        if kind in ("power", "group_power"):
            kind = "word" if token["word"] else "close"
        if kind == "sign":
            if expects_factor:
                return ()
            sign = -1 if "/" in token[0] else sign if is_wide else 1
            expects_factor = True
            continue
        if kind == "open":
            if not expects_factor:
                return ()
            stack.append((units, sign))
            units, sign = (ONE,), 1
            continue
        if kind == "close":
            if expects_factor or not stack:
                return ()
            factors, (units, sign) = units, stack.pop()
            power = _exponent(token["group_power"])
        else:
            if not expects_factor:
                return ()
            factors = (ONE,) if token["one"] else (find or find_symbol)(token["word"])
            power = _exponent(token["power"])
        if power is None:
            return ()
        is_alone = token[0] == source and power == 1
        if not is_alone:
            products = (u.times(f, power * sign) for u, f in product(units, factors))
            factors = tuple(unit for unit in products if unit is not None)
        units, expects_factor = factors, False
    return units if end == len(source) and not expects_factor and not stack else ()


def _exponent(text: str | None) -> Fraction | None:
    if not text:
        return Fraction(1)
    exponent = Fraction(text.translate(_SUPERSCRIPTS).strip("^{}()"))
    return exponent if abs(exponent) <= 12 else None


@functools.cache
def find_symbol(word: str) -> tuple[Unit, ...]:
    """The units that a word of letters may be, with or without a prefix."""
    word = re.sub(r"\s", "", word).replace("\u2126", "Ω").replace("\u212b", "Å")
    if len(word) > 2 and word not in NAMES:  # `mètres`, `días`
        word = re.sub("[\u0300\u0301]", "", unicodedata.normalize("NFD", word))
        word = unicodedata.normalize("NFC", word)
    symbol = NAMES.get(word, word)
    if symbol in UNITS:
        row = UNITS[symbol]
        return () if symbol in LEVELS else tuple(_read_size(s, row.base) for s in row.sizes)
    if symbol in _BASES:
        return (_base_unit(symbol),)
    for name, prefix in _PREFIX_NAMES.items():
        rest = word[len(name) :]
        rest = NAMES.get(rest, NAMES.get(rest.capitalize(), rest))
        if word.lower().startswith(name) and rest in UNITS:
            return find_symbol(prefix + rest)
    if len(word) > 2 and word[:2] in _BINARY_PREFIXES and word[2:] in ("B", "bit"):
        (unit,) = find_symbol(word[2:])
        return (replace(unit, size=unit.size * _BINARY_PREFIXES[word[:2]]),)
    for length in (1, 2):
        prefix, rest = word[:length], word[length:]
        if prefix in _PREFIXES and rest in UNITS and "*" in UNITS[rest].marks:
            scale = Fraction(10) ** _PREFIXES[prefix]
            return tuple(replace(unit, size=unit.size * scale) for unit in find_symbol(rest))
    return ()


def _base_unit(symbol: str) -> Unit:
    return Unit(Fraction(1), ((_BASES[symbol], Fraction(1)),))


def _read_size(text: str, base: str) -> Unit:
    """A unit of the table: `1609.344`, `5/9@459.67`, `π/180`, `2π`, `1e6:m^3/s`."""
    text, _, own_base = text.partition(":")
    size, _, zero = text.partition("@")
    base = own_base or base
    unit = _base_unit(base) if base in _BASES else _parse(base)[0]
    numerator, _, denominator = size.partition("/")
    pi = numerator.count("π") - denominator.count("π")
    parts = [Fraction(part.replace("π", "") or 1) for part in (numerator, denominator)]
    powers = unit.powers
    if "cycle" in dict(powers) and pi:  # a revolution is 2π radians, or one cycle
        turns = dict(powers)
        turns["angle"] = turns.pop("cycle")
        powers = tuple(sorted(turns.items()))
    return Unit(unit.size * parts[0] / parts[1], powers, unit.pi + pi, Fraction(zero or 0))


def is_name(word: str) -> bool:
    """Whether a unit is a name or a word as often, so that it is one at the end of a phrase only.

    So is what has a prefix for a Latin letter, as `us` and `um`, or one that few texts use.
    """
    symbol = NAMES.get(word, word)
    if symbol in UNITS:
        return word not in NAMES and UNITS[symbol].marks.strip("*") != ""
    return len(word) == 2 and word[0] not in "kMGcmnµμ" and bool(find_symbol(word))


def check_unit(unit: Excerpt) -> Iterator[Diagnostic]:
    """Yield what is wrong with a unit, which may be empty."""
    text = _with_signs(" ".join(unit.text.split()))
    if find_units(text):
        return
    if len(text) > _LONGEST or not _parse(text or "1", find=lambda word: (ONE,)):
        message = f"`{text}` cannot be read as a unit"
        help = "write it as in `kg m^2`, `m/s²` or `N m/rad`"
        yield diagnose("unit-unknown", unit.span(), message, help=help)
        return
    for match in re.finditer(_WORD, unit.text):
        word = match[0]
        if find_symbol(word) or word in (*UNITS, *NAMES, *PER):
            continue
        help = "leave it out, and name in words what is counted"
        if (likely := nearest(word, (*COMMON, *NAMES))) is not None:
            likely = NAMES.get(likely, likely)
            help = Fix(f"did you mean `{likely}`?", likely)
        message = f"there is no unit `{word}`"
        yield diagnose("unit-unknown", unit.span(*match.span()), message, help=help)


def _pattern_of_units() -> str:
    """The pattern of the units right behind a number in prose, up to four."""
    symbols = [(symbol, row.marks) for symbol, row in UNITS.items() if "?" not in row.marks]
    prefix = _alternatives(_PREFIXES)
    prefixable = _alternatives(symbol for symbol, marks in symbols if "*" in marks)
    unprefixable = _alternatives(symbol for symbol, marks in symbols if "*" not in marks)
    power = r"(?:[²³⁻¹⁴⁶0-9]|\^-?[0-9])*"
    unit = rf"(?:{prefix}?{prefixable}|{unprefixable}|[KMGT]iB){power}"
    units = rf"{unit}(?:[/·⋅*]{unit})*(?![^\W_])"
    return rf"{units}(?:[ \u00a0\u202f]{units}){{0,3}}"


def _alternatives(symbols: Iterable[str]) -> str:
    """The pattern of one of these, the longest first."""
    by_length = sorted(symbols, key=len, reverse=True)
    letters = "".join(symbol for symbol in by_length if len(symbol) == 1)
    return f"(?:{'|'.join(symbol for symbol in by_length if len(symbol) > 1)}|[{letters}])"


UNIT_PATTERN = _pattern_of_units()
"""It takes more for a unit than `find_units` does with its context: typography may."""
