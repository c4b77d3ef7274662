"""The headings of a document, and what can be folded in it.

Entry points: `headings`, as a tree; `folds`.
"""

from __future__ import annotations

from lsprotocol import types

from coursebuild.core import model
from coursebuild.core.text.source import Span
from coursebuild.features.language_server.commands.places import Places

_FOLDED = (
    *(model.Callout, model.Recording, model.Script, model.PlainCode),
    *(model.CodeBlock, model.FeatureBlock, model.Mjcf),
)


def headings(document: model.Document, places: Places) -> list[types.DocumentSymbol]:
    """The headings, those of lower levels in those above them."""
    found: list[types.DocumentSymbol] = []
    around: list[tuple[int, list[types.DocumentSymbol]]] = [(0, found)]
    for heading, section in _sections(document):
        while around[-1][0] >= heading.level:
            around.pop()
        inner: list[types.DocumentSymbol] = []
        symbol = types.DocumentSymbol(
            " ".join(model.plain_text(heading.children).split()) or "…",  # a name is never empty
            types.SymbolKind.String,
            places.range(section),
            places.range(heading.span),
            children=inner,
        )
        around[-1][1].append(symbol)
        around.append((heading.level, inner))
    return found


def _sections(document: model.Document) -> list[tuple[model.Heading, Span]]:
    """Each heading, and all that stands under it."""
    found = [block for block in document.blocks if isinstance(block, model.Heading)]
    end = document.source.span(len(document.source.text))
    return [
        (one, Span(document.source, one.span.start, _below(one, found[at + 1 :], end).start))
        for at, one in enumerate(found)
    ]


def _below(heading: model.Heading, others: list[model.Heading], end: Span) -> Span:
    return next((other.span for other in others if other.level <= heading.level), end)


def folds(document: model.Document) -> list[types.FoldingRange]:
    """Sections, fences with what is recorded of them, and callouts."""
    blocks = [block.span for block in model.document_blocks(document) if isinstance(block, _FOLDED)]
    spans = [*blocks, *(section for _, section in _sections(document))]
    lines = ((span.line - 1, span.line + span.text.rstrip().count("\n") - 1) for span in spans)
    return [types.FoldingRange(first, last) for first, last in lines if first < last]
