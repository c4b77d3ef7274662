"""JSON and TOML with places: the values are those of the standard library.

What courses, models and quizzes become stands in `tests/fixtures/values/`, the diagnostics of wrong
texts in `tests/fixtures/texts/`; `pytest tests/core/syntax --rewrite-fixtures` writes both anew.
"""

from __future__ import annotations

import datetime
import json
import re
import tomllib
from collections.abc import Callable
from decimal import Decimal
from typing import Any

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from msgspec import NODEFAULT, Struct
from msgspec.structs import fields

from coursebuild.core.model import Comparison, Mode
from coursebuild.core.syntax.coursemap import parse_course_map
from coursebuild.core.syntax.declarations import parse_declarations
from coursebuild.core.syntax.json_text import parse_json
from coursebuild.core.syntax.nodes import (
    ArrayNode,
    BoolNode,
    DateNode,
    Node,
    NumberNode,
    ObjectNode,
    StringNode,
)
from coursebuild.core.syntax.toml_text import parse_toml
from coursebuild.core.text.diagnostics import Diagnostic, Parsed
from coursebuild.core.text.source import Excerpt, Source, Span
from support.fixture_cases import Case, check_cases, read_cases
from support.text_cases import FOLDER, Reader, check_texts, parse_lab, parse_quiz, plain
from support.text_cases import parse_text as parse

VALUE_FOLDER = FOLDER.parent / "values"


def walk(node: Node) -> list[Node]:
    if isinstance(node, ObjectNode):
        inner = [n for member in node.members.values() for n in (member.key, member.value)]
        return [node, *(m for n in inner for m in walk(n))]
    if isinstance(node, ArrayNode):
        return [node, *(n for item in node.items for n in walk(item))]
    return [node]


def test_each_character_of_json_knows_its_place() -> None:
    text = '> ["a\\n\\u00e9\\ud83d\\ude00\\\\x",\n>  "plain", ""]'
    source = Source("lesson.md", text)
    body = Excerpt.join([line.slice(2) for line in source.excerpt().lines()], "\n")
    node = parse_json(body, source.span(0, 0)).value
    assert isinstance(node, ArrayNode)
    with_escapes, simple, empty = node.items
    assert isinstance(with_escapes, StringNode) and isinstance(simple, StringNode)
    assert isinstance(empty, StringNode)
    excerpt = with_escapes.excerpt
    assert excerpt.text == "a\n\u00e9\U0001f600\\x"
    places = [excerpt.offset(i) for i in range(len(excerpt.text))]
    assert [text[p : p + 2] for p in places] == ["a\\", "\\n", "\\u", "\\u", "\\\\", 'x"']
    assert simple.excerpt.span().text == "plain"
    assert simple.excerpt.span(2, 4).text == "ai"
    assert (simple.span.line, simple.span.column) == (2, 4)
    assert empty.excerpt.text == "" and text[empty.excerpt.span().start] == '"'


# ------------------------------------------------------------------------------------- properties

VALUES = st.recursive(
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats(allow_nan=False, allow_infinity=False)
    | st.text(st.characters(exclude_categories=["Cs"]), max_size=8),
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.dictionaries(
            st.text(st.characters(exclude_categories=["Cs"]), max_size=4), inner, max_size=4
        )
    ),
    max_leaves=12,
)
JSON_PIECES = st.sampled_from(
    [
        *"{}[],:\" \n\t\r0123456789-+.eE/*#\\='",
        *('"a"', '"b":', "true", "false", "null", "NaN", "True", "//", "/*", "*/", '"$\\tau$"'),
        *("\\u00e9", "\\ud83d\\ude00", "“", "\u00a0", "\x0c"),
    ]
)


@given(VALUES, st.sampled_from([None, 0, 2]), st.booleans())
@example([float("inf"), 10**30, "\x00\U0001f600/"], None, True)
def test_valid_json_is_read_as_the_standard_library_reads_it_and_knows_its_places(
    value: object, indent: int | None, ascii_only: bool
) -> None:
    text = json.dumps(value, indent=indent, ensure_ascii=ascii_only).replace("Infinity", "1e999")
    parsed_json = parse(text)
    assert [d for d in parsed_json.diagnostics if d.rule != "field-value"] == []
    root = parsed_json.value
    assert root is not None
    assert repr(plain(root)) == repr(json.loads(text))
    for node in walk(root):
        assert json.loads(node.span.text) == plain(node)
        assert root.span.contains(node.span)
        assert node.span.contains(node.mark)
        if isinstance(node, StringNode):
            excerpt = node.excerpt
            assert excerpt.text == node.value
            for i, char in enumerate(excerpt.text):
                source_char = text[excerpt.offset(i)]
                assert source_char in (char, "\\")
                assert node.span.start < excerpt.offset(i) < node.span.end - 1


