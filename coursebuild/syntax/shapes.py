"""What a declared type takes: a shape for each kind of type.

Entry points: `Shape`, `Run`, `FAILED`, and the shapes of scalars, arrays, maps and unions. Those of
structs are in `structs`.

A shape turns a node into a Python value, or reports what is wrong with it and gives `FAILED`.
"""

from __future__ import annotations

import math
import operator
import re
from collections.abc import Callable, Iterable

from msgspec import Struct, field

from coursebuild.diagnostics import Diagnostic, diagnose, did_you_mean
from coursebuild.source import Span
from coursebuild.syntax.fields import NOT_BLANK
from coursebuild.syntax.nodes import (
    ArrayNode,
    BoolNode,
    BrokenNode,
    Node,
    NumberNode,
    ObjectNode,
    StringNode,
)
from coursebuild.syntax.wording import (
    Takes,
    Words,
    kind_of,
    named,
    quoted,
    type_help,
    wrong_type,
)


class _Failed:
    """The value of a node that is wrong."""


FAILED = _Failed()


class Run(Struct):
    """What one decoding gathers."""

    words: Words
    diagnostics: list[Diagnostic] = field(default_factory=list)
    structs: dict[ObjectNode, Struct] = field(default_factory=dict)
    texts: list[tuple[StringNode, str]] = field(default_factory=list)

    def fault(self, rule: str, span: Span, message: str, help: str = "") -> _Failed:
        """Report a mistake."""
        self.diagnostics.append(diagnose(rule, span, message, help=help))
        return FAILED

    def wrong_type(self, node: Node, name: str, takes: Takes, help: str = "") -> _Failed:
        """Report that a value is of a type that its field does not take."""
        if isinstance(node, BrokenNode):  # reported when it was read
            return FAILED
        message = wrong_type(node, name, takes, self.words)
        return self.fault("field-type", node.mark, message, help or type_help(node, takes))


class Shape(Struct, frozen=True):
    """What a field takes."""

    takes: Takes

    def accepts(self, node: Node) -> bool:
        """Whether the node is of the right type, whatever its value."""
        return kind_of(node) in self.takes.kinds

    def decode(self, node: Node, name: str, run: Run) -> object:
        """The value, or `FAILED`; `name` is what messages call it."""
        if not self.accepts(node):
            return run.wrong_type(node, name, self.takes)
        return self._value(node, name, run)

    def _value(self, node: Node, name: str, run: Run) -> object:
        """The value of a node that is of the right type."""
        raise NotImplementedError


class NullShape(Shape, frozen=True):
    """`null`."""

    def _value(self, node: Node, name: str, run: Run) -> object:
        return None


class BoolShape(Shape, frozen=True):
    """`true` or `false`."""

    def _value(self, node: Node, name: str, run: Run) -> object:
        assert isinstance(node, BoolNode)
        return node.value


class StringShape(Shape, frozen=True):
    """Text, which may be bound by a pattern or a length."""

    pattern: re.Pattern[str] | None
    min_length: int
    expects: str
    """What matches the pattern, in words."""
    text: str
    """`blocks` or `inlines` when it is Markdown."""

    def _value(self, node: Node, name: str, run: Run) -> object:
        assert isinstance(node, StringNode)
        value = node.value
        blank = self.pattern is not None and self.pattern.pattern == NOT_BLANK
        if len(value) < self.min_length or (blank and not value.strip()):
            return run.fault("field-value", node.mark, f"{named(name)} is empty")
        if self.pattern is not None and not blank and self.pattern.fullmatch(value) is None:
            message = f"{named(name)} cannot be {quoted(node)}"
            return run.fault("field-value", node.mark, message, f"expected: {self.expects}")
        if self.text:
            run.texts.append((node, self.text))
        return value


class LiteralShape(Shape, frozen=True):
    """One of a few words."""

    values: tuple[str, ...]

    def _value(self, node: Node, name: str, run: Run) -> object:
        assert isinstance(node, StringNode)
        if node.value in self.values:
            return node.value
        message = f"{named(name)} cannot be {quoted(node)}"
        return run.fault("field-value", node.mark, message, did_you_mean(node.value, self.values))


