r"""Tries an identity between symbols at points of its domain.

Entry points: `read_domain(text)`, of `x > 0, 0 \le y < 1`; `check_identity(tex, symbols, domain)`.

Both sides are computed at the same points, with dimensions: whole numbers, tiny and large ones, of
both signs where the domain has them. Points where a side is no real number do not count. If the
balls of both sides have no number in common, the identity is refuted, and the point is told. If
they agree at all points, it was tried, and not proven. Where one side is an integral without
limits, its integrand is compared with the derivative of the other side.
"""

from __future__ import annotations

import random
from collections.abc import Iterator, Mapping
from decimal import Decimal
from fractions import Fraction
from itertools import pairwise

from msgspec import Struct

from coursebuild.core.model import IDENTITY_POINTS
from coursebuild.core.text.units import Dimension
from coursebuild.features.arithmetic.evaluate import (
    ORDERS,
    UNDECIDED,
    FormulaComparison,
    PhysicalQuantity,
    WrongDimensions,
    evaluate,
    find_conflict,
)
from coursebuild.features.arithmetic.expressions import Expression, NotUnderstood
from coursebuild.features.arithmetic.real import Real
from coursebuild.features.arithmetic.statements import Statement, read_statements

_CANDIDATES = 60 * IDENTITY_POINTS
_Point = dict[str, Fraction]


class Domain(Struct, frozen=True):
    """Conditions on the symbols of an identity."""

    statements: tuple[Statement, ...] = ()

    def conditions(self) -> Iterator[tuple[Expression, str, Expression]]:
        """Yield each pair of sides with the relation between them."""
        for statement in self.statements:
            for (left, right), relation in zip(
                pairwise(statement.sides), statement.relations, strict=True
            ):
                yield left.get_expression(), relation, right.get_expression()

    def contains(self, symbols: Mapping[str, PhysicalQuantity]) -> bool:
        """Whether all conditions certainly hold."""
        for left, relation, right in self.conditions():
            sides = evaluate(left, symbols), evaluate(right, symbols)
            if conflict := find_conflict(*sides):
                raise right.not_understood(conflict)
            sign = (sides[0].value - sides[1].value).sign()
            if sign is None or not ORDERS[relation](sign, 0):
                return False
        return True

    def bounds(self) -> tuple[_Point, _Point]:
        """Return the largest lower and the smallest upper bound that numbers give to symbols."""
        lower: _Point = {}
        upper: _Point = {}
        for left, relation, right in self.conditions():
            for symbol, side, below in ((left, right, "<≤"), (right, left, ">≥")):
                if symbol.kind != "symbol" or side.names() or relation == "≠":
                    continue
                bound = Fraction(float(evaluate(side).value)).limit_denominator(10**9)
                name, is_upper = symbol.text, relation in below
                limits, choose = (upper, min) if is_upper else (lower, max)
                limits[name] = choose(limits.get(name, bound), bound)
        return lower, upper


def read_domain(text: str) -> Domain:
    """Read conditions, with commas between them.

    Raises:
        NotUnderstood: they are no conditions.
    """
    domain = Domain(read_statements(text) if text.strip() else ())
    if text.strip() and not any(True for _ in domain.conditions()):
        raise NotUnderstood("it is no condition", 0, len(text))
    for left, relation, right in domain.conditions():
        if relation not in ORDERS:
            raise NotUnderstood("it is no condition", left.start, right.end)
    domain.bounds()
    return domain


def check_identity(
    tex: str, symbols: Mapping[str, Dimension], domain: Domain | None = None
) -> Iterator[FormulaComparison]:
    """Yield the comparisons of a formula's sides that fail or are not understood."""
    statements = read_statements(tex)
    if not any(statement.relations for statement in statements):
        yield FormulaComparison("unread", 0, len(tex), "it is not an equation")
    for statement in statements:
        for (left, right), relation in zip(
            pairwise(statement.sides), statement.relations, strict=True
        ):
            try:
                if relation not in ("=", "≡"):
                    raise NotUnderstood("it is not an equation", left.start, right.end)
                sides = left.get_expression(), right.get_expression()
                _try_identity(*sides, symbols, domain or Domain())
            except NotUnderstood as error:
                help = _DOMAIN_HELP if isinstance(error, _Refuted) else ""
                yield FormulaComparison(error.kind, error.start, error.end, error.reason, help=help)


_DOMAIN_HELP = 'name the domain in its label, as in `check="x > 0"`'


class _Refuted(NotUnderstood):
    """The sides differ at a point."""

    kind = "wrong"


