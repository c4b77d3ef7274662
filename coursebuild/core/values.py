"""Values as bytes that hold data only: decoding them runs no code, whoever wrote them.

In MessagePack each value that is no scalar becomes a list: a number for its type, then its parts.
The names of structs, named tuples and enums stand before the value. Of these, only classes of this
package and of features are instantiated. Whether their fields are of their types is not looked at:
what is kept is sealed (`core.files.trust`). All places in a value are in one source, which `encode`
leaves out and `decode` puts in again.

msgspec makes the bytes, and not the lists: it decodes a union of structs only where each class is
known and tagged when the union is declared, and the classes of `FeatureBlock` are those of the
features that a course happens to have.
"""

from __future__ import annotations

import enum
import hashlib
import importlib
import sys
import zlib
from collections.abc import Callable, Iterable, Mapping
from decimal import Decimal
from itertools import chain
from operator import attrgetter
from typing import Any, TypeVar, get_origin

import msgspec
from markupsafe import Markup
from msgspec import Struct

from coursebuild.core.text.source import Excerpt, Source, Span

Value = TypeVar("Value")

_PLAIN = frozenset((type(None), bool, float, bytes, int, str))
"""What MessagePack holds; of integers and texts only those that fit 64 bits and UTF-8. If one does
not, all of the value are packed."""
_PARTS: dict[type, Callable[[Any], Iterable[Any]]] = {
    tuple: iter,
    list: iter,
    frozenset: iter,
    dict: lambda value: chain.from_iterable(value.items()),
    Markup: lambda value: (str(value),),
    str: lambda value: (value.encode("utf-8", "surrogatepass"),),
    int: lambda value: (str(value),),
    Source: lambda value: (),
    Span: lambda value: (value.start, value.end),
    Excerpt: lambda value: (value.text, *chain.from_iterable(value.pieces)),
    Decimal: lambda value: (str(value),),
}
"""What a value of each type consists of. The number of a type is its index; others come after."""
_VALUE_PACKAGES = tuple(f"coursebuild.{part}." for part in ("core.model", "core.pages", "features"))
"""Packages with classes of values; `decode` imports their modules if need be."""
DAMAGE = (
    ArithmeticError,
    AttributeError,
    ImportError,
    LookupError,
    MemoryError,
    RecursionError,
    TypeError,
    ValueError,
    msgspec.MsgspecError,
    zlib.error,
)
"""What reading damaged bytes may raise."""


def encode(value: object) -> bytes:
    """A value as bytes, without its one source; a part of no such type raises TypeError."""
    return _to_bytes(value, {})


def decode(data: bytes | None, kind: type[Value], source: Source | None = None) -> Value | None:
    """The value that `encode` was given; `None` if the bytes hold none of that class."""
    try:
        names, packed = msgspec.msgpack.decode(data or b"", type=tuple[list[str], Any])
        value = _make_builder(names, source)(packed) if type(packed) is list else packed
        return value if isinstance(value, get_origin(kind) or kind) else None
    except DAMAGE:
        return None


def fingerprint(value: object, substitutes: Mapping[type, Callable[[Any], object]] = {}) -> str:
    """A hash of a value; the order of a mapping counts.

    What `substitutes` make of values of some types is hashed in the place of these.
    """
    return hashlib.sha256(_to_bytes(value, substitutes)).hexdigest()


def _to_bytes(value: object, substitutes: Mapping[type, Callable[[Any], object]]) -> bytes:
    try:
        return _Encoder(substitutes, _PLAIN).bytes(value)
    except (OverflowError, UnicodeEncodeError):
        return _Encoder(substitutes, _PLAIN - {int, str}).bytes(value)


