"""The texts of a course as they are now, in an editor or on the disk, and what can stand there.

A client counts lines as CommonMark does, and within a line UTF-16 units or those of the agreed
encoding. Other line ends that Python knows, such as U+2028, end no line.

JSON in a fence and a TOML file are read also while they are edited: only brackets, keys and scalars
count, so that mistakes anywhere do no harm. The fields come from the declarations that the decoder
checks against (`schema_roots`).
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import lru_cache
from itertools import chain
from pathlib import Path

import msgspec.inspect as inspect
from lsprotocol import types
from msgspec import Struct
from pygls import uris

from coursebuild.api import Document, Edit, Lesson, Library, Source, Span, regex
from coursebuild.core.files.course_root import MAP
from coursebuild.core.files.read import read_sources
from coursebuild.core.files.write import FileChange
from coursebuild.core.model import Owner
from coursebuild.core.model.course import Words
from coursebuild.core.syntax.course_schema import schema_roots
from coursebuild.core.syntax.document import parse_document
from coursebuild.preview.session import Session

_UNITS = {"utf-8": ("utf-8", 1), "utf-16": ("utf-16-le", 2), "utf-32": ("utf-32-le", 4)}
"""The codec of each encoding, and the bytes of a unit."""


class Places:
    """The paths, offsets and spans of a course as a client writes them."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self.encoding: str = "utf-16"
        self._uris: dict[str, str] = {}
        """The URIs that the client used, by path."""

    def path(self, uri: str) -> str:
        """Return the path of a file relative to the course's folder; empty for files outside."""
        try:
            file = Path((uri.startswith("file:") and uris.to_fs_path(uri)) or "/")
            full = file.parent.resolve() / file.name
        except (ValueError, RuntimeError):  # no name of a file, as with NUL; links in a circle
            return ""
        if not full.is_relative_to(self.root):
            return ""
        path = full.relative_to(self.root).as_posix()
        self._uris[path] = uri
        return path

    def uri(self, path: str) -> str:
        """Return the URI of a file of the course."""
        return self._uris.get(path) or uris.from_fs_path(str(self.root / path)) or ""

    def offset(self, source: Source, position: types.Position) -> int:
        """Return the offset of a position, or the nearest that exists."""
        if position.line >= len(source.line_starts):
            return len(source.text)
        codec, size = _UNITS[self.encoding]
        units = source.line_text(position.line + 1).encode(codec)[: position.character * size]
        return source.line_starts[position.line] + len(units.decode(codec, "ignore"))

    def position(self, source: Source, offset: int) -> types.Position:
        """Return the position of an offset."""
        codec, size = _UNITS[self.encoding]
        line, column = source.position(offset)
        before = source.line_text(line)[: column - 1]
        return types.Position(line - 1, len(before.encode(codec)) // size)

    def range(self, span: Span) -> types.Range:
        """Return the range of a span."""
        start, end = (self.position(span.source, offset) for offset in (span.start, span.end))
        return types.Range(start, end)

    def location(self, span: Span) -> types.Location:
        """Return the file and the range of a span."""
        return types.Location(self.uri(span.path), self.range(span))

    def changes(self, edits: Iterable[Edit]) -> dict[str, list[types.TextEdit]]:
        """Return edits by the URIs of their files."""
        changes: dict[str, list[types.TextEdit]] = {}
        for edit in edits:
            file_edits = changes.setdefault(self.uri(edit.span.path), [])
            file_edits.append(types.TextEdit(self.range(edit.span), edit.text))
        return changes

    def document_edits(self, edits: Iterable[Edit]) -> list[types.TextDocumentEdit]:
        """Return the same in the form that can stand beside changes of files."""
        identifier = types.OptionalVersionedTextDocumentIdentifier
        changes = self.changes(edits).items()
        return [types.TextDocumentEdit(identifier(uri), edits) for uri, edits in changes]

    def change_files(
        self, edits: Iterable[Edit], files: Sequence[FileChange]
    ) -> types.WorkspaceEdit:
        """Return edits together with whole new texts of other files, some of which may be new."""
        sources = ((file, Source(file.path, (file.old or b"").decode())) for file in files)
        new_texts = [Edit(source.span(), (file.new or b"").decode()) for file, source in sources]
        new_files = [types.CreateFile(self.uri(file.path)) for file in files if file.old is None]
        return types.WorkspaceEdit(
            document_changes=[*new_files, *self.document_edits([*edits, *new_texts])]
        )


class OpenTexts(Struct, frozen=True):
    """The texts of a course as they are now."""

    session: Session
    library: Library
    """The course as it was last read."""
    places: Places

    def source(self, path: str) -> Source:
        """Return the text of a file of the course; an empty one where there is no such file."""
        read = read_sources(self.session.root, [path], self.session.open_texts)
        return next(iter(read.value), Source(path, ""))

    def document(self, source: Source) -> Document | None:
        """Return the document of a lesson or page; `None` for other texts, and those too long."""
        owner = self.owner(source)
        if owner is None:
            return None
        course = self.library.course
        words = course.words_of(owner)
        return _parse(source, course.callout_names, isinstance(owner, Lesson), words)

    def owner(self, source: Source) -> Owner | None:
        """Return the lesson or page of a text, unless the text is too long to be read."""
        course = self.library.course
        owners = course.owners if len(source.text) <= course.limits.text else ()
        return next((owner for owner in owners if owner.path == source.path), None)


@lru_cache(maxsize=16)
def _parse(source: Source, callouts: frozenset[str], lesson: bool, words: Words) -> Document:
    """Cached, since an editor sends many requests about the same text."""
    return parse_document(source, callouts, lesson=lesson, words=words).value


# --- the fields that there can be at a place

_FENCE = regex(
    r"^[ \t>]*(?P<marks>`{3,}+|~{3,}+)[ \t]*(?P<kind>[\w-]*).*\n(?P<body>[\s\S]*?)"
    # An unclosed fence ends where the next one begins.
    r"(?:(?=^[ \t>]*(?P=marks)[ \t]*\w)|^[ \t>]*(?P=marks).*|\Z)",
    re.MULTILINE,
)
_TOKEN = r'[{}\[\]:,=]|"(?:[^"\\\n]|\\.)*"|"[\w./-]*|[^\s"{}\[\]:,=>]+'
_JSON = regex(_TOKEN)
_TOML = regex(
    rf"(?:^[ \t]*\[\[?(?P<header>[\w. -]+)\]\]?[ \t\r]*)?(?:#.*)?\n|{_TOKEN}", re.MULTILINE
)


class FieldPlace(Struct, frozen=True):
    """The place of a key or a value, or one where it can be inserted."""

    span: Span
    """What is there of it, with quotes."""
    fields: Mapping[str, inspect.Field]
    """The fields that the enclosing object can have, by name."""
    keys: frozenset[str]
    """The keys that the enclosing object has."""
    key: str = ""
    """The key whose value this is; empty where this is a key."""

    @property
    def text(self) -> str:
        """The key or value without quotes."""
        return self.span.text.strip('"')

    @property
    def field(self) -> inspect.Field | None:
        """The field of the key or the value."""
        return self.fields.get(self.key or self.text)


class _Object(Struct):
    """An object or table, as far as it has been read."""

    key: str = ""
    """The key whose value comes next."""
    members: dict[str, str] = {}
    """The text of each scalar, by key; empty for other values."""

    def read(self, token: str) -> None:
        """Read the next token that is not part of a nested object or array."""
        if token[-1] in ",\n":
            self.key = ""
        elif self.key and token not in ":=":
            self.members[self.key] = token.strip('"')
        elif token not in ":=":
            self.key = token.strip('"')
            self.members.setdefault(self.key, "")


def field_place(source: Source, offset: int) -> FieldPlace | None:
    """Return the place of a key or a value at an offset, where its declaration is known."""
    if source.path == MAP:
        kind, body = "course", source.span()
    elif source.path.startswith("models/") and source.path.endswith(".toml"):
        kind, body = "model", source.span()
    else:
        kind, body = fence_at(source, offset) or ("", source.span(0, 0))
    if kind not in (roots := schema_roots()):
        return None
    span, objects = _find_token(body, offset)
    if not objects:
        return None
    declared_type = inspect.type_info(roots[kind][0])
    for object, key in objects[:-1]:
        field = _fields(declared_type, object.members).get(key)
        if field is not None:
            declared_type = field.type
            continue
        mappings = (t for t in _alternatives(declared_type) if isinstance(t, inspect.DictType))
        declared_type = next((mapping.value_type for mapping in mappings), inspect.AnyType())
    innermost, key = objects[-1]
    keys = frozenset(innermost.members) - {span.text.strip('"')}
    return FieldPlace(span, _fields(declared_type, innermost.members), keys, key)


def fence_at(source: Source, offset: int) -> tuple[str, Span] | None:
    """Return the kind of the fence around an offset, and the text between its marks."""
    for fence in _FENCE.finditer(source.text):
        if fence.start("body") <= offset <= fence.end("body"):
            return fence["kind"], source.span(*fence.span("body"))
    return None


def _find_token(body: Span, offset: int) -> tuple[Span, list[tuple[_Object, str]]]:
    """Return the token at an offset, and the objects around it, each with the key that leads there.

    All of the body is read, since an object can have further keys after the offset.
    """
    is_toml = body.path.endswith(".toml")
    stack: list[_Object | None] = [_Object()] if is_toml else []  # `None` is an array
    position: tuple[Span, list[tuple[_Object, str]]] | None = None
    for match in (_TOML if is_toml else _JSON).finditer(body.text + "\n}"):
        token, start, end = match[0], body.start + match.start(), body.start + match.end()
        is_scalar = token[-1] not in "\n{}[]:,="
        if position is None and (end > offset or (end == offset and is_scalar)):
            bounds = (start, end) if is_scalar and start <= offset else (offset, offset)
            objects = [(object, object.key) for object in stack if object is not None]
            position = Span(body.source, *bounds), objects if match.lastgroup is None else []
        if match.lastgroup is not None:
            stack = [*map(_Object, match["header"].split(".")), _Object()]
        elif token in "{[":
            stack.append(_Object() if token == "{" else None)
        elif token in "}]":
            del stack[-1:]
        elif stack and stack[-1] is not None:
            stack[-1].read(token)
    assert position is not None  # the bracket added at the end is after every offset
    return position


# --- declarations


def _fields(declared_type: inspect.Type, members: Mapping[str, str]) -> dict[str, inspect.Field]:
    """Return the fields of a struct; of a union, the tag and the fields that its value admits."""
    structs = [t for t in _alternatives(declared_type) if isinstance(t, inspect.StructType)]
    tag = next((struct.tag_field for struct in structs if struct.tag_field), "")
    with_tag = [struct for struct in structs if tag and struct.tag == members.get(tag)]
    fields = {field.name: field for struct in with_tag or structs for field in struct.fields}
    if tag:
        kinds = inspect.LiteralType(tuple(str(struct.tag) for struct in structs))
        fields[tag] = inspect.Field(tag, tag, kinds)
    return fields


def _alternatives(declared_type: inspect.Type) -> Iterator[inspect.Type]:
    """Yield the types of a union, and of the items of an array."""
    match declared_type:
        case inspect.Metadata():
            yield from _alternatives(declared_type.type)
        case inspect.UnionType():
            yield from chain.from_iterable(map(_alternatives, declared_type.types))
        case inspect.VarTupleType():
            yield from _alternatives(declared_type.item_type)
        case inspect.TupleType():
            yield from chain.from_iterable(map(_alternatives, declared_type.item_types))
        case _:
            yield declared_type


def possible_values(declared_type: inspect.Type) -> tuple[str, ...]:
    """Return the possible values of a field as text, where they can be listed."""
    values: list[str] = []
    for alternative in _alternatives(declared_type):
        if isinstance(alternative, inspect.LiteralType):
            values += (f'"{value}"' for value in alternative.values)
        elif isinstance(alternative, inspect.BoolType):
            values += ("true", "false")
    return tuple(values)
