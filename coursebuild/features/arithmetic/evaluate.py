"""Reads sides of a formula as numbers, evaluates them to quantities, compares them as identities.

Entry points: `read_numeral(expression)`, `agrees`,
`is_close`, `format_number`, of numbers as they are written; `evaluate(expression, symbols,
arithmetic)`, a value in base units with its dimension; `EXACT`, the arithmetic of fractions, which
become floating-point numbers where necessary; `check_identity(tex, symbols)`.

Results that are too large, or no numbers, are not understood. Sums of different dimensions, and
functions of an argument with a dimension, are `WrongDimensions`.

Both sides of an identity between symbols are computed at random points, with dimensions. mpmath
computes derivatives and integrals, in thirty digits. Where one side is an integral without limits,
its integrand is compared with the derivative of the other side. What is not understood does not
pass.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Iterator, Mapping
from decimal import Decimal
from fractions import Fraction
from itertools import pairwise
from typing import Any, Literal

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core.text.units import Dimension, find_unit, multiply
from coursebuild.features.arithmetic.statements import read_statements
from coursebuild.features.arithmetic.tex import Expression, NotUnderstood

_CLOSE = 1e-12


class FormulaComparison(Struct, frozen=True):
    """The result of comparing two sides of a formula, for a range of its TeX."""

    kind: Literal["holds", "wrong", "unread"]
    start: int
    end: int
    message: str = ""
    help: str = ""
    result: str = ""
    """What should stand there, where a number that stands there is wrong."""


class Numeral(Struct, frozen=True):
    """A number as it is written, with its precision."""

    value: Any
    step: Any
    """One unit of its last place."""
    is_whole: bool
    """Whether it has neither a point nor a power of ten."""
    digits: int
    unit_size: Any
    """The size of its unit in base units."""


def read_numeral(expression: Expression) -> Numeral | None:
    """Return the numeral that an expression is; `None` if it is more than that."""
    match expression:
        case Expression(kind="number", text=text):
            whole, _, decimals = text.partition(".")
            is_whole = "." not in text
            zeros = len(whole) - len(whole.rstrip("0")) if is_whole and whole.strip("0") else 0
            step = Fraction(10) ** (zeros - len(decimals))
            digits = len(text.replace(".", "").lstrip("0")) or 1
            return Numeral(Fraction(text), step, is_whole, digits, Fraction(1))
        case Expression(kind="-", parts=(inner,)):
            numeral = read_numeral(inner)
            return numeral and replace(numeral, value=-numeral.value)
        case Expression(kind="^", parts=(Expression(kind="number", text="10"), _)):
            size = evaluate(expression).value
            return Numeral(size, size, True, 1, Fraction(1))
        case Expression(kind="*", parts=(inner, Expression(kind="unit" | "^") as factor)):
            numeral, power = read_numeral(inner), read_numeral(factor)
            if numeral is None or (factor.kind == "^" and (power is None or numeral.digits == 0)):
                return None
            size = evaluate(factor).value
            scaled = replace(numeral, value=numeral.value * size, step=numeral.step * size)
            if factor.kind == "^":
                return replace(scaled, is_whole=False)
            return replace(scaled, unit_size=size)
        case _:
            return None


def agrees(numeral: Numeral, value: Any, relation: str) -> bool:
    """Whether a value, rounded to the digits of a numeral, is that number."""
    is_exact = isinstance(value, Fraction) and isinstance(numeral.value, Fraction)
    if numeral.is_whole and relation == "=":
        return value == numeral.value if is_exact else is_close(value, numeral.value)
    gap = 2 * abs(value - numeral.value)
    return bool(gap <= numeral.step if is_exact else gap <= numeral.step * (1 + 1e-9))


def is_close(left: Any, right: Any) -> bool:
    """Whether two values are the same, but for rounding of floating-point numbers."""
    return bool(abs(left - right) <= _CLOSE * max(abs(left), abs(right)))


def format_number(value: Any, digits: int = 10) -> str:
    """Return a value as text."""
    if isinstance(value, Fraction):
        value = Decimal(value.numerator) / Decimal(value.denominator)
    return f"{value:.{digits}g}"


_MAX_BITS = 4_000
_MAX_DIGITS = 300
_MAX_SERIES_BITS = 10_000
_MAX_COUNT = 1_000
"""The limit for factorials, and for the terms of the sums in a side."""


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
    def __init__(
        self,
        arithmetic: Arithmetic,
        symbols: Mapping[str, PhysicalQuantity],
        term_numbers: Iterator[int] | None = None,
    ) -> None:
        self.arithmetic, self.symbols = arithmetic, symbols
        self.term_numbers = term_numbers or iter(range(_MAX_COUNT))
        """Those that are left."""

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
            case "sum" | "prod":
                return self._evaluate_series(expression)
            case "index":
                if expression.text not in self.symbols:
                    raise expression.not_understood("the dimension may differ from term to term")
                return self.symbols[expression.text]
            case name:
                inners = [*map(self.evaluate, expression.parts)]
                for inner in inners:
                    if inner.dimension:
                        words = describe_dimension(inner.dimension)
                        function = "a factorial" if name == "factorial" else f"`\\{name}`"
                        reason = f"{function} is of {words}, and not of a number"
                        raise WrongDimensions(reason, expression.start, expression.end)
                values = [inner.value for inner in inners]
                if name in ("factorial", "binom"):
                    return PhysicalQuantity(self._count(expression, values))
                function_name = _RECIPROCALS.get(name) or _LIBRARY_NAMES.get(name, name)
                value = getattr(self.arithmetic.library, function_name)(*values)
                return PhysicalQuantity(1 / value if name in _RECIPROCALS else value)

    def _count(self, expression: Expression, values: list[Any]) -> Any:
        """Return the factorial of a number, or the binomial of two."""
        if any(abs(value) > _MAX_COUNT for value in values):
            raise OverflowError
        if self.arithmetic.library is not math:  # mpmath knows those of all numbers
            name = "factorial" if len(values) == 1 else "binomial"
            return getattr(self.arithmetic.library, name)(*values)
        if any(value < 0 or value != int(value) for value in values):
            raise expression.not_understood("it is of whole numbers only")
        function: Callable[..., int] = math.factorial if len(values) == 1 else math.comb
        return Fraction(function(*map(int, values)))

    def _evaluate_series(self, expression: Expression) -> PhysicalQuantity:
        """Return a sum or a product of terms."""
        term, index, *ends = expression.parts
        first, last = (self.evaluate(end) for end in ends)
        if any(
            end.dimension or not math.isfinite(end.value) or end.value != int(end.value)
            for end in (first, last)
        ):
            raise expression.not_understood("its limits are not two whole numbers")
        is_sum = expression.kind == "sum"
        total: PhysicalQuantity | None = None
        for value in range(int(first.value), int(last.value) + 1):
            if next(self.term_numbers, None) is None:
                raise OverflowError
            number = PhysicalQuantity(self.arithmetic.number(str(value)))
            symbols = {**self.symbols, index.text: number}
            quantity = _Evaluator(self.arithmetic, symbols, self.term_numbers).evaluate(term)
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
            if isinstance(total.value, Fraction) and (
                max(map(abs, total.value.as_integer_ratio())).bit_length() > _MAX_SERIES_BITS
            ):
                raise OverflowError
        return total or PhysicalQuantity(self.arithmetic.number("0" if is_sum else "1"))

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
            symbols = {**self.symbols, variable.text: quantity}
            inner = _Evaluator(self.arithmetic, symbols, self.term_numbers)
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


_POINTS = 5
_MAX_MAGNITUDE = 1000
"""The limit for exponents."""


def check_identity(tex: str, symbols: Mapping[str, Dimension]) -> Iterator[FormulaComparison]:
    """Yield the comparisons of a formula's sides that fail or are not understood."""
    statements = read_statements(tex)
    if not any(statement.relations for statement in statements):
        yield FormulaComparison("unread", 0, len(tex), "it is not an equation")
    for statement in statements:
        for (left, right), relation in zip(
            pairwise(statement.sides), statement.relations, strict=True
        ):
            try:
                if relation != "=":
                    raise NotUnderstood("it is not an equation", left.start, right.end)
                yield from _compare(left.get_expression(), right.get_expression(), symbols)
            except NotUnderstood as error:
                yield FormulaComparison(error.kind, error.start, error.end, error.reason)


