"""Finds the terms of a document with their definitions.

Entry point: `document_terms`. A definition is the sentence with the term and the next one, as HTML.
If they continue in a displayed formula, the formula is part of it. Links lose their addresses,
since the glossary is another page; of links to formulas of the document the numbers remain.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from urllib.parse import unquote

from markupsafe import Markup
from msgspec import Struct

from coursebuild.core.features import Mathml
from coursebuild.core.model import (
    Block,
    Document,
    Inline,
    Math,
    MathBlock,
    Paragraph,
    Target,
    Term,
    UrlTarget,
    sibling_groups,
    walk_inlines,
    without_links,
)
from coursebuild.core.pages import formulas
from coursebuild.core.pages.formulas import number_equations
from coursebuild.core.pages.markup import HtmlWriter
from coursebuild.core.text.diagnostics import Parsed
from coursebuild.features.glossary.sentences import definition_of, runs_on


class DefinitionPart(Struct, frozen=True):
    """A part of a definition, as HTML; `display` means a displayed formula."""

    html: Markup
    display: bool = False


class DefinedTerm(Struct, frozen=True):
    """A term with its definition."""

    id: str
    name: str
    title: Markup
    """The name as HTML."""
    definition: tuple[DefinitionPart, ...]


class DocumentTerms(Struct, frozen=True):
    """The terms of a document, in the order of its text."""

    terms: tuple[DefinedTerm, ...]


def document_terms(document: Document, mathml: Mathml) -> Parsed[DocumentTerms | None]:
    """Return the terms of a document; a formula that is not typeset remains TeX."""
    terms = tuple(_find_terms(document, mathml)) if "]{" in document.source.text else ()
    return Parsed(DocumentTerms(terms) if terms else None)


class _ExcerptWriter(HtmlWriter):
    """Writes a sentence that is shown on another page."""

    def __init__(self, mathml: Mathml) -> None:
        self._mathml = mathml

    def math(self, tex: str) -> Markup:
        mathml = self._mathml(tex, False)
        return Markup(formulas.split_formula(mathml)) if mathml else super().math(tex)

    def display(self, tex: str, start: int) -> Markup:
        return Markup(self._mathml(tex, True)) or super().display(tex, start)


def _find_terms(document: Document, mathml: Mathml) -> Iterator[DefinedTerm]:
    writer = _ExcerptWriter(mathml)
    equations = number_equations(document, mathml).values()
    names = {f"#{e.id}": f"({e.number})" for e in equations if e.number}

    def reference(target: Target) -> str:
        return names.get(unquote(target.url), "") if isinstance(target, UrlTarget) else ""

    def html(inlines: tuple[Inline, ...]) -> Markup:
        return writer.inlines(without_links(inlines, reference))

    for siblings in sibling_groups(document):
        for number, block in enumerate(siblings):
            if not isinstance(block, Paragraph):
                continue
            for term in walk_inlines(block.children):
                if not isinstance(term, Term):
                    continue
                following = siblings[number + 1] if number + 1 < len(siblings) else None
                title = Markup.escape(term.name) if term.renamed else html(term.children)
                definition = definition_of(block.children, term)
                pieces = tuple(_split_definition(definition, following, html, writer))
                yield DefinedTerm(term.id, term.name, title, pieces)


def _split_definition(
    definition: tuple[Inline, ...],
    following: Block | None,
    html: Callable[[tuple[Inline, ...]], Markup],
    writer: _ExcerptWriter,
) -> Iterator[DefinitionPart]:
    """Split a definition at its displayed formulas."""
    line: list[Inline] = []
    for inline in definition:
        if isinstance(inline, Math) and inline.display:
            yield DefinitionPart(html(tuple(line)).strip())
            yield DefinitionPart(writer.display(inline.tex.text, 0), display=True)
            line = []
        else:
            line.append(inline)
    if line:
        yield DefinitionPart(html(tuple(line)).strip())
    if isinstance(following, MathBlock) and following.tex.text and runs_on(definition):
        yield DefinitionPart(writer.display(following.tex.text, 0), display=True)
