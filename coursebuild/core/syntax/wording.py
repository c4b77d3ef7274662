"""The words of messages for types and for the author's values.

Entry points: `Format` (`JSON`, `TOML`), `accepts`, `wrong_type_message`, `type_help`,
`format_name`, `format_value`, `shorten`.
"""

from __future__ import annotations

import re
from typing import Literal, TypeAlias, assert_never

import msgspec.inspect as inspect

from coursebuild.core.syntax.nodes import (
    ArrayNode,
    BoolNode,
    DateNode,
    ErrorNode,
    Node,
    NullNode,
    NumberNode,
    ObjectNode,
    StringNode,
)

_MAX_LENGTH = 40
"""The most characters of an author's text in a message."""
_NUMBER = re.compile(r"[-+]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][-+]?[0-9]+)?", re.ASCII)


Format: TypeAlias = Literal["JSON", "TOML"]
JSON: Format = "JSON"
TOML: Format = "TOML"
"""The language of a value; messages call the same value an object in JSON and a table in TOML."""

_TYPES: dict[type[inspect.Type], tuple[str, str, type[Node]]] = {
    inspect.StrType: ("a string", "strings", StringNode),
    inspect.LiteralType: ("a string", "strings", StringNode),
    inspect.IntType: ("an integer", "integers", NumberNode),
    inspect.FloatType: ("a number", "numbers", NumberNode),
    inspect.BoolType: ("`true` or `false`", "`true` or `false`", BoolNode),
    inspect.DictType: ("an object", "objects", ObjectNode),
    inspect.StructType: ("an object", "objects", ObjectNode),
    inspect.VarTupleType: ("an array", "arrays", ArrayNode),
    inspect.TupleType: ("an array", "arrays", ArrayNode),
    inspect.NoneType: ("", "", NullNode),
}
"""The words for one value and for several of a type, and the type of its node."""


def _union_members(type: inspect.Type) -> list[inspect.Type]:
    """The types of a union for a message, without `null`, and with one struct for all of them."""
    while isinstance(type, inspect.Metadata):
        type = type.type
    if not isinstance(type, inspect.UnionType):
        return [type]
    types = [member for inner in type.types for member in _union_members(inner)]
    structs = [member for member in types if isinstance(member, inspect.StructType)]
    return [t for t in types if not isinstance(t, inspect.NoneType) and t not in structs[1:]]


def _describe_type(type: inspect.Type) -> tuple[str, str]:
    """A type in words: for one value, and for several."""
    singulars, plurals = [], []
    for member in _union_members(type):
        singular, plural, _ = _TYPES[member.__class__]
        content = ""
        if isinstance(member, inspect.VarTupleType):
            content = f" of {_describe_type(member.item_type)[1]}"
        elif isinstance(member, inspect.TupleType):
            content = f" of {len(member.item_types)} values"
        singulars.append(singular + content)
        plurals.append(plural + content)
    return " or ".join(singulars), " or ".join(plurals)


def accepts(type: inspect.Type, node: Node) -> bool:
    """Whether a node is of a type, whatever its value."""
    if isinstance(type, inspect.Metadata):
        return accepts(type.type, node)
    if isinstance(type, inspect.UnionType):
        return any(accepts(member, node) for member in type.types)
    if isinstance(type, inspect.IntType) and isinstance(node, NumberNode):
        return isinstance(node.value, int)
    return isinstance(node, _TYPES[type.__class__][2])


def shorten(text: str) -> str:
    """A text of the author on one line, cut to a length that fits into a message."""
    line = " ".join(text.split())
    return line if len(line) <= _MAX_LENGTH else line[: _MAX_LENGTH - 1] + "…"


def format_name(name: str) -> str:
    """The name of a field in a message; "the quiz", which is no field, stays as it is."""
    return name if name.startswith("the ") else f"`{shorten(name)}`"


def format_value(node: Node) -> str:
    """A value in a message, as the author wrote it."""
    return f"`{shorten(node.value if isinstance(node, StringNode) else node.raw)}`"


def wrong_type_message(node: Node, name: str, type: inspect.Type, format: Format) -> str:
    """The message for a value of the wrong type."""
    problem = f"must be {_describe_type(type)[0]}, not {_describe_value(node)}"
    if format == TOML:
        problem = problem.replace("an object", "a table").replace("objects", "tables")
    return f"{format_name(name)} {problem}"


def _describe_value(node: Node) -> str:
    match node:
        case ObjectNode():
            return "an object"
        case ArrayNode():
            return "an array"
        case StringNode():
            return "a string"
        case NumberNode():
            return f"the number {shorten(node.raw)}"
        case DateNode():
            return "a date or time"
        case BoolNode() | NullNode() | ErrorNode():
            return f"`{shorten(node.raw)}`"
        case _:
            assert_never(node)


def type_help(node: Node, type: inspect.Type) -> str:
    """How to mend a value of the wrong type, if that is clear."""
    raw = node.raw
    members = _union_members(type)
    kinds = {_TYPES[member.__class__][2] for member in members}
    arrays = [member for member in members if isinstance(member, inspect.VarTupleType)]
    item_types = (member for array in arrays for member in _union_members(array.item_type))
    item_kinds = {_TYPES[member.__class__][2] for member in item_types}
    if isinstance(node, NullNode):
        return "leave the field out"
    if isinstance(node, ObjectNode) and ObjectNode in item_kinds and raw.startswith("["):
        return f"write its header with two brackets: `[{node.mark.text}]`"
    if len(raw) > _MAX_LENGTH or "\n" in raw:
        return ""
    if isinstance(node, NumberNode | DateNode | BoolNode):
        if kinds == {StringNode} or (StringNode in kinds and not isinstance(node, BoolNode)):
            return f'put it between quotes: `"{raw}"`'
        if StringNode in item_kinds:
            return f'put it between brackets and quotes: `["{raw}"]`'
    if isinstance(node, StringNode):
        if NumberNode in kinds and _NUMBER.fullmatch(node.value):
            return f"write it without quotes: `{node.value}`"
        if BoolNode in kinds and node.value.lower() in ("true", "false"):
            return f"write it without quotes: `{node.value.lower()}`"
    if any(accepts(array.item_type, node) for array in arrays):
        return f"put it between brackets: `[{raw}]`"
    return ""