def is_json(text: str) -> bool:
    def refuse(name: str) -> None:
        raise ValueError(name)

    try:
        value = json.loads(text, parse_constant=refuse)
        json.dumps(value, ensure_ascii=False).encode()
    except (ValueError, UnicodeEncodeError):
        return False
    return True


@st.composite
def edited_json(draw: st.DrawFn) -> str:
    """JSON with a piece in the place of some characters."""
    text = json.dumps(draw(VALUES), indent=1)
    at = draw(st.integers(0, len(text)))
    return text[:at] + draw(JSON_PIECES) + text[at + draw(st.integers(0, 3)) :]


@settings(max_examples=200)
@given(st.lists(JSON_PIECES, max_size=16).map("".join) | st.text(max_size=20) | edited_json())
@example('{"a":1}{')
@example("[1]]")
@example('["\\u')
def test_invalid_json_is_always_reported(text: str) -> None:
    parsed_json = parse(text)
    syntax = [d for d in parsed_json.diagnostics if d.rule == "json-syntax"]
    assert is_json(text) == (not syntax)
    for diagnostic in parsed_json.diagnostics:
        assert 0 <= diagnostic.span.start <= diagnostic.span.end <= len(text)
    assert syntax or parsed_json.value is not None


DATES = (datetime.date, datetime.time)


def replace_dates(value: object) -> object:
    """A value of tomllib with dates as `plain` gives them."""
    if isinstance(value, dict):
        return {key: replace_dates(inner) for key, inner in value.items()}
    if isinstance(value, list):
        return [replace_dates(inner) for inner in value]
    return "a date" if isinstance(value, DATES) else value


def test_each_character_of_toml_knows_its_place() -> None:
    text = "a = \"\"\"\r\nx\\ty\\\r\n   \\u00e9z\r\n\"\"\"\r\nb = '''\r\np\r\nq'''\r\n"
    root = parse_toml(Source("content/course.toml", text)).value
    assert root is not None
    a, b = root.get("a"), root.get("b")
    assert isinstance(a, StringNode) and isinstance(b, StringNode)
    assert a.value == "x\ty\u00e9z\n"
    assert "".join(text[a.excerpt.offset(i)] for i in range(len(a.value))) == "x\\y\\z\r"
    assert b.value == "p\nq"
    assert [b.excerpt.span(i, i + 1).line for i in range(3)] == [6, 6, 7]


# ------------------------------------------------------------------------------------- properties

TOML_PIECES = st.sampled_from(
    [
        *"[]{}.=,\n\"'#\\ abc1",
        *("[[", "]]", " = ", "4.2", '"x"', "'y'", '"""', "'''", "\r\n", "\r", "#c", "true", "inf"),
        *("1979-05-27", "07:32:00", '"$\\tau$"', "\\\n", "\\u00e9", "“x”", "\u00a0"),
        *("[a]\n", "[[a]]\n", "[a.b]\n", "[[a.b]]\n", "a.b=1\n", "a={}\n", "b=[1,2]\n"),
        *("a.b.c=1\n", "c={a.b=1,c=[]}\n", 'd="""\nx\\\n y"""\n', "e='''x'''\n", "a=[]\n"),
    ]
)


@st.composite
def edited_toml(draw: st.DrawFn) -> str:
    """A text with a piece in the place of some characters."""
    text = read_cases(VALUE_FOLDER / "toml.md")[0].input
    at = draw(st.integers(0, len(text)))
    return text[:at] + draw(TOML_PIECES) + text[at + draw(st.integers(0, 3)) :]


@settings(max_examples=200)
@given(st.lists(TOML_PIECES, max_size=14).map("".join) | st.text(max_size=20) | edited_toml())
@example("a=[]\na.b=1\n")
@example("[a.b.c]\n[a]\nb.x=1\n")
@example("[x]\na.b=1\n[x.a.c]\n")
@example('a="""""" \n')
@example("\r\r\n")
def test_values_and_validity_are_those_of_tomllib(text: str) -> None:
    parsed_toml = parse_toml(Source("x.toml", text))
    try:
        expected = replace_dates(tomllib.loads(text))
    except ValueError:
        assert parsed_toml.value is None
        assert len(parsed_toml.diagnostics) == 1
    else:
        assert parsed_toml.value is not None
        assert repr(plain(parsed_toml.value)) == repr(expected)
        check_places(parsed_toml.value, text)
    for diagnostic in parsed_toml.diagnostics:
        assert 0 <= diagnostic.span.start <= diagnostic.span.end <= len(text)


