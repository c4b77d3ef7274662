"""From nodes to declared structs, with every mistake at its place.

One walk over the nodes, guided by what `msgspec.inspect` says of the type, reports everything that
is wrong. A struct is made as soon as all its own fields are right, and kept by its node, so that
checks of rules that types cannot express run on it, even if the whole is wrong.
"""

from __future__ import annotations

import functools
import math
import operator
import re
from collections.abc import Iterable, Iterator, Mapping
from typing import Generic, TypeVar

import msgspec.inspect as inspect
from msgspec import Struct

from coursebuild.core.model.fields import NOT_BLANK
from coursebuild.core.syntax.nodes import (
    ArrayNode,
    BoolNode,
    Format,
    Node,
    NullNode,
    NumberNode,
    ObjectNode,
    StringNode,
    accepts,
    format_name,
    format_value,
    shorten,
    type_help,
    wrong_type_message,
)
from coursebuild.core.text.characters import REORDERING
from coursebuild.core.text.diagnostics import Diagnostic, Note, diagnose, did_you_mean, propose
from coursebuild.core.text.near import nearest
from coursebuild.core.text.numbers import point_decimals, scan_prose
from coursebuild.core.text.regex import regex
from coursebuild.core.text.source import Span

S = TypeVar("S", bound=Struct)
T = TypeVar("T", bound=Struct)

_NO_REMARKS: Mapping[str, str] = {}
_INVALID = object()
_MARKUP = regex(r"\$[^\s$](?:[^$]*[^\s$])?\$(?!\w)|\*\*[^\s*](?:[^*]*[^\s*])?\*\*(?!\w)")
"""A formula or strong text, unlike `$5/$6` and `x**2`."""
_BOUND_NUMBER = regex(r"`(?P<text>[^`]+)`\{out\b[^{}]*\}")


class Decoding(Struct, Generic[S], frozen=True):
    """The values of a tree of nodes."""

    value: S | None
    """The whole; it can be there along with diagnostics, as an unknown field does no harm."""
    diagnostics: tuple[Diagnostic, ...]
    structs: Mapping[ObjectNode, Struct]
    texts: tuple[tuple[StringNode, str], ...]
    """Every string that is Markdown, or binds numbers, with the `text` of its remarks."""

    def find_structs(
        self, type: type[T], nodes: Iterable[ObjectNode] | None = None
    ) -> Iterator[tuple[ObjectNode, T]]:
        """The objects, of all or of `nodes`, that are right and of a type, each with its struct."""
        for node in self.structs if nodes is None else nodes:
            struct = self.structs.get(node)
            if isinstance(struct, type):
                yield node, struct


def decode(
    node: Node, type: type[S], name: str, format: Format, *, comma: bool = False
) -> Decoding[S]:
    """Read a node as a struct; messages call the whole `name`, as in `the quiz`.

    Bound numbers are in a language that may have a comma before decimals.
    """
    decoder = _Decoder(format, comma)
    value = decoder.decode_value(node, _type_info(type), name)
    whole = value if isinstance(value, type) else None
    return Decoding(whole, tuple(decoder.diagnostics), decoder.structs, tuple(decoder.texts))


_type_info = functools.cache(inspect.type_info)