class _Encoder:
    def __init__(
        self, substitutes: Mapping[type, Callable[[Any], object]], plain: frozenset[type]
    ) -> None:
        self._substitutes = substitutes
        self._plain = plain
        self._class_numbers = {kind: number for number, kind in enumerate(_PARTS)}
        self._parts = dict(_PARTS)

    def bytes(self, value: object) -> bytes:
        packed = value if type(value) in self._plain else self.pack(value)
        kinds = [*self._class_numbers][len(_PARTS) :]
        names = [f"{kind.__module__}:{kind.__qualname__}" for kind in kinds]
        return msgspec.msgpack.encode((names, packed))

    def pack(self, value: Any) -> Any:
        """The value, which is not plain, as lists and scalars that MessagePack can hold."""
        kind, plain, pack = type(value), self._plain, self.pack
        if kind in self._substitutes:
            value = self._substitutes[kind](value)
            kind = type(value)
            if kind in plain:
                return value
        kind = frozenset if kind is set else kind
        parts = self._parts.get(kind)
        if parts is None:
            self._class_numbers[kind] = len(self._class_numbers)
            parts = self._parts[kind] = _parts_of(kind)
        items = [part if type(part) in plain else pack(part) for part in parts(value)]
        if kind is frozenset:
            items.sort(key=msgspec.msgpack.encode)
        return [self._class_numbers[kind], *items]


def _parts_of(kind: type) -> Callable[[Any], Iterable[Any]]:
    if issubclass(kind, Struct):
        names = kind.__struct_fields__
        if len(names) > 1:
            return attrgetter(*names)  # all at once
        return lambda value: [getattr(value, name) for name in names]
    if issubclass(kind, enum.Enum):
        return lambda value: (value.name,)
    if issubclass(kind, tuple):
        return iter
    raise TypeError(f"a {kind.__qualname__} cannot be kept")


def _make_builder(names: list[str], source: Source | None) -> Callable[[list[Any]], Any]:

    def span(start: Any, end: Any) -> Span:
        if type(start) is not int or type(end) is not int or source is None:
            raise TypeError("no span")
        return Span(source, start, end)

    def excerpt(text: Any, *offsets: Any) -> Excerpt:
        if source is None or not isinstance(text, str) or set(map(type, offsets)) != {int}:
            raise TypeError("no excerpt")
        return Excerpt(source, text, tuple(zip(offsets[::2], offsets[1::2], strict=True)))

    constructors: dict[type, Callable[..., Any]] = {
        tuple: lambda *items: items,
        list: lambda *items: list(items),
        frozenset: lambda *items: frozenset(items),
        dict: lambda *items: dict(zip(items[::2], items[1::2], strict=True)),
        int: int,
        str: lambda data: data.decode("utf-8", "surrogatepass"),
        Decimal: Decimal,
        Markup: Markup,
        Span: span,
        Excerpt: excerpt,
        Source: lambda: source,
    }
    by_number = [constructors[kind] for kind in _PARTS]
    for name in names:
        module, _, inner = name.partition(":")
        if module not in sys.modules and module.startswith(_VALUE_PACKAGES) and "__" not in module:
            importlib.import_module(module)
        kind: Any = sys.modules[module]
        for part in inner.split("."):
            kind = vars(kind)[part]
        if not isinstance(kind, type) or not issubclass(kind, enum.Enum | Struct | tuple):
            raise TypeError(f"{name} is no class of values")
        by_number.append(_constructor_of(kind))

    def build(packed: list[Any]) -> Any:
        number, *parts = packed
        return by_number[number](*[build(part) if type(part) is list else part for part in parts])

    return build


def _constructor_of(kind: Any) -> Callable[..., Any]:
    """The function that makes a value of a class from its parts."""
    if issubclass(kind, enum.Enum):
        return lambda member: kind[member]
    fields = kind.__struct_fields__ if issubclass(kind, Struct) else kind._fields
    if len(kind.__match_args__) < len(fields):  # some are given by their names only
        return lambda *items: kind(**dict(zip(fields, items, strict=True)))
    constructor: Callable[..., Any] = kind
    return constructor
