r"""Checks arithmetic between numbers: compares each side of a chain of relations with the next.

Entry point: `check_arithmetic(tex, symbols, unit)`.

1. One of two sides is a numeral, as `3.2\cdot10^{-4}\ \mathrm m`. The other must agree with its
   digits, within half a unit of the last place. After `=` a whole number is exact, but for one of
   two digits or more that comes of decimals, or that no decimal can be exactly; after `\approx` its
   final zeros can be the result of rounding.
2. If some sides of a chain end in the same unit, and there is no other, it holds for all sides.
   Different units are converted.
   A relation holds if it does so for one meaning of each unit that has several.
3. Sides with symbols are compared by `SymbolComparison`.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from fractions import Fraction

from msgspec.structs import replace

from coursebuild.core.text.unit_table import UNITS
from coursebuild.core.text.units import find_units
from coursebuild.features.arithmetic.evaluate import (
    ORDERS,
    UNDECIDED,
    FormulaComparison,
    PhysicalQuantity,
    Readings,
    evaluate,
    find_conflict,
    read_numeral,
    unit_readings,
)
from coursebuild.features.arithmetic.expressions import (
    CONSTANTS,
    OF_QUOTIENT,
    Expression,
    NotUnderstood,
)
from coursebuild.features.arithmetic.real import Real
from coursebuild.features.arithmetic.statements import (
    FormulaSide,
    Statement,
    point_decimals,
    read_statements,
    second_reading,
)
from coursebuild.features.arithmetic.symbol_comparison import (
    NotJudged,
    SymbolComparison,
    SymbolQuantity,
    agrees,
    choose_rounded,
    decide,
)


@functools.lru_cache(maxsize=1024)
def check_arithmetic(
    tex: str,
    symbols: tuple[SymbolQuantity, ...] = (),
    unit: str = "",
    comma: bool = False,
    has_word: bool = False,
) -> tuple[FormulaComparison, ...]:
    """Compare the numbers, and the symbols, between which a formula states a relation.

    `unit`: that which follows the formula in the text; `comma`: it may stand before decimals;
    `has_word`: a word follows that is no unit.
    """
    if not (symbols or re.search(r"\d", tex)):
        return ()
    comparisons = _check_statements(tex, symbols, unit, comma)
    is_wrong = any(comparison.kind == "wrong" for comparison in comparisons)
    if is_wrong and (unit or has_word) and _counts_what_follows(read_statements(tex, comma), unit):
        return (FormulaComparison("unread", 0, len(tex), "what follows may belong to its number"),)
    if is_wrong and comma and (reason := second_reading(tex)):
        return (FormulaComparison("unread", 0, len(tex), reason),)
    if is_wrong and not comma and point_decimals(tex, comma=True) != point_decimals(tex):
        as_decimals = _check_statements(tex, symbols, unit, comma=True)
        if all(comparison.kind != "wrong" for comparison in as_decimals):
            return (FormulaComparison("unread", 0, len(tex), "`{,}` may be a decimal point"),)
    return comparisons


def _check_statements(
    tex: str, symbols: tuple[SymbolQuantity, ...], unit: str, comma: bool
) -> tuple[FormulaComparison, ...]:
    statements = read_statements(tex, comma)
    by_name = {symbol.name: symbol for symbol in symbols}
    comparisons = tuple(
        comparison
        for statement in statements
        for comparison in _check_chain(
            statement, by_name, unit if statement is statements[-1] else ""
        )
    )
    pointed = point_decimals(tex, comma)
    comparisons = tuple(replace(c, end=_end_of_number(tex, pointed, c.end)) for c in comparisons)
    rests = [statement.sides[0] for statement in statements if not statement.relations]
    if any(c.kind == "wrong" for c in comparisons) and any(
        isinstance(rest.expression, NotUnderstood) for rest in rests
    ):  # as `\quad(\mathrm{mod}\ 12)` or `\quad\text{is false}`
        return (FormulaComparison("unread", 0, len(tex), "a part of it may say how it is meant"),)
    return comparisons


def _end_of_number(tex: str, pointed: str, end: int) -> int:
    """Where what ends at `end` of a formula with points ends in the formula as it is written."""
    while end < len(tex) and pointed[end] == " " != tex[end]:
        end += 1
    return end


def _check_chain(
    statement: Statement, symbols: Mapping[str, SymbolQuantity], unit: str
) -> Iterator[FormulaComparison]:
    earlier: list[Expression] = []
    for i, relation in enumerate(statement.relations):
        left, right = statement.sides[i : i + 2]
        try:
            if _is_of_numbers(left, symbols) and _is_of_numbers(right, symbols):
                first, second = left.get_expression(), right.get_expression()
                if _has_common_unit(statement.sides):
                    first, second = _strip_unit(first), _strip_unit(second)
                earlier = [*earlier, first] if relation in ("=", "≈") else []
                mistake = _find_mistake(first, second, relation)
                if mistake:
                    if None in (_find_mistake(side, second, relation) for side in earlier):
                        continue  # `20/3 = 3.33\cdot2 = 6.67`
                    # A letter may stand for anything, as in `\pi = 0.5` or `\pi^1 = 0.5`.
                    bases = {
                        (
                            term.parts[0]
                            if term.kind == "^" and term.parts[1].text.isdigit()
                            else term
                        ).text
                        for term in (first, second)
                    }
                    letter = min(CONSTANTS & bases, default="")
                    reason = "it says what the letter stands for"
                    if letter or (reason := _other_reading(left, right, relation)):
                        mistake = FormulaComparison("unread", left.start, right.end, reason, letter)
            elif symbols and relation not in ("?", "≡"):
                follows = unit if right is statement.sides[-1] else ""
                mistake = SymbolComparison(statement, i, symbols, follows).find_mistake()
            else:
                continue
        except NotJudged:
            continue
        except NotUnderstood as error:
            mistake = FormulaComparison(error.kind, error.start, error.end, error.reason)
        sign = left.end, right.start
        yield mistake or FormulaComparison("holds", left.start, right.end, sign=sign)


def _counts_what_follows(statements: Sequence[Statement], unit: str) -> bool:
    """Whether the last number is right if what follows multiplies it: `8^8 ≈ 17` million, `25` %.

    A word may be one of a number, which are powers of ten from a hundred on.
    """
    sides = statements[-1].sides[-2:]
    if len(sides) < 2 or not all(side.is_numeric for side in sides):
        return False
    factors = [reading.size for reading in find_units(unit)] if unit else _NUMBER_WORDS
    try:
        left, right = (side.get_expression() for side in sides)
        numeral = read_numeral(right)
        if numeral is None or (left.has("unit") and not unit):
            return False
        value, of_decimals = evaluate(left).value, left.has_decimals()
    except NotUnderstood:
        return False
    relation = statements[-1].relations[-1]
    return any(
        agrees(numeral, value / Real.of(factor), relation, of_decimals=of_decimals)
        for factor in factors
    )


def _other_reading(left: FormulaSide, right: FormulaSide, relation: str) -> str:
    r"""Return how a wrong relation may be meant; empty where numbers are what they say.

    `0 = 1` and `4.5\ \mathrm m = 0` end a proof by contradiction, and of whole numbers `/` may be a
    division without rest.
    """
    sides = left.get_expression(), right.get_expression()
    if _says_how_many(*sides):
        return "it says how many one of them is"
    if _may_hold(sides, relation):
        return "its unit may be that of another part"
    if _holds_in_base_units(*sides, relation) or _holds_in_base_units(*sides[::-1], relation):
        return "the number without a unit may be in base units"
    units = (part.text for side in sides for part in side.walk() if part.kind == "unit")
    turns = [{n for u in find_units(t) for n, _ in u.powers} & {"angle", "cycle"} for t in units]
    if {"angle"} in turns and {"cycle"} in turns:
        return "turns stand beside angles"
    if relation == "≈":
        return ""
    first, second = (side.tex[side.start : side.end].strip(" .") for side in (left, right))
    if not re.fullmatch("[0-9]+", second):
        return ""
    if re.fullmatch("[0-9]+", first) or (second == "0" and read_numeral(sides[0])):
        return "there is nothing to compute"
    quotient = re.fullmatch(r"([0-9]+)\s*/\s*([1-9][0-9]*)", first)
    if quotient is not None and int(quotient[1]) // int(quotient[2]) == int(second):
        return "`/` may be the division of whole numbers"
    return ""


def _says_how_many(left: Expression, right: Expression) -> bool:
    r"""Whether `1\text{ dozen} = 12`, `2\text{ dozen} = 24` or `24 = 2\text{ dozen}`.

    Behind what is computed, as in `3\cdot4 = 12\text{ steps}`, a word says what is counted.
    """
    if left.ends_in_unit() and not right.has("unit"):
        return left.parts[0].text == "1" or not find_units(left.parts[1].text)
    if right.ends_in_unit() and not left.has("unit"):
        return left.kind == "number" and not find_units(right.parts[1].text)
    return False


def _is_of_numbers(side: FormulaSide, symbols: Mapping[str, SymbolQuantity]) -> bool:
    """Whether a side has numbers and no symbols; a constant is one if the lesson says so."""
    if not side.is_numeric or isinstance(side.expression, NotUnderstood):
        return side.is_numeric
    return not (side.expression.names() & symbols.keys())


_NUMBER_WORDS = [Fraction(10) ** power for power in range(2, 19)]
_OF_ONE_NUMBER = {"deg"} | {symbol for symbol, row in UNITS.items() if row.base == "1"}
"""Units that are part of their number, as % is: no other side leaves them out."""


def _has_common_unit(sides: tuple[FormulaSide, ...]) -> bool:
    """Whether sides end in the same unit, and there is no other in all of them."""
    expressions = [s.expression for s in sides if isinstance(s.expression, Expression)]
    parts = (part for expression in expressions for part in expression.walk())
    units = {part.text for part in parts if part.kind == "unit"}
    return len(units) == 1 and not any(_strip_unit(e).has("unit") for e in expressions)


def _strip_unit(expression: Expression, whole: Collection[str] = _OF_ONE_NUMBER) -> Expression:
    """Return an expression without the unit at its end, but for units in `whole`."""
    kind, parts = expression.kind, expression.parts
    if kind == "-" and len(parts) == 1:
        return replace(expression, parts=(_strip_unit(parts[0], whole),))
    return parts[0] if expression.ends_in_unit() and parts[1].text not in whole else expression


def _may_hold(sides: tuple[Expression, Expression], relation: str) -> bool:
    r"""Whether a relation holds where a unit is of more or less than it stands behind.

    `1/50\ \mathrm{Hz}` may divide by hertz, `2\cdot45 = 90^\circ` be of degrees; not one number.
    """
    pairs = [(_divide_by_unit(sides[0]), _divide_by_unit(sides[1]))]
    bare = [side for side in sides if not side.has("unit")]
    if len(bare) == 1 and bare[0].parts and not bare[0].has("symbol"):
        pairs.append((_strip_unit(sides[0], ()), _strip_unit(sides[1], ())))
    try:
        return any(_find_mistake(*pair, relation) is None for pair in pairs if pair != sides)
    except NotUnderstood:
        return False


def _holds_in_base_units(bare: Expression, quantity: Expression, relation: str) -> bool:
    r"""Whether a number is that of a quantity in base units: `2\cdot3000 = 6\,\mathrm{kW}`."""
    if quantity.kind == "-" and len(quantity.parts) == 1:
        return _holds_in_base_units(replace(quantity, parts=(bare,)), quantity.parts[0], relation)
    if relation in ORDERS or bare.has("unit") or not quantity.ends_in_unit():
        return False
    numeral = read_numeral(quantity) if find_units(quantity.parts[1].text) else None
    if numeral is None:
        return False
    value, of_decimals = evaluate(bare).value, bare.has_decimals()
    return agrees(numeral, value, relation, of_decimals=of_decimals) is True


def _divide_by_unit(expression: Expression) -> Expression:
    """Return a quotient with a unit, as `1/50 Hz`, with the unit as a part of what divides."""
    if expression.text != OF_QUOTIENT:
        return expression
    quotient, unit = expression.parts
    divisor = replace(expression, parts=(quotient.parts[1], unit), text="")
    return replace(quotient, parts=(quotient.parts[0], divisor))


def _find_mistake(left: Expression, right: Expression, relation: str) -> FormulaComparison | None:
    """Return a comparison that is wrong if a relation does not hold; `None` if it does.

    It holds if it does so for any meaning of its units.

    Raises:
        NotUnderstood: this is not certain.
    """
    if relation in ("?", "≡"):
        raise right.not_understood("the relation says too little")
    mistakes: list[FormulaComparison | NotUnderstood] = []
    for readings in unit_readings(left, right):
        try:
            mistake = _find_mistake_as_read(left, right, relation, readings)
        except NotUnderstood as error:
            mistakes.append(error)
            continue
        if mistake is None:
            return None
        mistakes.append(mistake)
    unread = (mistake for mistake in mistakes if mistake.kind == "unread")
    worst = next(unread, mistakes[0])
    if isinstance(worst, NotUnderstood):
        raise worst
    return worst


def _find_mistake_as_read(
    left: Expression, right: Expression, relation: str, readings: Readings
) -> FormulaComparison | None:
    quantities = [evaluate(side, readings=readings) for side in (left, right)]
    values = [quantity.value for quantity in quantities]
    if conflict := find_conflict(*quantities, zero_fits=False):
        return FormulaComparison("wrong", right.start, right.end, conflict)
    numerals = {
        i: numeral
        for i, side in enumerate((left, right))
        if (numeral := read_numeral(side, readings))
    }
    if relation in ORDERS or not numerals:
        if relation == "≈":
            raise right.not_understood("neither side is a number whose digits could be compared")
        sign = (values[0] - values[1]).sign()
        if sign is None:
            raise right.not_understood(UNDECIDED)
        if ORDERS[relation](sign, 0) if relation in ORDERS else sign == 0:
            return None
        if relation == "=":  # as `100\cdot1.05^2 = 100\cdot1.1`
            numbers = {part.text for part in left.walk()}
            decimals = {
                part.text: PhysicalQuantity(numeral.value.widen(numeral.step))
                for part in right.walk()
                if part.text not in numbers
                and (numeral := read_numeral(part, readings))
                and not numeral.is_whole
            }
            value = evaluate(right, decimals, readings=readings).value
            if (value - values[0]).sign() is None:
                raise right.not_understood("its decimals may be rounded")
        message = f"{values[0]:.10g} {relation} {values[1]:.10g} does not hold"
        return FormulaComparison("wrong", right.start, right.end, message)
    index = choose_rounded(numerals, relation)
    numeral, side, value = numerals[index], (left, right)[index], values[1 - index]
    has_scale = any(number.zero.sign() for number in numerals.values())  # that begins at 273.15 K
    may_be = {i: n for i, n in numerals.items() if i == index or (n.is_whole and numeral.is_whole)}
    for i, rounded in may_be.items():
        of_decimals = has_scale or (left, right)[1 - i].has_decimals()
        if decide(agrees(rounded, values[1 - i], relation, of_decimals=of_decimals), right):
            return None
    if len(numerals) == 2 and not any(n.is_whole for n in numerals.values()):
        a, b = numerals.values()
        pairs = (a.unit_size, b.unit_size), (a.step, b.step)
        is_converted = all((x - y).sign() != 0 for x, y in pairs)
        if is_converted and (a.value.widen(a.step) - b.value.widen(b.step)).sign() is None:
            return None  # one number rounds to both: 8.3144 J are 0.082057 L atm
    result = f"{numeral.express(value):.{max(numeral.digits + 2, 4)}g}"
    is_rounded = numeral.is_whole and relation == "=" and agrees(numeral, value, "≈")
    help = "write `\\approx` where a whole number is rounded" if is_rounded else ""
    message = f"the result is {result}, not this"
    return FormulaComparison("wrong", side.start, side.end, message, help=help, result=result)
