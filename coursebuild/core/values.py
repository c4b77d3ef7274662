"""Values as bytes that hold data only: decoding them runs no code, whoever wrote them.

Entry points: `encode` and `decode`; `fingerprint`, a hash that is the same for equal values.

1. A value consists of texts, numbers, tuples, lists, sets, mappings, structs and members of enums.
   In MessagePack each becomes a list: a number for its type, then its parts. Classes have numbers
   from 16 on; their names stand before the value.
2. Of the classes named there, only structs, named tuples and enums of this package and of features
   are instantiated, and only if each field is of its type.
3. All places in a value are in one source. `encode` leaves it out, `decode` puts it in again.
"""

from __future__ import annotations

import enum
import functools
import hashlib
import importlib
import sys
import zlib
from collections.abc import Callable, Collection, Mapping
from decimal import Decimal
from types import UnionType
from typing import Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

import msgspec
from markupsafe import Markup
from msgspec import Struct

from coursebuild.core.text.source import Excerpt, Source, Span

Value = TypeVar("Value")

_TUPLE, _LIST, _SET, _MAPPING, _MARKUP, _TEXT, _NUMBER, _SOURCE, _SPAN, _EXCERPT, _DECIMAL = range(
    11
)
_FIRST_CLASS = 16
_PLAIN = frozenset((type(None), bool, float, bytes))
_MIN_INT, _INT_END = -(1 << 63), 1 << 64
"""MessagePack holds integers from the first up to the second; others are packed as texts."""
_VALUE_PACKAGES = tuple(
    f"coursebuild.{part}." for part in ("core.model", "core.pages", "features", "numerics")
)
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
    """A value as bytes, without the one source that all its places are in.

    Raises:
        TypeError: a part of it is of a type that cannot be encoded.
    """
    return _Encoder().bytes(value)


def decode(data: bytes | None, kind: type[Value], source: Source | None = None) -> Value | None:
    """The value that `encode` was given; `None` if the bytes hold none of that type."""
    try:
        names, packed = msgspec.msgpack.decode(data or b"", type=tuple[list[str], Any])
        value = _make_builder(names, source)(packed) if type(packed) is list else packed
        fits = _make_type_test(kind)  # type: ignore[arg-type]  # a class has a hash
        return value if fits(value) else None
    except DAMAGE:
        return None


def fingerprint(
    value: object, substitutes: Mapping[type, Callable[[Any], object]] | None = None
) -> str:
    """A hash of a value; the order of a mapping counts.

    `substitutes` has a function for some types: what it returns is hashed in the place of a value.
    """
    return hashlib.sha256(_Encoder(substitutes).bytes(value)).hexdigest()


class _Encoder:
    def __init__(self, substitutes: Mapping[type, Callable[[Any], object]] | None = None) -> None:
        self._substitutes = substitutes or {}
        self._class_numbers: dict[type, int] = {}

    def bytes(self, value: object) -> bytes:
        packed = self.pack(value)
        names = [f"{kind.__module__}:{kind.__qualname__}" for kind in self._class_numbers]
        return msgspec.msgpack.encode((names, packed))

    def pack(self, value: Any) -> Any:
        """The value as lists and scalars that MessagePack can hold."""
        kind = type(value)
        if kind in self._substitutes:
            value = self._substitutes[kind](value)
            kind = type(value)
        if kind is str:
            return value if value.isascii() else _pack_text(value)
        if kind is int:
            return value if _MIN_INT <= value < _INT_END else [_NUMBER, str(value)]
        if kind in _PLAIN:
            return value
        pack = self.pack
        if kind is tuple:
            return [_TUPLE, *[pack(part) for part in value]] if value else []
        if kind is Span:
            return [_SPAN, value.start, value.end]
        if kind is Excerpt:
            offsets = [offset for piece in value.pieces for offset in piece]
            return [_EXCERPT, pack(value.text), *offsets]
        if kind is Source:
            return [_SOURCE]
        if isinstance(value, Struct):
            fields = [pack(getattr(value, name)) for name in value.__struct_fields__]
            return [self._class_number(kind), *fields]
        return self._pack_rare(kind, value)

    def _pack_rare(self, kind: type, value: Any) -> Any:
        pack = self.pack
        if isinstance(value, enum.Enum):
            return [self._class_number(kind), value.name]
        if kind is dict:
            return [_MAPPING, *[pack(part) for item in value.items() for part in item]]
        if kind is list:
            return [_LIST, *[pack(part) for part in value]]
        if kind in (set, frozenset):
            return [_SET, *sorted((pack(part) for part in value), key=msgspec.msgpack.encode)]
        if kind is Decimal:
            return [_DECIMAL, str(value)]
        if kind is Markup:
            return [_MARKUP, pack(str(value))]
        if isinstance(value, tuple):
            return [self._class_number(kind), *[pack(part) for part in value]]
        raise TypeError(f"a {kind.__qualname__} cannot be kept")

    def _class_number(self, kind: type) -> int:
        return self._class_numbers.setdefault(kind, len(self._class_numbers) + _FIRST_CLASS)


