"""What the JSON of a fence or a TOML file may say at a place, also while it is being written.

Entry points: `field_place`; `fence_at`, the fence around a place; `known_values`, of a type.

It follows the declarations that the decoder checks against (`schema_roots`). Of the text only
brackets, keys and scalars are looked at, so that it may be wrong anywhere.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from itertools import chain

import msgspec.inspect as inspect
from msgspec import Struct

from coursebuild.core.files.course_root import MAP
from coursebuild.core.syntax.schemas import schema_roots
from coursebuild.core.text.source import Source, Span

_FENCE = re.compile(
    r"^[ \t>]*(?P<marks>`{3,}+|~{3,}+)[ \t]*(?P<kind>[\w-]*).*\n(?P<body>[\s\S]*?)"
    # One that was never closed ends where the next one begins.
    r"(?:(?=^[ \t>]*(?P=marks)[ \t]*\w)|^[ \t>]*(?P=marks).*|\Z)",
    re.MULTILINE,
)
_TOKEN = r'[{}\[\]:,=]|"(?:[^"\\\n]|\\.)*"|"[\w./-]*|[^\s"{}\[\]:,=>]+'
_JSON = re.compile(_TOKEN)
_TOML = re.compile(
    rf"(?:^[ \t]*\[\[?(?P<header>[\w. -]+)\]\]?[ \t\r]*)?(?:#.*)?\n|{_TOKEN}", re.MULTILINE
)


class FieldPlace(Struct, frozen=True):
    """Where a key or a value stands, or may stand."""

    span: Span
    """What is written of it, quotes included."""
    fields: Mapping[str, inspect.Field]
    """Those that the object around it may have, by name."""
    given: frozenset[str]
    """The keys that it has."""
    key: str = ""
    """Of which a value stands here; empty where a key does."""

    @property
    def text(self) -> str:
        """What is written, without quotes."""
        return self.span.text.strip('"')

    @property
    def field(self) -> inspect.Field | None:
        """That of the key or the value."""
        return self.fields.get(self.key or self.text)


class _Object(Struct):
    """An object or table, as far as it was read."""

    key: str = ""
    """Whose value comes next."""
    members: dict[str, str] = {}
    """Its scalars as they are written, and nothing for all else."""

    def read(self, token: str) -> None:
        """Read on, outside of the values that are objects or arrays."""
        if token[-1] in ",\n":
            self.key = ""
        elif self.key and token not in ":=":
            self.members[self.key] = token.strip('"')
        elif token not in ":=":
            self.key = token.strip('"')
            self.members.setdefault(self.key, "")


def field_place(source: Source, offset: int) -> FieldPlace | None:
    """The place of a key or a value at an offset, where it is known which there can be."""
    if source.path == MAP:
        kind, body = "course", source.span()
    elif source.path.startswith("models/") and source.path.endswith(".toml"):
        kind, body = "model", source.span()
    else:
        kind, body = fence_at(source, offset) or ("", source.span(0, 0))
    if kind not in (roots := schema_roots()):
        return None
    span, around = _surroundings(body, offset)
    return _place(span, around, roots[kind][0]) if around else None


def fence_at(source: Source, offset: int) -> tuple[str, Span] | None:
    """The kind of the fence in which an offset lies, and the text between its marks."""
    for fence in _FENCE.finditer(source.text):
        if fence.start("body") <= offset <= fence.end("body"):
            return fence["kind"], source.span(*fence.span("body"))
    return None


def _surroundings(body: Span, offset: int) -> tuple[Span, list[tuple[_Object, str]]]:
    """What is written at an offset, and the objects around it, each with the key that leads on.

    All of the body is read: an object may have further keys behind the offset.
    """
    is_toml = body.path.endswith(".toml")
    stack: list[_Object | None] = [_Object()] if is_toml else []  # `None` is an array
    here: tuple[Span, list[tuple[_Object, str]]] | None = None
    for found in (_TOML if is_toml else _JSON).finditer(body.text + "\n}"):
        token, start, end = found[0], body.start + found.start(), body.start + found.end()
        is_scalar = token[-1] not in "\n{}[]:,="
        if here is None and (end > offset or (end == offset and is_scalar)):
            touched = (start, end) if is_scalar and start <= offset else (offset, offset)
            objects = [(one, one.key) for one in stack if one is not None]
            here = Span(body.source, *touched), objects if found.lastgroup is None else []
        if found.lastgroup is not None:
            stack = [*map(_Object, found["header"].split(".")), _Object()]
        elif token in "{[":
            stack.append(_Object() if token == "{" else None)
        elif token in "}]":
            del stack[-1:]
        elif stack and stack[-1] is not None:
            stack[-1].read(token)
    assert here is not None  # the bracket at the end is behind every offset
    return here


# --- what is declared


def _place(span: Span, around: list[tuple[_Object, str]], root: type[Struct]) -> FieldPlace:
    declared = inspect.type_info(root)
    for object, key in around[:-1]:
        inner = _fields(declared, object.members).get(key)
        declared = _mapped(declared) if inner is None else inner.type
    innermost, key = around[-1]
    given = frozenset(innermost.members) - {span.text.strip('"')}
    return FieldPlace(span, _fields(declared, innermost.members), given, key)


def _fields(declared: inspect.Type, members: Mapping[str, str]) -> dict[str, inspect.Field]:
    """The fields of a struct; of a union's those that its tag leaves, and the tag."""
    structs = [one for one in _parts(declared) if isinstance(one, inspect.StructType)]
    tag = next((one.tag_field for one in structs if one.tag_field), "")
    chosen = [one for one in structs if tag and one.tag == members.get(tag)] or structs
    found = {field.name: field for one in chosen for field in one.fields}
    if tag:
        kinds = inspect.LiteralType(tuple(str(one.tag) for one in structs))
        found[tag] = inspect.Field(tag, tag, kinds)
    return found


def _mapped(declared: inspect.Type) -> inspect.Type:
    """What a mapping has under every name."""
    values = (one.value_type for one in _parts(declared) if isinstance(one, inspect.DictType))
    return next(values, inspect.AnyType())


def _parts(declared: inspect.Type) -> Iterator[inspect.Type]:
    """The types of a union, and those of the items of an array."""
    match declared:
        case inspect.Metadata():
            yield from _parts(declared.type)
        case inspect.UnionType():
            yield from chain.from_iterable(map(_parts, declared.types))
        case inspect.VarTupleType():
            yield from _parts(declared.item_type)
        case inspect.TupleType():
            yield from chain.from_iterable(map(_parts, declared.item_types))
        case _:
            yield declared


def known_values(declared: inspect.Type) -> tuple[str, ...]:
    """The values that a field may have, as they are written, where they can be listed."""
    found: list[str] = []
    for one in _parts(declared):
        if isinstance(one, inspect.LiteralType):
            found += (f'"{value}"' for value in one.values)
        elif isinstance(one, inspect.BoolType):
            found += ("true", "false")
    return tuple(found)
