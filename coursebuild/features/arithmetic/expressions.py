"""What a formula says, as a tree of expressions."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Literal

from msgspec import Struct
from msgspec.structs import replace


class NotUnderstood(Exception):  # noqa: N818  # it is no mistake
    """A part of a formula that cannot be computed, with the reason and its range in the TeX."""

    kind: Literal["wrong", "unread"] = "unread"

    def __init__(self, reason: str, start: int, end: int) -> None:
        super().__init__(reason)
        self.reason, self.start, self.end = reason, start, end


CONSTANTS = frozenset((r"\pi", r"\mathrm{e}"))
"""Symbols that stand for fixed numbers."""
OF_QUOTIENT = "unit of a quotient"
"""The text of a product as `1/50 Hz`, whose unit may be that of the divisor alone."""
SIDE_BY_SIDE = "side by side"
"""The text of a product in what a function without brackets is of."""


class Expression(Struct, frozen=True):
    """An operation on expressions, or a number, symbol or unit.

    `kind` is `number`, `symbol`, `unit`, one of `+ - * / ^`, `abs`, `derivative` (parts: function,
    variable), `integral` (parts: function, variable, and the limits if there are any), `sum` or
    `prod` (parts: term, index, first, last), `index`, `factorial`, `binom`, or the name of a
    function, as `sin`.
    """

    kind: str
    start: int
    end: int
    parts: tuple[Expression, ...] = ()
    text: str = ""
    """The digits of a number; the name of a symbol or a unit."""

    def move(self, start: int, end: int) -> Expression:
        """Return it as if all of it were written between these offsets."""
        parts = tuple(part.move(start, end) for part in self.parts)
        return replace(self, start=start, end=end, parts=parts)

    def walk(self) -> Iterator[Expression]:
        """Yield this expression and all expressions in it."""
        yield self
        for part in self.parts:
            yield from part.walk()

    def has(self, *kinds: str) -> bool:
        """Whether this expression is or contains one of these kinds."""
        return any(expression.kind in kinds for expression in self.walk())

    def has_decimals(self) -> bool:
        """Whether it holds a number with a decimal point, which may be rounded."""
        return any(part.kind == "number" and "." in part.text for part in self.walk())

    def ends_in_unit(self, *texts: str) -> bool:
        """Whether this is a number with a unit, or with one of these units."""
        unit = self.parts[1] if self.kind == "*" else self
        return unit is not self and unit.kind == "unit" and (not texts or unit.text in texts)

    def names(self) -> set[str]:
        """The names of the symbols on which its value depends."""
        if self.kind == "symbol":
            return {self.text}
        if self.kind == "integral" and len(self.parts) == 4:
            integrand, variable, first, last = self.parts
            return (integrand.names() - {variable.text}) | first.names() | last.names()
        return set().union(*(part.names() for part in self.parts))

    def substitute(self, symbols: Mapping[str, Expression]) -> Expression:
        """Return this expression with others for symbols."""
        if self.kind == "symbol":
            return symbols.get(self.text, self)
        parts = tuple(part.substitute(symbols) for part in self.parts)
        return replace(self, parts=parts)

    def not_understood(self, reason: str) -> NotUnderstood:
        """Return the exception that says that this part cannot be computed."""
        return NotUnderstood(reason, self.start, self.end)


def join_units(product: Expression, sign: str, unit: Expression) -> Expression:
    r"""Return a product whose unit goes on behind a sign, as in `5\,\mathrm N\cdot\mathrm m`."""
    if not product.ends_in_unit():
        raise unit.not_understood("it may be a symbol")
    number, first = product.parts
    text = f"{first.text}{'/' if sign == '/' else '·'}{unit.text}"
    whole = Expression("unit", first.start, unit.end, text=text)
    return Expression("*", product.start, unit.end, (number, whole))


def is_mixed(left: Expression, right: Expression) -> bool:
    r"""Whether this may be one number: `2\tfrac12`; `9.81(2)`, with its uncertainty; `(12)(34)`."""
    is_fraction = right.kind == "/" and all(part.kind == "number" for part in right.parts)
    while left.kind in ("*", "-") and left.parts:
        left = left.parts[-1]
    return left.kind == "number" and (is_fraction or right.kind == "number")
