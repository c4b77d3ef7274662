"""Numbers as they are written, and what comparing two sides of a formula finds.

Entry points: `read_numeral(expression)`; `agrees`, `is_close`, `format_number`.
"""

from __future__ import annotations

from decimal import Decimal
from fractions import Fraction
from typing import Any, Literal

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.features.arithmetic.evaluate import evaluate
from coursebuild.features.arithmetic.expressions import Expression

_CLOSE = 1e-12


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