def check_places(node: Node, text: str) -> None:
    """Check that a node contains its mark and, if the text has no headers, its child nodes."""
    inner: list[Node] = []
    if isinstance(node, ObjectNode):
        inner = [n for member in node.members.values() for n in (member.key, member.value)]
    elif isinstance(node, ArrayNode):
        inner = list(node.items)
    assert node.span.contains(node.mark)
    for child in inner:
        assert 0 <= child.span.start <= child.span.end <= len(text)
        assert node.span.contains(child.span) or "[" in text or node.span.start == 0
        check_places(child, text)


def test_toml_of_a_fence_has_its_places_in_the_lesson() -> None:
    lesson = Source("lesson.md", "> ```toml\n> a = 1\n> b = 'x'\n> ```\n")
    lines = (Excerpt.of_span(lesson.span(start, end)) for start, end in ((12, 17), (20, 27)))
    body = Excerpt.join([*lines], "\n")
    root = parse_toml(body).value
    assert root is not None
    assert [member.value.span.text for member in root.members.values()] == ["1", "'x'"]
    (diagnostic,) = parse_toml(body.slice(0, 3), rule="toml-syntax").diagnostics
    assert (diagnostic.rule, diagnostic.span.source) == ("toml-syntax", lesson)
    assert (diagnostic.span.line, diagnostic.span.column) == (2, 6)


DEEP = "objects and arrays nest more than 64 deep"


def read_toml(text: str) -> tuple[object, tuple[Diagnostic, ...]]:
    return None, parse_toml(Source("course.toml", text)).diagnostics


def read_map(text: str) -> tuple[object, tuple[Diagnostic, ...]]:
    parsed_map = parse_course_map(Source("content/course.toml", text))
    return parsed_map.value, parsed_map.diagnostics


def read_model(text: str) -> tuple[object, tuple[Diagnostic, ...]]:
    parsed_file = parse_declarations(Source("models/arms/arm.toml", text))
    return parsed_file.value, parsed_file.diagnostics


def read_lab(text: str) -> tuple[object, tuple[Diagnostic, ...]]:
    parsed_lab = parse_lab(text)
    return parsed_lab.value, parsed_lab.diagnostics


READERS: dict[str, Reader] = {
    "json": lambda text: (None, parse(text).diagnostics),
    "toml": read_toml,
    "map": read_map,
    "model": read_model,
    "lab": read_lab,
    "quiz": lambda text: (None, parse_quiz(text).diagnostics),
}


@pytest.mark.parametrize("name", READERS)
def test_diagnostics_of_wrong_texts(name: str, rewriting: bool) -> None:
    check_texts(name, READERS[name], rewriting=rewriting)


def test_every_file_of_texts_is_read() -> None:
    assert {path.stem for path in FOLDER.iterdir()} == {*READERS, "fields"}
    assert {path.stem for path in VALUE_FOLDER.iterdir()} == {*VALUES_READ}


def test_notes_point_at_the_first_key_and_at_the_bracket() -> None:
    notes = [
        (diagnostics[0].message, note.message, note.span and (note.span.line, note.span.column))
        for diagnostics in (
            parse('{"a": 1,\n "a": 2}').diagnostics,
            parse('{"a":\n [1}').diagnostics,
        )
        for note in diagnostics[0].notes
    ]
    assert notes == [
        ("`a` is given twice", "the first one is here", (1, 2)),
        ("expected `,` or `]`, found `}`", "`[` is opened here", (2, 2)),
    ]


def test_deep_nesting_is_reported() -> None:
    diagnostics = [
        *parse("[" * 100_000).diagnostics,
        *parse('{"a":' * 100_000).diagnostics,
        *read_toml("a = " + "[" * 9_999)[1],
    ]
    assert [(d.span.start, d.message) for d in diagnostics] == [
        (64, DEEP),
        (320, DEEP),
        (0, "tables, arrays or keys are nested too deeply"),
    ]


def test_nesting_up_to_the_limit_is_read() -> None:
    assert parse("[" * 64 + "]" * 64).diagnostics == ()
    assert read_toml("a = " + "[" * 64 + "]" * 64)[1] == ()
    assert read_toml(".".join("a" * 64) + " = 1")[1] == ()


VALUES_READ: dict[str, Callable[[str], Parsed[Any]]] = {
    "map": lambda text: parse_course_map(Source("content/course.toml", text)),
    "model": lambda text: parse_declarations(Source("models/arms/arm.toml", text)),
    "quiz": parse_quiz,
    "toml": lambda text: parse_toml(Source("x.toml", text)),
}


