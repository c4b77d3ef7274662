"""Decoding nodes against declared structs: every mistake in one run; the schemas for editors."""

from __future__ import annotations

import json
from typing import Annotated, ClassVar, Literal

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec import Meta, Struct

from coursebuild.core.model.fields import Blocks, Inlines, Text
from coursebuild.core.syntax.course_schema import CourseFile, json_schema
from coursebuild.core.syntax.decode import Decoding, decode
from coursebuild.core.syntax.json_text import parse_json
from coursebuild.core.syntax.nodes import JSON, TOML
from coursebuild.core.syntax.toml_text import parse_toml
from coursebuild.core.text.source import Excerpt, Source
from coursebuild.features.lab.schema import SimLab
from coursebuild.features.quiz.schema import QuizFile
from support.text_cases import check_texts, format_diagnostics


class Disc(Struct, frozen=True, forbid_unknown_fields=True, tag_field="kind", tag="disc"):
    """A variant that needs no tag."""

    implied: ClassVar[bool] = True
    radius: Annotated[float, Meta(gt=0, description="in metres")]
    mass: float = 1.0


class Plate(Struct, frozen=True, forbid_unknown_fields=True, tag_field="kind", tag="plate"):
    """A variant that has fields of its own."""

    sides: tuple[float, float]
    mass: float = 1.0


class Part(Struct, frozen=True):
    """A struct that takes unknown fields."""

    name: Text


class Body(Struct, frozen=True, forbid_unknown_fields=True):
    """One field of every kind."""

    name: Text
    count: Annotated[int, Meta(ge=1, le=9)] = 1
    ratio: Annotated[float, Meta(ge=0, lt=1)] = 0.5
    fixed: bool = False
    colour: Literal["red", "green", "blue"] = "red"
    slug: (
        Annotated[str, Meta(pattern=r"^[a-z]+$", extra={"expects": "lower-case letters"})] | None
    ) = None
    key: int | str = 0
    tags: tuple[str, ...] = ()
    pair: tuple[Text, float] | None = None
    angle: float | tuple[float, ...] = 0.0
    shape: Disc | Plate | None = None
    parts: Annotated[tuple[Part, ...], Meta(min_length=1)] | None = None
    limits: dict[str, float] = {}
    note: Blocks | None = None
    title: Inlines | None = None


def read(text: str) -> Decoding[Body]:
    source = Source("lesson.md", text)
    parsed_json = parse_json(Excerpt.of_span(source.span()), source.span())
    assert parsed_json.value is not None
    return decode(parsed_json.value, Body, "the body", JSON)


def test_a_clean_value() -> None:
    decoding = read(
        '{"name": "box", "count": 3, "ratio": 0, "key": "k", "tags": ["a"], "pair": ["x", 2],'
        ' "angle": [1, 2.5], "shape": {"radius": 2}, "parts": [{"name": "lid", "more": [1]}],'
        ' "limits": {"low": -1, "none": 0e5}, "slug": null}'
    )
    assert decoding.diagnostics == ()
    assert decoding.value == Body(
        "box",
        3,
        0.0,
        key="k",
        tags=("a",),
        pair=("x", 2.0),
        angle=(1.0, 2.5),
        shape=Disc(2.0),
        parts=(Part("lid"),),
        limits={"low": -1.0, "none": 0.0},
    )
    assert decoding.value is not None
    assert [type(v) for v in (decoding.value.ratio, decoding.value.limits["low"])] == [float, float]


def test_diagnostics_of_wrong_fields(rewriting: bool) -> None:
    check_texts("fields", lambda text: (None, read(text).diagnostics), rewriting=rewriting)


def test_markdown_is_found_in_the_order_of_the_text() -> None:
    decoding = read('{"title": "t $x$", "name": "n", "note": "long"}')
    assert [(node.value, kind) for node, kind in decoding.texts] == [
        ("t $x$", "inlines"),
        ("long", "blocks"),
    ]


def test_toml_has_other_nouns() -> None:
    parsed_toml = parse_toml(
        Source("x.toml", 'name = 2024-01-01\nshape = 3\n[parts]\nname = "x"\n')
    )
    assert parsed_toml.value is not None
    decoding = decode(parsed_toml.value, Body, "the body", TOML)
    assert format_diagnostics(decoding.diagnostics) == [
        "1:8-18 field-type: `name` must be a string, not a date or time"
        ' [put it between quotes: `"2024-01-01"`]',
        "2:9-10 field-type: `shape` must be a table, not the number 3",
        "3:1-8 field-type: `parts` must be an array of tables, not a table",
    ]


# ------------------------------------------------------------------------------------- properties

SCALARS = (
    st.none()
    | st.booleans()
    | st.integers(-2, 12)
    | st.floats(-2, 2).filter(lambda x: not x.is_integer())
    | st.sampled_from(["", "a", "red", "disc", "plate", "A", " "])
)
KEYS = st.sampled_from([*Body.__struct_fields__, "kind", "radius", "sides", "mass", "what"])
DOCUMENTS = st.dictionaries(
    KEYS,
    st.recursive(
        SCALARS,
        lambda inner: st.lists(inner, max_size=3) | st.dictionaries(KEYS, inner, max_size=3),
        max_leaves=4,
    ),
    max_size=4,
).map(lambda value: {"name": "x", **value})


def msgspec_value(text: str) -> Body | None:
    """The value that msgspec itself decodes; `None` for one that it refuses."""
    try:
        return msgspec.json.decode(text, type=Body)
    except msgspec.ValidationError:
        return None


@given(DOCUMENTS)
def test_decoding_agrees_with_msgspec(value: object) -> None:
    text = json.dumps(value)
    decoding = read(text)
    expected = msgspec_value(text)
    if expected is not None:
        assert decoding.value == expected
        assert decoding.diagnostics == ()
    elif not decoding.diagnostics:
        # msgspec requires a tag that may be left out here
        shape = decoding.value.shape if decoding.value is not None else None
        assert isinstance(shape, Disc)
        assert msgspec_value(json.dumps({**json.loads(text), "shape": msgspec.to_builtins(shape)}))


# ---------------------------------------------------------------------------------------- schemas


@pytest.mark.parametrize(
    ("name", "root"), [("quiz", QuizFile), ("lab", SimLab), ("course", CourseFile)]
)
def test_schemas_say_what_the_declarations_say(name: str, root: type[Struct]) -> None:
    data = json_schema(name)
    assert data == json_schema(name)
    assert data.endswith(b"}\n")
    schema = json.loads(data)
    assert schema["$schema"] == "https://json-schema.org/draft/2020-12/schema"
    definitions = schema["$defs"]
    assert schema["$ref"] == f"#/$defs/{root.__name__}"
    assert list(definitions) == sorted(definitions)
    main = definitions[root.__name__]
    assert set(main["properties"]) == set(root.__struct_fields__)
    assert main["additionalProperties"] is False

    without_description = [key for key, item in definitions.items() if not item.get("description")]
    assert without_description == []
