"""TOML with places: its values are those of tomllib, its places those of the text."""

from __future__ import annotations

import datetime
import tomllib

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from coursebuild.core.syntax.nodes import (
    ArrayNode,
    Node,
    ObjectNode,
    StringNode,
)
from coursebuild.core.syntax.toml_text import parse_toml
from coursebuild.core.text.source import Excerpt, Source
from support.positioned_nodes import plain

DATES = (datetime.date, datetime.time)


def root_of(text: str) -> ObjectNode:
    parsed_toml = parse_toml(Source("content/course.toml", text))
    assert parsed_toml.diagnostics == ()
    assert parsed_toml.value is not None
    return parsed_toml.value


def replace_dates(value: object) -> object:
    """A value of tomllib with dates as `plain` gives them."""
    if isinstance(value, dict):
        return {key: replace_dates(inner) for key, inner in value.items()}
    if isinstance(value, list):
        return [replace_dates(inner) for inner in value]
    return "a date" if isinstance(value, DATES) else value


ALL = r'''# a comment
top = 1
a.b."c d".'e' = 0x1F   # dotted

[course]
title = "Mass and \"inertia\""
path = 'C:\temp'
long = """
first \
   joined
 second""""
raw = """""\u00e9"""
literal = LLL'quoted'LLL
when = 1979-05-27 07:32:00Z
day = 1979-05-27
hour = 07:32:00.999
numbers = [ 1, 2.5e3, +inf, -nan, 1_000, # comment ] here
  0o17, 0b1,
]
inline = { x = 1, y.z = [ "a", { b = true } ], "q" = 'r' }

[[level]]
id = 0
[[level.lesson]]
id = "0.1"
[level.lesson.more]
k = []
[[level.lesson]]
id = "0.2"
[[level]]
id = 1
[other.deep]
[other]
x = false
'''.replace("LLL", "'''")


@pytest.mark.parametrize("newline", ["\n", "\r\n"])
def test_every_kind_of_statement_and_its_place(newline: str) -> None:
    text = ALL.replace("\n", newline)
    root = root_of(text)
    assert repr(plain(root)) == repr(replace_dates(tomllib.loads(text)))

    def at(*path: str | int) -> str:
        node: Node | None = root
        for part in path:
            if isinstance(part, int):
                assert isinstance(node, ArrayNode)
                node = node.items[part]
            else:
                assert isinstance(node, ObjectNode)
                node = node.get(part)
        assert node is not None
        return f"{node.span.line}:{node.span.column} {node.mark.text}"

    assert at("top") == "2:7 1"
    assert at("a") == "3:1 a"
    assert at("a", "b", "c d", "e") == "3:17 0x1F"
    assert at("course") == "5:1 [course]"
    assert at("course", "title") == r'6:9 "Mass and \"inertia\""'
    assert at("course", "when") == "14:8 1979-05-27 07:32:00Z"
    assert at("course", "numbers") == "17:11 ["
    assert at("course", "numbers", 4) == "17:35 1_000"
    assert at("course", "numbers", 6) == "18:9 0b1"
    assert at("course", "inline") == "20:10 {"
    assert at("course", "inline", "y", "z", 1, "b") == "20:38 true"
    assert at("level") == "22:1 [[level]]"
    assert at("level", 0, "lesson") == "24:1 [[level.lesson]]"
    assert at("level", 0, "lesson", 0, "more", "k") == "27:5 ["
    assert at("level", 0, "lesson", 1, "id") == '29:6 "0.2"'
    assert at("level", 1) == "30:1 [[level]]"
    assert at("other") == "32:2 [other]"  # its first part stands above its header
    assert at("other", "x") == "34:5 false"


def test_each_character_of_a_string_knows_its_place() -> None:
    text = "a = \"\"\"\r\nx\\ty\\\r\n   \\u00e9z\r\n\"\"\"\r\nb = '''\r\np\r\nq'''\r\n"
    root = root_of(text)
    a, b = root.get("a"), root.get("b")
    assert isinstance(a, StringNode) and isinstance(b, StringNode)
    assert a.value == "x\ty\u00e9z\n"
    assert "".join(text[a.excerpt.offset(i)] for i in range(len(a.value))) == "x\\y\\z\r"
    assert b.value == "p\nq"
    assert [b.excerpt.span(i, i + 1).line for i in range(3)] == [6, 6, 7]


# ------------------------------------------------------------------------------------- properties

PIECES = st.sampled_from(
    [
        *"[]{}.=,\n\"'#\\ abc1",
        *("[[", "]]", " = ", "4.2", '"x"', "'y'", '"""', "'''", "\r\n", "\r", "#c", "true", "inf"),
        *("1979-05-27", "07:32:00", '"$\\tau$"', "\\\n", "\\u00e9", "“x”", "\u00a0"),
        *("[a]\n", "[[a]]\n", "[a.b]\n", "[[a.b]]\n", "a.b=1\n", "a={}\n", "b=[1,2]\n"),
        *("a.b.c=1\n", "c={a.b=1,c=[]}\n", 'd="""\nx\\\n y"""\n', "e='''x'''\n", "a=[]\n"),
    ]
)


@st.composite
def edit(draw: st.DrawFn, text: str) -> str:
    """A text with a piece in the place of some characters."""
    at = draw(st.integers(0, len(text)))
    return text[:at] + draw(PIECES) + text[at + draw(st.integers(0, 3)) :]


@settings(max_examples=200)
@given(st.lists(PIECES, max_size=14).map("".join) | st.text(max_size=20) | edit(ALL))
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
