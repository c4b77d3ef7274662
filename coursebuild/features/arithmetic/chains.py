r"""Checks arithmetic between numbers: compares each side of a chain of relations with the next.

Entry point: `check_arithmetic(tex)`.

1. One of two sides is a numeral, as `3.2\cdot10^{-4}\ \mathrm m`. The other must agree with its
   digits, within half a unit of the last place. After `=` a whole number is exact; after
   `\approx` its final zeros can be the result of rounding.
2. If some sides of a chain end in the same unit, and there is no other, it holds for all sides.
   Different units are converted.
"""

from __future__ import annotations

import functools
import operator
import re
from collections.abc import Iterator
from decimal import Decimal
from fractions import Fraction
from itertools import pairwise
from typing import Any, Literal

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.features.arithmetic.evaluate import describe_dimension, evaluate
from coursebuild.features.arithmetic.expressions import Expression, NotUnderstood
from coursebuild.features.arithmetic.statements import FormulaSide, Statement, read_statements

_RELATION = re.compile(r"[=<>≈≤≥≠]|\\(?:approx|sim|le|ge|ne|ll|gg)")
_CLOSE = 1e-12
_ORDER = {"<": operator.lt, ">": operator.gt, "≤": operator.le, "≥": operator.ge, "≠": operator.ne}


class FormulaComparison(Struct, frozen=True):
    """The result of comparing two sides of a formula, for a range of its TeX."""

    kind: Literal["holds", "wrong", "unread"]
    start: int
    end: int
    message: str = ""
    help: str = ""


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


@functools.lru_cache(maxsize=1024)
def check_arithmetic(tex: str) -> tuple[FormulaComparison, ...]:
    """Compare the numbers between which a formula states a relation."""
    if not _RELATION.search(tex) or not re.search("[0-9]", tex):
        return ()
    statements = read_statements(tex)
    return tuple(comparison for statement in statements for comparison in _check_chain(statement))


def _check_chain(statement: Statement) -> Iterator[FormulaComparison]:
    pairs = [*zip(pairwise(statement.sides), statement.relations, strict=False)]
    if not any(left.is_numeric and right.is_numeric for (left, right), _ in pairs):
        return
    strip = _strip_unit if _has_common_unit(statement.sides) else lambda expression: expression
    for (left, right), relation in pairs:
        if not (left.is_numeric and right.is_numeric):
            continue
        try:
            terms = strip(left.get_expression()), strip(right.get_expression())
            mistake = _find_mistake(*terms, relation)
        except NotUnderstood as error:
            mistake = FormulaComparison(error.kind, error.start, error.end, error.reason)
        yield mistake or FormulaComparison("holds", left.start, right.end)


def _has_common_unit(sides: tuple[FormulaSide, ...]) -> bool:
    """Whether sides end in the same unit, and there is no other in all of them."""
    expressions = [s.expression for s in sides if isinstance(s.expression, Expression)]
    parts = (part for expression in expressions for part in expression.walk())
    units = {part.text for part in parts if part.kind == "unit"}
    return len(units) == 1 and not any(_strip_unit(e).has("unit") for e in expressions)


def _strip_unit(expression: Expression) -> Expression:
    """Return an expression without the unit at its end."""
    kind, parts = expression.kind, expression.parts
    if kind == "-" and len(parts) == 1:
        return replace(expression, parts=(_strip_unit(parts[0]),))
    has_unit = kind == "*" and parts[1].kind == "unit" and parts[1].text not in ("%", "deg")
    return parts[0] if has_unit else expression


def _find_mistake(left: Expression, right: Expression, relation: str) -> FormulaComparison | None:
    """Return a comparison that is wrong if a relation does not hold; `None` if it does."""
    if relation == "?":
        raise right.not_understood("the relation says too little")
    values = evaluate(left), evaluate(right)
    if values[0].dimension != values[1].dimension:
        message = " is held against ".join(describe_dimension(value.dimension) for value in values)
        return FormulaComparison("wrong", right.start, right.end, message)
    if relation in _ORDER:
        if _ORDER[relation](values[0].value, values[1].value):
            return None
        numbers = [_format_number(value.value) for value in values]
        message = f"{numbers[0]} {relation} {numbers[1]} does not hold"
        return FormulaComparison("wrong", right.start, right.end, message)
    numerals = [(i, n) for i, e in enumerate((left, right)) if (n := _read_numeral(e))]
    if not numerals:
        if relation == "≈":
            raise right.not_understood("neither side is a number whose digits could be compared")
        if _is_close(values[0].value, values[1].value):
            return None
        numbers = [_format_number(value.value) for value in values]
        message = f"{numbers[0]} and {numbers[1]} are not the same"
        return FormulaComparison("wrong", right.start, right.end, message)
    index, numeral = max(numerals, key=lambda item: (item[1].step, item[0]))  # the coarser one
    side, value = (left, right)[index], values[1 - index].value
    if _agrees(numeral, value, relation):
        return None
    digits = max(numeral.digits + 2, 4)
    message = f"{_format_number(value / numeral.unit_size, digits)} comes out, and not this"
    is_rounded = numeral.is_whole and relation == "=" and _agrees(numeral, value, "≈")
    help = "write `\\approx` where a whole number is rounded" if is_rounded else ""
    return FormulaComparison("wrong", side.start, side.end, message, help)


def _format_number(value: Any, digits: int = 10) -> str:
    if isinstance(value, Fraction):
        value = Decimal(value.numerator) / Decimal(value.denominator)
    return f"{value:.{digits}g}"


def _agrees(numeral: Numeral, value: Any, relation: str) -> bool:
    """Whether a value, rounded to the digits of a numeral, is that number."""
    is_exact = isinstance(value, Fraction) and isinstance(numeral.value, Fraction)
    if numeral.is_whole and relation == "=":
        return value == numeral.value if is_exact else _is_close(value, numeral.value)
    gap = 2 * abs(value - numeral.value)
    return bool(gap <= numeral.step if is_exact else gap <= numeral.step * (1 + 1e-9))


def _is_close(left: Any, right: Any) -> bool:
    return bool(abs(left - right) <= _CLOSE * max(abs(left), abs(right)))


def _read_numeral(expression: Expression) -> Numeral | None:
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
            numeral = _read_numeral(inner)
            return numeral and replace(numeral, value=-numeral.value)
        case Expression(kind="^", parts=(Expression(kind="number", text="10"), _)):
            size = evaluate(expression).value
            return Numeral(size, size, True, 1, Fraction(1))
        case Expression(kind="*", parts=(inner, Expression(kind="unit" | "^") as factor)):
            numeral, power = _read_numeral(inner), _read_numeral(factor)
            if numeral is None or (factor.kind == "^" and (power is None or numeral.digits == 0)):
                return None
            size = evaluate(factor).value
            scaled = replace(numeral, value=numeral.value * size, step=numeral.step * size)
            if factor.kind == "^":
                return replace(scaled, is_whole=False)
            return replace(scaled, unit_size=size)
        case _:
            return None
