"""From nodes to declared structs, with every mistake at its place.

Entry point: `decode(node, type, name, words)` → `Decoding`.

1. A declared type is introspected once and becomes a shape (`shapes`).
2. The shape walks the nodes and reports everything that is wrong in one go: unknown and missing
   fields, wrong types, impossible values. (Repeated fields were reported by the parser that made
   the nodes.)
3. What was right is kept by node, so that checks of what no type can say run on all of it, even
   when the whole is wrong.
"""

from __future__ import annotations

import functools
import operator
import re
from collections.abc import Mapping
from typing import Any, Generic, TypeVar

import msgspec.inspect as inspect
from msgspec import Struct

from coursebuild.diagnostics import Diagnostic
from coursebuild.syntax.nodes import Node, ObjectNode, StringNode
from coursebuild.syntax.shapes import (
    ArrayShape,
    BoolShape,
    LiteralShape,
    MapShape,
    NullShape,
    NumberShape,
    Run,
    Shape,
    StringShape,
    TupleShape,
    UnionShape,
)
from coursebuild.syntax.structs import FieldShape, StructShape, TaggedShape
from coursebuild.syntax.wording import (
    BOOL,
    INTEGER,
    NULL,
    NUMBER,
    OBJECT,
    STRING,
    Words,
    array_of,
    tuple_of,
)

S = TypeVar("S", bound=Struct)


class Decoding(Struct, Generic[S], frozen=True):
    """What a tree of nodes holds."""

    value: S | None
    """The whole; it can be there along with diagnostics (an unknown field takes nothing away)."""
    diagnostics: tuple[Diagnostic, ...]
    structs: Mapping[ObjectNode, Struct]
    """Every object whose own fields are all right."""
    texts: tuple[tuple[StringNode, str], ...]
    """Every string that is Markdown, with `blocks` or `inlines`."""


def decode(node: Node, type: type[S], name: str, words: Words) -> Decoding[S]:
    """Read a node as a struct; messages call the whole `name`, as in `the quiz`."""
    run = Run(words)
    value = shape_of(type).decode(node, name, run)
    whole = value if isinstance(value, type) else None
    return Decoding(whole, tuple(run.diagnostics), run.structs, tuple(run.texts))


@functools.cache
def shape_of(type: type[Struct]) -> Shape:
    """The shape of a struct."""
    return _shape(inspect.type_info(type), {})


def _shape(info: inspect.Type, remarks: dict[str, Any]) -> Shape:
    match info:
        case inspect.Metadata():
            return _shape(info.type, {**(info.extra or {}), **remarks})
        case inspect.NoneType():
            return NullShape(NULL)
        case inspect.BoolType():
            return BoolShape(BOOL)
        case inspect.StrType():
            pattern = re.compile(info.pattern) if info.pattern is not None else None
            expects, text = remarks.get("expects", ""), remarks.get("text", "")
            return StringShape(STRING, pattern, info.min_length or 0, expects, text)
        case inspect.IntType():
            return NumberShape(INTEGER, _bounds(info))
        case inspect.FloatType():
            return NumberShape(NUMBER, _bounds(info))
        case inspect.LiteralType():
            return LiteralShape(STRING, tuple(str(value) for value in info.values))
        case inspect.VarTupleType():
            item = _shape(info.item_type, remarks)
            return ArrayShape(array_of(item.takes), item, info.min_length or 0)
        case inspect.TupleType():
            each = tuple(_shape(item, remarks) for item in info.item_types)
            return TupleShape(tuple_of(len(each)), each)
        case inspect.DictType():
            return MapShape(OBJECT, _shape(info.value_type, remarks))
        case inspect.UnionType():
            return _union(info, remarks)
        case inspect.StructType():
            return _struct(info)
        case _:
            raise TypeError(f"no shape for {info}")


def _bounds(info: inspect.IntType | inspect.FloatType) -> tuple[tuple[str, float], ...]:
    limits = (("ge", info.ge), ("gt", info.gt), ("le", info.le), ("lt", info.lt))
    return tuple((name, limit) for name, limit in limits if limit is not None)


def _union(info: inspect.UnionType, remarks: dict[str, Any]) -> Shape:
    structs = [t for t in info.types if isinstance(t, inspect.StructType) and t.tag is not None]
    shapes = [_shape(t, remarks) for t in info.types if t not in structs]
    if structs:
        shapes.append(_tagged(structs))
    if len(shapes) == 1:
        return shapes[0]
    return UnionShape(functools.reduce(operator.or_, (s.takes for s in shapes)), tuple(shapes))


def _tagged(structs: list[inspect.StructType]) -> TaggedShape:
    variants = {str(info.tag): _struct(info) for info in structs}
    implied = [tag for tag, shape in variants.items() if getattr(shape.cls, "implied", False)]
    owners: dict[str, list[str]] = {}
    for tag, shape in variants.items():
        for key in shape.fields:
            owners.setdefault(key, []).append(tag)
    return TaggedShape(
        OBJECT,
        str(structs[0].tag_field),
        variants,
        implied[0] if implied else None,
        {key: tuple(tags) for key, tags in owners.items()},
    )


def _struct(info: inspect.StructType) -> StructShape:
    fields: dict[str, FieldShape] = {}
    for field in info.fields:
        extra = field.type.extra_json_schema if isinstance(field.type, inspect.Metadata) else None
        description = (extra or {}).get("description", "")
        shape = _shape(field.type, {})
        fields[field.name] = FieldShape(field.name, field.required, shape, description)
    return StructShape(OBJECT, info.cls, fields, info.forbid_unknown_fields)
