"""TOML with places: values are tomllib's, places are the author's, mistakes are told there."""

from __future__ import annotations

import datetime
import re
import tomllib

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from coursebuild.source import Source
from coursebuild.syntax.nodes import (
    ArrayNode,
    Node,
    ObjectNode,
    StringNode,
)
from coursebuild.syntax.toml_text import parse_toml
from support.positioned_nodes import plain, shown, tree

DATES = (datetime.date, datetime.time)


def root_of(text: str) -> ObjectNode:
    parsed = parse_toml(Source("content/course.toml", text))
    assert parsed.diagnostics == ()
    assert parsed.value is not None
    return parsed.value


def dated(value: object) -> object:
    """A value of tomllib as `plain` gives it."""
    if isinstance(value, dict):
        return {key: dated(inner) for key, inner in value.items()}
    if isinstance(value, list):
        return [dated(inner) for inner in value]
    return "a date" if isinstance(value, DATES) else value


def told(text: str) -> list[str]:
    return shown(parse_toml(Source("content/course.toml", text)).diagnostics)


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
def test_every_kind_of_statement(newline: str) -> None:
    text = ALL.replace("\n", newline)
    assert repr(plain(root_of(text))) == repr(dated(tomllib.loads(text)))


@pytest.mark.parametrize("newline", ["\n", "\r\n"])
def test_places(newline: str) -> None:
    root = root_of(ALL.replace("\n", newline))

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


