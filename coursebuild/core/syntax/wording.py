"""How messages call types and the author's values.

Entry points: `Format` (`JSON`, `TOML`), `accepts`, `wrong_type`, `type_help`, `format_name`,
`format_value`, `shorten`.
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

_SHORT = 40
"""Characters of an author's text in a message."""
_NUMBER = re.compile(r"[-+]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][-+]?[0-9]+)?", re.ASCII)


Format: TypeAlias = Literal["JSON", "TOML"]
JSON: Format = "JSON"
TOML: Format = "TOML"
"""The language that a value is written in, by which messages call it an object or a table."""

_SIMPLE: dict[str, tuple[str, str, type[Node]]] = {
    "string": ("a string", "strings", StringNode),
    "integer": ("an integer", "integers", NumberNode),
    "number": ("a number", "numbers", NumberNode),
    "bool": ("`true` or `false`", "`true` or `false`", BoolNode),
    "object": ("an object", "objects", ObjectNode),
}
"""The kinds of values but arrays: one and several of them in words, and the node."""


def _single(type: inspect.Type) -> list[inspect.Type]:
    """The types of a union, without remarks and `null`: that a field can be left out is clear."""
    while isinstance(type, inspect.Metadata):
        type = type.type
    if not isinstance(type, inspect.UnionType):
        return [type]
    types = [one for inner in type.types for one in _single(inner)]
    structs = [one for one in types if isinstance(one, inspect.StructType)]
    return [
        one for one in types if not isinstance(one, inspect.NoneType) and one not in structs[1:]
    ]


def _kind(type: inspect.Type) -> str:
    """What a type is called that is neither a union nor `null`."""
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


def _in_words(type: inspect.Type) -> tuple[str, str]:
    """What a field takes: one of it, and several."""
    ones, many = [], []
    for single in _single(type):
        if isinstance(single, inspect.VarTupleType):
            items = _in_words(single.item_type)[1]
            words = (f"an array of {items}", f"arrays of {items}")
        elif isinstance(single, inspect.TupleType):
            length = f"of {len(single.item_types)} values"
            words = (f"an array {length}", f"arrays {length}")
        else:
            words = _SIMPLE[_kind(single)][:2]
        ones.append(words[0])
        many.append(words[1])
    return " or ".join(ones), " or ".join(many)


def accepts(type: inspect.Type, node: Node) -> bool:
    """Whether a node is of a type, whatever its value."""
    if isinstance(type, inspect.Metadata):
        return accepts(type.type, node)
    if isinstance(type, inspect.UnionType):
        return any(accepts(one, node) for one in type.types)
    if isinstance(type, inspect.NoneType):
        return isinstance(node, NullNode)
    kind = _kind(type)
    if kind == "integer" and isinstance(node, NumberNode):
        return isinstance(node.value, int)
    return isinstance(node, ArrayNode if kind == "array" else _SIMPLE[kind][2])


def shorten(text: str) -> str:
    """A stretch of the author's text that fits into a message."""
    line = " ".join(text.split())
    return line if len(line) <= _SHORT else line[: _SHORT - 1] + "…"


def format_name(name: str) -> str:
    """A field's name in a message; "the quiz" is no field's, and stays as it is."""
    return name if name.startswith("the ") else f"`{shorten(name)}`"


def format_value(node: Node) -> str:
    """A value in a message, as the author wrote it."""
    return f"`{shorten(node.value if isinstance(node, StringNode) else node.raw)}`"


def wrong_type(node: Node, name: str, type: inspect.Type, format: Format) -> str:
    """The message for a value of a type that its field does not take."""
    wrong = f"must be {_in_words(type)[0]}, not {_found(node)}"
    if format == TOML:
        wrong = wrong.replace("an object", "a table").replace("objects", "tables")
    return f"{format_name(name)} {wrong}"


def _found(node: Node) -> str:
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
    """How to mend a value of the wrong type, where that is clear."""
    raw = node.raw
    kinds = {_kind(single) for single in _single(type)}
    arrays = [one for one in _single(type) if isinstance(one, inspect.VarTupleType)]
    items = {_kind(single) for array in arrays for single in _single(array.item_type)}
    if isinstance(node, NullNode):
        return "leave the field out"
    if isinstance(node, ObjectNode) and "object" in items and raw.startswith("["):
        return f"write its header with two brackets: `[{node.mark.text}]`"
    if len(raw) > _SHORT or "\n" in raw:
        return ""
    if isinstance(node, NumberNode | DateNode | BoolNode):
        plain = not isinstance(node, BoolNode) or kinds == {"string"}
        if "string" in kinds and plain:
            return f'put it between quotes: `"{raw}"`'
        if "string" in items:
            return f'put it between brackets and quotes: `["{raw}"]`'
    if isinstance(node, StringNode):
        if kinds & {"integer", "number"} and _NUMBER.fullmatch(node.value):
            return f"write it without quotes: `{node.value}`"
        if "bool" in kinds and node.value.lower() in ("true", "false"):
            return f"write it without quotes: `{node.value.lower()}`"
    if any(accepts(array.item_type, node) for array in arrays):
        return f"put it between brackets: `[{raw}]`"
    return ""
