"""Evaluates sides of a formula to quantities, and reads numbers as they are written.

Entry points: `evaluate(expression, symbols)`, a value in base units with its dimension;
`read_numeral(expression)`, a number with its precision.

Results that are too large, or no numbers, are not understood. Sums of different dimensions, and
functions of an argument with a dimension, are `WrongDimensions`.
"""

from __future__ import annotations

import itertools
import math
import operator
from collections.abc import Iterator, Mapping
from fractions import Fraction
from types import MappingProxyType
from typing import Literal, TypeAlias

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core.text.units import Dimension, Unit, find_units, multiply
from coursebuild.features.arithmetic.calculus import differentiate
from coursebuild.features.arithmetic.expressions import (
    CONSTANTS,
    SIDE_BY_SIDE,
    Expression,
    NotUnderstood,
)
from coursebuild.features.arithmetic.real import ONE, PI, E, Real, apply, integrate

_ZERO = Real.of(0)
ORDERS = {"<": operator.lt, ">": operator.gt, "≤": operator.le, "≥": operator.ge, "≠": operator.ne}
"""Relations between numbers that are not equations."""
UNDECIDED = "300 digits do not tell whether it holds"


Readings: TypeAlias = Mapping[int | str, Unit]
"""What units mean, by their text, or by their place in the formula."""
FIRST_READINGS: Readings = MappingProxyType({})


class FormulaComparison(Struct, frozen=True):
    """The result of comparing two sides of a formula, for a range of its TeX."""

    kind: Literal["holds", "fits", "wrong", "unread"]
    """It `fits` if the dimensions of symbols were compared, and no values."""
    start: int
    end: int
    message: str = ""
    letter: str = ""
    """A constant, such as π, that stands for something else here."""
    help: str = ""
    result: str = ""
    """What should stand there, where a number that stands there is wrong."""
    sign: tuple[int, int] | None = None
    """The range between the sides, if it holds or fits."""


class Numeral(Struct, frozen=True):
    """A number as it is written, with its precision."""

    value: Real
    step: Real
    """One unit of its last place."""
    is_whole: bool
    """Whether it has neither a point nor a power of ten."""
    digits: int
    unit_size: Real
    """The size of its unit in base units."""
    zeros: int = 0
    """How many zeros end a whole number."""
    zero: Real = _ZERO
    """Where the scale of its unit begins, in this unit."""
    is_order: bool = False
    """Whether it is a power of ten and no more: after `≈`, an order of magnitude."""

    def scale(self, size: Real) -> Numeral:
        """Return the number times the size of a unit."""
        return replace(self, value=self.value * size, step=self.step * size)

    def express(self, value: Real) -> Real:
        """Return a value in its unit."""
        return value / self.unit_size - self.zero


def read_numeral(expression: Expression, readings: Readings = FIRST_READINGS) -> Numeral | None:
    """Return the numeral that an expression is; `None` if it is more than that."""
    match expression:
        case Expression(kind="number", text=text):
            whole, _, decimals = text.partition(".")
            is_whole = "." not in text
            zeros = len(whole) - len(whole.rstrip("0")) if is_whole and whole.strip("0") else 0
            step = Real.of(Fraction(10) ** (zeros - len(decimals)))
            digits = len(text.replace(".", "").lstrip("0")) or 1
            return Numeral(Real.of(text), step, is_whole, digits, ONE, zeros)
        case Expression(kind="-", parts=(inner,)):
            numeral = read_numeral(inner, readings)
            if numeral is None:
                return None
            beginning = numeral.zero * numeral.unit_size
            return replace(numeral, value=beginning + beginning - numeral.value)
        case Expression(kind="^", parts=(Expression(kind="number", text="10"), _)):
            size = evaluate(expression).value
            return Numeral(size, size, True, 1, ONE, is_order=True) if size.rational else None
        case Expression(kind="*", parts=(inner, Expression(kind="unit" | "^") as factor)):
            numeral = read_numeral(inner, readings)
            if numeral is None:
                return None
            if factor.kind == "^":
                power = read_numeral(factor)
                return power and replace(numeral.scale(power.value), is_whole=False)
            unit = find_reading(factor, readings)
            scaled, size = numeral.scale(measure(unit)), numeral.unit_size * measure(unit)
            zero = Real.of(unit.zero)
            return replace(scaled, value=scaled.value + zero * size, unit_size=size, zero=zero)
        case _:
            return None


