"""Expressions: a side of a formula as a tree of operations.

Entry points: `Expression`, `NotUnderstood`; `CONSTANTS`.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

from msgspec import Struct

CONSTANTS = frozenset((r"\pi", r"\mathrm{e}"))
"""Symbols that stand for fixed numbers."""


class NotUnderstood(Exception):  # noqa: N818  # it is no mistake
    """A part of a formula that cannot be computed, with the reason and its range in the TeX."""

    kind: Literal["wrong", "unread"] = "unread"

    def __init__(self, reason: str, start: int, end: int) -> None:
        super().__init__(reason)
        self.reason, self.start, self.end = reason, start, end


class Expression(Struct, frozen=True):
    """An operation on expressions, or a number, symbol or unit.

    `kind` is `number`, `symbol`, `unit`, one of `+ - * / ^`, `abs`, `derivative` (parts: function,
    variable), `integral` (parts: function, variable, and the limits if there are any), or the name
    of a function, as `sin`.
    """

    kind: str
    start: int
    end: int
    parts: tuple[Expression, ...] = ()
    text: str = ""
    """The digits of a number; the name of a symbol or a unit."""

    def walk(self) -> Iterator[Expression]:
        """Yield this expression and all expressions in it."""
        yield self
        for part in self.parts:
            yield from part.walk()

    def has(self, *kinds: str) -> bool:
        """Whether this expression is or contains one of these kinds."""
        return any(expression.kind in kinds for expression in self.walk())

    def not_understood(self, reason: str) -> NotUnderstood:
        """Return the exception that says that this part cannot be computed."""
        return NotUnderstood(reason, self.start, self.end)
