"""Decoding nodes against declared structs: every mistake in one run; the schemas for editors."""

from __future__ import annotations

import json
from typing import Annotated, ClassVar, Literal

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec import Meta, Struct

from coursebuild.core.syntax.course_schema import CourseFile
from coursebuild.core.syntax.decode import Decoding, decode
from coursebuild.core.syntax.fields import Blocks, Inlines, Text
from coursebuild.core.syntax.json_text import parse_json
from coursebuild.core.syntax.lab_schema import SimLab
from coursebuild.core.syntax.schemas import json_schema
from coursebuild.core.syntax.toml_text import parse_toml
from coursebuild.core.syntax.wording import JSON, TOML
from coursebuild.core.text.source import Excerpt, Source
from coursebuild.features.quiz.schema import QuizFile
from support.positioned_nodes import shown


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
    """A struct that takes whatever else stands there."""

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
    parsed = parse_json(Excerpt.of_span(source.span()), source.span())
    assert parsed.value is not None
    return decode(parsed.value, Body, "the body", JSON)


def test_a_clean_value() -> None:
    decoding = read(
        '{"name": "box", "count": 3, "ratio": 0, "key": "k", "tags": ["a"], "pair": ["x", 2],'
        ' "angle": [1, 2.5], "shape": {"radius": 2}, "parts": [{"name": "lid", "more": [1]}],'
        ' "limits": {"low": -1}, "slug": null}'
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
        limits={"low": -1.0},
    )
    assert decoding.value is not None
    assert [type(v) for v in (decoding.value.ratio, decoding.value.limits["low"])] == [float, float]


