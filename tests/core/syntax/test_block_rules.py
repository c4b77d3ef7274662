"""Lines that are cut out, and cells of tables, are those of markdown-it; each has its place."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st
from markdown_it import MarkdownIt
from markdown_it.rules_block import StateBlock

from coursebuild.core.syntax.markdown import block_tokens
from coursebuild.core.syntax.spans import BlockState, locate
from coursebuild.core.syntax.tables import read_table
from coursebuild.core.text.source import Excerpt, Source

MARKDOWN = MarkdownIt("zero")

texts = st.text(st.sampled_from("ab \t\t\n\n>-|\\é\x0b\xa0\u2028"), max_size=60)
rows = st.lists(st.text(st.sampled_from("||a \\>`\t\x0bé"), max_size=12), max_size=4)
tables = st.builds(
    lambda prefix, head, rows: "\n".join(prefix + line for line in [*head, *rows]),
    st.sampled_from(["", "  ", "> ", "    ", "\t"]),
    st.sampled_from([("|a|b|", "|-|:-:|"), ("a \\| b", "-:|"), ("|  |a", "|-|-|"), ("|a", "|-")]),
    rows,
)


@given(texts, st.data())
def test_lines_are_cut_out_as_by_markdown_it(text: str, data: st.DataObject) -> None:
    theirs, ours = StateBlock(text, MARKDOWN, {}, []), BlockState(text, MARKDOWN, {})
    begin = data.draw(st.integers(0, ours.lineMax))
    end = data.draw(st.integers(begin, ours.lineMax))
    arguments = (begin, end, data.draw(st.integers(0, 5)), data.draw(st.booleans()))
    assert ours.getLines(*arguments) == theirs.getLines(*arguments)
    base = Excerpt(Source("a.md", text), text, ((0, 0),))
    assert not ours.rows or locate(base, ours.rows).text == ours.getLines(*arguments)


@given(tables)
def test_cells_are_those_of_markdown_it(text: str) -> None:
    base = Excerpt(Source("a.md", text), text, ((0, 0),))
    tokens = block_tokens(base, {})
    for i, token in enumerate(tokens):
        if token.type == "table_open":
            table, after = read_table(tokens, i, base, lambda _: (), lambda _: None)
            ours = [cell.text.text for row in (table.header, *table.rows) for cell in row]
            assert ours == [one.content for one in tokens[i:after] if one.type == "inline"]
