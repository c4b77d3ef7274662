"""Checks identities between symbols: computes both sides and dimensions at random points.

Entry point: `check_identity(tex, symbols)`. mpmath computes derivatives and integrals, in thirty
digits. Where one side is an integral without limits, its integrand is compared with the derivative
of the other side. What is not understood does not pass.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator, Mapping
from itertools import pairwise
from typing import Any

from coursebuild.core.text.units import Dimension
from coursebuild.features.arithmetic.evaluate import (
    Arithmetic,
    PhysicalQuantity,
    describe_dimension,
    evaluate,
)
from coursebuild.features.arithmetic.expressions import Expression, NotUnderstood
from coursebuild.features.arithmetic.numerals import FormulaComparison
from coursebuild.features.arithmetic.statements import read_statements

_POINTS = 5
_CLOSE = 1e-12
_MAX_BITS = 1000
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
        if exponent and mp.mag(exponent) > _MAX_BITS:
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