def _try_identity(
    left: Expression, right: Expression, symbols: Mapping[str, Dimension], domain: Domain
) -> None:
    """Compare two sides at points.

    Raises:
        NotUnderstood: they differ, or there are too few points where they can be compared.
    """
    left, right = _without_integral(left, right)
    right, left = _without_integral(right, left)
    parts = [*left.walk(), *right.walk()]
    for condition in domain.conditions():
        parts += [*condition[0].walk(), *condition[2].walk()]
    for part in parts:
        if part.kind == "symbol" and part.text not in symbols:
            evaluate(part)
    names = sorted({part.text for part in parts if part.kind == "symbol"} & symbols.keys())
    if not names:
        raise NotUnderstood("it has no symbol; leave out `check`", left.start, right.end)
    count, skip = 0, NotUnderstood("no point is in its domain", right.start, right.end)
    matters = left.names() | right.names()  # unlike what is integrated over
    agreements: set[tuple[Fraction, ...]] = set()
    skip_count = 0
    is_slow = left.has("integral") or right.has("integral")
    for point in _points(names, domain, random.Random(repr((left, right))), is_slow):
        values = {name: PhysicalQuantity(Real.of(x), symbols[name]) for name, x in point.items()}
        key = tuple(value for name, value in point.items() if name in matters)
        try:
            if not domain.contains(values):
                continue
            if key not in agreements:
                lhs, rhs = (evaluate(side, values) for side in (left, right))
                if conflict := find_conflict(lhs, rhs):
                    raise WrongDimensions(conflict, right.start, right.end)
                difference = lhs.value - rhs.value
                if difference.sign():
                    texts = ", ".join(f"{name} = {x.value:.6g}" for name, x in values.items())
                    numbers = " and ".join(_format_apart(lhs.value, rhs.value))
                    reason = f"the sides are {numbers} where {texts}"
                    raise _Refuted(reason, right.start, right.end)
                if not difference.is_negligible(lhs.value, rhs.value):
                    raise right.not_understood(UNDECIDED)
                agreements.add(key)
            count += 1
        except NotUnderstood as error:
            if error.kind == "wrong":
                raise
            skip, skip_count = error, skip_count + 1
        if count == IDENTITY_POINTS:
            return
        if is_slow and skip_count > count + 8:
            break
    if count:
        reason = f"it can be tried at {count} points only: elsewhere {skip.reason}"
        raise NotUnderstood(reason, skip.start, skip.end)
    raise skip


def _format_apart(left: Real, right: Real) -> tuple[str, str]:
    """Return two numbers in as many digits as show that they differ."""
    texts = [(f"{left:.{digits}g}", f"{right:.{digits}g}") for digits in (6, 17, 40)]
    return next((pair for pair in texts if Decimal(pair[0]) != Decimal(pair[1])), texts[-1])


def _points(
    names: list[str], domain: Domain, generator: random.Random, is_slow: bool
) -> Iterator[_Point]:
    """Yield different points that may lie in the domain."""
    lower, upper = domain.bounds()
    points: set[tuple[Fraction, ...]] = set()
    kinds = _SIZES[:-1] if is_slow else _SIZES  # integrals up to large numbers take long
    for number in range(2 * IDENTITY_POINTS if is_slow else _CANDIDATES):
        sizes = kinds[number % 5 : number % 5 + 1] or kinds
        point: _Point = {}
        for name in names:
            size = generator.choice(sizes)(generator)
            if name in lower and name in upper:
                share = min(size, generator.choice((1, Fraction(1, 3) + size % 1 / 2)))
                share = generator.choice((share, 1 - share))
                point[name] = lower[name] + (upper[name] - lower[name]) * share
            elif name in lower or name in upper:
                point[name] = lower[name] + size if name in lower else upper[name] - size
            else:
                point[name] = size * generator.choice((1, 1, -1))
        if tuple(point.values()) not in points:
            points.add(tuple(point.values()))
            yield point


_SIZES = (
    lambda generator: Fraction(generator.randint(1, 3000), 1000),
    lambda generator: Fraction(generator.randint(0, generator.choice((6, 100)))),
    lambda generator: Fraction(generator.randint(1, 9), 10 ** generator.randint(2, 9)),
    lambda generator: Fraction(generator.randint(10, 99) * 10 ** generator.randint(1, 5), 7),
)
"""Numbers of the size of one, whole ones, tiny ones and large ones."""


def _without_integral(side: Expression, opposite: Expression) -> tuple[Expression, Expression]:
    """Differentiate both sides, if the first is an integral without limits."""
    if side.kind != "integral" or len(side.parts) > 2:
        return side, opposite
    integrand, variable = side.parts
    derivative = Expression("derivative", opposite.start, opposite.end, (opposite, variable))
    return integrand, derivative
