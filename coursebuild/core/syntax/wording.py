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

_NAMED_TYPES: dict[str, tuple[str, str, type[Node]]] = {
    "string": ("a string", "strings", StringNode),
    "integer": ("an integer", "integers", NumberNode),
    "number": ("a number", "numbers", NumberNode),
    "bool": ("`true` or `false`", "`true` or `false`", BoolNode),
    "object": ("an object", "objects", ObjectNode),
}
"""All types but arrays: the words for one value and for several, and the type of the node."""


def _union_members(type: inspect.Type) -> list[inspect.Type]:
    """The types of a union for a message, without `null`, and with one struct for all of them."""
    while isinstance(type, inspect.Metadata):
        type = type.type
    if not isinstance(type, inspect.UnionType):
        return [type]
    types = [member for inner in type.types for member in _union_members(inner)]
    structs = [member for member in types if isinstance(member, inspect.StructType)]
    return [t for t in types if not isinstance(t, inspect.NoneType) and t not in structs[1:]]


def _type_name(type: inspect.Type) -> str:
    """The name of a type that is neither a union nor `null`."""
    match type:
        case inspect.StrType() | inspect.LiteralType():
            return "string"
        case inspect.IntType():
            return "integer"
        case inspect.FloatType():
            return "number"
        case inspect.BoolType():
            return "bool"
        case inspect.DictType() | inspect.StructType():
            return "object"
        case inspect.VarTupleType() | inspect.TupleType():
            return "array"
        case _:
            raise TypeError(f"no value of a lesson is of {type}")


def _describe_type(type: inspect.Type) -> tuple[str, str]:
    """A type in words: for one value, and for several."""
    singulars, plurals = [], []
    for member in _union_members(type):
        if isinstance(member, inspect.VarTupleType):
            items = _describe_type(member.item_type)[1]
            words = (f"an array of {items}", f"arrays of {items}")
        elif isinstance(member, inspect.TupleType):
            length = f"of {len(member.item_types)} values"
            words = (f"an array {length}", f"arrays {length}")
        else:
            words = _NAMED_TYPES[_type_name(member)][:2]
        singulars.append(words[0])
        plurals.append(words[1])
    return " or ".join(singulars), " or ".join(plurals)


def accepts(type: inspect.Type, node: Node) -> bool:
    """Whether a node is of a type, whatever its value."""
    if isinstance(type, inspect.Metadata):
        return accepts(type.type, node)
    if isinstance(type, inspect.UnionType):
        return any(accepts(member, node) for member in type.types)
    if isinstance(type, inspect.NoneType):
        return isinstance(node, NullNode)
    kind = _type_name(type)
    if kind == "integer" and isinstance(node, NumberNode):
        return isinstance(node.value, int)
    return isinstance(node, ArrayNode if kind == "array" else _NAMED_TYPES[kind][2])


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
    names = {_type_name(member) for member in members}
    arrays = [member for member in members if isinstance(member, inspect.VarTupleType)]
    item_types = (member for array in arrays for member in _union_members(array.item_type))
    item_names = {_type_name(member) for member in item_types}
    if isinstance(node, NullNode):
        return "leave the field out"
    if isinstance(node, ObjectNode) and "object" in item_names and raw.startswith("["):
        return f"write its header with two brackets: `[{node.mark.text}]`"
    if len(raw) > _MAX_LENGTH or "\n" in raw:
        return ""
    if isinstance(node, NumberNode | DateNode | BoolNode):
        needs_quotes = not isinstance(node, BoolNode) or names == {"string"}
        if "string" in names and needs_quotes:
            return f'put it between quotes: `"{raw}"`'
        if "string" in item_names:
            return f'put it between brackets and quotes: `["{raw}"]`'
    if isinstance(node, StringNode):
        if names & {"integer", "number"} and _NUMBER.fullmatch(node.value):
            return f"write it without quotes: `{node.value}`"
        if "bool" in names and node.value.lower() in ("true", "false"):
            return f"write it without quotes: `{node.value.lower()}`"
    if any(accepts(array.item_type, node) for array in arrays):
        return f"put it between brackets: `[{raw}]`"
    return ""