class _Decoder:
    """One walk; methods return the value of a node, or report and return `_INVALID`."""

    def __init__(self, format: Format, comma: bool) -> None:
        self.format = format
        self.comma = comma
        self.diagnostics: list[Diagnostic] = []
        self.structs: dict[ObjectNode, Struct] = {}
        self.texts: list[tuple[StringNode, str]] = []

    def report(self, rule: str, span: Span, message: str, help: str = "") -> object:
        self.diagnostics.append(diagnose(rule, span, message, help=help))
        return _INVALID

    def report_wrong_type(
        self, node: Node, type: inspect.Type, name: str, help: str = ""
    ) -> object:
        message = wrong_type_message(node, name, type, self.format)
        help = help or type_help(node, type) or _field_help(name, type)
        return self.report("field-type", node.mark, message, help)

    def decode_value(
        self, node: Node, type: inspect.Type, name: str, remarks: Mapping[str, str] = _NO_REMARKS
    ) -> object:
        """The value of a node of a declared type; `remarks` are what its `Meta` says."""
        extra = type.extra if isinstance(type, inspect.Metadata) else None
        is_bound = isinstance(node, StringNode) and "{out" in node.value
        if isinstance(node, StringNode) and is_bound and (extra or {}).get("text") == "number":
            return self.decode_bound_number(node, name)
        if not accepts(type, node):
            return self.report_wrong_type(node, type, name)
        match type, node:
            case inspect.Metadata(), _:
                remarks = {**(type.extra_json_schema or {}), **(type.extra or {})}
                return self.decode_value(node, type.type, name, remarks)
            case inspect.StrType(), StringNode():
                return self.decode_string(node, type, name, remarks)
            case inspect.LiteralType(), StringNode():
                if node.value in type.values:
                    return node.value
                message = f"{format_name(name)} cannot be {format_value(node)}"
                help = did_you_mean(node.value, map(str, type.values))
                return self.report("field-value", node.mark, message, help)
            case inspect.IntType() | inspect.FloatType(), NumberNode():
                return self.decode_number(node, type, name, remarks)
            case inspect.VarTupleType() | inspect.TupleType(), ArrayNode():
                return self.decode_array(node, type, name)
            case inspect.DictType(), ObjectNode():
                return self.decode_map(node, type)
            case inspect.StructType(), ObjectNode():
                return self.decode_struct(node, type)
            case inspect.UnionType(), _:
                structs = [
                    member for member in type.types if isinstance(member, inspect.StructType)
                ]
                tagged = {str(member.tag): member for member in structs if member.tag is not None}
                if tagged and isinstance(node, ObjectNode):
                    return self.decode_tagged(node, tagged)
                fitting = next(member for member in type.types if accepts(member, node))
                return self.decode_value(node, fitting, name)
            case _:
                return node.value if isinstance(node, BoolNode) else None

    # ---------------------------------------------------------------------------------- scalars

    def decode_string(
        self, node: StringNode, type: inspect.StrType, name: str, remarks: Mapping[str, str]
    ) -> object:
        value = node.value
        blank = type.pattern == NOT_BLANK
        if len(value) < (type.min_length or 0) or (blank and not value.strip()):
            return self.report("field-value", node.mark, f"{format_name(name)} is empty")
        if type.pattern and not blank and re.fullmatch(type.pattern, value) is None:
            message = f"{format_name(name)} cannot be {format_value(node)}"
            help = f"expected: {remarks.get('expects', '')}"
            return self.report("field-value", node.mark, message, help)
        if "plain text" in remarks.get("description", "") and (mark := _MARKUP.search(value)):
            message = f"`{mark[0]}` would be shown as written, in a plain text"
            self.report("shown-as-written", node.mark, message, "write what readers should see")
        if "text" in remarks:
            self.texts.append((node, remarks["text"]))
        elif (character := REORDERING.search(value)) is not None:
            message = f"U+{ord(character[0]):04X} shows the text in another order than it is read"
            return self.report("control-character", node.mark, message, "delete it")
        elif (blank or not type.pattern) and _BOUND_NUMBER.search(value):
            self.texts.append((node, "plain"))
            value = _BOUND_NUMBER.sub(lambda match: match["text"], value)
        return value

    def decode_bound_number(self, node: StringNode, name: str) -> object:
        """The number of a text such as `` `1.42`{out} ``."""
        match = _BOUND_NUMBER.fullmatch(node.value.strip())
        text = "" if match is None else match["text"].strip()
        text = point_decimals(text) if self.comma else text
        number = next(iter(scan_prose(text)), None)
        if number is None or number.text != text or not number.is_finite:
            message = f"{format_name(name)} must be a number, not {format_value(node)}"
            help = "a text binds a number to what a script printed: `1.42`{out=examples/x.py}"
            return self.report("field-type", node.mark, message, help)
        self.texts.append((node, "number"))
        return float(number.value)

    def decode_number(
        self,
        node: NumberNode,
        type: inspect.IntType | inspect.FloatType,
        name: str,
        remarks: Mapping[str, str],
    ) -> object:
        problem, help, digits = "", "", node.raw.lower().partition("e")[0]
        try:
            double = float(node.value)
        except OverflowError:
            double = math.inf
        value = node.value if isinstance(type, inspect.IntType) else double
        if node.raw.strip("+-") in ("inf", "nan"):
            problem = f"must be a finite number, not {node.raw}"
        elif math.isinf(double) or (double == 0 and re.search("[1-9]", digits)):
            problem = "is outside what a number of a computer holds"
        for attribute, words, holds in () if problem else _BOUNDS:
            limit = getattr(type, attribute)
            if limit is not None and not holds(value, limit):
                problem = f"must be {words} {limit:g}, not {node.raw}"
                help = f"expected: {remarks['expects']}" if "expects" in remarks else ""
                break
        if problem:
            return self.report("field-value", node.mark, f"{format_name(name)} {problem}", help)
        return value

    # ------------------------------------------------------------------------------- containers

    def decode_array(
        self, node: ArrayNode, type: inspect.VarTupleType | inspect.TupleType, name: str
    ) -> object:
        length, problem = len(node.items), ""
        if isinstance(type, inspect.TupleType):
            types = type.item_types
            if length != len(types):
                problem = f"needs {len(types)} entries, and has {length}"
        else:
            types, least = (type.item_type,) * length, type.min_length or 0
            if length < least:
                problem = f"needs at least {least} entries, and has {length}"
                problem = problem if length else "is empty"
        if problem:
            return self.report("field-value", node.mark, f"{format_name(name)} {problem}")
        values = [
            self.decode_value(item, type, f"{name}[{i}]")
            for i, (item, type) in enumerate(zip(node.items, types, strict=True))
        ]
        return _INVALID if _INVALID in values else tuple(values)

    def decode_map(self, node: ObjectNode, type: inspect.DictType) -> object:
        values = {}
        for key, member in node.members.items():
            if isinstance(type.key_type, inspect.LiteralType) and key not in type.key_type.values:
                message = f"unknown field {format_name(key)}"
                help = did_you_mean(key, map(str, type.key_type.values))
                self.report("field-unknown", member.key.span, message, help)
                continue
            values[key] = self.decode_value(member.value, type.value_type, key)
        return _INVALID if _INVALID in values.values() else values

    # ---------------------------------------------------------------------------------- structs

    def decode_struct(
        self,
        node: ObjectNode,
        type: inspect.StructType,
        variants: Mapping[str, inspect.StructType] | None = None,
    ) -> object:
        """The struct; `variants` are those of its union, by their tags."""
        fields = {field.name: field for field in type.fields}
        values: dict[str, object] = {}
        unknown: list[StringNode] = []
        for key, member in node.members.items():
            if key in fields:
                values[key] = self.decode_value(member.value, fields[key].type, key)
            elif type.forbid_unknown_fields and not (variants and key == type.tag_field):
                unknown.append(member.key)
        for key_node in unknown:
            key = key_node.value
            help = did_you_mean(key, set(fields) - set(values))
            if owners := _variants_with_field(key, variants or {}):
                names = " and ".join(f'`"{type.tag_field}": "{owner}"`' for owner in owners)
                help = f"it is a field of {names}"
            self.report("field-unknown", key_node.span, f"unknown field {format_name(key)}", help)
        missing = [field for field in type.fields if field.required and field.name not in values]
        for absent in missing:
            if not any(nearest(key.value, [absent.name]) for key in unknown):  # one mistake
                help = _field_help(absent.name, absent.type)
                self.report("field-missing", node.mark, f"`{absent.name}` is missing", help)
        if missing or _INVALID in values.values():
            return _INVALID
        struct: Struct = type.cls(**values)
        self.structs[node] = struct
        return struct

    def decode_tagged(self, node: ObjectNode, variants: Mapping[str, inspect.StructType]) -> object:
        """The struct that the tag of an object names, or the implied one.

        That is meant unless the fields are clearly those of another.
        """
        tag = str(next(iter(variants.values())).tag_field)
        tag_node = node.get(tag)
        if isinstance(tag_node, StringNode):
            if tag_node.value in variants:
                return self.decode_struct(node, variants[tag_node.value], variants)
            message = f"{format_name(tag)} cannot be {format_value(tag_node)}"
            help = did_you_mean(tag_node.value, variants)
            return self.report("field-value", tag_node.mark, message, help)
        help = did_you_mean("", variants)
        if tag_node is not None:
            return self.report_wrong_type(tag_node, inspect.StrType(), tag, help)
        owners = {key: _variants_with_field(key, variants) for key in node.members}
        for key, member in node.members.items():
            if not owners[key] and nearest(key, [tag]):
                message, place = f"unknown field {format_name(key)}", member.key.span
                return self.report("field-unknown", place, message, propose(key, tag))
        implied = next((t for t, v in variants.items() if getattr(v.cls, "implied", False)), None)
        if implied is not None:
            foreign = [tags for tags in owners.values() if tags and implied not in tags]
            if not foreign or [implied] in owners.values():
                return self.decode_struct(node, variants[implied], variants)
            help = f'its fields are those of `"{tag}": "{foreign[0][0]}"`'
        return self.report("field-missing", node.mark, f"`{tag}` is missing", help)


