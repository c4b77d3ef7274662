"""Values as bytes that hold nothing but data: reading them runs no code, whoever wrote them.

Entry points: `encode` and `decode`; `fingerprint`, a hash that is the same for equal values.

1. A value is made of texts, numbers, tuples, lists, sets, mappings, structs and members of enums.
   It becomes lists in MessagePack: a number that says what the list is, then what is in it. Classes
   have numbers from 16 on, and are named at the beginning.
2. Only structs, named tuples and enums of this package and of features are made of a name, and
   only where each field is of its type.
3. All places in a value are in one source. It is left out, and put in again by `decode`.
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
_LEAST, _MOST = -(1 << 63), 1 << 64
"""Numbers beyond these are texts in MessagePack."""
_WITH_VALUES = tuple(
    f"coursebuild.{part}." for part in ("core.model", "core.pages", "features", "numerics")
)
"""Where modules are that may have to be imported."""
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
        TypeError: there is something in it that is no such value.
    """
    try:
        return _Encoder().bytes(value)
    except UnicodeEncodeError:  # half a character, as JSON may have one
        return _Encoder(escaped=True).bytes(value)


def decode(data: bytes | None, kind: type[Value], source: Source | None = None) -> Value | None:
    """The value of a type that `encode` was given; `None` where the bytes are none of such."""
    try:
        names, packed = msgspec.msgpack.decode(data or b"", type=tuple[list[str], Any])
        found = _builder(names, source)(packed) if type(packed) is list else packed
        fits = _type_test(kind)  # type: ignore[arg-type]  # a class has a hash
        return found if fits(found) else None
    except DAMAGE:
        return None


def fingerprint(value: object, shown: Mapping[type, Callable[[Any], object]] | None = None) -> str:
    """A hash of a value; the order of a mapping counts.

    `shown` gives what counts of values of some types.
    """
    try:
        data = _Encoder(shown).bytes(value)
    except UnicodeEncodeError:
        data = _Encoder(shown, escaped=True).bytes(value)
    return hashlib.sha256(data).hexdigest()


class _Encoder:
    def __init__(
        self, shown: Mapping[type, Callable[[Any], object]] | None = None, *, escaped: bool = False
    ) -> None:
        self._shown = shown or {}
        self._escaped = escaped
        self._numbers: dict[type, int] = {}

    def bytes(self, value: object) -> bytes:
        packed = self.pack(value)
        names = [f"{kind.__module__}:{kind.__qualname__}" for kind in self._numbers]
        return msgspec.msgpack.encode((names, packed))

    def pack(self, value: Any) -> Any:
        """The value as MessagePack can hold it."""
        kind = type(value)
        if kind in self._shown:
            value = self._shown[kind](value)
            kind = type(value)
        if kind is str:
            return self._text(value) if self._escaped else value
        if kind is int:
            return value if _LEAST <= value < _MOST else [_NUMBER, str(value)]
        if kind in _PLAIN:
            return value
        pack = self.pack
        if kind is tuple:
            return [_TUPLE, *[pack(one) for one in value]] if value else []
        if kind is Span:
            return [_SPAN, value.start, value.end]
        if kind is Excerpt:
            pieces = [at for piece in value.pieces for at in piece]
            return [_EXCERPT, pack(value.text), *pieces]
        if kind is Source:
            return [_SOURCE]
        if isinstance(value, Struct):
            fields = [pack(getattr(value, name)) for name in value.__struct_fields__]
            return [self._number(kind), *fields]
        return self._rest(kind, value)

    def _rest(self, kind: type, value: Any) -> Any:
        pack = self.pack
        if isinstance(value, enum.Enum):
            return [self._number(kind), value.name]
        if kind is dict:
            return [_MAPPING, *[pack(one) for item in value.items() for one in item]]
        if kind is list:
            return [_LIST, *[pack(one) for one in value]]
        if kind in (set, frozenset):
            return [_SET, *sorted((pack(one) for one in value), key=msgspec.msgpack.encode)]
        if kind is Decimal:
            return [_DECIMAL, str(value)]
        if kind is Markup:
            return [_MARKUP, pack(str(value))]
        if isinstance(value, tuple):
            return [self._number(kind), *[pack(one) for one in value]]
        raise TypeError(f"a {kind.__qualname__} cannot be kept")

    def _number(self, kind: type) -> int:
        return self._numbers.setdefault(kind, len(self._numbers) + _FIRST_CLASS)

    def _text(self, text: str) -> Any:
        try:
            text.encode()
        except UnicodeEncodeError:
            return [_TEXT, text.encode("utf-8", "surrogatepass")]
        return text


