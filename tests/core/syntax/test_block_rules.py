"""Lines that are cut out, and tables, are those that markdown-it finds; each has its place."""

from __future__ import annotations

from typing import Any

from hypothesis import given
from hypothesis import strategies as st
from markdown_it import MarkdownIt
from markdown_it.rules_block import StateBlock

from coursebuild.core.model import Table
from coursebuild.core.syntax import tables
from coursebuild.core.syntax.block_parser import Definitions, block_parser
from coursebuild.core.syntax.document import parse_document
from coursebuild.core.syntax.markdown import block_tokens
from coursebuild.core.syntax.spans import BlockState, locate
from coursebuild.core.text.source import Excerpt, Source

_MARKDOWN = MarkdownIt("gfm-like", {"linkify": False})
_OURS = MarkdownIt("zero")
_OURS.block = block_parser()

texts = st.text(st.sampled_from("ab \t\t\n\n>-|\\é\x0b\xa0\u2028"), max_size=60)
rows = st.lists(
    st.text(st.sampled_from("|||---:: \\a\t>é\xa0\x0b"), max_size=12), min_size=2, max_size=5
)
likely = st.builds(
    lambda head, below, rest: [head, below, *rest],
    st.text(st.sampled_from("|a \\"), min_size=3, max_size=9),
    st.sampled_from(["|-|-|", "-|-", ":-:|--:", "| - | :-- |", "---", "|-", "-|", "- -|", ":|-:"]),
    st.lists(st.text(st.sampled_from("||a \\>`"), max_size=9), max_size=4),
)
tables_within = st.builds(
    lambda prefix, lines: "\n".join(prefix + line for line in lines),
    st.sampled_from(["", "  ", "> ", "    ", "\t"]),
    rows | likely,
)


@given(texts, st.data())
def test_the_lines_that_are_cut_out_are_those_that_markdown_it_cuts(
    text: str, data: st.DataObject
) -> None:
    theirs, ours = StateBlock(text, _OURS, {}, []), BlockState(text, _OURS, {})
    begin = data.draw(st.integers(0, ours.lineMax))
    end = data.draw(st.integers(begin, ours.lineMax))
    arguments = (begin, end, data.draw(st.integers(0, 5)), data.draw(st.booleans()))
    assert ours.getLines(*arguments) == theirs.getLines(*arguments)
    assert ours.count == end - begin
    base = Excerpt(Source("a.md", text), text, ((0, 0),))
    assert locate(base, ours.rows).text == ours.getLines(*arguments)


def _their_tables(text: str) -> list[tuple[list[int] | None, list[list[str]], list[str]]]:
    """Lines, cells and alignments of the tables that markdown-it finds in a text."""
    found: list[tuple[list[int] | None, list[list[str]], list[str]]] = []
    tokens = _MARKDOWN.parse(text)
    for i, token in enumerate(tokens):
        if token.type == "table_open":
            found.append((token.map, [], []))
        elif token.type == "tr_open":
            found[-1][1].append([])
        elif token.type in ("th_open", "td_open"):
            found[-1][1][-1].append(tokens[i + 1].content)
            if token.type == "th_open":
                found[-1][2].append(str(token.attrs.get("style", "")))
    return found


def _our_tables(text: str) -> list[tuple[list[int] | None, list[list[str]], list[str]]]:
    base = Excerpt(Source("a.md", text), text, ((0, 0),))
    tokens = block_tokens(base, Definitions())
    found: list[tuple[list[int] | None, list[list[str]], list[str]]] = []

    def plain(cell: Excerpt) -> tuple[Any, ...]:
        return ()

    for i, token in enumerate(tokens):
        if token.type == "table_open":
            table, _ = tables.read_table(tokens, i, base, plain, lambda wrong: None)
            cells = [[cell.text.text for cell in row] for row in (table.header, *table.rows)]
            align = [f"text-align:{one}" if one else "" for one in table.align]
            found.append((token.map, cells, align))
    return found


@given(tables_within)
def test_tables_are_those_that_markdown_it_finds(text: str) -> None:
    assert _our_tables(text) == _their_tables(text)


def test_a_table_in_a_lesson_has_cells_where_they_stand() -> None:
    source = Source("a.md", "> | a | b \\| c |\n> |:-:|---|\n> | 1 |\n")
    quote = parse_document(source, frozenset(), lesson=True).value.blocks[0]
    table = quote.blocks[0]  # type: ignore[union-attr]
    assert isinstance(table, Table)
    assert table.align == ("center", None)
    assert [cell.text.text for cell in table.header] == ["a", "b | c"]
    assert [cell.span.text for cell in table.header] == ["a", "b \\| c"]
    assert [cell.span.text for cell in table.rows[0]] == ["1", ""]
