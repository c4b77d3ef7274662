"""Offsets, lines and columns; excerpts that know where each of their characters stands."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from coursebuild.core.text.source import Excerpt, Source, Span


@pytest.mark.parametrize(
    ("text", "offset", "position"),
    [
        ("", 0, (1, 1)),
        ("abc", 3, (1, 4)),
        ("a\nb", 2, (2, 1)),
        ("a\r\nb", 3, (2, 1)),
        ("a\r\nb", 2, (1, 3)),
        ("a\rb", 2, (2, 1)),
        ("a\n\nb", 2, (2, 1)),
        ("é\U0001f600x", 2, (1, 3)),
        ("a\u2028b\x0bc\x85d", 6, (1, 7)),
    ],
)
def test_position(text: str, offset: int, position: tuple[int, int]) -> None:
    assert Source("x.md", text).position(offset) == position


def test_span_of_several_lines() -> None:
    source = Source("x.md", "one\ntwo\nthree")
    span = source.span(1, 9)
    assert (span.line, span.column, span.end_line, span.end_column) == (1, 2, 3, 2)
    assert span.first_line().text == "ne"
    assert span.to(source.span(10, 12)) == source.span(1, 12)
    assert source.span(0, 13).contains(span)
    assert not span.contains(source.span(0, 13))
    assert not Span(Source("y.md", "one"), 0, 3).contains(span)


def test_excerpt_of_a_crlf_text_points_into_it() -> None:
    source = Source("x.md", "ab\r\ncd\r\n")
    excerpt = source.excerpt()
    assert excerpt.text == "ab\ncd\n"
    assert [excerpt.offset(i) for i in range(6)] == [0, 1, 2, 4, 5, 6]
    assert excerpt.lines()[1].span().text == "cd"


def test_excerpt_of_prefixed_lines() -> None:
    source = Source("x.md", "> {\n>  1}\n")
    excerpt = Excerpt.join([Excerpt.of_span(source.span(*at)) for at in ((2, 3), (6, 9))], "\n")
    assert excerpt.span(3, 4).text == "1"
    assert excerpt.slice(2, 5).span(1, 3).text == "1}"
    assert excerpt.span().text == "{\n>  1}"
    assert [line.text for line in excerpt.lines()] == ["{", " 1}"]


@given(
    st.lists(st.text(alphabet="ab \t", max_size=6), min_size=1, max_size=8),
    st.sampled_from(["\n", "\r\n", "\r"]),
    st.data(),
)
def test_slices_of_excerpts_agree_with_the_source(
    lines: list[str], end: str, data: st.DataObject
) -> None:
    source = Source("x.md", end.join(lines))
    excerpt = source.excerpt()
    assert excerpt.text == "\n".join(lines)
    a = data.draw(st.integers(0, len(excerpt.text)))
    b = data.draw(st.integers(a, len(excerpt.text)))
    part = excerpt.slice(a, b)
    assert part.text == excerpt.text[a:b]
    for i, ch in enumerate(part.text):
        at = part.offset(i)
        assert at == excerpt.offset(a + i)
        assert source.text[at] == ch or (ch == "\n" and source.text[at] in "\r\n")
    assert part.span().text.replace("\r\n", "\n").replace("\r", "\n").rstrip(
        "\n"
    ) == part.text.rstrip("\n")


def test_spans_of_an_excerpt_longer_than_its_source_stay_in_it() -> None:
    source = Source("x.md", "abc")
    excerpt = Excerpt(source, "bc\n", ((0, 1),))  # a fence at the end of a text gets a line end
    assert (excerpt.span().end, excerpt.slice(2).span().start, excerpt.offset(3)) == (3, 3, 3)
