"""Contents that are read at a glance say what markdown-it makes of them."""

from __future__ import annotations

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from coursebuild.model import Inline
from coursebuild.source import Excerpt, Source
from coursebuild.syntax.html import Balance
from coursebuild.syntax.inlines import InlineReader, _Pass
from coursebuild.syntax.session import Session
from coursebuild.syntax.simple import simple_inlines

PIECES = [
    *("a", "word ", "é", "1", "(", ").", ",", " ", "  ", "\t", "\n", "\u00a0", "\u2028", "!", "{"),
    *("$x$", "$$y$$", "$", "$$", r"$\$`$", r"\$", "\\", "`c`", "`", "``", "` `", "`a b`", "{out}"),
    *("*a*", "**b c**", "_d_", "__e__", "*", "**", "_", "~", "~~", "*a_b*", "*$x$*", "{#eq:a}"),
    *("&amp;", "<b>", "[", "]", "![", "[a](b)", "Lesson 2.2", "Level 1", "https://a.b/c_d"),
]


def excerpt_of(text: str, cut: int) -> Excerpt:
    """A text that stands in its source with a gap."""
    source = Source("content/x.md", f'"{text[:cut]}...{text[cut:]}"')
    pieces = ((0, 1), (cut, cut + 4)) if 0 < cut < len(text) else ((0, 1 if cut else 4),)
    return Excerpt(source, text, pieces)


def at_length(content: Excerpt, *, mentions: bool) -> tuple[tuple[Inline, ...], object]:
    session = Session(content.source, frozenset(), True)
    reader = InlineReader(content, session.definitions, session, Balance(session.report))
    return _Pass(reader, content, mentions).read(), tuple(session.diagnostics)


@given(
    st.lists(st.sampled_from(PIECES), max_size=9).map("".join),
    st.integers(0, 30),
    st.booleans(),
)
@example("a *b*c", 0, True)
@example("*a***b*", 0, True)
@example("**a*b**c*", 0, True)
@example("_a_b_", 0, True)
@example("`a``b`", 0, True)
@example("$x$1", 0, True)
@example("$a`$`b$", 0, True)
def test_what_is_read_at_a_glance_is_what_there_is(text: str, cut: int, mentions: bool) -> None:
    content = excerpt_of(text, cut)
    found = simple_inlines(content, mentions=mentions)
    if found is not None:
        assert (found, ()) == at_length(content, mentions=mentions)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "words",
        "The mass $m = 1$ at *t*, in `code`,\nand **two words** (_so_).",
        "See Lesson 2.2 and Level 3.",
    ],
)
def test_such_contents_are_read_at_a_glance(text: str) -> None:
    assert simple_inlines(excerpt_of(text, 0)) is not None
