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

_FENCE = re.compile(r"^[ \t>]*(`{3,}|~{3,})[ \t]*([\w-]*)", re.MULTILINE)
_TOKEN = re.compile(r'"(?:[^"\\\n]|\\.)*"|"[\w./-]*|[{}\[\]:,=]|[^\s"{}\[\]:,=>]+')
_HEADER = re.compile(r"^[ \t]*\[\[?[ \t]*([\w.-]+).*$", re.MULTILINE)
_KEY = re.compile(r"^[ \t]*([\w-]+)[ \t]*=[ \t]*(.*)$", re.MULTILINE)


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


class _Container(Struct):
    """An object or array, as far as it was read."""

    is_array: bool = False
    members: dict[str, str] = {}
    """Its scalars as they are written, and nothing for all else."""
    key: str = ""
    """Whose value comes next."""


def field_place(source: Source, offset: int) -> FieldPlace | None:
    """The place of a key or a value at an offset, where it is known which there can be."""
    roots = schema_roots()
    if source.path == MAP:
        return _in_toml(source, offset, roots["course"][0])
    if source.path.startswith("models/"):
        return (
            _in_toml(source, offset, roots["model"][0]) if source.path.endswith(".toml") else None
        )
    kind, body = fence_at(source, offset) or ("", source.span(0, 0))
    return _in_json(body, offset, roots[kind][0]) if kind in roots else None


def fence_at(source: Source, offset: int) -> tuple[str, Span] | None:
    """The kind of the fence in which an offset lies, and the text between its marks."""
    opened: re.Match[str] | None = None
    for mark in chain(_FENCE.finditer(source.text), (None,)):
        if opened is not None and mark is not None and not mark[1].startswith(opened[1]):
            continue
        if opened is not None:
            start = source.text.find("\n", opened.end()) + 1
            stop = len(source.text) if mark is None else mark.start()
            if 0 < start <= offset <= stop:
                return opened[2], Span(source, start, stop)
        # A fence that was never closed ends where the next one begins.
        opened = mark if mark is not None and (opened is None or mark[2]) else None
    return None


# --- reading what is there


def _in_json(body: Span, offset: int, root: type[Struct]) -> FieldPlace | None:
    stack: list[_Container] = []
    here: tuple[Span, list[tuple[_Container, str]]] | None = None
    for token in _TOKEN.finditer(body.source.text, body.start, body.end):
        scalar = token[0] not in "{}[]:,="
        if here is None and token.end() >= offset:
            touches = scalar and token.start() <= offset
            place = token.span() if touches else (offset, offset)
            here = Span(body.source, *place), [(one, one.key) for one in stack]
        if token[0] in "{[":
            stack.append(_Container(token[0] == "["))
        elif token[0] in "}]":
            del stack[-1:]
        elif stack and not stack[-1].is_array:
            _read(stack[-1], token[0], scalar=scalar)
    if here is None or not here[1]:
        return None
    return _place(here[0], here[1], root)


def _read(container: _Container, token: str, *, scalar: bool) -> None:
    if token == ",":
        container.key = ""
    elif scalar and container.key:
        container.members[container.key] = token.strip('"')
    elif scalar:
        container.key = token.strip('"')
        container.members.setdefault(container.key, "")


def _in_toml(source: Source, offset: int, root: type[Struct]) -> FieldPlace | None:
    text = source.text
    headers = list(_HEADER.finditer(text))
    above = [header for header in headers if header.start() <= offset]
    start = above[-1].end() if above else 0
    if offset < start:
        return None
    end = next((header.start() for header in headers if header.start() > offset), len(text))
    keys = list(_KEY.finditer(text, start, end))
    before = [key for key in keys if key.start(2) <= offset]
    written = text[before[-1].start(2) : offset] if before else "\n"
    in_value = "\n" not in written or written.count("[") > written.count("]")
    key = before[-1][1] if before and in_value else ""
    parts = above[-1][1].split(".") if above else []
    members = {found[1]: found[2].strip().strip('"') for found in keys}
    around = [*((_Container(), part) for part in parts), (_Container(members=members), key)]
    words = (w for w in _TOKEN.finditer(text, start, end) if w.start() <= offset <= w.end())
    word = next((w.span() for w in words if w[0] not in "{}[]:,="), (offset, offset))
    return _place(Span(source, *word), around, root)


# --- what is declared


def _place(
    span: Span, around: list[tuple[_Container, str]], root: type[Struct]
) -> FieldPlace | None:
    """A place inside some containers, of each of which is known the key that leads on."""
    objects = [(one, key) for one, key in around if not one.is_array]
    declared = inspect.type_info(root)
    for container, key in objects[:-1]:
        inner = _fields(declared, container.members).get(key)
        declared = _mapped(declared) if inner is None else inner.type
    innermost, key = objects[-1]
    given = frozenset(innermost.members) - {span.text.strip('"')}
    return FieldPlace(span, _fields(declared, innermost.members), given, key)


def _fields(declared: inspect.Type, members: Mapping[str, str]) -> dict[str, inspect.Field]:
    """The fields of a struct; of a union's those that its tag leaves, and the tag."""
    structs = [one for one in _parts(declared) if isinstance(one, inspect.StructType)]
    found: dict[str, inspect.Field] = {}
    tags: dict[str, list[str]] = {}
    for struct in structs:
        if struct.tag_field is not None:
            tags.setdefault(struct.tag_field, []).append(str(struct.tag))
    for struct in structs:
        tag = members.get(struct.tag_field or "")
        if tag == struct.tag or tag not in tags.get(struct.tag_field or "", ()):
            found |= {field.name: field for field in struct.fields}
    for name, values in tags.items():
        found[name] = inspect.Field(name, name, inspect.LiteralType(tuple(values)))
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
