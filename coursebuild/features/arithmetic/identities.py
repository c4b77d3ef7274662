"""Identities between symbols: both sides computed at random points, with their dimensions.

Entry point: `check_identity(tex, symbols)`. Derivatives are taken and integrals computed by
mpmath, in thirty digits; of an integral without limits the other side's derivative is taken. What
is not understood does not pass.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator, Mapping
from itertools import pairwise
from typing import Any

from coursebuild.core.text.units import Dimension
from coursebuild.features.arithmetic.chains import FormulaFinding
from coursebuild.features.arithmetic.evaluate import (
    Arithmetic,
    PhysicalQuantity,
    WrongDimensions,
    evaluate,
    say,
)
from coursebuild.features.arithmetic.expressions import Expression, NotUnderstood
from coursebuild.features.arithmetic.statements import read_statements

_POINTS = 5
_CLOSE = 1e-12
_MOST_BITS = 1000
"""Of an exponent."""


def check_identity(tex: str, symbols: Mapping[str, Dimension]) -> Iterator[FormulaFinding]:
    """What does not hold, or is not understood, in a formula of these symbols."""
    statements = read_statements(tex)
    if not any(statement.relations for statement in statements):
        yield FormulaFinding("unread", 0, len(tex), "it is no equation")
    for statement in statements:
        for (left, right), relation in zip(
            pairwise(statement.sides), statement.relations, strict=True
        ):
            try:
                if relation != "=":
                    raise NotUnderstood("it is no equation", left.start, right.end)
                yield from _compare(left.understood(), right.understood(), symbols)
            except WrongDimensions as found:
                yield FormulaFinding("wrong", found.start, found.end, found.reason)
            except NotUnderstood as found:
                yield FormulaFinding("unread", found.start, found.end, found.reason)


def _compare(
    left: Expression, right: Expression, symbols: Mapping[str, Dimension]
) -> Iterator[FormulaFinding]:
    import mpmath

    left, right = _without_integral(left, right)
    right, left = _without_integral(right, left)
    used = {one.text for side in (left, right) for one in side.walk() if one.kind == "symbol"}
    names = sorted(used & symbols.keys())
    draw = random.Random(repr((left, right)))
    with mpmath.workdps(30):
        arithmetic = _precise(mpmath.mp)
        for _ in range(_POINTS):
            point = {name: mpmath.mpf(round(draw.uniform(0.5, 2), 3)) for name in names}
            values = {name: PhysicalQuantity(value, symbols[name]) for name, value in point.items()}
            one, other = (evaluate(side, values, arithmetic) for side in (left, right))
            if one.dimension != other.dimension and 0 not in (one.value, other.value):
                message = f"{say(one.dimension)} is held against {say(other.dimension)}"
                yield FormulaFinding("wrong", right.start, right.end, message)
                return
            if abs(one.value - other.value) > _CLOSE * (abs(one.value) + abs(other.value)):
                at = ", ".join(f"{name} = {float(value):g}" for name, value in point.items())
                sides = " and ".join(mpmath.nstr(side.value, 6) for side in (one, other))
                where = f" where {at}" if at else ""
                yield FormulaFinding(
                    "wrong", right.start, right.end, f"the sides are {sides}{where}"
                )
                return


def _without_integral(side: Expression, other: Expression) -> tuple[Expression, Expression]:
    """What an integral without limits is of, and the derivative of the other side."""
    if side.kind != "integral" or len(side.parts) > 2:
        return side, other
    what, by = side.parts
    return what, Expression("derivative", other.start, other.end, (other, by))


def _precise(mp: Any) -> Arithmetic:
    """Numbers of mpmath."""

    def power(base: Any, exponent: Any) -> Any:
        if exponent and mp.mag(exponent) > _MOST_BITS:
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
