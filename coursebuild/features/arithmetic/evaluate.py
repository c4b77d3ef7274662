"""Evaluates expressions to quantities: a value in base units, and a dimension.

Entry points: `evaluate(expression, symbols, arithmetic)`; `EXACT`, the arithmetic of fractions,
which become floating-point numbers where necessary.

Results that are too large, or no numbers, are not understood. Sums of different dimensions, and
functions of an argument with a dimension, are `WrongDimensions`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from fractions import Fraction
from typing import Any

from msgspec import Struct

from coursebuild.core.text.units import Dimension, find_unit, multiply
from coursebuild.features.arithmetic.expressions import Expression, NotUnderstood

_MAX_BITS = 4_000
_MAX_DIGITS = 300


class WrongDimensions(NotUnderstood):
    """Quantities of different dimensions are combined."""

    kind = "wrong"


class PhysicalQuantity(Struct, frozen=True):
    """A value in base units of the SI."""

    value: Any
    dimension: Dimension = ()


class Arithmetic(Struct, frozen=True):
    """The operations of one kind of numbers."""

    number: Callable[[str], Any]
    power: Callable[[Any, Any], Any]
    library: Any
    """Has the functions and constants: `math`, or a context of mpmath."""
    calculus: Callable[..., Any] | None = None
    """Return the derivative of a function at a point, or its integral between two."""


def _exact_power(base: Any, exponent: Any) -> Any:
    if isinstance(base, Fraction) and isinstance(exponent, Fraction) and exponent.denominator == 1:
        bits = base.numerator.bit_length() + base.denominator.bit_length()
        if abs(exponent) * bits > _MAX_BITS:
            raise OverflowError
        return base ** int(exponent)
    if base < 0:
        raise ValueError
    return float(base) ** float(exponent)


EXACT = Arithmetic(Fraction, _exact_power, math)
_LIBRARY_NAMES = {"ln": "log", "arcsin": "asin", "arccos": "acos", "arctan": "atan"}
"""Names of functions in libraries, where they differ from those in TeX."""
_RECIPROCALS = {"cot": "tan", "sec": "cos", "csc": "sin"}
_CONSTANTS = {r"\pi": "pi", r"\mathrm{e}": "e", r"\infty": "inf"}


def evaluate(
    expression: Expression,
    symbols: Mapping[str, PhysicalQuantity] = {},
    arithmetic: Arithmetic = EXACT,
) -> PhysicalQuantity:
    """Return the quantity that an expression has as its value.

    Raises:
        NotUnderstood: it cannot be computed.
    """
    try:
        return _Evaluator(arithmetic, symbols).evaluate(expression)
    except (OverflowError, MemoryError):
        raise expression.not_understood("the numbers become too large") from None


class _Evaluator:
    def __init__(self, arithmetic: Arithmetic, symbols: Mapping[str, PhysicalQuantity]) -> None:
        self.arithmetic, self.symbols = arithmetic, symbols

    def evaluate(self, expression: Expression) -> PhysicalQuantity:
        """Return the value of an expression."""
        try:
            return self._evaluate(expression)
        except ZeroDivisionError:
            raise expression.not_understood("it divides by zero") from None
        except (ValueError, TypeError):
            raise expression.not_understood("it is not a real number") from None

    def _evaluate(self, expression: Expression) -> PhysicalQuantity:
        match expression.kind:
            case "number":
                if len(expression.text) > _MAX_DIGITS:
                    raise OverflowError
                return PhysicalQuantity(self.arithmetic.number(expression.text))
            case "symbol":
                return self._evaluate_symbol(expression)
            case "unit":
                return self._evaluate_unit(expression)
            case "+" | "-":
                return self._evaluate_sum(expression)
            case "*":
                left, right = map(self.evaluate, expression.parts)
                dimension = multiply(left.dimension, right.dimension)
                return PhysicalQuantity(left.value * right.value, dimension)
            case "/":
                left, right = map(self.evaluate, expression.parts)
                dimension = multiply(left.dimension, right.dimension, -1)
                return PhysicalQuantity(left.value / right.value, dimension)
            case "^":
                return self._evaluate_power(expression)
            case "abs":
                (inner,) = map(self.evaluate, expression.parts)
                return PhysicalQuantity(abs(inner.value), inner.dimension)
            case "derivative" | "integral":
                return self._evaluate_calculus(expression)
            case name:
                (inner,) = map(self.evaluate, expression.parts)
                if inner.dimension:
                    words = describe_dimension(inner.dimension)
                    reason = f"`\\{name}` is of {words}, and not of a number"
                    raise WrongDimensions(reason, expression.start, expression.end)
                function_name = _RECIPROCALS.get(name) or _LIBRARY_NAMES.get(name, name)
                value = getattr(self.arithmetic.library, function_name)(inner.value)
                return PhysicalQuantity(1 / value if name in _RECIPROCALS else value)

    def _evaluate_symbol(self, expression: Expression) -> PhysicalQuantity:
        quantity = self.symbols.get(expression.text)
        if quantity is not None:
            return quantity
        if expression.text not in _CONSTANTS:
            reason = f"no lesson says what `{expression.text}` is, or several differ in its unit"
            raise expression.not_understood(reason)
        return PhysicalQuantity(getattr(self.arithmetic.library, _CONSTANTS[expression.text]))

    def _evaluate_unit(self, expression: Expression) -> PhysicalQuantity:
        if expression.text == "%":
            return PhysicalQuantity(self.arithmetic.number("0.01"))
        if expression.text == "deg":
            return PhysicalQuantity(self.arithmetic.library.pi / 180)
        unit = find_unit(expression.text)
        if unit is None:
            raise expression.not_understood(f"`{expression.text}` is not a known unit")
        return PhysicalQuantity(self.arithmetic.number(str(unit.size)), unit.dimension)

    def _evaluate_sum(self, expression: Expression) -> PhysicalQuantity:
        first, *rest = map(self.evaluate, expression.parts)
        if not rest:
            return PhysicalQuantity(-first.value, first.dimension)
        (second,) = rest
        if first.dimension != second.dimension and 0 not in (first.value, second.value):
            dimensions = [describe_dimension(term.dimension) for term in (first, second)]
            reason = f"{dimensions[0]} and {dimensions[1]} are added"
            raise WrongDimensions(reason, expression.start, expression.end)
        sign = 1 if expression.kind == "+" else -1
        return PhysicalQuantity(
            first.value + sign * second.value, first.dimension or second.dimension
        )

    def _evaluate_power(self, expression: Expression) -> PhysicalQuantity:
        base, exponent = map(self.evaluate, expression.parts)
        if exponent.dimension:
            reason = f"an exponent is {describe_dimension(exponent.dimension)}, not a number"
            raise WrongDimensions(reason, expression.parts[1].start, expression.parts[1].end)
        dimension: Dimension = ()
        if base.dimension:
            power = _Evaluator(EXACT, {}).evaluate(expression.parts[1]).value
            dimension = multiply((), base.dimension, Fraction(power).limit_denominator(1000))
        return PhysicalQuantity(self.arithmetic.power(base.value, exponent.value), dimension)

    def _evaluate_calculus(self, expression: Expression) -> PhysicalQuantity:
        body, variable, *ends = expression.parts
        if self.arithmetic.calculus is None or (expression.kind == "integral" and not ends):
            raise expression.not_understood("it is not a number")
        point = self._evaluate_symbol(variable)
        dimension: list[Dimension] = []

        def function(value: Any) -> Any:
            quantity = PhysicalQuantity(value, point.dimension)
            inner = _Evaluator(self.arithmetic, {**self.symbols, variable.text: quantity})
            result = inner.evaluate(body)
            dimension[:] = [result.dimension]
            return result.value

        places = [self.evaluate(end).value for end in ends] or [point.value]
        value = self.arithmetic.calculus(function, *places)
        sign = 1 if ends else -1
        return PhysicalQuantity(value, multiply(dimension[0], point.dimension, sign))


def describe_dimension(dimension: Dimension) -> str:
    """Return a dimension in words: `length/time^2`."""
    if not dimension:
        return "a number"
    parts = (name + ("" if power == 1 else f"^{power}") for name, power in dimension)
    return "`" + " ".join(parts) + "`"
