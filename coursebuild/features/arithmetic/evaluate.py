"""Expressions → quantities: the value, in base units, and the dimension.

Entry points: `evaluate(expression, symbols, arithmetic)`; `EXACT`, the arithmetic of fractions,
which become floating-point numbers where they must.

What would be too large, or is no number, is not understood. Sums of different dimensions, and
functions of what has one, are `WrongDimensions`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from fractions import Fraction
from typing import Any

from msgspec import Struct

from coursebuild.core.text.units import Dimension, find_unit, multiply
from coursebuild.features.arithmetic.expressions import Expression, NotUnderstood

_MOST_BITS = 4_000
_LONGEST = 300


class WrongDimensions(NotUnderstood):
    """That quantities of different dimensions meet."""


class PhysicalQuantity(Struct, frozen=True):
    """A value in base units of the SI."""

    value: Any
    dimension: Dimension = ()


class Arithmetic(Struct, frozen=True):
    """Numbers of some kind."""

    number: Callable[[str], Any]
    power: Callable[[Any, Any], Any]
    library: Any
    """What has the functions and constants: `math`, or a context of mpmath."""
    calculus: Callable[..., Any] | None = None
    """The derivative of a function at a place, or its integral between two."""


def _exact_power(base: Any, exponent: Any) -> Any:
    if isinstance(base, Fraction) and isinstance(exponent, Fraction) and exponent.denominator == 1:
        bits = base.numerator.bit_length() + base.denominator.bit_length()
        if abs(exponent) * bits > _MOST_BITS:
            raise OverflowError
        return base ** int(exponent)
    if base < 0:
        raise ValueError
    return float(base) ** float(exponent)


EXACT = Arithmetic(Fraction, _exact_power, math)
_CALLED = {"ln": "log", "arcsin": "asin", "arccos": "acos", "arctan": "atan"}
"""Functions that libraries call otherwise."""
_RECIPROCALS = {"cot": "tan", "sec": "cos", "csc": "sin"}
_CONSTANTS = {r"\pi": "pi", r"\mathrm{e}": "e", r"\infty": "inf"}


def evaluate(
    expression: Expression,
    symbols: Mapping[str, PhysicalQuantity] = {},
    arithmetic: Arithmetic = EXACT,
) -> PhysicalQuantity:
    """What an expression comes to.

    Raises:
        NotUnderstood: it cannot be computed.
    """
    try:
        return _Evaluator(arithmetic, symbols).of(expression)
    except (OverflowError, MemoryError):
        raise expression.not_understood("the numbers become too large") from None


class _Evaluator:
    def __init__(self, arithmetic: Arithmetic, symbols: Mapping[str, PhysicalQuantity]) -> None:
        self.arithmetic, self.symbols = arithmetic, symbols

    def of(self, one: Expression) -> PhysicalQuantity:
        """What an expression comes to."""
        try:
            return self._of(one)
        except ZeroDivisionError:
            raise one.not_understood("it divides by zero") from None
        except (ValueError, TypeError):
            raise one.not_understood("it is no real number") from None

    def _of(self, one: Expression) -> PhysicalQuantity:
        match one.kind:
            case "number":
                if len(one.text) > _LONGEST:
                    raise OverflowError
                return PhysicalQuantity(self.arithmetic.number(one.text))
            case "symbol":
                return self._symbol(one)
            case "unit":
                return self._unit(one)
            case "+" | "-":
                return self._sum(one)
            case "*":
                left, right = map(self.of, one.parts)
                dimension = multiply(left.dimension, right.dimension)
                return PhysicalQuantity(left.value * right.value, dimension)
            case "/":
                left, right = map(self.of, one.parts)
                dimension = multiply(left.dimension, right.dimension, -1)
                return PhysicalQuantity(left.value / right.value, dimension)
            case "^":
                return self._power(one)
            case "abs":
                (inner,) = map(self.of, one.parts)
                return PhysicalQuantity(abs(inner.value), inner.dimension)
            case "derivative" | "integral":
                return self._calculus(one)
            case name:
                (inner,) = map(self.of, one.parts)
                if inner.dimension:
                    reason = f"`\\{name}` is of {say(inner.dimension)}, and not of a number"
                    raise WrongDimensions(reason, one.start, one.end)
                called = _RECIPROCALS.get(name) or _CALLED.get(name, name)
                value = getattr(self.arithmetic.library, called)(inner.value)
                return PhysicalQuantity(1 / value if name in _RECIPROCALS else value)

    def _symbol(self, one: Expression) -> PhysicalQuantity:
        known = self.symbols.get(one.text)
        if known is not None:
            return known
        if one.text not in _CONSTANTS:
            reason = f"no lesson says what `{one.text}` is, or several differ in its unit"
            raise one.not_understood(reason)
        return PhysicalQuantity(getattr(self.arithmetic.library, _CONSTANTS[one.text]))

    def _unit(self, one: Expression) -> PhysicalQuantity:
        if one.text == "%":
            return PhysicalQuantity(self.arithmetic.number("0.01"))
        if one.text == "deg":
            return PhysicalQuantity(self.arithmetic.library.pi / 180)
        unit = find_unit(one.text)
        if unit is None:
            raise one.not_understood(f"`{one.text}` is no unit that is known")
        return PhysicalQuantity(self.arithmetic.number(str(unit.size)), unit.dimension)

    def _sum(self, one: Expression) -> PhysicalQuantity:
        first, *rest = map(self.of, one.parts)
        if not rest:
            return PhysicalQuantity(-first.value, first.dimension)
        (second,) = rest
        if first.dimension != second.dimension and 0 not in (first.value, second.value):
            reason = f"{say(first.dimension)} and {say(second.dimension)} are added"
            raise WrongDimensions(reason, one.start, one.end)
        sign = 1 if one.kind == "+" else -1
        return PhysicalQuantity(
            first.value + sign * second.value, first.dimension or second.dimension
        )

    def _power(self, one: Expression) -> PhysicalQuantity:
        base, exponent = map(self.of, one.parts)
        if exponent.dimension:
            reason = f"an exponent is {say(exponent.dimension)}, and no number"
            raise WrongDimensions(reason, one.parts[1].start, one.parts[1].end)
        dimension: Dimension = ()
        if base.dimension:
            power = _Evaluator(EXACT, {}).of(one.parts[1]).value
            dimension = multiply((), base.dimension, Fraction(power).limit_denominator(1000))
        return PhysicalQuantity(self.arithmetic.power(base.value, exponent.value), dimension)

    def _calculus(self, one: Expression) -> PhysicalQuantity:
        what, by, *ends = one.parts
        if self.arithmetic.calculus is None or (one.kind == "integral" and not ends):
            raise one.not_understood("it is no number")
        at = self._symbol(by)
        dimension: list[Dimension] = []

        def function(value: Any) -> Any:
            inner = {**self.symbols, by.text: PhysicalQuantity(value, at.dimension)}
            found = _Evaluator(self.arithmetic, inner).of(what)
            dimension[:] = [found.dimension]
            return found.value

        places = [self.of(end).value for end in ends] or [at.value]
        value = self.arithmetic.calculus(function, *places)
        sign = 1 if ends else -1
        return PhysicalQuantity(value, multiply(dimension[0], at.dimension, sign))


def say(dimension: Dimension) -> str:
    """A dimension in words: `length/time^2`."""
    if not dimension:
        return "a number"
    parts = (name + ("" if power == 1 else f"^{power}") for name, power in dimension)
    return "`" + " ".join(parts) + "`"
