"""What the rest of a course must know of a document, without its prose.

Entry point: `without_prose(document)`, a document of the same type whose walk (`document_blocks`,
`document_inlines`) meets, in the same order, everything that somebody other than the document's own
page looks at, or for which that page looks up something elsewhere: headings with their anchors,
scripts, recorded outputs, bound numbers, blocks of features, MJCF, callouts, links, terms,
pictures, raw HTML.

1. Containers are opened, since nobody outside the page asks what stands in what.
2. Of text only links, pictures, bound numbers and raw HTML stay. What links say is left out.
3. Formulas are left out, but for those of recorded tables: that they parse is found out where the
   whole document is.
4. Only where the document shows nothing does its summary: else a break stands for all the prose.
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

_KEPT = frozenset((Link, Image, NumberBinding, RawInline, Term))


def without_prose(document: Document) -> Document:
    """The document without what only its own page shows."""
    recorded: set[int] = set()
    kept: list[Block] = []
    for block in document_blocks(document):
        if isinstance(block, Recording):
            recorded.add(id(block.body))
        if id(block) not in recorded:  # a recorded table stays in its recording
            kept += _kept_of(block)
    if is_blank(kept) and not is_blank(document_blocks(document)):
        kept.append(ThematicBreak(document.blocks[0].span))
    return Document(document.source, tuple(kept), (), document.title_anchor)


def _kept_of(block: Block) -> Iterator[Block]:
    """What stays of a block, without the blocks in it, which come by themselves."""
    match block:
        case Paragraph() if block.figure:
            yield replace(block, children=_inlines(block))
        case Paragraph() | HtmlFlow() | Table():
            yield from _text(block.span, _inlines(block))
        case Heading():
            yield replace(block, children=_inlines(block))
        case Script() | Mjcf() | HtmlBlock():
            yield block
        case Recording():
            yield replace(block, caption=_inlines(block))
        case FeatureBlock():
            bare = block.summary()
            if bare is not None:
                yield bare
            yield from _text(block.span, _inlines(block))
        case Callout():
            yield replace(block, title=_inlines(block), blocks=())
        case PlainCode() if block.source is not None:
            yield block
        case BlockQuote() | ListBlock() | CodeBlock() | PlainCode() | ThematicBreak() | MathBlock():
            pass
        case _:
            assert_never(block)


def _text(span: Span, inlines: tuple[Inline, ...]) -> Iterator[Paragraph]:
    if inlines:
        yield Paragraph(span, inlines)


def _inlines(block: Block) -> tuple[Inline, ...]:
    """The inlines of a block that stay, one after the other: none is in another."""
    return tuple(
        replace(inline, children=()) if isinstance(inline, Link | Term) else inline
        for inline in walk_inlines(block_inlines(block))
        if type(inline) in _KEPT
    )