def _compare(
    left: Expression, right: Expression, symbols: Mapping[str, Dimension]
) -> Iterator[FormulaComparison]:
    import mpmath

    left, right = _without_integral(left, right)
    right, left = _without_integral(right, left)
    parts = (*left.walk(), *right.walk())
    names = sorted({part.text for part in parts if part.kind == "symbol"} & symbols.keys())
    generator = random.Random(repr((left, right)))
    with mpmath.workdps(30):
        arithmetic = _mpmath_arithmetic(mpmath.mp)
        for _ in range(_POINTS):
            point = {name: mpmath.mpf(round(generator.uniform(0.5, 2), 3)) for name in names}
            values = {name: PhysicalQuantity(value, symbols[name]) for name, value in point.items()}
            lhs, rhs = (evaluate(side, values, arithmetic) for side in (left, right))
            if lhs.dimension != rhs.dimension and 0 not in (lhs.value, rhs.value):
                dimensions = [describe_dimension(side.dimension) for side in (lhs, rhs)]
                message = f"{dimensions[0]} is held against {dimensions[1]}"
                yield FormulaComparison("wrong", right.start, right.end, message)
                return
            if abs(lhs.value - rhs.value) > _CLOSE * (abs(lhs.value) + abs(rhs.value)):
                symbol_values = ", ".join(f"{n} = {float(value):g}" for n, value in point.items())
                sides = " and ".join(mpmath.nstr(side.value, 6) for side in (lhs, rhs))
                suffix = f" where {symbol_values}" if symbol_values else ""
                message = f"the sides are {sides}{suffix}"
                yield FormulaComparison("wrong", right.start, right.end, message)
                return


def _without_integral(side: Expression, opposite: Expression) -> tuple[Expression, Expression]:
    """Differentiate both sides, if the first is an integral without limits."""
    if side.kind != "integral" or len(side.parts) > 2:
        return side, opposite
    integrand, variable = side.parts
    derivative = Expression("derivative", opposite.start, opposite.end, (opposite, variable))
    return integrand, derivative


def _mpmath_arithmetic(mp: Any) -> Arithmetic:

    def power(base: Any, exponent: Any) -> Any:
        if exponent and mp.mag(exponent) > _MAX_MAGNITUDE:
            raise OverflowError
        return base**exponent

    def calculus(function: Callable[[Any], Any], *places: Any) -> Any:
        if len(places) == 1:
            return mp.diff(function, places[0])
        value, error = mp.quad(function, places, error=True)
        if not error <= _CLOSE * (1 + abs(value)):
            raise ValueError
        return value

    return Arithmetic(mp.mpf, power, mp, calculus)
