r"""Arithmetic between numbers: each side of a chain of relations computed, and held to the next.

Entry point: `check_arithmetic(tex)`.

1. Of two sides one shows a number, as `3.2\cdot10^{-4}\ \mathrm m`, and the other must come to it
   to the digits shown: within half a unit of the last place. After `=` a whole number is exact;
   after `\approx` its zeros at the end need not be.
2. A unit that is the only one of a chain, behind some of its sides, holds for all of them.
   Different units are converted.
"""

from __future__ import annotations

import functools
import operator
import re
from collections.abc import Iterator
from decimal import Decimal
from fractions import Fraction
from typing import Any, Literal

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.features.arithmetic.evaluate import WrongDimensions, evaluate, say
from coursebuild.features.arithmetic.expressions import Expression, NotUnderstood
from coursebuild.features.arithmetic.statements import FormulaSide, Statement, read_statements

_RELATION = re.compile(r"[=<>≈≤≥≠]|\\(?:approx|sim|le|ge|ne|ll|gg)")
_CLOSE = 1e-12
_ORDER = {"<": operator.lt, ">": operator.gt, "≤": operator.le, "≥": operator.ge, "≠": operator.ne}


class FormulaFinding(Struct, frozen=True):
    """What was found of two sides of a formula, at a stretch of its TeX."""

    kind: Literal["holds", "wrong", "unread"]
    start: int
    end: int
    message: str = ""
    help: str = ""


class ShownNumber(Struct, frozen=True):
    """A number as it is written."""

    value: Any
    step: Any
    """One unit of its last place."""
    whole: bool
    """Whether it has neither a point nor a power of ten."""
    digits: int
    size: Any
    """How large its unit is."""


@functools.lru_cache(maxsize=1024)
def check_arithmetic(tex: str) -> tuple[FormulaFinding, ...]:
    """What was found of the numbers that a formula holds against each other."""
    if not _RELATION.search(tex) or not re.search("[0-9]", tex):
        return ()
    return tuple(found for one in read_statements(tex) for found in _chain(one))


def _chain(statement: Statement) -> Iterator[FormulaFinding]:
    sides = _without_common_unit(statement.sides)
    for left, right, relation in zip(sides, sides[1:], statement.relations, strict=False):
        if not (left.numeric and right.numeric):
            continue
        try:
            wrong = _mistake(left.understood(), right.understood(), relation)
        except WrongDimensions as found:
            yield FormulaFinding("wrong", found.start, found.end, found.reason)
        except NotUnderstood as found:
            yield FormulaFinding("unread", found.start, found.end, found.reason)
        else:
            if wrong is None:
                yield FormulaFinding("holds", left.start, right.end)
            else:
                yield FormulaFinding("wrong", *wrong)


def _without_common_unit(sides: tuple[FormulaSide, ...]) -> tuple[FormulaSide, ...]:
    """The sides without their unit, where no other unit is in any of them."""
    known = [s.expression for s in sides if isinstance(s.expression, Expression)]
    units = {one.text for side in known for one in side.walk() if one.kind == "unit"} - {"%", "deg"}
    if len(units) != 1 or any(s.has("unit") for s in map(_bare, known)):
        return sides
    return tuple(
        replace(s, expression=_bare(s.expression)) if isinstance(s.expression, Expression) else s
        for s in sides
    )


def _bare(one: Expression) -> Expression:
    """An expression without the unit at its end."""
    if one.kind == "-" and len(one.parts) == 1:
        return replace(one, parts=(_bare(one.parts[0]),))
    is_unit = one.kind == "*" and one.parts[1].kind == "unit"
    return one.parts[0] if is_unit and one.parts[1].text not in ("%", "deg") else one


def _mistake(
    left: Expression, right: Expression, relation: str
) -> tuple[int, int, str, str] | None:
    """Where two numbers do not stand in a relation, why, and what mends it; `None` if they do."""
    if relation == "?":
        raise right.not_understood("the relation says too little")
    values = evaluate(left), evaluate(right)
    if values[0].dimension != values[1].dimension:
        message = " is held against ".join(say(value.dimension) for value in values)
        return right.start, right.end, message, ""
    if relation in _ORDER:
        if _ORDER[relation](values[0].value, values[1].value):
            return None
        message = f"{_digits(values[0].value)} {relation} {_digits(values[1].value)} does not hold"
        return right.start, right.end, message, ""
    shown = [(n, number) for n, one in enumerate((left, right)) if (number := _shown(one))]
    if not shown:
        if relation == "≈":
            raise right.not_understood("neither side is a number whose digits could be compared")
        if _is_close(values[0].value, values[1].value):
            return None
        message = f"{_digits(values[0].value)} and {_digits(values[1].value)} are not the same"
        return right.start, right.end, message, ""
    at, number = max(shown, key=lambda one: (one[1].step, one[0]))
    if _shows(number, values[1 - at].value, relation):
        return None
    place = (left, right)[at]
    digits = max(number.digits + 2, 4)
    message = f"{_digits(values[1 - at].value / number.size, digits)} comes out, and not this"
    rounded = number.whole and relation == "=" and _shows(number, values[1 - at].value, "≈")
    help = "write `\\approx` where a whole number is rounded" if rounded else ""
    return place.start, place.end, message, help


def _digits(value: Any, digits: int = 10) -> str:
    if isinstance(value, Fraction):
        value = Decimal(value.numerator) / Decimal(value.denominator)
    return f"{value:.{digits}g}"


def _shows(number: ShownNumber, value: Any, relation: str) -> bool:
    """Whether a value, rounded to the digits of a number, is the number."""
    exact = isinstance(value, Fraction) and isinstance(number.value, Fraction)
    if number.whole and relation == "=":
        return value == number.value if exact else _is_close(value, number.value)
    gap = 2 * abs(value - number.value)
    return bool(gap <= number.step if exact else gap <= number.step * (1 + 1e-9))


def _is_close(left: Any, right: Any) -> bool:
    return bool(abs(left - right) <= _CLOSE * max(abs(left), abs(right)))


def _shown(one: Expression) -> ShownNumber | None:
    """The number that an expression is, if it is one as people write them."""
    match one:
        case Expression(kind="number", text=text):
            whole, _, decimals = text.partition(".")
            is_whole = "." not in text
            zeros = len(whole) - len(whole.rstrip("0")) if is_whole and whole.strip("0") else 0
            step = Fraction(10) ** (zeros - len(decimals))
            digits = len(text.replace(".", "").lstrip("0")) or 1
            return ShownNumber(Fraction(text), step, is_whole, digits, Fraction(1))
        case Expression(kind="-", parts=(inner,)):
            found = _shown(inner)
            return found and replace(found, value=-found.value)
        case Expression(kind="^", parts=(Expression(kind="number", text="10"), _)):
            size = evaluate(one).value
            return ShownNumber(size, size, True, 1, Fraction(1))
        case Expression(kind="*", parts=(inner, Expression(kind="unit" | "^") as factor)):
            found, power = _shown(inner), _shown(factor)
            if found is None or (factor.kind == "^" and (power is None or found.digits == 0)):
                return None
            size = evaluate(factor).value
            scaled = replace(found, value=found.value * size, step=found.step * size)
            if factor.kind == "^":
                return replace(scaled, whole=False)
            return replace(scaled, size=size)
        case _:
            return None
