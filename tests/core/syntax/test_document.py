"""What files become, and what is found in them: the fixtures, and properties of any text.

A file in `tests/fixtures/syntax/` whose name begins with `page` is parsed as a page, all others as
lessons. `pytest tests/core/syntax --rewrite-fixtures` writes the expected parts anew, and those of
`tests/fixtures/markup/`, where those of `innocent.md` stay empty.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from types import FrameType

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from markdown_it.common.utils import unescapeAll

from coursebuild.core import model
from coursebuild.core.model.course import CALLOUTS
from coursebuild.core.syntax.document import parse_document
from coursebuild.core.text.diagnostics import Parsed
from coursebuild.core.text.source import Excerpt, Source, Span
from coursebuild.features.quiz.model import Quiz
from support.fixture_cases import Case, check_cases, fixture_tables, fixture_text
from support.plain_html import plain_html
from support.random_lessons import KINDS, markdown
from support.tree_dump import dump

FOLDER = Path(__file__).parents[2] / "fixtures" / "syntax"
FILES = sorted(FOLDER.glob("*.md"))
CALLOUT_KINDS = frozenset(CALLOUTS)


def dump_document(path: Path, case: Case) -> str:
    source = Source("content/lessons/1.1-x.md", case.input)
    return dump(parse_document(source, CALLOUT_KINDS, lesson=not path.stem.startswith("page")))


def test_every_file_of_the_folder_is_read() -> None:
    assert len(FILES) >= 10
    assert set(FOLDER.iterdir()) == set(FILES)


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_documents_are_as_their_fixtures_say(path: Path, rewriting: bool) -> None:
    check_cases(path, lambda case: dump_document(path, case), rewriting=rewriting)


SOURCE_KINDS = frozenset({"note", "try"})
LESSON = fixture_text("documents/nested.md")


def document_of(text: str, *rules: str) -> model.Document:
    result = parse_document(Source("x.md", text), SOURCE_KINDS, lesson=True)
    assert tuple(diagnostic.rule for diagnostic in result.diagnostics) == rules
    return result.value


@pytest.mark.parametrize("line_end", ["\n", "\r\n", "\r"])
def test_line_ends(line_end: str) -> None:
    text = LESSON.replace("\n", line_end)
    document = document_of(text)
    callout = document.blocks[1]
    assert isinstance(callout, model.Callout)
    script, recording = callout.blocks
    assert isinstance(script, model.Script) and isinstance(recording, model.Recording)
    assert script.code.text == "print(1)\n\nprint(2)\n"
    assert script.code.span().text.startswith("print(1)" + line_end)
    assert isinstance(recording.body, Excerpt) and recording.body.text == "1\n2\n"
    assert recording.body_span.text == f"> 1{line_end}> 2{line_end}"
    assert recording.prefix == "> "
    assert recording.span.line == 10
    assert plain_html(document) == plain_html(document_of(LESSON))


def test_a_byte_order_mark_is_skipped() -> None:
    document = document_of("\ufeff## A\n")
    heading = document.blocks[0]
    assert isinstance(heading, model.Heading) and heading.anchor == "a"
    assert (heading.span.start, heading.span.end) == (1, 5)


def test_nul_is_a_replacement_character() -> None:
    document = document_of("a\0b `c\0`", "control-character")
    assert plain_html(document) == "<p>a\ufffdb <code>c\ufffd</code></p>\n"


def test_an_unclosed_fence_without_final_line_end_has_one() -> None:
    result = parse_document(Source("x.md", "```c\nx"), SOURCE_KINDS, lesson=True)
    block = result.value.blocks[0]
    assert isinstance(block, model.CodeBlock) and block.code.text == "x\n"
    assert [d.rule for d in result.diagnostics] == ["fence-unclosed"]


def test_deep_nesting_becomes_paragraphs_and_loses_nothing() -> None:
    document = document_of(">" * 300 + " a", "nesting-deep")
    blocks = list(model.document_blocks(document))
    assert sum(isinstance(block, model.BlockQuote) for block in blocks) == 60
    assert blocks[-1].span.text == ">" * 240 + " a"


def test_deep_emphasis_loses_its_marks_and_no_text() -> None:
    text = "*a " * 200 + "b*" * 200
    inlines = list(model.document_inlines(document_of(text)))
    assert sum(isinstance(inline, model.Emphasis) for inline in inlines) == 60
    assert str(plain_html(document_of(text))).count("a ") == 200


REPEATED_PIECES = fixture_tables("repeated_pieces")["pieces"]


def calls(text: str) -> int:
    """How many functions parsing and rendering call: a repeatable measure of the work."""
    count = 0

    def count_call(frame: FrameType, event: str, argument: object) -> None:
        nonlocal count
        count += 1

    sys.setprofile(count_call)
    try:
        plain_html(parse_document(Source("x.md", text), SOURCE_KINDS, lesson=True).value)
    finally:
        sys.setprofile(None)
    return count


NESTED = [("[", "]"), ("[", "](u)"), ("![", "](u)"), ("*a ", "b*")]


@pytest.mark.site
def test_work_grows_in_proportion_to_repeated_pieces() -> None:
    failures = []
    for piece in REPEATED_PIECES:
        size = 300 // len(piece)
        calls(piece)
        once, twice = calls(piece * size), calls(piece * (2 * size))
        if twice >= 2.2 * once + 500:
            failures.append(f"{piece!r}: {once} and {twice} calls")
    assert failures == []


def test_work_grows_in_proportion_to_nested_brackets() -> None:
    failures = []
    for left, right in NESTED:
        once, twice = (calls(left * n + "x" + right * n) for n in (150, 300))
        if twice >= 2.3 * once + 500:
            failures.append(f"{left!r} and {right!r}: {once} and {twice} calls")
    assert failures == []


def parse_any(text: str, lesson: bool = True) -> Parsed[model.Document]:
    return parse_document(Source("x.md", text), KINDS, lesson=lesson)


@settings(max_examples=250)
@given(markdown(), st.booleans())
def test_parsing_never_raises_and_every_node_stands_where_it_says(text: str, lesson: bool) -> None:
    result = parse_any(text, lesson)
    document = result.value
    plain_html(document)
    for diagnostic in result.diagnostics:
        assert 0 <= diagnostic.span.start <= diagnostic.span.end <= len(text)
        assert diagnostic.message and not diagnostic.message.endswith(".")
    check_order(document.blocks)
    for block in model.document_blocks(document):
        check_within(block.span, Span(document.source, 0, len(text)))
        for child in model.child_blocks(block):
            check_within(child.span, block.span)
        if isinstance(block, model.ListBlock):
            for item in block.items:
                check_within(item.span, block.span)
        if isinstance(block, model.Heading | model.Paragraph | model.HtmlFlow):
            check_inlines(block.children, block.span)
    for block in own_blocks(document):
        check_block_text(block, text)


def check_block_text(block: model.Block, text: str) -> None:
    for excerpt in excerpts(block):
        check_characters(excerpt, text)
    for inline in model.walk_inlines(model.block_inlines(block)):
        if isinstance(inline, model.Math):
            check_characters(inline.tex, text)
        if not isinstance(block, model.Table | model.HtmlFlow):
            check_marks(inline)
    if isinstance(block, model.Script) or (
        isinstance(block, model.Recording) and isinstance(block.body, Excerpt)
    ):
        span = block.body_span
        assert span.start == 0 or text[span.start - 1] in "\r\n"
        assert span.end == len(text) or text[span.end - 1] in "\r\n"
        assert block.prefix.strip("> \t") == ""


def check_within(inner: Span, outer: Span) -> None:
    assert outer.start <= inner.start <= inner.end <= outer.end


def check_order(nodes: tuple[model.Block, ...]) -> None:
    for first, second in pairwise(nodes):
        assert first.span.end <= second.span.start


def check_inlines(inlines: tuple[model.Inline, ...], outer: Span) -> None:
    for first, second in pairwise(inlines):
        assert first.span.end <= second.span.start
    for inline in inlines:
        check_within(inline.span, outer)
        if isinstance(inline, model.Emphasis | model.Strong | model.Strikethrough | model.Link):
            check_inlines(inline.children, inline.span)


def own_blocks(document: model.Document) -> Iterator[model.Block]:
    """The blocks that are not in the JSON of a quiz or lab."""
    inner = {
        id(b)
        for block in model.document_blocks(document)
        if isinstance(block, Quiz)
        for b in model.walk_blocks((block,))
    }
    return (block for block in model.document_blocks(document) if id(block) not in inner)


def excerpts(block: model.Block) -> Iterator[Excerpt]:
    if (
        isinstance(block, model.CodeBlock | model.PlainCode | model.Mjcf | model.Script)
        and block.code.text != "\n"
    ):
        yield block.code
    if isinstance(block, model.MathBlock):
        yield block.tex
    if isinstance(block, model.Recording) and isinstance(block.body, Excerpt):
        yield block.body
    if isinstance(block, model.Table):
        yield from (cell.text for row in (block.header, *block.rows) for cell in row)


def check_characters(excerpt: Excerpt, text: str) -> None:
    """Each character stands at its offset, except line ends, NUL and the spaces of a tab."""
    for i, char in enumerate(excerpt.text):
        at = excerpt.offset(i)
        source_char = text[at : at + 1]
        assert (
            source_char == char
            or (char == "\n" and source_char in ("\r", "\n", ""))
            or (char == " " and source_char == "\t")
            or (char == "\ufffd" and source_char == "\0")
        ), (i, char, source_char)


def check_marks(inline: model.Inline) -> None:
    text = inline.span.text
    match inline:
        case model.Text() if not {"\0", "\r"} & set(text) and "&#" not in text:
            unescaped = unescapeAll(text)
            autolink = ":" in inline.text or "@" in inline.text
            assert unescaped == inline.text or autolink or "\n" in text
        case model.CodeSpan():
            assert text[0] == text[-1] == "`"
        case model.NumberBinding():
            assert text[0] == "`" and text[-1] == "}"
            is_same = inline.text_span.text == inline.text
            assert is_same or {"\n", "\r", "\0"} & set(inline.text_span.text)
        case model.Math():
            assert text[0] == text[-1] == "$"
        case model.Emphasis():
            assert text[0] == text[-1] and text[0] in "*_"
        case model.Strong():
            assert text[:2] == text[-2:] and text[:2] in ("**", "__")
        case model.Strikethrough():
            assert text[:2] == text[-2:] == "~~"
        case model.Link() if inline.mention:
            assert inline.target_span.text == getattr(inline.target, "id", None)
        case model.FootnoteRef():
            assert text == f"[^{inline.label}]"
        case _:
            pass
