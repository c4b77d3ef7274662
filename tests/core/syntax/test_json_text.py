"""JSON with places: what is JSON, and where its values stand."""

from __future__ import annotations

import json

from hypothesis import example, given, settings
from hypothesis import strategies as st

from coursebuild.core.syntax.json_text import parse_json
from coursebuild.core.syntax.nodes import ArrayNode, Node, ObjectNode, StringNode
from coursebuild.core.text.source import Excerpt, Source
from support.json_fences import parse_text as parse
from support.positioned_nodes import plain


def walk(node: Node) -> list[Node]:
    if isinstance(node, ObjectNode):
        inner = [n for member in node.members.values() for n in (member.key, member.value)]
        return [node, *(m for n in inner for m in walk(n))]
    if isinstance(node, ArrayNode):
        return [node, *(n for item in node.items for n in walk(item))]
    return [node]


def test_each_character_of_a_string_knows_its_place() -> None:
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
PIECES = st.sampled_from(
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
def edit(draw: st.DrawFn) -> str:
    """JSON with a piece in the place of some characters."""
    text = json.dumps(draw(VALUES), indent=1)
    at = draw(st.integers(0, len(text)))
    return text[:at] + draw(PIECES) + text[at + draw(st.integers(0, 3)) :]


@settings(max_examples=200)
@given(st.lists(PIECES, max_size=16).map("".join) | st.text(max_size=20) | edit())
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