def find_reading(unit: Expression, readings: Readings) -> Unit:
    """Return the unit that an expression is read as: as readings say, or the first that it has.

    Raises:
        NotUnderstood: it is not known.
    """
    for key in (unit.start, unit.text):
        if key in readings:
            return readings[key]
    units = find_units(unit.text)
    if not units:
        raise unit.not_understood(f"`{unit.text}` is not a known unit")
    return units[0]


def unit_readings(*sides: Expression) -> Iterator[Readings]:
    """Yield all readings of the units in both sides of a relation.

    A unit with several sizes has the same one in all places; a temperature of a scale may be one,
    or a difference, in each. A number of cycles beside an angle is one of 2π radians each.
    """
    choices: dict[int | str, tuple[Unit, ...]] = {}
    numbers = [side for side in sides if read_numeral(side) is not None]
    is_sum = any(side.has("+", "-") for side in sides)
    for part in (part for side in sides for part in side.walk()):
        units = find_units(part.text) if part.kind == "unit" else ()
        if units and units[0].zero:
            readings = (units[0], replace(units[0], zero=Fraction(0)))
            choices[part.start] = readings[::-1] if is_sum else readings
        elif units:
            choices[part.text] = units
    if sum(len(units) > 1 for units in choices.values()) > _MAX_CHOICES:
        raise sides[-1].not_understood("its units have too many readings")
    for units in itertools.product(*choices.values()):
        readings_of_units = dict(zip(choices, units, strict=True))
        is_mixed = {"angle", "cycle"} <= {name for unit in units for name, _ in unit.powers}
        if not is_mixed or len(numbers) < len(sides):
            yield readings_of_units
        of_cycles = {key for key, unit in readings_of_units.items() if "cycle" in dict(unit.powers)}
        if is_mixed and any(part.text in of_cycles for side in numbers for part in side.walk()):
            yield {key: unit.in_radians() for key, unit in readings_of_units.items()}


_MAX_CHOICES = 5
_MAX_DIGITS = 300
_MAX_COUNT = 1_000
"""The limit for factorials, and for the terms of the sums in a side."""


class WrongDimensions(NotUnderstood):
    """Quantities of different dimensions are combined."""

    kind = "wrong"


class PhysicalQuantity(Struct, frozen=True):
    """A value in base units of the SI."""

    value: Real
    dimension: Dimension = ()


def evaluate(
    expression: Expression,
    symbols: Mapping[str, PhysicalQuantity] = {},
    has_calculus: bool = True,
    readings: Readings = FIRST_READINGS,
) -> PhysicalQuantity:
    """Return the quantity that an expression has as its value.

    `symbols` may also say what a number stands for, by its digits, as one that is rounded does.
    Without calculus derivatives and integrals have their dimensions, and any value. `readings`:
    what units mean that may mean several.

    Raises:
        NotUnderstood: it cannot be computed.
    """
    try:
        quantity = _Evaluator(symbols, has_calculus, readings=readings).evaluate(expression)
    except (OverflowError, MemoryError):
        raise expression.not_understood("the numbers become too large") from None
    if not quantity.value.is_finite:
        raise expression.not_understood("300 digits do not tell whether it is a real number")
    return quantity