def field_description(type: inspect.Type) -> str:
    """The description in the declaration of a field; may be empty."""
    extra = type.extra_json_schema if isinstance(type, inspect.Metadata) else None
    return str((extra or {}).get("description", ""))


def _field_help(name: str, type: inspect.Type) -> str:
    text = field_description(type)
    return text and f"`{name}`: {text}"


def _variants_with_field(key: str, variants: Mapping[str, inspect.StructType]) -> list[str]:
    return [tag for tag, variant in variants.items() if key in variant.cls.__struct_fields__]


# ----------------------------------------------------------------------------------------- numbers

_BOUNDS = (
    ("ge", "at least", operator.ge),
    ("gt", "greater than", operator.gt),
    ("le", "at most", operator.le),
    ("lt", "less than", operator.lt),
)


def has_value(node: ObjectNode, name: str) -> bool:
    """Whether a field is there and is not null."""
    value = node.get(name)
    return value is not None and not isinstance(value, NullNode)


def require_one_of(
    node: ObjectNode, type: type[Struct], names: tuple[str, ...], *, only: bool = True
) -> Iterator[Diagnostic]:
    """Report if none of the fields is there or, with `only`, more than one of them."""
    members = [
        member for name in names if (member := node.members.get(name)) and has_value(node, name)
    ]
    foreign = node.members.keys() - set(type.__struct_fields__)
    # A field that is surely a misspelling of one of the names was already reported.
    if not members and not any(nearest(key, names) for key in foreign):
        choice = ", ".join(f"`{name}`" for name in names[:-1])
        choice = f"{choice} or `{names[-1]}`" if choice else f"`{names[-1]}`"
        yield diagnose("field-missing", node.mark, f"{choice} is missing")
    for second in members[1:] if only else ():
        first, help = members[0].key, "leave one of them out"
        notes = (Note("the other one is here", first.span),)
        message = f"`{first.value}` and `{second.key.value}` exclude each other"
        yield diagnose("field-value", second.key.span, message, help=help, notes=notes)


def check_unique(
    names: Iterable[tuple[str | float, Span]], rule: str, message: str, *, help: str = ""
) -> Iterator[Diagnostic]:
    """Report each name that is repeated; `{}` in the message is the name."""
    first: dict[str | float, Span] = {}
    for name, span in names:
        if first.setdefault(name, span) is not span:
            notes = (Note("the first one is here", first[name]),)
            text = message.format(shorten(name) if isinstance(name, str) else f"{name:g}")
            yield diagnose(rule, span, text, help=help, notes=notes)