@pytest.mark.parametrize(
    ("field", "expected"),
    [
        # types
        ('"count": "3"', "12-15 field-type: `count` must be an integer, not a string"
         " [write it without quotes: `3`]"),
        ('"count": 2.0', "12-15 field-type: `count` must be an integer, not the number 2.0"),
        ('"count": true', "12-16 field-type: `count` must be an integer, not `true`"),
        ('"count": null', "12-16 field-type: `count` must be an integer, not `null`"
         " [leave the field out]"),
        ('"count": [1]', "12-13 field-type: `count` must be an integer, not an array"),
        ('"ratio": {}', "12-13 field-type: `ratio` must be a number, not an object"),
        ('"fixed": "True"', "12-18 field-type: `fixed` must be `true` or `false`, not a string"
         " [write it without quotes: `true`]"),
        ('"fixed": 1', "12-13 field-type: `fixed` must be `true` or `false`, not the number 1"),
        ('"colour": 4', "13-14 field-type: `colour` must be a string, not the number 4"
         ' [put it between quotes: `"4"`]'),
        ('"key": 4.2', "10-13 field-type: `key` must be an integer or a string, not the number 4.2"
         ' [put it between quotes: `"4.2"`]'),
        ('"tags": "a"', "11-14 field-type: `tags` must be an array of strings, not a string"
         ' [put it between brackets: `["a"]`]'),
        ('"tags": 4', "11-12 field-type: `tags` must be an array of strings, not the number 4"
         ' [put it between brackets and quotes: `["4"]`]'),
        ('"tags": ["a", 2]', "17-18 field-type: `tags[1]` must be a string, not the number 2"
         ' [put it between quotes: `"2"`]'),
        ('"pair": ["x"]', "11-12 field-value: `pair` needs 2 entries, and has 1"),
        ('"pair": 1', "11-12 field-type: `pair` must be an array of 2 values, not the number 1"),
        ('"angle": "1"', "12-15 field-type: `angle` must be a number or an array of numbers,"
         " not a string [write it without quotes: `1`]"),
        ('"shape": 1', "12-13 field-type: `shape` must be an object, not the number 1"),
        ('"parts": {}', "12-13 field-type: `parts` must be an array of objects, not an object"
         " [put it between brackets: `[{}]`]"),
        ('"limits": {"a": "b"}', "19-22 field-type: `a` must be a number, not a string"),
        # values
        ('"count": 0', "12-13 field-value: `count` must be at least 1, not 0"),
        ('"count": 10', "12-14 field-value: `count` must be at most 9, not 10"),
        ('"ratio": 1', "12-13 field-value: `ratio` must be less than 1, not 1"),
        ('"ratio": -1e-3', "12-17 field-value: `ratio` must be at least 0, not -1e-3"),
        ('"ratio": 1e999', "12-17 field-value: `ratio` is too large: numbers end at about 1.8e308"),
        ('"ratio": 1' + "0" * 400, "12-413 field-value: `ratio` is too large:"
         " numbers end at about 1.8e308"),
        ('"ratio": 0.1e-999', "12-20 field-value: `ratio` is too small: it becomes 0"),
        ('"colour": "gren"', "13-19 field-value: `colour` cannot be `gren`"
         " [did you mean `green`?]"),
        ('"colour": "x"', "13-16 field-value: `colour` cannot be `x`"
         " [known: `blue`, `green`, `red`]"),
        ('"slug": "A b"', "11-16 field-value: `slug` cannot be `A b`"
         " [expected: lower-case letters]"),
        ('"slug": "a\\n"', "11-16 field-value: `slug` cannot be `a`"
         " [expected: lower-case letters]"),
        ('"note": " \\n "', "11-17 field-value: `note` is empty"),
        ('"parts": []', "12-13 field-value: `parts` is empty"),
        # fields
        ('"colr": "red"', "3-9 field-unknown: unknown field `colr` [did you mean `colour`?]"),
        ('"parts": [{}]', "13-14 field-missing: `name` is missing"),
        ('"shape": {}', "12-13 field-missing: `radius` is missing [`radius`: in metres]"),
        ('"shape": {"raduis": 1}', "13-21 field-unknown: unknown field `raduis`"
         " [did you mean `radius`?]"),
        # tags
        ('"shape": {"kind": "plat"}', "21-27 field-value: `kind` cannot be `plat`"
         " [did you mean `plate`?]"),
        ('"shape": {"kind": 3}', "21-22 field-type: `kind` must be a string, not the number 3"
         " [known: `disc`, `plate`]"),
        ('"shape": {"knid": "disc"}', "13-19 field-unknown: unknown field `knid`"
         " [did you mean `kind`?]"),
        ('"shape": {"sides": [1, 2]}', "12-13 field-missing: `kind` is missing"
         ' [its fields are those of `"kind": "plate"`]'),
        ('"shape": {"kind": "disc", "radius": 1, "sides": 3}', "42-49 field-unknown:"
         ' unknown field `sides` [it is a field of `"kind": "plate"`]'),
        ('"shape": {"radius": 0}', "23-24 field-value: `radius` must be greater than 0, not 0"),
    ],
)  # fmt: skip
def test_what_an_author_is_told(field: str, expected: str) -> None:
    decoding = read('{"name": "box",\n  ' + field + "}")
    assert shown(decoding.diagnostics) == ["2:" + expected]


def test_the_whole_has_a_name_of_its_own() -> None:
    assert shown(read("[]").diagnostics) == [
        "1:1-2 field-type: the body must be an object, not an array"
    ]
    assert shown(read("{}").diagnostics) == ["1:1-2 field-missing: `name` is missing"]


