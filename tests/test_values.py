"""Our data classes do what the standard library's do."""

from __future__ import annotations

import copy
import dataclasses
import io
import pickle
from collections.abc import Callable
from typing import Any, Generic, TypeVar

import pytest

from coursebuild import values
from coursebuild.source import Source

T = TypeVar("T")


@values.dataclass(frozen=True, slots=True)
class Point:
    """Two numbers."""

    x: int
    y: int = 2

    @property
    def both(self) -> tuple[int, int]:
        """The two."""
        return self.x, self.y

    @classmethod
    def origin(cls) -> Point:
        """The first of all."""
        return cls(0, 0)


@values.dataclass(frozen=True, slots=True)
class Named(Point):
    """A point with a name."""

    name: str = ""


@values.dataclass(frozen=True, slots=True)
class Box(Generic[T]):
    """Of one thing, and of notes that do not count."""

    content: T
    notes: list[str] = values.field(default_factory=list, repr=False, compare=False, hash=False)
    _cache: dict[str, str] = values.field(
        default_factory=dict, init=False, repr=False, compare=False, hash=False
    )


@values.dataclass(slots=True)
class Open:
    """Can be changed."""

    a: int = 1
    b: list[int] = values.field(default_factory=list)


@values.dataclass(frozen=True, slots=True, eq=False)
class Itself:
    """Equal to nothing but itself."""

    a: int


@values.dataclass(frozen=True, slots=True, order=True)
class Ranked:
    """Can be sorted."""

    a: int
    b: str


@values.dataclass(frozen=True, slots=True)
class Empty:
    """Nothing."""


def test_making() -> None:
    assert Point(1).both == (1, 2)
    assert Point(y=3, x=1) == Point(1, 3) != Point(1, 4)
    assert Point.origin() == Point(0, 0)
    assert Named(1, 2, "p") == Named(name="p", x=1)
    assert Empty() == Empty()
    make: Any = Point
    for values_of, named in (((), {}), ((1, 2, 3), {}), ((1,), {"z": 2})):
        with pytest.raises(TypeError):
            make(*values_of, **named)


def test_each_has_its_own_of_what_is_made() -> None:
    one, two = Box(1), Box(1)
    one.notes.append("x")
    one._cache["k"] = "v"
    assert (two.notes, two._cache) == ([], {})
    assert one == two and hash(one) == hash(two)
    assert Box(1, ["n"]).notes == ["n"]


def test_equality_and_hashes() -> None:
    assert Point(1, 2) != Named(1, 2)
    assert Point(1, 2) != (1, 2)  # type: ignore[comparison-overlap]
    assert hash(Point(1, 2)) == hash((1, 2))
    assert len({Point(1), Point(1, 2), Point(2)}) == 2
    assert Itself(1) != Itself(1)
    assert len({Itself(1), Itself(1)}) == 2
    assert Open() == Open()
    with pytest.raises(TypeError, match="unhashable"):
        hash(Open())
    assert sorted([Ranked(2, "a"), Ranked(1, "b")]) == [Ranked(1, "b"), Ranked(2, "a")]


def test_what_is_frozen_stays() -> None:
    point: Any = Point(1)
    with pytest.raises(dataclasses.FrozenInstanceError, match="cannot assign to field 'x'"):
        point.x = 2
    with pytest.raises(dataclasses.FrozenInstanceError):
        point.z = 2
    with pytest.raises(dataclasses.FrozenInstanceError):
        del point.x
    changing: Any = Open()
    changing.a = 5
    assert changing == Open(5)
    with pytest.raises(AttributeError):
        changing.c = 1
    assert not hasattr(point, "__dict__")


def test_showing() -> None:
    assert repr(Point(1)) == "Point(x=1, y=2)"
    assert repr(Named(1, name="p")) == "Named(x=1, y=2, name='p')"
    assert repr(Box("x")) == "Box(content='x')"
    holder = Open()
    holder.b.append(holder)  # type: ignore[arg-type]
    assert repr(holder) == "Open(a=1, b=[...])"


@values.dataclass(frozen=True, slots=True)
class Counted:
    """Says itself what it is pickled as."""

    x: int

    def __reduce__(self) -> tuple[type[Counted], tuple[int]]:
        return Counted, (self.x + 1,)


class Derived(Point):
    """Not decorated."""

    __slots__ = ()


def test_values_are_pickled_as_what_they_are() -> None:
    assert pickle.loads(pickle.dumps(Counted(1))) == Counted(2)
    derived = pickle.loads(pickle.dumps(Derived(1, 3)))
    assert type(derived) is Derived and derived.both == (1, 3)
    # With a table that does not know their classes they are written as the same bytes.
    for value in (Point(1), Named(1, 2, "n"), Box([Empty(), Ranked(1, "r")]), Source("p", "a")):
        out = io.BytesIO()
        pickler = pickle.Pickler(out, pickle.HIGHEST_PROTOCOL)
        pickler.dispatch_table = {}
        pickler.dump(value)
        assert out.getvalue() == pickle.dumps(value, pickle.HIGHEST_PROTOCOL)


@pytest.mark.parametrize("replace", [values.replace, dataclasses.replace])
def test_a_value_with_other_fields(replace: Callable[..., Any]) -> None:
    assert replace(Named(1, 2, "n"), y=3) == Named(1, 3, "n")
    assert replace(Named(1)) == Named(1)
    with pytest.raises(TypeError):
        replace(Point(1), z=3)


