"""How messages call types and the author's values.

Entry points: `Takes` (the types that a field takes) and its constants, `Words` (`JSON`, `TOML`),
`named`, `quoted`, `wrong_type`, `type_help`.
"""

from __future__ import annotations

import re
from typing import assert_never

from msgspec import Struct

from coursebuild.patterns import pattern
from coursebuild.syntax.nodes import (
    ArrayNode,
    BoolNode,
    BrokenNode,
    DateNode,
    Node,
    NullNode,
    NumberNode,
    ObjectNode,
    StringNode,
)

_NUMBER = pattern(r"[-+]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][-+]?[0-9]+)?", re.ASCII)


class Words(Struct, frozen=True):
    """The nouns of a language for what the other calls an object."""

    object: str
    objects: str


JSON = Words("an object", "objects")
TOML = Words("a table", "tables")


class Takes(Struct, frozen=True):
    """The types that a field takes, for the decoder and in words."""

    kinds: frozenset[str]
    """Of `string`, `integer`, `float`, `bool`, `null`, `array`, `object`."""
    one: str
    many: str
    items: frozenset[str] = frozenset()
    """The kinds of the items, where it takes an array."""

    def __or__(self, other: Takes) -> Takes:
        """Either of two."""
        kinds = self.kinds | other.kinds
        if "null" in (self.one, other.one):  # that a field can be left out need not be said
            main = other if self.one == "null" else self
            return Takes(kinds, main.one, main.many, self.items | other.items)
        one, many = f"{self.one} or {other.one}", f"{self.many} or {other.many}"
        return Takes(kinds, one, many, self.items | other.items)


STRING = Takes(frozenset({"string"}), "a string", "strings")
INTEGER = Takes(frozenset({"integer"}), "an integer", "integers")
NUMBER = Takes(frozenset({"integer", "float"}), "a number", "numbers")
BOOL = Takes(frozenset({"bool"}), "`true` or `false`", "`true` or `false`")
NULL = Takes(frozenset({"null"}), "null", "null")
OBJECT = Takes(frozenset({"object"}), "an object", "objects")


def array_of(item: Takes) -> Takes:
    """An array of any length."""
    array = frozenset({"array"})
    return Takes(array, f"an array of {item.many}", f"arrays of {item.many}", item.kinds)


def tuple_of(length: int) -> Takes:
    """An array with a place for each item."""
    words = f"of {length} values"
    return Takes(frozenset({"array"}), f"an array {words}", f"arrays {words}")


def kind_of(node: Node) -> str:
    """The type of a node."""
    match node:
        case StringNode():
            return "string"
        case NumberNode():
            return "float" if isinstance(node.value, float) else "integer"
        case BoolNode():
            return "bool"
        case NullNode():
            return "null"
        case ArrayNode():
            return "array"
        case ObjectNode():
            return "object"
        case DateNode():
            return "date"
        case BrokenNode():
            return "broken"
        case _:
            assert_never(node)


def short(text: str, limit: int = 40) -> str:
    """A stretch of the author's text that fits into a message."""
    line = " ".join(text.split())
    return line if len(line) <= limit else line[: limit - 1] + "…"


def named(name: str) -> str:
    """A field's name in a message; "the quiz" is no field's, and stays as it is."""
    return name if name.startswith("the ") else f"`{short(name)}`"


def quoted(node: Node) -> str:
    """A value in a message, as the author wrote it."""
    return f"`{short(node.value if isinstance(node, StringNode) else node.raw)}`"


def wrong_type(node: Node, name: str, takes: Takes, words: Words) -> str:
    """The message for a value of a type that its field does not take."""
    expected = takes.one.replace("an object", words.object).replace("objects", words.objects)
    return f"{named(name)} must be {expected}, not {_found(node, words)}"


def _found(node: Node, words: Words) -> str:
    match node:
        case ObjectNode():
            return words.object
        case ArrayNode():
            return "an array"
        case StringNode():
            return "a string"
        case NumberNode():
            return f"the number {short(node.raw)}"
        case DateNode():
            return "a date or time"
        case BoolNode() | NullNode() | BrokenNode():
            return f"`{short(node.raw)}`"
        case _:
            assert_never(node)


def type_help(node: Node, takes: Takes) -> str:
    """How to mend a value of the wrong type, where that is clear."""
    raw = node.raw
    if isinstance(node, NullNode):
        return "leave the field out"
    if isinstance(node, ObjectNode) and "object" in takes.items and raw.startswith("["):
        return f"write its header with two brackets: `[{node.mark.text}]`"
    if len(raw) > 40 or "\n" in raw:
        return ""
    if isinstance(node, NumberNode | DateNode | BoolNode):
        plain = not isinstance(node, BoolNode) or takes.kinds <= {"string", "null"}
        if "string" in takes.kinds and plain:
            return f'put it between quotes: `"{raw}"`'
        if "string" in takes.items:
            return f'put it between brackets and quotes: `["{raw}"]`'
    if isinstance(node, StringNode):
        if takes.kinds & {"integer", "float"} and _NUMBER.fullmatch(node.value):
            return f"write it without quotes: `{node.value}`"
        if "bool" in takes.kinds and node.value.lower() in ("true", "false"):
            return f"write it without quotes: `{node.value.lower()}`"
    if kind_of(node) in takes.items:
        return f"put it between brackets: `[{raw}]`"
    return ""