def _builder(names: list[str], source: Source | None) -> Callable[[list[Any]], Any]:
    """What makes a value of a list."""

    def excerpt(text: Any, *at: Any) -> Excerpt:
        if source is None or not isinstance(text, str) or set(map(type, at)) != {int}:
            raise TypeError("no excerpt")
        return Excerpt(source, text, tuple(zip(at[::2], at[1::2], strict=True)))

    makers: dict[int, Callable[..., Any]] = {
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
    makers.update((number, _maker(_class(name))) for number, name in enumerate(names, _FIRST_CLASS))

    def build(packed: list[Any]) -> Any:
        if not packed:
            return ()
        head = packed[0]
        if head == _SPAN:  # of these there are as many as of all others
            _, start, end = packed
            if type(start) is not int or type(end) is not int or source is None:
                raise TypeError("no span")
            return Span(source, start, end)
        items = [build(one) if type(one) is list else one for one in packed]
        if head == _TUPLE:
            return tuple(items[1:])
        return makers[head](*items[1:])

    return build


def _class(name: str) -> type:
    """The class of a name."""
    module, _, inner = name.partition(":")
    kind: Any = _module(module)
    for part in inner.split("."):
        kind = vars(kind)[part]
    if isinstance(kind, type) and issubclass(kind, enum.Enum | Struct | tuple):
        return kind
    raise TypeError(f"{name} is no class of values")


@functools.cache
def _maker(kind: Any) -> Callable[..., Any]:
    """What makes a value of a class, of fields that must be of their types."""
    if issubclass(kind, enum.Enum):
        return lambda member: kind[member]
    fields = kind.__struct_fields__ if issubclass(kind, Struct) else kind._fields
    named = len(kind.__match_args__) < len(fields)
    hints = get_type_hints(kind)
    tests = [_type_test(hints[field]) for field in fields]

    def make(*items: Any) -> Any:
        for test, item in zip(tests, items, strict=True):
            if not test(item):
                raise TypeError(f"a field of {kind.__qualname__} is of another type")
        return kind(**dict(zip(fields, items, strict=True))) if named else kind(*items)

    return make


@functools.cache
def _type_test(hint: Any) -> Callable[[Any], bool]:
    """What tells whether a value is of a type; what is in structs has been tested."""
    kind, inner = get_origin(hint) or hint, get_args(hint)
    if kind is Literal:
        return inner.__contains__
    if kind in (Union, UnionType):
        plain = tuple(one for one in inner if isinstance(one, type) and one is not float)
        tests = [_type_test(one) for one in inner if one not in plain]
        return lambda value: isinstance(value, plain) or any(test(value) for test in tests)
    if kind is float:
        return lambda value: isinstance(value, float | int)
    if not isinstance(kind, type):  # `Any`, or a variable
        return lambda value: True
    if kind is tuple and inner and inner[-1] is not ...:
        row = [_type_test(one) for one in inner]
        return lambda value: (
            type(value) is tuple
            and len(value) == len(row)
            and all(test(one) for test, one in zip(row, value, strict=True))
        )
    if inner and issubclass(kind, Mapping):
        of_key, of_value = map(_type_test, inner)
        return lambda value: (
            isinstance(value, kind)
            and all(map(of_key, value))
            and all(map(of_value, value.values()))
        )
    if inner and issubclass(kind, Collection):
        of_one = _type_test(inner[0])
        return lambda value: isinstance(value, kind) and all(map(of_one, value))
    return lambda value: isinstance(value, kind)


def _module(name: str) -> Any:
    """A module with classes of values; of others nothing is imported."""
    if name not in sys.modules and name.startswith(_WITH_VALUES) and "__" not in name:
        importlib.import_module(name)
    return sys.modules[name]