CURLY = "TOML knows only the straight quotes `\"` and `'`"
DEEP = "tables and arrays nest more than 64 deep"
SEPARATE = "values in an array have commas between them; a line holds one `key = value`"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (
            "title = Mass and inertia",
            "1:9-25 map-syntax: `Mass and inertia` is not a value of TOML"
            ' [text stands between quotes: `"Mass and inertia"`]',
        ),
        ("a = 1\nx = “a”", f"2:5-8 map-syntax: `“a”` is not a value of TOML [{CURLY}]"),
        ("“x” = 1", f"1:1-2 map-syntax: expected a key, found `“` [{CURLY}]"),
        (
            "engine = 3.14.0",
            "1:10-16 map-syntax: `3.14.0` is not a value of TOML"
            ' [text stands between quotes: `"3.14.0"`]',
        ),
        ("a = True", "1:5-9 map-syntax: `True` is not a value of TOML [write `true`]"),
        (
            "a = null",
            "1:5-9 map-syntax: `null` is not a value of TOML"
            " [TOML has no such value; leave the field out]",
        ),
        (
            "a = 007",
            "1:5-8 map-syntax: `007` is not a value of TOML [a number has no leading zeros]",
        ),
        (
            "a = .5",
            "1:5-7 map-syntax: `.5` is not a value of TOML [a decimal point stands between digits]",
        ),
        ("a = 2024-13-01", "1:5-15 map-syntax: `2024-13-01` is not a value of TOML"
         ' [text stands between quotes: `"2024-13-01"`]'),
        (
            "a = " + "9" * 5000,
            f"1:5-5005 map-syntax: `{'9' * 39}…` is not a value of TOML"
            " [an integer has at most 64 bits]",
        ),
        ("a =", '1:4-4 map-syntax: expected a value, found the end of the file'
         ' [an empty text is written `""`]'),
        ("a = # none\nb = 1", "1:5-6 map-syntax: expected a value, found `#`"
         ' [an empty text is written `""`]'),
        ("a 1", "1:3-4 map-syntax: expected `=` after the key `a`, found `1`"),
        ("a: 1", "1:2-3 map-syntax: expected `=` after the key `a`, found `:`"
         " [TOML writes `key = value`]"),
        ("- a", "1:3-4 map-syntax: expected `=` after the key `-`, found `a`"),
        ("= 1", "1:1-2 map-syntax: expected a key, found `=`"),
        ("a = 1 b = 2", f"1:7-12 map-syntax: `b = 2` after the value `1` [{SEPARATE}]"),
        (
            'a = "x" b = 2',
            "1:9-10 map-syntax: expected the end of the line, found `b`"
            " [each `key = value` stands on a line of its own]",
        ),
        ("a = [1 2]", f"1:8-9 map-syntax: `2` after the value `1` [{SEPARATE}]"),
        ('a = [\n "x"\n "y"\n]', '3:2-3 map-syntax: expected `,` or `]`, found `"`'),
        ("a = [1,\n2", "1:5-6 map-syntax: `[` is never closed"),
        ("a = { x = 1", "1:5-6 map-syntax: `{` is never closed"),
        (
            "a = {\n x = 1\n}",
            "1:5-6 map-syntax: a table in braces stands on one line"
            " [a longer table has a `[header]` of its own]",
        ),
        (
            "[course",
            "1:8-8 map-syntax: expected `]` at the end of a `[table]` line,"
            " found the end of the file",
        ),
        (
            "[[level]\nid = 1",
            "1:8-9 map-syntax: expected `]]` at the end of a `[[table]]` line, found `]`",
        ),
        (
            "[course]]",
            "1:9-10 map-syntax: expected the end of the line, found `]`"
            " [each `key = value` stands on a line of its own]",
        ),
        ("[]", "1:2-3 map-syntax: expected a key, found `]`"),
        (
            'a = "x\nb = 1',
            "1:5-7 map-syntax: the string is not closed on its line"
            ' [close it with `"`; text of several lines stands between three quotes]',
        ),
        (
            "a = 'it's'",
            "1:9-10 map-syntax: expected the end of the line, found `s`"
            " [each `key = value` stands on a line of its own]",
        ),
        ('a = """x\ny', '1:5-8 map-syntax: `"""` is never closed'),
        (
            r'a = "$\omega$"',
            r"1:7-9 map-syntax: `\o` is not an escape of TOML"
            r" [double the backslash: `\\omega`, or put the text between single quotes]",
        ),
        (
            r'a = "\ud800"',
            r"1:6-12 map-syntax: `\ud800` is no character [write the character itself]",
        ),
        (
            "\ufeffa = 1",
            "1:1-2 map-syntax: U+FEFF (zero width no-break space) cannot stand here in TOML"
            " [remove it]",
        ),
        (
            "a =\u00a01",
            "1:4-5 map-syntax: U+00A0 (no-break space) cannot stand here in TOML"
            " [replace it by a plain space, or remove it]",
        ),
        (
            'a = "x\x01"',
            "1:7-8 map-syntax: U+0001 (control character) cannot stand here in TOML"
            " [replace it by a plain space, or remove it]",
        ),
        ("a = 1\rb = 2", f"2:1-6 map-syntax: `b = 2` after the value `1` [{SEPARATE}]"),
        ("a = 1\nb = 2\na = 3", "3:1-2 field-repeated: `a` is given twice"),
        ("[a]\nx = 1\n[b]\n[a]\n", "4:2-3 field-repeated: `a` is given twice"),
        ("a = 1\n[a]\n", "2:2-3 field-repeated: `a` is given twice"),
        ("[a]\n[[a]]\n", "2:3-4 field-repeated: `a` is given twice"),
        ("a = []\n[[a]]\n", "2:3-4 field-repeated: `a` is given twice"),
        ("a = { b = 1 }\n[a.c]\n", "2:2-3 field-repeated: `a` is given twice"),
        ("a = { b = 1, b = 2 }", "1:14-15 field-repeated: `b` is given twice"),
        ("a.b = 1\na.b.c = 2", "2:3-4 field-repeated: `b` is given twice"),
        ("[a.b]\n[a]\nb.c = 1", "3:1-2 field-repeated: `b` is given twice"),
        ("a.b = 1\n[a]\n", "2:2-3 field-repeated: `a` is given twice"),
        ("a = " + "[" * 70 + "]" * 70, f"1:69-70 map-syntax: {DEEP}"),
        ("a = " + "[" * 99_999, f"1:69-70 map-syntax: {DEEP}"),
        ("a = " + "{a=" * 99_999, f"1:197-198 map-syntax: {DEEP}"),
        (".".join("a" * 99) + " = 1", "1:129-130 map-syntax: a key has more than 64 parts"),
    ],
)  # fmt: skip
def test_what_an_author_is_told(text: str, expected: str) -> None:
    assert told(text) == [expected]