def _pack_text(text: str) -> Any:
    try:
        text.encode()
    except UnicodeEncodeError:  # a lone surrogate, as JSON may have one
        return [_TEXT, text.encode("utf-8", "surrogatepass")]
    return text


def _make_builder(names: list[str], source: Source | None) -> Callable[[list[Any]], Any]:
    """Return the function that builds a value of a packed list."""

    def excerpt(text: Any, *offsets: Any) -> Excerpt:
        if source is None or not isinstance(text, str) or set(map(type, offsets)) != {int}:
            raise TypeError("no excerpt")
        return Excerpt(source, text, tuple(zip(offsets[::2], offsets[1::2], strict=True)))

    constructors: dict[int, Callable[..., Any]] = {
        _LIST: lambda *items: list(items),
        _SET: lambda *items: frozenset(items),
        _MAPPING: lambda *items: dict(zip(items[::2], items[1::2], strict=True)),
        _MARKUP: Markup,
        _TEXT: lambda data: data.decode("utf-8", "surrogatepass"),
        _NUMBER: int,
        _DECIMAL: Decimal,
        _SOURCE: lambda: source,
        _EXCERPT: excerpt,
    }
    constructors.update(
        (number, _make_constructor(_find_class(name)))
        for number, name in enumerate(names, _FIRST_CLASS)
    )

    def build(packed: list[Any]) -> Any:
        if not packed:
            return ()
        head = packed[0]
        if head == _SPAN:  # the commonest by far, so it goes first
            _, start, end = packed
            if type(start) is not int or type(end) is not int or source is None:
                raise TypeError("no span")
            return Span(source, start, end)
        items = [build(part) if type(part) is list else part for part in packed]
        if head == _TUPLE:
            return tuple(items[1:])
        return constructors[head](*items[1:])

    return build


def _find_class(name: str) -> type:
    """The class of a name, `MODULE:CLASS`."""
    module, _, inner = name.partition(":")
    kind: Any = _find_module(module)
    for part in inner.split("."):
        kind = vars(kind)[part]
    if isinstance(kind, type) and issubclass(kind, enum.Enum | Struct | tuple):
        return kind
    raise TypeError(f"{name} is no class of values")


@functools.cache
def _make_constructor(kind: Any) -> Callable[..., Any]:
    """Return the function that makes a value of a class, once each field is of its type."""
    if issubclass(kind, enum.Enum):
        return lambda member: kind[member]
    fields = kind.__struct_fields__ if issubclass(kind, Struct) else kind._fields
    has_keyword_fields = len(kind.__match_args__) < len(fields)
    hints = get_type_hints(kind)
    tests = [_make_type_test(hints[field]) for field in fields]

    def make(*items: Any) -> Any:
        for test, item in zip(tests, items, strict=True):
            if not test(item):
                raise TypeError(f"a field of {kind.__qualname__} is of another type")
        return kind(**dict(zip(fields, items, strict=True))) if has_keyword_fields else kind(*items)

    return make


@functools.cache
def _make_type_test(hint: Any) -> Callable[[Any], bool]:
    """Return a test of whether a value is of a type; the fields of structs are tested already."""
    kind, inner = get_origin(hint) or hint, get_args(hint)
    if kind is Literal:
        return inner.__contains__
    if kind in (Union, UnionType):
        plain = tuple(
            member for member in inner if isinstance(member, type) and member is not float
        )
        tests = [_make_type_test(member) for member in inner if member not in plain]
        return lambda value: isinstance(value, plain) or any(test(value) for test in tests)
    if kind is float:
        return lambda value: isinstance(value, float | int)
    if not isinstance(kind, type):  # `Any`, or a variable
        return lambda value: True
    if kind is tuple and inner and inner[-1] is not ...:
        tests = [_make_type_test(member) for member in inner]
        return lambda value: (
            type(value) is tuple
            and len(value) == len(tests)
            and all(test(part) for test, part in zip(tests, value, strict=True))
        )
    if inner and issubclass(kind, Mapping):
        test_key, test_value = map(_make_type_test, inner)
        return lambda value: (
            isinstance(value, kind)
            and all(map(test_key, value))
            and all(map(test_value, value.values()))
        )
    if inner and issubclass(kind, Collection):
        test_item = _make_type_test(inner[0])
        return lambda value: isinstance(value, kind) and all(map(test_item, value))
    return lambda value: isinstance(value, kind)


def _find_module(name: str) -> Any:
    """A module with classes of values; only those in `_VALUE_PACKAGES` are imported."""
    if name not in sys.modules and name.startswith(_VALUE_PACKAGES) and "__" not in name:
        importlib.import_module(name)
    return sys.modules[name]
