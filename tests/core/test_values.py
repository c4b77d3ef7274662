"""Values as bytes: decoding gives equal values, and foreign bytes run no code."""

from __future__ import annotations

import enum
import os
import sys
from typing import Any

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st
from markupsafe import Markup

from coursebuild.core.model import Heading, Mode, Text
from coursebuild.core.model.results import Outcome
from coursebuild.core.model.walk import DisplayFormula
from coursebuild.core.text.diagnostics import diagnose
from coursebuild.core.text.source import Excerpt, Source, Span
from coursebuild.core.values import decode, encode, fingerprint

SOURCE = Source("content/a.md", "# One\n\ntwo\n")
SPAN = SOURCE.span(2, 5)

ATOMS = st.one_of(
    *(st.none(), st.booleans(), st.integers(), st.floats(allow_nan=False), st.binary(max_size=9)),
    *(st.text(max_size=9), st.text("\ud800a", max_size=3), st.decimals(allow_nan=False)),
    st.just(Markup("<b>")),
)
VALUES = st.recursive(
    ATOMS,
    lambda inner: st.one_of(
        st.lists(inner, max_size=4),
        st.lists(inner, max_size=4).map(tuple),
        st.dictionaries(st.text(max_size=4) | st.integers(), inner, max_size=4),
        st.frozensets(ATOMS, max_size=4),
    ),
    max_leaves=12,
)


@given(VALUES)
def test_decoding_gives_the_encoded_value(value: object) -> None:
    value_again = decode(encode(value), object)
    assert value_again == value or value is None
    assert type(value_again) is type(value)
    assert fingerprint(value) == fingerprint(value_again)


def test_decoded_places_are_in_the_given_source() -> None:
    value = (
        Heading(SPAN, 1, (Text(SPAN, "One"),), "one", True),
        Excerpt(SOURCE, "One\ntwo", ((0, 2), (4, 7))),
        diagnose("link-broken", SPAN, "nowhere"),
        Outcome.OK,
        DisplayFormula(0, "x", None, "one"),
        SOURCE,
    )
    data = encode(value)
    assert decode(data, tuple, SOURCE) == value
    assert SOURCE.text.encode() not in data
    assert decode(data, list, SOURCE) is None
    assert fingerprint(value) != fingerprint(value, {Span: lambda span: None})
    spans = (SOURCE.span(0, 1), SOURCE.span(7, 8))
    assert len({fingerprint(span, {Span: lambda span: None}) for span in spans}) == 1


def test_a_value_of_another_class_is_none() -> None:
    assert decode(encode(Outcome.OK), Mode) is None
    assert decode(encode(([1], "a")), list[object]) is None


@pytest.mark.parametrize(
    ("kind", "parts"),
    [(Span, ("2", 5)), (Excerpt, (7, ((0, 2),))), (Excerpt, ("One", ((0, "2"),)))],
)
def test_a_place_that_is_none_is_refused(kind: Any, parts: tuple[Any, ...]) -> None:
    assert decode(encode((kind(SOURCE, *parts),)), tuple, SOURCE) is None


def test_equal_sets_have_one_fingerprint() -> None:
    names = [f"name{number}" for number in range(50)]
    assert fingerprint(frozenset(names)) == fingerprint(frozenset(reversed(names)))


def test_other_objects_cannot_be_encoded() -> None:
    for value in (object(), os.system, [lambda: None], {"a": sys}):
        with pytest.raises(TypeError):
            encode(value)


@given(st.binary(max_size=60))
def test_any_bytes_are_read(data: bytes) -> None:
    decode(data, object)


class Trap(enum.Enum):
    """An enum is made by name only, and nothing else of its module."""

    SPRUNG = "sprung"


@pytest.mark.parametrize(
    ("name", "arguments"),
    [
        ("os:system", ["exit 1"]),
        ("builtins:eval", ["1"]),
        ("builtins:tuple", [[0]]),
        ("subprocess:Popen", ["true"]),
        ("coursebuild.core.text.source:Source.span", [1]),
        ("coursebuild.core.values:decode", [b""]),
        ("coursebuild.features.__main__:x", []),
        ("coursebuild.features.__init__:X", []),  # a module a second time
        ("coursebuild.cli.build:run", [1]),
        ("no.such.module:X", []),
        ("coursebuild.core.model.blocks:NoSuch", []),
        ("coursebuild.core.model.blocks:Heading", []),
        ("coursebuild.core.model.blocks:Mode", ["NO_SUCH"]),
        ("", []),
    ],
)
def test_foreign_bytes_make_nothing_but_values(name: str, arguments: list[Any]) -> None:
    modules_before = set(sys.modules)
    assert decode(msgspec.msgpack.encode(([name], [11, *arguments])), object) is None
    new_modules = set(sys.modules) - modules_before
    assert not {name for name in new_modules if "coursebuild" not in name or "__" in name}


def test_deep_bytes_are_refused() -> None:
    packed: list[Any] = [0]
    for _ in range(100_000):
        packed = [0, packed]
    with pytest.raises(RecursionError):
        msgspec.msgpack.encode(packed)
    assert decode(b"\x92\x90" + b"\x91" * 1_000_000 + b"\x00", object) is None
