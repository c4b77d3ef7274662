"""The headings of a text, what can be folded in it, and how it is formatted.

Entry points: `headings`, as a tree; `folds`; `layout`.
"""

from __future__ import annotations

from collections.abc import Iterator

from lsprotocol import types

from coursebuild.core.model import (
    Document,
    Heading,
    Lesson,
    Paragraph,
    document_blocks,
    plain_text,
)
from coursebuild.core.text.source import Source, Span
from coursebuild.features.authoring.format import format_document
from coursebuild.features.language_server.commands.texts import OpenTexts


def headings(
    texts: OpenTexts, source: Source, asked: types.DocumentSymbolParams
) -> list[types.DocumentSymbol]:
    """The headings, those of lower levels in those above them."""
    places, document = texts.places, texts.document(source)
    found: list[types.DocumentSymbol] = []
    around: list[tuple[int, list[types.DocumentSymbol]]] = [(0, found)]
    for heading, section in _sections(document) if document else ():
        while around[-1][0] >= heading.level:
            around.pop()
        inner: list[types.DocumentSymbol] = []
        symbol = types.DocumentSymbol(
            " ".join(plain_text(heading.children).split()) or "…",  # a name is never empty
            types.SymbolKind.String,
            places.range(section),
            places.range(heading.span),
            children=inner,
        )
        around[-1][1].append(symbol)
        around.append((heading.level, inner))
    return found


def _sections(document: Document) -> Iterator[tuple[Heading, Span]]:
    """Each heading, and all that stands under it."""
    found = [block for block in document.blocks if isinstance(block, Heading)]
    for at, one in enumerate(found, 1):
        below = (other.span.start for other in found[at:] if other.level <= one.level)
        end = next(below, len(document.source.text))
        yield one, document.source.span(one.span.start, end)


def folds(
    texts: OpenTexts, source: Source, asked: types.FoldingRangeParams
) -> list[types.FoldingRange]:
    """Sections, and all blocks of several lines but paragraphs."""
    document = texts.document(source)
    if document is None:
        return []
    blocks = (block for block in document_blocks(document) if not isinstance(block, Paragraph))
    spans = [*(b.span for b in blocks), *(section for _, section in _sections(document))]
    lines = ((span.line - 1, span.line + span.text.rstrip().count("\n") - 1) for span in spans)
    return [types.FoldingRange(first, last) for first, last in lines if first < last]


def layout(
    texts: OpenTexts, source: Source, asked: types.DocumentFormattingParams
) -> list[types.TextEdit]:
    """What `coursebuild fmt` changes."""
    owner, width = texts.owner(source), texts.library.course.width
    if owner is None:
        return []
    callouts, lesson = frozenset(texts.library.callouts), isinstance(owner, Lesson)
    new = format_document(source, callouts, lesson=lesson, width=width).value
    whole = types.TextEdit(texts.places.range(source.span()), new)
    return [] if new == source.text else [whole]
