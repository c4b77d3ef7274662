"""Texts of quizzes and labs: a line that can only be a paragraph takes a shorter way."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from coursebuild.core.model import Block
from coursebuild.core.syntax.parsing_state import ParsingState
from coursebuild.core.syntax.spans import normalized
from coursebuild.core.syntax.tree import TextReader, Texts
from coursebuild.core.text.source import Excerpt, Source

PIECES = [
    *("a", "word ", "é", "ª", "0", " ", "  ", "\t", "\n", "# ", "- ", "1. ", "> ", "|", "---"),
    *(
        "$x$",
        "$",
        "`c`",
        "**",
        "_",
        "~~",
        "[a](b)",
        "![i](j)",
        "[^1]",
        "<b>",
        "</b>",
        "<!--",
        "-->",
    ),
    *("&amp;", "\\", "Lesson 2.2", "{#id}", "`1`{out}", "http://x"),
]


def read(text: str, cut: int, *, whole: bool) -> tuple[tuple[Block, ...], object]:
    """The blocks of a text that stands in its source with a gap, and what is wrong with them."""
    source = Source("content/x.md", f'"{text[:cut]}...{text[cut:]}"')
    pieces = ((0, 1), (cut, cut + 4)) if 0 < cut < len(text) else ((0, 1 if cut else 4),)
    excerpt = Excerpt(source, text, pieces)
    session = ParsingState(source, frozenset(), True)
    if not whole:
        parsed = Texts(session).blocks(excerpt)
        return parsed.value, parsed.diagnostics
    blocks = TextReader(normalized(excerpt), session, session.definitions, nested=True).read()
    return blocks, tuple(session.diagnostics)


@given(st.lists(st.sampled_from(PIECES), min_size=1, max_size=9).map("".join), st.integers(0, 30))
def test_the_shorter_way_leads_to_the_same(text: str, cut: int) -> None:
    assert read(text, cut, whole=False) == read(text, cut, whole=True)
