"""Values with one field changed: for each field of each type of struct inside a value."""

from __future__ import annotations

import enum
import functools
from collections.abc import Collection, Iterator, Mapping
from decimal import Decimal
from types import NoneType, UnionType
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

from markupsafe import Markup
from msgspec import NODEFAULT, Struct
from msgspec.structs import fields, replace

from coursebuild.core.model import Document
from coursebuild.core.model.results import Reports
from coursebuild.core.text.source import Excerpt, Source, Span
from coursebuild.numerics.reports.case_report import CaseReport
from coursebuild.numerics.reports.diet_report import DietReport
from coursebuild.numerics.reports.scene_report import SceneReport

SOURCE = Source("a/place.md", "A text.\n")
OPAQUE = (Document, Excerpt, Source, Span)
"""Values that are changed as wholes: a text and places in it."""


def changes(value: object) -> dict[str, Any]:
    """Values with one field changed, by the name of the field, such as `Lesson.title`.

    Each field of a type is changed once, in the first value of that type where it is not empty.
    """
    values_by_name: dict[str, tuple[bool, Any]] = {}
    for name, is_filled, changed in _changes(value):
        if name not in values_by_name or (is_filled and not values_by_name[name][0]):
            values_by_name[name] = is_filled, changed
    return {name: changed for name, (_, changed) in values_by_name.items()}


def _changes(value: Any) -> Iterator[tuple[str, bool, Any]]:
    if isinstance(value, OPAQUE):
        return
    if isinstance(value, Struct):
        for name, hint in _hints(type(value)).items():
            part = getattr(value, name)
            label = f"{type(value).__name__}.{name}"
            yield label, bool(part), replace(value, **{name: replacement(part, hint)})
            for inner, is_filled, changed in _changes(part):
                yield inner, is_filled, replace(value, **{name: changed})
    elif isinstance(value, tuple):
        for i, part in enumerate(value):
            for inner, is_filled, changed in _changes(part):
                yield inner, is_filled, (*value[:i], changed, *value[i + 1 :])
    elif isinstance(value, Mapping):
        for key, part in value.items():
            for inner, is_filled, changed in _changes(part):
                yield inner, is_filled, {**value, key: changed}


@functools.cache
def _hints(kind: type[Struct]) -> dict[str, Any]:
    """The types of the fields of a struct, also of those that its module imports for types only."""
    names = {struct.__name__: struct for struct in _subclasses(Struct)}
    hints = get_type_hints(kind, localns=names)
    if kind is Reports:  # the core does not say what reports are
        hints |= {"scenes": Mapping[str, SceneReport], "diets": Mapping[str, DietReport]}
        hints["cases"] = tuple[CaseReport, ...]
    return {name: hints[name] for name in kind.__struct_fields__}


def _subclasses(kind: type) -> Iterator[type]:
    for subclass in kind.__subclasses__():
        yield subclass
        yield from _subclasses(subclass)


def replacement(value: Any, hint: Any) -> Any:
    """Another value of a type."""
    kind = get_origin(hint) or hint
    members = get_args(hint)
    if kind is Literal:
        return next(member for member in members if member != value)
    if value is None:
        return make(
            next(member for member in members if member is not NoneType) if members else str
        )
    if isinstance(value, tuple) and members and members[-1] is not ...:
        return tuple(map(replacement, value, members))
    match value:
        case bool():
            return not value
        case enum.Enum():
            return next(member for member in type(value) if member is not value)
        case int() | float() | Decimal():
            return value + 1
        case str() | bytes():
            return value + type(value)(b"x" if isinstance(value, bytes) else "x")  # type: ignore[operator,arg-type]
        case Source():
            return Source(value.path, f"{value.text}x\n")
        case Span() | Excerpt() | Document():
            return make(type(value))
        case Struct():
            return next(changed for _, _, changed in _changes(value))
        case Mapping() | Collection():
            if value:
                return type(value)()
            return make(hint)
    raise TypeError(f"no other {type(value)}")


def make(hint: Any) -> Any:
    """Some value of a type, and no empty one."""
    kind, members = get_origin(hint) or hint, get_args(hint)
    if kind is Literal:
        return members[0]
    if kind in (Union, UnionType):
        return make(next(member for member in members if member is not NoneType))
    if getattr(kind, "__metadata__", None) or hasattr(hint, "__metadata__"):
        return make(members[0])
    if kind in (int, float, Decimal, bool):
        return kind(1)
    if kind in (str, object, Any, Markup):
        return Markup("made") if kind is Markup else "made"
    if kind is bytes:
        return b"made"
    if kind is Span:
        return SOURCE.span(0, 1)
    if kind is Excerpt:
        return Excerpt(SOURCE, "A", ((0, 0),))
    if kind is Source:
        return SOURCE
    if kind is Document:
        return Document(SOURCE, (), ())
    if issubclass(kind, enum.Enum):
        return next(iter(kind))
    if issubclass(kind, Struct):
        if kind is Struct:
            return make(Sample)
        hints = _hints(kind)
        required = (f.name for f in fields(kind) if f.default is f.default_factory is NODEFAULT)
        return kind(**{name: make(hints[name]) for name in required})
    if issubclass(kind, tuple):
        return tuple(make(member) for member in members if member is not ...)
    if issubclass(kind, Mapping):
        return {make(members[0]): make(members[1])}
    return kind((make(members[0]),))


class Sample(Struct, frozen=True):
    """Any struct."""

    text: str