class _Evaluator:
    def __init__(
        self,
        symbols: Mapping[str, PhysicalQuantity],
        has_calculus: bool,
        term_numbers: Iterator[int] | None = None,
        analytic: bool = False,
        readings: Readings = FIRST_READINGS,
    ) -> None:
        self.symbols, self.has_calculus, self.analytic = symbols, has_calculus, analytic
        self.readings = readings
        self.term_numbers = term_numbers or iter(range(_MAX_COUNT))
        """Those that are left."""

    def with_symbol(
        self, name: str, quantity: PhysicalQuantity, analytic: bool = False
    ) -> _Evaluator:
        """Return an evaluator to which a symbol is known."""
        symbols = {**self.symbols, name: quantity}
        is_analytic = self.analytic or analytic
        return _Evaluator(symbols, self.has_calculus, self.term_numbers, is_analytic, self.readings)

    def evaluate(self, expression: Expression) -> PhysicalQuantity:
        """Return the value of an expression."""
        try:
            return self._evaluate(expression)
        except ZeroDivisionError:
            raise expression.not_understood("it divides by zero") from None
        except ValueError:
            raise expression.not_understood("it is not a real number") from None

    def _evaluate(self, expression: Expression) -> PhysicalQuantity:
        match expression.kind:
            case "number" | "symbol" | "index" if expression.text in self.symbols:
                return self.symbols[expression.text]
            case "number":
                if len(expression.text) > _MAX_DIGITS:
                    raise OverflowError
                return PhysicalQuantity(Real.of(expression.text))
            case "symbol" if expression.text in CONSTANTS:
                return PhysicalQuantity(PI if expression.text == r"\pi" else E)
            case "symbol" if expression.text == r"\infty":
                raise expression.not_understood("nothing is computed up to infinity")
            case "symbol":
                reason = (
                    f"no lesson says what `{expression.text}` is, or several differ in its unit"
                )
                raise expression.not_understood(reason)
            case "unit":
                unit = find_reading(expression, self.readings)
                return PhysicalQuantity(measure(unit), unit.dimension)
            case "+" | "-":
                return self._evaluate_sum(expression)
            case "*":
                left, right = map(self.evaluate, expression.parts)
                dimension = multiply(left.dimension, right.dimension)
                value = left.value * right.value
                return PhysicalQuantity(value + self._beginning(expression), dimension)
            case "/":
                left, right = map(self.evaluate, expression.parts)
                dimension = multiply(left.dimension, right.dimension, -1)
                return PhysicalQuantity(left.value / right.value, dimension)
            case "^":
                return self._evaluate_power(expression)
            case "abs":
                (inner,) = map(self.evaluate, expression.parts)
                return PhysicalQuantity(inner.value.abs(self.analytic), inner.dimension)
            case "derivative" if self.has_calculus:
                body, variable = expression.parts
                return self.evaluate(differentiate(body, variable.text))
            case "derivative":
                quantity, point = map(self.evaluate, expression.parts)
                dimension = multiply(quantity.dimension, point.dimension, -1)
                return replace(quantity, dimension=dimension)
            case "integral":
                return self._evaluate_integral(expression)
            case "sum" | "prod":
                return self._evaluate_series(expression)
            case "index":
                raise expression.not_understood("the dimension may differ from term to term")
            case "factorial" | "binom":
                wholes = [number.whole for number in self._numbers(expression)]
                counts = [whole for whole in wholes if whole is not None and whole >= 0]
                if len(counts) < len(wholes):
                    raise expression.not_understood("it is of whole numbers only")
                if max(counts) > _MAX_COUNT:
                    raise OverflowError
                count = math.factorial(*counts) if len(counts) == 1 else math.comb(*counts)
                return PhysicalQuantity(Real.of(count))
            case name:
                (argument,) = self._numbers(expression)
                return PhysicalQuantity(apply(name, argument, self.analytic))

    def _numbers(self, expression: Expression) -> list[Real]:
        """Return what a function is of, which has no dimension."""
        arguments = [*map(self.evaluate, expression.parts)]
        for part, argument in zip(expression.parts, arguments, strict=True):
            if argument.dimension:
                if part.text == SIDE_BY_SIDE:
                    raise part.not_understood("the function may be of the first factor alone")
                words = describe_dimension(argument.dimension)
                is_function = expression.kind not in ("factorial", "binom")
                function = f"`\\{expression.kind}`" if is_function else "a factorial"
                reason = f"{function} is of {words}, and not of a number"
                raise WrongDimensions(reason, expression.start, expression.end)
        return [argument.value for argument in arguments]

    def _evaluate_series(self, expression: Expression) -> PhysicalQuantity:
        """Return a sum or a product of terms."""
        term, index, *ends = expression.parts
        first, last = (limit.value.whole for limit in map(self.evaluate, ends))
        if first is None or last is None:
            raise expression.not_understood("its limits are not two whole numbers")
        if last < first - 1:
            raise expression.not_understood("it ends before it begins")
        is_sum = expression.kind == "sum"
        total: PhysicalQuantity | None = None
        for number in range(first, last + 1):
            if next(self.term_numbers, None) is None:
                raise OverflowError
            inner = self.with_symbol(index.text, PhysicalQuantity(Real.of(number)))
            quantity = inner.evaluate(term)
            if total is None:
                total = quantity
            elif is_sum and total.dimension != quantity.dimension:
                reason = "its terms have different dimensions"
                raise WrongDimensions(reason, expression.start, expression.end)
            elif is_sum:
                total = PhysicalQuantity(total.value + quantity.value, total.dimension)
            else:
                dimension = multiply(total.dimension, quantity.dimension)
                total = PhysicalQuantity(total.value * quantity.value, dimension)
        return total or PhysicalQuantity(_ZERO if is_sum else ONE)

    def _beginning(self, expression: Expression) -> Real:
        """Return where the scale begins on which a product is a place, as 25 °C is."""
        if not expression.ends_in_unit():
            return _ZERO
        unit = find_reading(expression.parts[1], self.readings)
        return Real.of(unit.zero) * measure(unit)

    def _evaluate_sum(self, expression: Expression) -> PhysicalQuantity:
        before, last = expression.parts[0], expression.parts[-1]
        if last.ends_in_unit("%") and not any(part.text == "%" for part in before.walk()):
            raise last.not_understood("it may be of what stands before it")
        first, *rest = map(self.evaluate, expression.parts)
        if not rest:  # -40 °C is not the opposite of 40 °C
            beginning = self._beginning(expression.parts[0])
            return PhysicalQuantity(beginning + beginning - first.value, first.dimension)
        (second,) = rest
        if find_conflict(first, second):
            dimensions = [describe_dimension(term.dimension) for term in (first, second)]
            reason = f"{dimensions[0]} and {dimensions[1]} are added"
            raise WrongDimensions(reason, expression.start, expression.end)
        term = second.value if expression.kind == "+" else -second.value
        return PhysicalQuantity(first.value + term, first.dimension or second.dimension)

    def _evaluate_power(self, expression: Expression) -> PhysicalQuantity:
        base, exponent = map(self.evaluate, expression.parts)
        part = expression.parts[1]
        if exponent.dimension:
            reason = f"an exponent is {describe_dimension(exponent.dimension)}, not a number"
            raise WrongDimensions(reason, part.start, part.end)
        dimension: Dimension = ()
        if base.dimension:
            rational = exponent.value.rational
            if rational is None:
                raise part.not_understood("the exponent of a unit is no fraction")
            dimension = multiply((), base.dimension, rational)
        return PhysicalQuantity(base.value.raise_to(exponent.value, self.analytic), dimension)

    def _evaluate_integral(self, expression: Expression) -> PhysicalQuantity:
        body, variable, *ends = expression.parts
        if not ends:
            raise expression.not_understood("it is not a number")
        point = self.evaluate(variable)
        limits = [self.evaluate(end).value for end in ends]
        inside = limits[0] + (limits[1] - limits[0]) * Real.of("0.382")
        quantity = self.with_symbol(
            variable.text, PhysicalQuantity(inside, point.dimension)
        ).evaluate(body)
        dimension = multiply(quantity.dimension, point.dimension)
        if not self.has_calculus:
            return replace(quantity, dimension=dimension)

        def integrand(place: Real, analytic: bool) -> Real:
            argument = PhysicalQuantity(place, point.dimension)
            inner = self.with_symbol(variable.text, argument, analytic)
            return inner.evaluate(body).value

        return PhysicalQuantity(integrate(integrand, *limits), dimension)


def measure(unit: Unit) -> Real:
    """Return the size of a unit in base units."""
    return Real.of(unit.size) * PI.raise_to(Real.of(unit.pi))


def has_zero(*quantities: PhysicalQuantity) -> bool:
    """Whether any is certainly zero, which has all dimensions."""
    return any(quantity.value.sign() == 0 for quantity in quantities)


def find_conflict(
    left: PhysicalQuantity, right: PhysicalQuantity, *, zero_fits: bool = True
) -> str:
    """Return in words how the dimensions of two quantities differ; empty if they may be equal.

    `zero_fits`: zero has all dimensions.
    """
    if left.dimension == right.dimension or (zero_fits and has_zero(left, right)):
        return ""
    return " is held against ".join(map(describe_dimension, (left.dimension, right.dimension)))


def describe_dimension(dimension: Dimension) -> str:
    """Return a dimension in words: `length/time^2`."""
    if not dimension:
        return "a number"
    parts = (name + ("" if power == 1 else f"^{power}") for name, power in dimension)
    return "`" + " ".join(parts) + "`"