def test_all_mistakes_come_in_one_run_and_none_twice() -> None:
    decoding = read(
        '{"nmae": "x",\n "count": 0,\n "tags": [1, "a", 2],\n "parts": [{"nam": "y"}, 3],\n'
        ' "colour": "bule", "wrong": 1, "limits": {"a": 1e999, "b": null}}'
    )
    assert [line.split(" [")[0] for line in sorted(shown(decoding.diagnostics))] == [
        "1:2-8 field-unknown: unknown field `nmae`",
        "2:11-12 field-value: `count` must be at least 1, not 0",
        "3:11-12 field-type: `tags[0]` must be a string, not the number 1",
        "3:19-20 field-type: `tags[2]` must be a string, not the number 2",
        "4:12-13 field-missing: `name` is missing",
        "4:26-27 field-type: `parts[1]` must be an object, not the number 3",
        "5:12-18 field-value: `colour` cannot be `bule`",
        "5:20-27 field-unknown: unknown field `wrong`",
        "5:48-53 field-value: `a` is too large: numbers end at about 1.8e308",
        "5:60-64 field-type: `b` must be a number, not `null`",
    ]
    assert decoding.value is None


def test_an_unknown_field_leaves_the_rest_usable() -> None:
    decoding = read('{"name": "x", "shape": {"radius": 2, "weight": 1}, "parts": [{"name": ""}]}')
    assert decoding.value is None
    assert Disc(2.0) in decoding.structs.values()


def test_a_value_that_the_reader_reported_is_not_reported_again() -> None:
    assert (
        shown(read('{"name": "x", "count": 01, "fixed": True, "parts": [NaN]}').diagnostics) == []
    )


def test_markdown_is_found_in_the_order_of_the_text() -> None:
    decoding = read('{"title": "t $x$", "name": "n", "note": "long"}')
    assert [(node.value, kind) for node, kind in decoding.texts] == [
        ("t $x$", "inlines"),
        ("long", "blocks"),
    ]


def test_toml_has_other_nouns() -> None:
    parsed = parse_toml(Source("x.toml", 'name = 2024-01-01\nshape = 3\n[parts]\nname = "x"\n'))
    assert parsed.value is not None
    decoding = decode(parsed.value, Body, "the body", TOML)
    assert shown(decoding.diagnostics) == [
        "1:8-18 field-type: `name` must be a string, not a date or time"
        ' [put it between quotes: `"2024-01-01"`]',
        "2:9-10 field-type: `shape` must be a table, not the number 3",
        "3:1-8 field-type: `parts` must be an array of tables, not a table"
        " [write its header with two brackets: `[[parts]]`]",
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


def accepted(text: str) -> Body | None:
    """What msgspec itself makes of it, as far as it checks the same."""
    try:
        return msgspec.json.decode(text, type=Body)
    except msgspec.ValidationError:
        return None


@settings(max_examples=200)
@given(DOCUMENTS)
def test_decoding_agrees_with_msgspec(value: object) -> None:
    text = json.dumps(value)
    decoding = read(text)
    expected = accepted(text)
    if expected is not None:
        assert decoding.value == expected
        assert decoding.diagnostics == ()
    elif not decoding.diagnostics:
        # a tag that msgspec demands and that may be left out here
        shape = decoding.value.shape if decoding.value is not None else None
        assert isinstance(shape, Disc)
        assert accepted(json.dumps({**json.loads(text), "shape": msgspec.to_builtins(shape)}))


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

    def references(value: object) -> set[str]:
        if isinstance(value, dict):
            own = {value["$ref"]} if "$ref" in value else set()
            return own.union(*(references(inner) for inner in value.values()))
        if isinstance(value, list):
            return set().union(*(references(inner) for inner in value))
        return set()

    assert references(schema) == {f"#/$defs/{key}" for key in definitions}
    described = [key for key, item in definitions.items() if not item.get("description")]
    assert described == []


def test_schemas_know_what_may_be_left_out() -> None:
    quiz = json.loads(json_schema("quiz"))["$defs"]
    assert quiz["Slider"]["required"] == ["label", "min", "max", "value"]
    assert quiz["SimLab"]["oneOf"] == [{"required": ["model"]}, {"required": ["xml"]}]
    course = json.loads(json_schema("course"))["$defs"]
    assert course["SilenceTable"]["required"] == ["rule", "reason"]
    assert quiz["MultipleChoice"]["properties"]["q"]["contentMediaType"] == "text/markdown"
