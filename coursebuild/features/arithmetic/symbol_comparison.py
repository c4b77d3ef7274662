r"""Compares two sides of a relation, at least one of which has symbols, by their values and units.

Entry points: `SymbolComparison`; `SymbolQuantity`, what is known of a symbol; `agrees`, whether a
value is a number as it is written.

1. A side is computed if all of its symbols have a value. A number that leaves out its unit has that
   of the chain, or of the symbol alone on one side, or is in base units.
2. Units are compared if all symbols have one. What can be a number whose unit is left out, as in
   `F = 9.81 m`, is no mistake.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from fractions import Fraction

from msgspec import Struct

from coursebuild.core.text.units import Dimension, Unit, find_unit, find_units
from coursebuild.features.arithmetic.evaluate import (
    UNDECIDED,
    FormulaComparison,
    Numeral,
    PhysicalQuantity,
    WrongDimensions,
    describe_dimension,
    evaluate,
    has_zero,
    measure,
    read_numeral,
)
from coursebuild.features.arithmetic.expressions import CONSTANTS, Expression, NotUnderstood
from coursebuild.features.arithmetic.real import ONE, Real
from coursebuild.features.arithmetic.statements import FormulaSide, Statement


def decide(verdict: bool | None, place: Expression) -> bool:
    """Return a verdict if there is one.

    Raises:
        NotUnderstood: there is none.
    """
    if verdict is None:
        raise place.not_understood(UNDECIDED)
    return verdict


_LARGEST_COEFFICIENT = 12
"""A larger number may be a quantity whose unit is left out."""


class SymbolQuantity(Struct, frozen=True):
    """What a symbol stands for."""

    name: str
    unit_text: str
    unit: Unit | None
    """`None` if the text does not say it."""
    value: Real | None = None
    """In base units; `None` if it has none."""
    step: Real | None = None
    """One unit of the last place of its value; `None` if that is exact, as a whole number is."""
    text: str = ""
    """Its value as it is written."""


class NotJudged(Exception):  # noqa: N818  # it is no mistake
    """Nothing is known of the symbols of a relation, or it says nothing of their values."""


class SymbolComparison:
    """Compares two sides of a chain, at least one of which has symbols."""

    def __init__(
        self, chain: Statement, index: int, symbols: Mapping[str, SymbolQuantity], unit: str
    ) -> None:
        """`unit`: what follows the second side in the text."""
        self.chain, self.symbols = chain, symbols
        self.sides, self.relation = chain.sides[index : index + 2], chain.relations[index]
        self.unit, self.unit_text = find_unit(unit) if unit else None, unit
        is_equation = self.relation in ("=", "≈")
        self.is_claim = is_equation and any(side.is_numeric for side in self.sides)

    def find_mistake(self) -> FormulaComparison | None:
        """Return a comparison that is wrong if the relation does not hold.

        Where there is nothing to compare but dimensions, and these are the same, it fits.

        Raises:
            NotUnderstood: it states a number of symbols with values, and cannot be computed.
            NotJudged: there is nothing to compare.
        """
        try:
            mistake = self._find_mistake()
        except WrongDimensions:
            if not self.has_readings:
                raise
        else:
            if not self.mixes_turns and (mistake is None or not self.has_readings):
                return mistake
        raise self.expressions[1].not_understood("a unit in it has two readings")

    def _find_mistake(self) -> FormulaComparison | None:
        self.is_claim &= any(symbol.value is not None for symbol in self.symbols.values())
        try:
            self.expressions = [side.get_expression() for side in self.sides]
            self._find_symbols()
            try:
                quantities = self._evaluate()
            except WrongDimensions:
                self._pass_hidden_unit()
                raise
        except NotUnderstood as error:
            if self.is_claim or error.kind == "wrong":
                raise
            raise NotJudged from None
        has_calculus = any(e.has("derivative", "integral") for e in self.expressions)
        # A side of numbers alone may have left out its unit.
        pairs = enumerate(zip(self.sides, self.expressions, strict=True))
        bare = next((i for i, (s, e) in pairs if s.is_numeric and not e.has("unit")), None)
        dimensions = [quantity.dimension for quantity in quantities]
        if bare is not None:
            base = dimensions[1 - bare]
            is_foreign = self.unit is not None and self.unit.dimension != base
            dimensions[bare] = self.unit.dimension if self.unit and is_foreign else base
        if dimensions[0] != dimensions[1] and not has_zero(*quantities):
            zeros = (side.tex[side.start : side.end].strip(r" .,;~\!") for side in self.chain.sides)
            if {*self.chain.relations} == {"="} and "0" in zeros:
                raise NotJudged  # all of them are zero, as in `\dot x = x = 0`
            if bare is None:
                self._pass_hidden_unit()
            message = " is held against ".join(map(describe_dimension, dimensions))
            right = self.expressions[1]
            return FormulaComparison("wrong", right.start, right.end, message)
        if not self.has_values or self.relation not in ("=", "≈") or has_calculus:
            if bare is not None or has_zero(*quantities):
                raise NotJudged
            first, second = self.sides
            sign = first.end, second.start
            return FormulaComparison("fits", first.start, second.end, sign=sign)
        try:
            return self._compare_values(
                [quantity.value for quantity in quantities], bare, dimensions
            )
        except OverflowError:
            reason = "the numbers become too large"
            raise self.expressions[1].not_understood(reason) from None

    @property
    def has_readings(self) -> bool:
        """Whether a unit has several sizes, or its scale another zero than its quantity."""
        parts = [part for expression in self.expressions for part in expression.walk()]
        texts = {self.unit_text, *(part.text for part in parts if part.kind == "unit")}
        texts |= {symbol.unit_text for symbol in self.known.values()}
        units = map(find_units, texts)
        return any(len(group) > 1 or any(unit.zero for unit in group) for group in units)

    @property
    def mixes_turns(self) -> bool:
        """Whether cycles stand beside angles: `f = 50 rad/s`, but not `2\\pi f = 314 rad/s`."""
        pairs = zip(self.sides, self.expressions, strict=True)
        whole = (side for side, e in pairs if e.kind == "symbol" or read_numeral(e))
        units = self._units(*whole)
        return {"angle", "cycle"} <= {name for unit in units for name, _ in unit.powers}

    def _pass_hidden_unit(self) -> None:
        """Raise unless units that do not fit are a mistake for sure."""
        hidden = next(filter(_may_hide_unit, self.expressions), None)
        if hidden is not None:
            if self.is_claim:
                raise hidden.not_understood("a number in it may leave out its unit")
            raise NotJudged

    def _find_symbols(self) -> None:
        """Collect what is known of the symbols."""
        self.known: dict[str, SymbolQuantity] = {}
        missing: list[Expression] = []
        for part in (part for e in self.expressions for part in e.walk()):
            if part.kind != "symbol" or (part.text in CONSTANTS and part.text not in self.symbols):
                continue
            quantity = _find_symbol(part.text, self.symbols)
            if quantity is not None:
                self.known[part.text] = quantity
            if quantity is None or quantity.value is None:
                missing.append(part)
        self.has_values = not missing
        self.is_claim &= any(symbol.value is not None for symbol in self.known.values())
        if any(part.text not in self.known for part in missing) or (missing and self.is_claim):
            raise missing[0].not_understood(f"`{missing[0].text}` has no value here")

    def _evaluate(self, is_rounded: bool = False) -> list[PhysicalQuantity]:
        """Return the quantities of both sides; without values, of any for which there are some.

        `is_rounded`: of all values that are rounded to those of the symbols.
        """
        for attempt in range(1 if self.has_values else 4):
            quantities = {}
            for number, (name, symbol) in enumerate(self.known.items(), 1):
                value = Real.of(Fraction(500 + (618 * number + 370 * attempt) % 1500, 1000))
                if self.has_values and symbol.value is not None:
                    value = symbol.value
                    if is_rounded and symbol.step is not None:
                        value = value.widen(symbol.step)
                dimension = symbol.unit.dimension if symbol.unit is not None else ()
                quantities[name] = PhysicalQuantity(value, dimension)
            try:
                return [evaluate(e, quantities, has_calculus=False) for e in self.expressions]
            except NotUnderstood as error:
                if self.has_values or error.kind == "wrong":
                    raise
        raise NotJudged

    def _compare_values(
        self, values: Sequence[Real], bare: int | None, dimensions: Sequence[Dimension]
    ) -> FormulaComparison | None:
        sizes = [ONE]
        if bare is not None:
            units = [self.unit] if self.unit is not None else [*self._units(*self.chain.sides)]
            sizes = [measure(u) for u in units if u.dimension == dimensions[1 - bare]]
            sizes += [] if self.unit is not None else [ONE]
        numerals = {i: n for i in (0, 1) if (n := self._numeral(i)) is not None}
        if not numerals and self.relation == "≈":
            raise NotJudged
        mistakes: list[FormulaComparison] = []
        for size in sizes:
            scaled = [v * size if i == bare else v for i, v in enumerate(values)]
            if not numerals:
                # They may agree where each value is rounded to half a unit of its place.
                rounded = [quantity.value for quantity in self._evaluate(is_rounded=True)]
                left, right = (v * size if i == bare else v for i, v in enumerate(rounded))
                sign = (left - right).sign()
                if sign is None and all(symbol.step is None for symbol in self.known.values()):
                    raise self.expressions[1].not_understood(UNDECIDED)
                if not sign:
                    return None
                numbers = " and ".join(f"{value:.10g}" for value in scaled)
                mistakes.append(self._mistake(1, f"{numbers} are not the same"))
                continue
            sized = {i: n.scale(size) if i == bare else n for i, n in numerals.items()}
            index = choose_rounded(sized, self.relation)
            numeral, unit_size = sized[index], size if index == bare else ONE
            value = scaled[1 - index]
            opposite = self.expressions[1 - index]
            symbols = (self.known[p.text] for p in opposite.walk() if p.text in self.known)
            of_decimals = opposite.has_decimals() or any(symbol.step for symbol in symbols)
            agreement = agrees(numeral, value, self.relation, of_decimals=of_decimals)
            if decide(agreement, self.expressions[1]):
                return None
            result = f"{numeral.express(value / unit_size):.{max(numeral.digits + 2, 4)}g}"
            mistakes.append(self._mistake(index, f"the result is {result}", result))
        return mistakes[0]

    def _mistake(self, index: int, message: str, result: str = "") -> FormulaComparison:
        """Return what is wrong with a side, with the values that the other side has."""
        side, opposite = self.expressions[index], self.expressions[1 - index]
        names = dict.fromkeys(part.text for part in opposite.walk() if part.text in self.known)
        conditions = " and ".join(f"`{name}` is {self.known[name].text}" for name in names)
        help = ""
        if opposite.kind == "symbol":
            help = "`{given}` after the formula gives the symbol another value in this section"
        message += f" where {conditions}" if conditions else ""
        message += ", not this" if result else ""
        return FormulaComparison("wrong", side.start, side.end, message, help=help, result=result)

    def _units(self, *sides: FormulaSide) -> Iterator[Unit]:
        """Yield the units that sides of the chain name."""
        for side in sides:
            if not isinstance(side.expression, Expression):
                continue
            alone = self.symbols.get(side.expression.text) if not side.expression.parts else None
            texts = [part.text for part in side.expression.walk() if part.kind == "unit"]
            units = [alone.unit if alone is not None else None, *map(find_unit, texts)]
            yield from (unit for unit in units if unit is not None)

    def _numeral(self, index: int) -> Numeral | None:
        """Return the number that a side is, or the value of the symbol that it is."""
        expression = self.expressions[index]
        if self.sides[index].is_numeric:
            return read_numeral(expression)
        symbol = self.known.get(expression.text) if expression.kind == "symbol" else None
        if symbol is None or symbol.value is None or symbol.step is None:
            return None
        size = measure(symbol.unit) if symbol.unit is not None else ONE
        return Numeral(symbol.value, symbol.step, False, 6, size)


def agrees(
    numeral: Numeral, value: Real, relation: str, *, of_decimals: bool = False
) -> bool | None:
    """Whether a value, rounded to the digits of a numeral, is that number; `None` if unknown.

    After `=` a whole number is exact, or, if it has two digits or more and the value comes
    `of_decimals`, rounded to as many digits: 49.05 to 49, but 9.75 to 9.8 and not to 10. So it is
    where no decimal can be exact, as of 100/3.
    """
    difference, step = (value - numeral.value).abs(), numeral.step
    if numeral.is_order and relation == "≈":
        ten = Real.of(10)
        signs = {(value * ten - numeral.value).sign(), (numeral.value * ten - value).sign()}
        return None if None in signs else -1 not in signs
    if numeral.is_whole and relation == "=":
        last_digit = step * Real.of(Fraction(1, 10**numeral.zeros))
        is_long = (value.abs() - last_digit * Real.of(10 ** (numeral.digits - 1))).sign()
        may_be_rounded = of_decimals or not numeral.express(value).has_end
        if not (may_be_rounded and numeral.digits > 1 and is_long in (0, 1)):
            sign = difference.sign()
            return None if sign is None else sign == 0
        step = last_digit
    excess = (difference * Real.of(2) - step).sign()
    return None if excess is None else excess <= 0


def choose_rounded(numerals: Mapping[int, Numeral], relation: str) -> int:
    """Return which side of a relation may be rounded: that with the coarser digits.

    A whole number is exact after `=`, and beside a decimal in another unit, as in `1 mi ≈ 1.6 km`.
    """
    rounded = {i: numeral for i, numeral in numerals.items() if not numeral.is_whole}
    sizes = {float(numeral.unit_size) for numeral in numerals.values()}
    if rounded and (relation == "=" or len(sizes) > 1):
        numerals = rounded
    return max(numerals, key=lambda i: (float(numerals[i].step), i))


def _find_symbol(name: str, symbols: Mapping[str, SymbolQuantity]) -> SymbolQuantity | None:
    """Return what is known of a symbol; of a time derivative, its unit."""
    symbol = symbols.get(name)
    if symbol is not None:
        return symbol if symbol.unit is not None else None
    dotted = re.fullmatch(r"\\(d?)dot\{(.+?)\}(.*)", name)
    base = symbols.get(dotted[2] + dotted[3]) if dotted is not None else None
    if dotted is None or base is None or base.unit is None:
        return None
    per_time = Unit(Fraction(1), (("time", Fraction(-2 if dotted[1] else -1)),))
    return SymbolQuantity(name, "", base.unit.times(per_time, 1))


def _may_hide_unit(expression: Expression) -> bool:
    """Whether a number may stand for one with a unit, as in `F = 9.81 m` or `x = 1 + v t`."""
    parts = [*expression.walk()]
    if any(part.kind == "unit" for part in parts):
        return False
    numbers = [part.text for part in parts if part.kind == "number"]
    terms = [term for part in parts if part.kind in ("+", "-") for term in part.parts]
    return any("." in number or int(number) > _LARGEST_COEFFICIENT for number in numbers) or any(
        not term.has("symbol") for term in terms
    )
