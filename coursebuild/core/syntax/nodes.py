"""Values of JSON and TOML that know where they stand.

Entry points: the union `Node`, `Member`. Both languages give the same nodes, so that one decoder
serves both.

A node keeps offsets into the excerpt that was parsed; its `span` in the lesson is worked out when
it is asked for. Nodes compare by identity: two equal numbers at two places are two nodes.
"""

from __future__ import annotations

from bisect import bisect_right
from typing import TypeAlias

from msgspec import Struct

from coursebuild.core.text.source import Excerpt, Span


class _Placed(Struct, frozen=True, eq=False):
    """What every node has: its stretch `[start, end)` of the text that was parsed."""

    body: Excerpt
    start: int
    end: int

    @property
    def span(self) -> Span:
        """Where it stands."""
        return self.body.span(self.start, self.end)

    @property
    def mark(self) -> Span:
        """What to point at in a message: all of a scalar, the opening of an object or array."""
        return self.span

    @property
    def raw(self) -> str:
        """The value as it is written."""
        return self.body.text[self.start : self.end]


class StringNode(_Placed, frozen=True, eq=False):
    """A string, a key included."""

    value: str
    """The text that is meant, escapes resolved."""
    runs: tuple[tuple[int, int], ...]
    """(offset in the value, offset in the body), growing, the first at 0: from there both advance
    together."""

    @property
    def excerpt(self) -> Excerpt:
        """The value, each character with its place in the source: an escape's is its backslash."""
        inner, offset = self.body.pieces, self.body.offset
        if len(inner) == 1:  # nearly always
            places = tuple([(at, offset(place)) for at, place in self.runs])
            return Excerpt(self.body.source, self.value, places)
        pieces: list[tuple[int, int]] = []
        stops = [*(at for at, _ in self.runs[1:]), len(self.value)]
        for (at, place), stop in zip(self.runs, stops, strict=True):
            pieces.append((at, offset(place)))
            i = bisect_right(inner, place, key=lambda piece: piece[0])
            while i < len(inner) and inner[i][0] < place + (stop - at):
                pieces.append((at + inner[i][0] - place, inner[i][1]))
                i += 1
        return Excerpt(self.body.source, self.value, tuple(pieces))


class NumberNode(_Placed, frozen=True, eq=False):
    """A number; a float may be infinite or, in TOML, not a number."""

    value: int | float


class BoolNode(_Placed, frozen=True, eq=False):
    """`true` or `false`."""

    value: bool


class NullNode(_Placed, frozen=True, eq=False):
    """JSON's `null`."""


class DateNode(_Placed, frozen=True, eq=False):
    """TOML's dates and times. No field takes one; `raw` says what was written."""


class ErrorNode(_Placed, frozen=True, eq=False):
    """What stands in the place of a value and was already reported."""


class ArrayNode(_Placed, frozen=True, eq=False):
    """A list of values."""

    mark_end: int
    """Where its opening ends: the bracket, or the first `[[header]]`."""
    items: tuple[Node, ...]

    @property
    def mark(self) -> Span:
        """Its opening."""
        return self.body.span(self.start, self.mark_end)


class ObjectNode(_Placed, frozen=True, eq=False):
    """A JSON object or a TOML table."""

    mark_start: int
    mark_end: int
    """The stretch of its opening: the brace, or the `[header]`, which may stand below a part of the
    table."""
    members: tuple[Member, ...]
    """As written: a repeated key is in it more than once."""

    @property
    def mark(self) -> Span:
        """Its opening."""
        return self.body.span(self.mark_start, self.mark_end)

    def member(self, name: str) -> Member | None:
        """The first member of that name."""
        for member in self.members:
            if member.key.value == name:
                return member
        return None

    def get(self, name: str) -> Node | None:
        """The value of the first member of that name."""
        member = self.member(name)
        return None if member is None else member.value

    def place(self, name: str) -> Span:
        """What to point at for a field: its value, or the opening where it is not given."""
        value = self.get(name)
        return self.mark if value is None else value.mark

    def objects(self, name: str) -> tuple[ObjectNode, ...]:
        """The objects in the array of that name."""
        value = self.get(name)
        items = value.items if isinstance(value, ArrayNode) else ()
        return tuple(item for item in items if isinstance(item, ObjectNode))


class Member(Struct, frozen=True):
    """A key and its value."""

    key: StringNode
    value: Node


Node: TypeAlias = (
    ObjectNode | ArrayNode | StringNode | NumberNode | BoolNode | NullNode | DateNode | ErrorNode
)
