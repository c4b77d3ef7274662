"""Expressions as values: what was understood of a side of a formula.

Entry points: `Expression`, `NotUnderstood`; `CONSTANTS`.
"""

from __future__ import annotations

from collections.abc import Iterator

from msgspec import Struct

CONSTANTS = frozenset((r"\pi", r"\mathrm{e}"))
"""Symbols that are numbers."""


class NotUnderstood(Exception):  # noqa: N818  # it is no mistake
    """Why something in a formula cannot be computed, and where it stands in the TeX."""

    def __init__(self, reason: str, start: int, end: int) -> None:
        super().__init__(reason)
        self.reason, self.start, self.end = reason, start, end


class Expression(Struct, frozen=True):
    """An operation on expressions, or a number, symbol or unit.

    `kind` is `number`, `symbol`, `unit`, one of `+ - * / ^`, `abs`, `derivative` (of what, by which
    symbol), `integral` (of what, by which symbol, perhaps from where, to where), or the name of a
    function, as `sin`.
    """

    kind: str
    start: int
    end: int
    parts: tuple[Expression, ...] = ()
    text: str = ""
    """A number's digits; the name of a symbol or a unit."""

    def walk(self) -> Iterator[Expression]:
        """This expression, and all inside."""
        yield self
        for part in self.parts:
            yield from part.walk()

    def has(self, *kinds: str) -> bool:
        """Whether an expression of one of these kinds is inside."""
        return any(one.kind in kinds for one in self.walk())

    def not_understood(self, reason: str) -> NotUnderstood:
        """That this part cannot be computed."""
        return NotUnderstood(reason, self.start, self.end)
