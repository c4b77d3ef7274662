"""The headings of a text, its foldable ranges, and its formatting.

Entry points: `headings`, as a tree; `folds`; `format_text`.
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
    texts: OpenTexts, source: Source, params: types.DocumentSymbolParams
) -> list[types.DocumentSymbol]:
    """Return the headings as a tree."""
    places, document = texts.places, texts.document(source)
    roots: list[types.DocumentSymbol] = []
    open_levels: list[tuple[int, list[types.DocumentSymbol]]] = [(0, roots)]
    for heading, section in _sections(document) if document else ():
        while open_levels[-1][0] >= heading.level:
            open_levels.pop()
        children: list[types.DocumentSymbol] = []
        symbol = types.DocumentSymbol(
            " ".join(plain_text(heading.children).split()) or "…",  # clients refuse an empty name
            types.SymbolKind.String,
            places.range(section),
            places.range(heading.span),
            children=children,
        )
        open_levels[-1][1].append(symbol)
        open_levels.append((heading.level, children))
    return roots


def _sections(document: Document) -> Iterator[tuple[Heading, Span]]:
    """Yield each heading with the span of its section."""
    headings = [block for block in document.blocks if isinstance(block, Heading)]
    for index, heading in enumerate(headings, 1):
        ends = (later.span.start for later in headings[index:] if later.level <= heading.level)
        end = next(ends, len(document.source.text))
        yield heading, document.source.span(heading.span.start, end)


def folds(
    texts: OpenTexts, source: Source, params: types.FoldingRangeParams
) -> list[types.FoldingRange]:
    """Return the sections, and all blocks of several lines except paragraphs."""
    document = texts.document(source)
    if document is None:
        return []
    blocks = (block for block in document_blocks(document) if not isinstance(block, Paragraph))
    spans = [*(b.span for b in blocks), *(section for _, section in _sections(document))]
    lines = ((span.line - 1, span.line + span.text.rstrip().count("\n") - 1) for span in spans)
    return [types.FoldingRange(first, last) for first, last in lines if first < last]


def format_text(
    texts: OpenTexts, source: Source, params: types.DocumentFormattingParams
) -> list[types.TextEdit]:
    """Return the edits that `coursebuild fmt` would make."""
    owner, course = texts.owner(source), texts.library.course
    if owner is None:
        return []
    lesson, width, words = isinstance(owner, Lesson), course.width, course.words
    new = format_document(
        source, course.callout_names, lesson=lesson, width=width, words=words
    ).value
    edit = types.TextEdit(texts.places.range(source.span()), new)
    return [] if new == source.text else [edit]
