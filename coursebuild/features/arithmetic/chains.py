r"""Checks arithmetic between numbers: compares each side of a chain of relations with the next.

Entry point: `check_arithmetic(tex, symbols, unit)`.

1. One of two sides is a numeral, as `3.2\cdot10^{-4}\ \mathrm m`. The other must agree with its
   digits, within half a unit of the last place. After `=` a whole number is exact; after
   `\approx` its final zeros can be the result of rounding.
2. If some sides of a chain end in the same unit, and there is no other, it holds for all sides.
   Different units are converted.
3. A side with symbols is computed if all of them have a value. A number that leaves out its unit
   has that of the chain, or of the symbol alone on one side, or is in base units.
4. Units of sides with symbols are compared if all of them have one. What can be a number whose unit
   is left out, as in `F = 9.81 m`, is no mistake.
"""

from __future__ import annotations

import functools
import operator
import re
from collections.abc import Iterator, Mapping

from msgspec.structs import replace

from coursebuild.features.arithmetic.evaluate import (
    describe_dimension,
    evaluate,
)
from coursebuild.features.arithmetic.expressions import Expression, NotUnderstood
from coursebuild.features.arithmetic.numerals import (
    FormulaComparison,
    agrees,
    format_number,
    is_close,
    read_numeral,
)
from coursebuild.features.arithmetic.statements import FormulaSide, Statement, read_statements
from coursebuild.features.arithmetic.symbol_comparison import (
    NotJudged,
    SymbolComparison,
    SymbolQuantity,
)

_RELATION = re.compile(r"[=<>≈≤≥≠]|\\(?:approx|sim|le|ge|ne|ll|gg)")
_ORDER = {"<": operator.lt, ">": operator.gt, "≤": operator.le, "≥": operator.ge, "≠": operator.ne}


def check_arithmetic(
    tex: str, symbols: tuple[SymbolQuantity, ...] = (), unit: str = ""
) -> tuple[FormulaComparison, ...]:
    """Compare the numbers, and the symbols, between which a formula states a relation.

    `unit`: what follows the formula in the text.
    """
    if not _RELATION.search(tex) or not (symbols or re.search("[0-9]", tex)):
        return ()
    return _check_formula(tex, symbols, unit)


@functools.lru_cache(maxsize=1024)
def _check_formula(
    tex: str, symbols: tuple[SymbolQuantity, ...], unit: str
) -> tuple[FormulaComparison, ...]:
    statements = read_statements(tex)
    by_name = {symbol.name: symbol for symbol in symbols}
    return tuple(
        comparison
        for statement in statements
        for comparison in _check_chain(
            statement, by_name, unit if statement is statements[-1] else ""
        )
    )


def _check_chain(
    statement: Statement, symbols: Mapping[str, SymbolQuantity], unit: str
) -> Iterator[FormulaComparison]:
    has_common_unit: bool | None = None
    for i, relation in enumerate(statement.relations):
        left, right = statement.sides[i : i + 2]
        try:
            if left.is_numeric and right.is_numeric:
                if has_common_unit is None:
                    has_common_unit = _has_common_unit(statement.sides)
                terms = left.get_expression(), right.get_expression()
                terms = (_strip_unit(terms[0]), _strip_unit(terms[1])) if has_common_unit else terms
                mistake = _find_mistake(*terms, relation)
            elif symbols and relation != "?":
                follows = unit if right is statement.sides[-1] else ""
                mistake = SymbolComparison(statement, i, symbols, follows).find_mistake()
            else:
                continue
        except NotJudged:
            continue
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
        numbers = [format_number(value.value) for value in values]
        message = f"{numbers[0]} {relation} {numbers[1]} does not hold"
        return FormulaComparison("wrong", right.start, right.end, message)
    numerals = [(i, n) for i, e in enumerate((left, right)) if (n := read_numeral(e))]
    if not numerals:
        if relation == "≈":
            raise right.not_understood("neither side is a number whose digits could be compared")
        if is_close(values[0].value, values[1].value):
            return None
        numbers = [format_number(value.value) for value in values]
        message = f"{numbers[0]} and {numbers[1]} are not the same"
        return FormulaComparison("wrong", right.start, right.end, message)
    index, numeral = max(numerals, key=lambda item: (item[1].step, item[0]))  # the coarser one
    side, value = (left, right)[index], values[1 - index].value
    if agrees(numeral, value, relation):
        return None
    digits = max(numeral.digits + 2, 4)
    message = f"{format_number(value / numeral.unit_size, digits)} is the result, not this"
    is_rounded = numeral.is_whole and relation == "=" and agrees(numeral, value, "≈")
    help = "write `\\approx` where a whole number is rounded" if is_rounded else ""
    return FormulaComparison("wrong", side.start, side.end, message, help)
