"""What lab code keeps in `ctx`: the fields and their types.

Entry point: `field_types(parameters, pieces)`.
"""

from __future__ import annotations

import keyword
from collections.abc import Iterable, Iterator, Mapping

from tree_sitter import Node

from coursebuild.features.lab.export.engine_names import ArrayField, engine_field
from coursebuild.features.lab.export.values import NUMBERS, Type
from coursebuild.features.lab.javascript import (
    UntranslatableError,
    children,
    dotted_name,
    field,
    text_of,
)


def field_types(
    parameters: Mapping[str, Type], pieces: Iterable[tuple[list[Node], Type | None]]
) -> dict[str, Type]:
    """The fields of `ctx`: those of parameters, and those that statements assign to.

    `pieces` are all statements of a lab, each with the type of `value` in it. Where a type can only
    be guessed, translating the assignment tells whether the guess was right.
    """
    types = dict(parameters)
    for nodes, given in pieces:
        for name, value in _assigned(nodes):
            found = "num" if value is None else _guess(value, given, types)
            if name not in types or (types[name] in NUMBERS and found in NUMBERS):
                types[name] = found if found not in NUMBERS else "num"
            if name not in parameters and types[name] == "str":
                raise UntranslatableError(f"the text `ctx.{name}`, which is not there at the start")
    for name in types:
        if keyword.iskeyword(name) or name.startswith("__") or not name.isidentifier():
            raise UntranslatableError(f"the name `ctx.{name}`")
    return types


def _assigned(nodes: Iterable[Node]) -> Iterator[tuple[str, Node | None]]:
    """Fields with what is assigned to them; `None` where they count on."""
    for node in nodes:
        target = node.child_by_field_name("left") or node.child_by_field_name("argument")
        path = dotted_name(target) if target is not None else ()
        if len(path) == 2 and path[0] == "ctx":
            if node.type == "assignment_expression":
                value = field(node, "right")
                while value.type == "assignment_expression":
                    value = field(value, "right")
                yield path[1], value
            elif node.type in ("augmented_assignment_expression", "update_expression"):
                yield path[1], None
        yield from _assigned(children(node))


def _guess(value: Node, given: Type | None, types: Mapping[str, Type]) -> Type:
    """The type of a value, as far as it is known without variables."""
    path = dotted_name(value)
    match value.type:
        case "true" | "false":
            return "bool"
        case "unary_expression" | "binary_expression" if _is_test(value):
            return "bool"
        case "string" | "template_string":
            return "str"
        case "array":
            return "vector"
        case "call_expression":
            function = field(value, "function")
            name = text_of(function).rpartition(".")[2] if "member" in function.type else ""
            vectors = ("slice", "subarray", "momentum", "angmom", "sitePos", "bodyPos")
            return "vector" if name in vectors else "num"
        case "ternary_expression":
            return _guess(field(value, "consequence"), given, types)
        case "identifier" if path == ("value",) and given is not None:
            return given
        case "member_expression" if path[:1] == ("ctx",) and path[-1] in types:
            return types[path[-1]]
        case "member_expression" if isinstance(engine_field(path), ArrayField):
            return "vector"
        case _:
            return "num"


def _is_test(node: Node) -> bool:
    operators = ("!", "==", "!=", "===", "!==", "<", ">", "<=", ">=", "&&", "||")
    return text_of(field(node, "operator")) in operators
