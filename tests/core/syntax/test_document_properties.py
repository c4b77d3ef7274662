"""Parsing never raises, and every node stands where it says, whatever the text."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

from hypothesis import given, settings
from hypothesis import strategies as st
from markdown_it.common.utils import unescapeAll

from coursebuild.core.model import (
    Block,
    CodeBlock,
    CodeSpan,
    Document,
    Emphasis,
    FootnoteRef,
    Heading,
    HtmlFlow,
    Inline,
    Link,
    ListBlock,
    Math,
    MathBlock,
    Mjcf,
    NumberBinding,
    Paragraph,
    PlainCode,
    Recording,
    Script,
    Strikethrough,
    Strong,
    Table,
    Text,
    block_inlines,
    child_blocks,
    document_blocks,
    walk_blocks,
    walk_inlines,
)
from coursebuild.core.syntax.document import parse_document
from coursebuild.core.text.diagnostics import Parsed
from coursebuild.core.text.source import Excerpt, Source, Span
from coursebuild.features.quiz.model import Quiz
from support.plain_html import plain_html
from support.random_lessons import KINDS, markdown


def parse(text: str, lesson: bool = True) -> Parsed[Document]:
    return parse_document(Source("x.md", text), KINDS, lesson=lesson)


@settings(max_examples=250)
@given(markdown(), st.booleans())
def test_parsing_never_raises_and_every_node_stands_where_it_says(text: str, lesson: bool) -> None:
    result = parse(text, lesson)
    document = result.value
    plain_html(document)
    for diagnostic in result.diagnostics:
        assert 0 <= diagnostic.span.start <= diagnostic.span.end <= len(text)
        assert diagnostic.message and not diagnostic.message.endswith(".")
    check_order(document.blocks)
    for block in document_blocks(document):
        check_within(block.span, Span(document.source, 0, len(text)))
        for child in child_blocks(block):
            check_within(child.span, block.span)
        if isinstance(block, ListBlock):
            for item in block.items:
                check_within(item.span, block.span)
        if isinstance(block, Heading | Paragraph | HtmlFlow):
            check_inlines(block.children, block.span)
    for block in own_blocks(document):
        check_block_text(block, text)


def check_block_text(block: Block, text: str) -> None:
    for excerpt in excerpts(block):
        check_characters(excerpt, text)
    for inline in walk_inlines(block_inlines(block)):
        if isinstance(inline, Math):
            check_characters(inline.tex, text)
        if not isinstance(block, Table | HtmlFlow):
            check_marks(inline)
    if isinstance(block, Script) or (
        isinstance(block, Recording) and isinstance(block.body, Excerpt)
    ):
        span = block.body_span
        assert span.start == 0 or text[span.start - 1] in "\r\n"
        assert span.end == len(text) or text[span.end - 1] in "\r\n"
        assert block.prefix.strip("> \t") == ""


@given(st.binary(max_size=200))
def test_decoded_bytes_never_raise(data: bytes) -> None:
    parse(data.decode("utf-8", "replace"))
    parse(data.decode("latin-1"))


def check_within(inner: Span, outer: Span) -> None:
    assert outer.start <= inner.start <= inner.end <= outer.end


def check_order(nodes: tuple[Block, ...]) -> None:
    for first, second in pairwise(nodes):
        assert first.span.end <= second.span.start


def check_inlines(inlines: tuple[Inline, ...], outer: Span) -> None:
    for first, second in pairwise(inlines):
        assert first.span.end <= second.span.start
    for inline in inlines:
        check_within(inline.span, outer)
        if isinstance(inline, Emphasis | Strong | Strikethrough | Link):
            check_inlines(inline.children, inline.span)


def own_blocks(document: Document) -> Iterator[Block]:
    """The blocks that are not in the JSON of a quiz or lab."""
    inner = {
        id(b)
        for block in document_blocks(document)
        if isinstance(block, Quiz)
        for b in walk_blocks((block,))
    }
    return (block for block in document_blocks(document) if id(block) not in inner)


def excerpts(block: Block) -> Iterator[Excerpt]:
    if isinstance(block, CodeBlock | PlainCode | Mjcf | Script) and block.code.text != "\n":
        yield block.code
    if isinstance(block, MathBlock):
        yield block.tex
    if isinstance(block, Recording) and isinstance(block.body, Excerpt):
        yield block.body
    if isinstance(block, Table):
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


def check_marks(inline: Inline) -> None:
    text = inline.span.text
    match inline:
        case Text() if not {"\0", "\r"} & set(text) and "&#" not in text:
            unescaped = unescapeAll(text)
            autolink = ":" in inline.text or "@" in inline.text
            assert unescaped == inline.text or autolink or "\n" in text
        case CodeSpan():
            assert text[0] == text[-1] == "`"
        case NumberBinding():
            assert text[0] == "`" and text[-1] == "}"
            is_same = inline.text_span.text == inline.text
            assert is_same or {"\n", "\r", "\0"} & set(inline.text_span.text)
        case Math():
            assert text[0] == text[-1] == "$"
        case Emphasis():
            assert text[0] == text[-1] and text[0] in "*_"
        case Strong():
            assert text[:2] == text[-2:] and text[:2] in ("**", "__")
        case Strikethrough():
            assert text[:2] == text[-2:] == "~~"
        case Link() if inline.mention:
            assert inline.target_span.text == getattr(inline.target, "id", None)
        case FootnoteRef():
            assert text == f"[^{inline.label}]"
        case _:
            pass