def test_copies() -> None:
    for value in (Point(1), Named(1, 2, "n"), Open(3, [1]), Empty(), Ranked(1, "r")):
        for protocol in range(pickle.HIGHEST_PROTOCOL + 1):
            assert pickle.loads(pickle.dumps(value, protocol)) == value
        assert copy.copy(value) == copy.deepcopy(value) == value
    source = Source("p", "a\nb")
    assert source.line_starts == [0, 2]
    assert pickle.loads(pickle.dumps(source)).line_starts == [0, 2]


def test_the_standard_library_knows_them() -> None:
    assert values.replace(Named(1, name="p"), y=7) == Named(1, 7, "p")
    assert dataclasses.replace(Named(1, name="p"), y=7) == Named(1, 7, "p")
    assert dataclasses.asdict(Point(1)) == {"x": 1, "y": 2}
    assert [field.name for field in dataclasses.fields(Box)] == ["content", "notes", "_cache"]
    assert [field.name for field in dataclasses.fields(Named(1))] == ["x", "y", "name"]
    assert dataclasses.is_dataclass(Point)
    assert Named.__match_args__ == ("x", "y", "name")
    match Named(1, 2, "n"):
        case Named(x, _, name):
            assert (x, name) == (1, "n")
    with pytest.raises(ValueError, match="init=False"):
        dataclasses.replace(Box(1), _cache={})


@pytest.mark.parametrize(
    ("ours", "options"),
    [
        (Point, {"frozen": True, "slots": True}),
        (Open, {"slots": True}),
        (Ranked, {"frozen": True, "slots": True, "order": True}),
    ],
)
def test_like_the_same_class_of_the_standard_library(ours: Any, options: dict[str, bool]) -> None:
    names = [one.name for one in dataclasses.fields(ours)]
    body: dict[str, Any] = {"__annotations__": dict.fromkeys(names, Any)}
    body |= {
        one.name: dataclasses.field(default=one.default, default_factory=one.default_factory)
        for one in dataclasses.fields(ours)
    }
    theirs: Any = dataclasses.dataclass(**options)(type(ours.__name__, (), body))
    for values_of in ((1, "a"), (1, "b"), (2, "a")):
        a, b = ours(*values_of), theirs(*values_of)
        assert repr(a) == repr(b)
        assert (a.__hash__ is None) == (b.__hash__ is None)
        assert a.__slots__ == b.__slots__
        if a.__hash__ is not None:
            assert hash(a) == hash(b)
        assert (a == ours(1, "a")) == (b == theirs(1, "a"))


CALLS: list[tuple[tuple[object, ...], dict[str, object]]] = [
    ((), {}),
    ((1,), {}),
    ((1, 2), {}),
    ((1, 2, [3]), {}),
    ((1, 2, [3], 4), {}),
    ((1, 2, [3], 4, 5), {}),
    ((), {"a": 1}),
    ((1,), {"b": 2}),
    ((1,), {"a": 2}),
    ((1,), {"d": 5}),
    ((), {"c": [3], "b": 2, "a": 1}),
    ((1, 2), {"e": 0}),
]


def some_classes() -> tuple[Any, ...]:
    """New classes, none of which was ever called."""

    @values.dataclass(slots=True)
    class Some:
        a: object
        b: object = 2
        c: list[int] = values.field(default_factory=list)
        d: object = values.field(default=4, init=False)
        seen: object = values.field(init=False)

        def __post_init__(self) -> None:
            self.seen = (self.a, self.b)

    @values.dataclass(slots=True)
    class Other(Some):
        e: object = 1

    class Plain(Other):
        pass

    return Some, Other, Plain


@pytest.mark.parametrize("call", CALLS, ids=repr)
@pytest.mark.parametrize("which", range(3))
def test_the_first_values_are_made_like_the_others(which: int, call: Any) -> None:
    def outcome(cls: Any) -> object:
        try:
            value = cls(*call[0], **call[1])
        except TypeError as error:
            return str(error)
        return [getattr(value, name, None) for name in ("a", "b", "c", "d", "e", "seen")]

    new, used = some_classes()[which], some_classes()[which]
    for _ in range(30):
        used(1)
    assert outcome(new) == outcome(used)
    assert outcome(new) == outcome(used)


def test_a_field_without_a_default_follows_none_with_it() -> None:
    @values.dataclass(frozen=True, slots=True)
    class Wrong:
        first: int = 1
        second: int  # type: ignore[misc]

    with pytest.raises(TypeError, match="Wrong: a field without a default follows one with it"):
        Wrong(1, 2)


def test_the_first_values_do_not_share_what_is_made_for_them() -> None:
    @values.dataclass(frozen=True, slots=True)
    class Holder:
        items: list[int] = values.field(default_factory=list)

    one, other = Holder(), Holder()
    one.items.append(1)
    assert other.items == []


def test_a_class_that_derives_keeps_an_init_of_its_own() -> None:
    @values.dataclass(frozen=True, slots=True)
    class Pair:
        x: int
        y: list[int] = values.field(default_factory=list)

    class Twice(Pair):
        __slots__ = ()

        def __init__(self, x: int) -> None:
            super().__init__(x, [x])

    assert [(one.x, one.y) for one in (Twice(1), Twice(2), Pair(3))] == [
        (1, [1]),
        (2, [2]),
        (3, []),
    ]
