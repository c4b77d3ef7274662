"""Terms and labels that stand where a reader would not find them.

Entry point: `misplaced(document)`.

The glossary shows the sentence around a term, so that one is defined in a paragraph. What stands in
a quiz or a lab, or in a heading, is shown elsewhere too, so that it cannot be led to.
"""

from __future__ import annotations

from collections.abc import Iterator

from coursebuild.core.model import (
    Block,
    Document,
    Heading,
    Math,
    MathBlock,
    Paragraph,
    Term,
    block_inlines,
    document_blocks,
    document_inlines,
    walk_inlines,
)
from coursebuild.core.model.equations import blocks_elsewhere
from coursebuild.core.text.diagnostics import Diagnostic, Note, diagnose
from coursebuild.core.text.source import Span

_MARKS = ("]{", "{#eq:")


def misplaced(document: Document) -> tuple[Diagnostic, ...]:
    """A diagnostic for each."""
    if not any(mark in document.source.text for mark in _MARKS):
        return ()
    elsewhere = blocks_elsewhere(document)
    found = [*_taken(document)]
    for block in document_blocks(document):
        away = id(block) in elsewhere
        for span in _terms(block) if away or not isinstance(block, Paragraph) else ():
            message = "a term is not defined here"
            help = "define it in a paragraph of the text, whose sentence the glossary can show"
            found.append(diagnose("term-place", span, message, help=help))
        for span in _labels(block) if away or isinstance(block, Heading) else ():
            message = "a formula has no label here"
            help = "label formulas of the text, but not those of quizzes, labs and headings"
            found.append(diagnose("equation-label", span, message, help=help))
    return tuple(found)


def _taken(document: Document) -> Iterator[Diagnostic]:
    """Headings whose explicit ids are those of terms."""
    terms = {
        inline.anchor: inline.span
        for inline in document_inlines(document)
        if isinstance(inline, Term)
    }
    for block in document_blocks(document):
        if isinstance(block, Heading) and block.anchor in terms:
            notes = [Note("it is that of this term", terms[block.anchor])]
            message = f"the id `{block.anchor}` is already used"
            yield diagnose("anchor-repeated", block.span, message, notes=notes)


def _terms(block: Block) -> Iterator[Span]:
    for inline in walk_inlines(block_inlines(block)):
        if isinstance(inline, Term):
            yield inline.span


def _labels(block: Block) -> Iterator[Span]:
    if isinstance(block, MathBlock) and block.label is not None:
        yield block.label.span
    for inline in walk_inlines(block_inlines(block)):
        if isinstance(inline, Math) and inline.label is not None:
            yield inline.label.span