_BOUNDS: dict[str, tuple[str, Callable[[float, float], bool]]] = {
    "ge": ("at least", operator.ge),
    "gt": ("greater than", operator.gt),
    "le": ("at most", operator.le),
    "lt": ("less than", operator.lt),
}


class NumberShape(Shape, frozen=True):
    """A number within bounds: pairs of `ge`, `gt`, `le` or `lt` and a limit."""

    bounds: tuple[tuple[str, float], ...]

    def _value(self, node: Node, name: str, run: Run) -> object:
        assert isinstance(node, NumberNode)
        value = node.value if "float" not in self.takes.kinds else _double(node.value)
        problem = _not_a_double(node) or self._out_of_bounds(value, node)
        if problem:
            return run.fault("field-value", node.mark, f"{named(name)} {problem}")
        return value

    def _out_of_bounds(self, value: float, node: NumberNode) -> str:
        for bound, limit in self.bounds:
            words, holds = _BOUNDS[bound]
            if not holds(value, limit):
                return f"must be {words} {limit:g}, not {node.raw}"
        return ""


def _double(value: float) -> float:
    try:
        return float(value)
    except OverflowError:
        return math.inf if value > 0 else -math.inf


def _not_a_double(node: NumberNode) -> str:
    """Why a number cannot be used in a calculation; empty when it can."""
    value = _double(node.value)
    if node.raw.strip("+-") in ("inf", "nan"):
        return f"must be a finite number, not {node.raw}"
    if math.isinf(value):
        return "is too large: numbers end at about 1.8e308"
    if value == 0 and re.search(r"[1-9]", re.split(r"[eE]", node.raw)[0]):
        return "is too small: it becomes 0"
    return ""


class ArrayShape(Shape, frozen=True):
    """An array of any length."""

    item: Shape
    min_length: int

    def _value(self, node: Node, name: str, run: Run) -> object:
        assert isinstance(node, ArrayNode)
        length = len(node.items)
        if length < self.min_length:
            problem = f"needs at least {self.min_length} entries, and has {length}"
            message = f"{named(name)} {problem if length else 'is empty'}"
            return run.fault("field-value", node.mark, message)
        item = self.item
        return _all([item.decode(v, f"{name}[{i}]", run) for i, v in enumerate(node.items)])


class TupleShape(Shape, frozen=True):
    """An array with a place for each item."""

    each: tuple[Shape, ...]

    def _value(self, node: Node, name: str, run: Run) -> object:
        assert isinstance(node, ArrayNode)
        if len(node.items) != len(self.each):
            problem = f"needs {len(self.each)} entries, and has {len(node.items)}"
            return run.fault("field-value", node.mark, f"{named(name)} {problem}")
        pairs = enumerate(zip(self.each, node.items, strict=True))
        return _all([shape.decode(item, f"{name}[{i}]", run) for i, (shape, item) in pairs])


def _all(values: list[object]) -> object:
    return FAILED if failed(values) else tuple(values)


def failed(values: Iterable[object]) -> bool:
    """Whether one of the values of nodes is none."""
    for value in values:  # noqa: SIM110 (any() with a generator takes twice the time)
        if value is FAILED:
            return True
    return False


class MapShape(Shape, frozen=True):
    """An object whose keys the author chooses."""

    value: Shape

    def _value(self, node: Node, name: str, run: Run) -> object:
        assert isinstance(node, ObjectNode)
        values: dict[str, object] = {}
        for member in node.members:
            key = member.key.value
            if key not in values:
                values[key] = self.value.decode(member.value, key, run)
        return FAILED if failed(values.values()) else values


class UnionShape(Shape, frozen=True):
    """One of several shapes, which the type of the node tells apart."""

    shapes: tuple[Shape, ...]

    def _value(self, node: Node, name: str, run: Run) -> object:
        shape = next(shape for shape in self.shapes if shape.accepts(node))
        return shape.decode(node, name, run)