def place(span: Span) -> str:
    """Where a span begins and, if that is in another line, where it ends."""
    end = f"-{span.end_line}:{span.end_column}" if span.end_line > span.line else ""
    return f"{span.line}:{span.column}{end}"


def describe(value: object, depth: int = 0) -> str:
    """A value in lines: its fields but for empty ones, and places as what stands there.

    Of Markdown its place: what stands in it is shown in `tests/fixtures/syntax`.
    """
    match value:
        case Source():
            return f" {value.path}\n"
        case Span() | Excerpt():
            span = value if isinstance(value, Span) else value.span()
            return f" {place(span)} {span.first_line().text}\n"
        case ObjectNode():
            pairs = [(f"{key}:", member.value, None) for key, member in value.members.items()]
            head = f" {place(value.span)} {value.mark.text}\n" if depth else "\n"
        case ArrayNode():
            pairs = [("-", item, None) for item in value.items]
            head = f" {place(value.span)} {value.mark.text}\n"
        case StringNode() | NumberNode() | BoolNode() | DateNode():
            return describe(value.span)
        case Struct(span=Span() as span, children=_):
            return f" {type(value).__name__} {place(span)} {span.first_line().text}\n"
        case Struct():
            pairs = [(f"{f.name}:", getattr(value, f.name), f.default) for f in fields(value)]
            head = f" {type(value).__name__}\n"
        case tuple() if any(isinstance(item, Struct | tuple) for item in value):
            pairs, head = [("-", item, NODEFAULT) for item in value], "\n"
        case _:
            return f" {value!r}\n"
    indent = "  " * depth
    return head + "".join(
        f"{indent}{name}{describe(part, depth + 1)}"
        for name, part, default in pairs
        if part != default and (default is not NODEFAULT or part not in ((), "", None, {}))
    )


@pytest.mark.parametrize("name", VALUES_READ)
def test_values_of_right_texts(name: str, rewriting: bool) -> None:
    def render(case: Case) -> str:
        text = case.input
        results = [VALUES_READ[name](text), VALUES_READ[name](text.replace("\n", "\r\n"))]
        assert [result.diagnostics for result in results] == [(), ()]
        first, second = (describe(result.value) for result in results)
        assert first == second
        return first

    check_cases(VALUE_FOLDER / f"{name}.md", render, rewriting=rewriting)


@pytest.mark.parametrize(("prefix", "newline"), [("> ", "\n"), ("  ", "\r\n")])
def test_a_quiz_in_a_quotation_or_indented_is_the_same(prefix: str, newline: str) -> None:
    text = read_cases(VALUE_FOLDER / "quiz.md")[0].input
    quiz = parse_quiz(text, prefix, newline)
    assert quiz.diagnostics == ()
    values = (quiz.value, parse_quiz(text).value)
    descriptions = {re.sub(r"\d+:\d+(-\d+:\d+)? ", "", describe(value)) for value in values}
    assert len(descriptions) == 1


@pytest.mark.parametrize(
    ("verify", "expected"),
    [
        ("", Comparison()),
        ('compare = "exact"', Comparison()),
        ('compare = "digits"', Comparison(Mode.DIGITS)),
        ('compare = "rtol"\nrtol = 0.001', Comparison(Mode.TOLERANCE, Decimal("0.001"))),
        ("rtol = 1e-3", Comparison(Mode.TOLERANCE, Decimal("0.001"))),
        ("atol = 1_000.5", Comparison(Mode.TOLERANCE, Decimal(0), Decimal("1000.5"))),
        ("atol = 0x10", Comparison(Mode.TOLERANCE, Decimal(0), Decimal(16))),
        ("ellipsis = true", Comparison(ellipsis=True)),
    ],
)
def test_how_outputs_are_compared(verify: str, expected: Comparison) -> None:
    text = f'[course]\ntitle = "T"\n[verify]\n{verify}\n'
    course = parse_course_map(Source("content/course.toml", text)).value
    assert course is not None and course.comparison == expected


@settings(max_examples=400)
@given(st.sampled_from([*VALUES_READ]), st.data())
def test_any_edit_of_a_right_text_is_parsed_or_reported(name: str, data: st.DataObject) -> None:
    text = read_cases(VALUE_FOLDER / f"{name}.md")[0].input
    at = data.draw(st.integers(0, len(text)))
    piece = data.draw(JSON_PIECES | TOML_PIECES | st.text(max_size=3))
    result = VALUES_READ[name](text[:at] + piece + text[at + data.draw(st.integers(0, 20)) :])
    assert result.value is not None or result.diagnostics
    orders = [diagnostic.order for diagnostic in result.diagnostics]
    assert orders == sorted(orders)