def test_a_repeated_key_points_at_the_first() -> None:
    notes = parse_toml(Source("x.toml", "[a]\nb = 1\nb = 2\n")).diagnostics[0].notes
    assert [(n.message, n.span and n.span.line) for n in notes] == [("the first one is here", 2)]


def test_tex_in_a_string_that_reads_it_otherwise() -> None:
    text = 'a = "about $\\tau$"\nb = \'about $\\tau$\'\nc = "a\\tb"\n'
    parsed = parse_toml(Source("x.toml", text))
    assert parsed.value is not None
    assert shown(parsed.diagnostics) == [
        r"1:13-17 field-value: `\t` of `\tau` is read as a control character"
        r" [double the backslash: `\\tau`, or put the text between single quotes]"
    ]


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


@settings(max_examples=200)
@given(st.lists(PIECES, max_size=14).map("".join) | st.text(max_size=20))
@example("a=[]\na.b=1\n")
@example("[a.b.c]\n[a]\nb.x=1\n")
@example("[x]\na.b=1\n[x.a.c]\n")
@example('a="""""" \n')
def test_values_and_validity_are_those_of_tomllib(text: str) -> None:
    parsed = parse_toml(Source("x.toml", text))
    try:
        expected = dated(tomllib.loads(text))
    except ValueError:
        assert parsed.value is None
        assert len(parsed.diagnostics) == 1
    else:
        assert parsed.value is not None
        assert repr(plain(parsed.value)) == repr(expected)
    for diagnostic in parsed.diagnostics:
        assert 0 <= diagnostic.span.start <= diagnostic.span.end <= len(text)
        assert diagnostic.message == diagnostic.message.strip(" .")


@settings(max_examples=100)
@given(st.data())
def test_any_edit_of_a_good_text_is_read_or_told(data: st.DataObject) -> None:
    at = data.draw(st.integers(0, len(ALL)))
    mutated = ALL[:at] + data.draw(PIECES) + ALL[at + data.draw(st.integers(0, 3)) :]
    parsed = parse_toml(Source("x.toml", mutated))
    try:
        expected = dated(tomllib.loads(mutated))
    except ValueError:
        assert parsed.value is None and parsed.diagnostics
    else:
        assert parsed.value is not None
        assert repr(plain(parsed.value)) == repr(expected)


@settings(max_examples=200)
@given(st.lists(PIECES, max_size=14).map("".join))
def test_spans_nest(text: str) -> None:
    root = parse_toml(Source("x.toml", text)).value
    if root is None:
        return

    def check(node: Node) -> None:
        inner: list[Node] = []
        if isinstance(node, ObjectNode):
            inner = [n for member in node.members for n in (member.key, member.value)]
        elif isinstance(node, ArrayNode):
            inner = list(node.items)
        assert node.span.contains(node.mark)
        for child in inner:
            assert root is not None
            assert 0 <= child.span.start <= child.span.end <= len(text)
            if node is not root and not text.count("["):
                assert node.span.contains(child.span)
            check(child)

    check(root)


PLAIN = 'a = |b=|a.b = |"k" = |"v"|""|"""|"a\\n"|"|1| |[t]|[[t]]|[u.v]|{|}|[|]|,|# c|=|'
PLAIN += "\n|\t|\\|'x'|é"


@given(st.lists(st.sampled_from(PLAIN.split("|")), max_size=12).map("".join))
def test_the_shorter_way_through_plain_pairs_leads_to_the_same(text: str) -> None:
    source = Source("content/course.toml", text)
    short = parse_toml(source)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("coursebuild.syntax.toml_scan._PLAIN_KEY", re.compile("(?!)"))
        long = parse_toml(source)
    assert tree(short.value) == tree(long.value)
    assert short.diagnostics == long.diagnostics
