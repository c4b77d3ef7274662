"""Summaries: what the rest of a course must know of a document, without its prose.

Entry point: `without_prose(document)`, a document of the same type. Walking it (`document_blocks`,
`document_inlines`) meets, in the same order, everything that other pages or checks look at, and
everything for which the document's own page looks something up: headings with their anchors,
scripts, recorded outputs, bound numbers, blocks of features, MJCF, callouts, links, terms,
pictures, raw HTML.

1. Blocks come out of their containers, since no other page asks what contains what.
2. Of inlines only links, without their text, pictures, bound numbers, terms and raw HTML stay.
3. Formulas are left out, except those in recorded tables: they are checked in the whole document.
4. If only prose was left out, a thematic break stands for it, so that the summary is not blank.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import assert_never

from msgspec.structs import replace

from coursebuild.core.model.blocks import (
    Block,
    BlockQuote,
    Callout,
    CodeBlock,
    Document,
    FeatureBlock,
    Heading,
    HtmlBlock,
    HtmlFlow,
    ListBlock,
    MathBlock,
    Mjcf,
    Paragraph,
    PlainCode,
    Recording,
    Script,
    Table,
    ThematicBreak,
)
from coursebuild.core.model.inlines import Image, Inline, Link, NumberBinding, RawInline, Term
from coursebuild.core.model.walk import block_inlines, document_blocks, is_blank, walk_inlines
from coursebuild.core.text.source import Span

_SUMMARY_INLINES = frozenset((Link, Image, NumberBinding, RawInline, Term))


def without_prose(document: Document) -> Document:
    """The summary of a document: all but what only its own page shows."""
    recorded_ids: set[int] = set()
    blocks: list[Block] = []
    for block in document_blocks(document):
        if isinstance(block, Recording):
            recorded_ids.add(id(block.body))
        if id(block) not in recorded_ids:  # a recorded table comes with its recording
            blocks += _summarize_block(block)
    if is_blank(blocks) and not is_blank(document_blocks(document)):
        blocks.append(ThematicBreak(document.blocks[0].span))
    return Document(document.source, tuple(blocks), (), document.title_anchor, document.unclaimed)


def _summarize_block(block: Block) -> Iterator[Block]:
    """The summary of a block without its child blocks, which come separately."""
    match block:
        case Paragraph() if block.figure:
            yield replace(block, children=_summary_inlines(block))
        case Paragraph() | HtmlFlow() | Table():
            yield from _paragraph_of(block.span, _summary_inlines(block))
        case Heading():
            yield replace(block, children=_summary_inlines(block))
        case Script() | Mjcf() | HtmlBlock():
            yield block
        case Recording():
            yield replace(block, caption=_summary_inlines(block))
        case FeatureBlock():
            bare = block.summary()
            if bare is not None:
                yield bare
            yield from _paragraph_of(block.span, _summary_inlines(block))
        case Callout():
            yield replace(block, title=_summary_inlines(block), blocks=())
        case PlainCode() if block.source is not None:
            yield block
        case BlockQuote() | ListBlock() | CodeBlock() | PlainCode() | ThematicBreak() | MathBlock():
            pass
        case _:
            assert_never(block)


def _paragraph_of(span: Span, inlines: tuple[Inline, ...]) -> Iterator[Paragraph]:
    if inlines:
        yield Paragraph(span, inlines)


def _summary_inlines(block: Block) -> tuple[Inline, ...]:
    """The inlines of a block that a summary keeps, without nesting."""
    return tuple(
        replace(inline, children=()) if isinstance(inline, Link | Term) else inline
        for inline in walk_inlines(block_inlines(block))
        if type(inline) in _SUMMARY_INLINES
    )
