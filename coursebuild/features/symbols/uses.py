"""The symbols in the formulas of a document, what it declares of them, and the index of all.

Entry points: `document_symbols`; `symbols_values`, for the page; `used_symbols`. Symbols are read
from formulas as they are typeset. In the index those come first whose meaning a lesson declares;
for the others only their places are listed.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TypeAlias

from markupsafe import Markup
from msgspec import Struct, field

from coursebuild.core import model
from coursebuild.core.model import Lesson, Owner
from coursebuild.core.model.results import Mathml
from coursebuild.core.pages import urls
from coursebuild.core.pages.document_inputs import (
    OwnerLink,
    OwnerLinks,
    added_page,
    owner_link,
    owner_links,
)
from coursebuild.core.pages.library import Library
from coursebuild.core.text.diagnostics import Diagnostic, Note, Parsed, diagnose
from coursebuild.features.symbols.mathml import declared_symbol, sort_key, symbols

_Formula: TypeAlias = model.Math | model.MathBlock


class SymbolUse(Struct, frozen=True):
    """A symbol in the formulas of a document, with the place of its first use."""

    symbol: str
    """MathML in its shortest form: symbols that look the same are equal."""
    section: tuple[str, str]
    """Anchor and text of the heading above it; empty before the first heading."""
    meaning: str = ""
    """What it stands for, if the document declares that."""
    unit: str = ""


class DocumentSymbols(Struct, frozen=True):
    """The symbols of a document in the order of its text, each once."""

    uses: tuple[SymbolUse, ...]


def document_symbols(document: model.Document, mathml: Mathml) -> Parsed[DocumentSymbols | None]:
    """Return the symbols of a document; diagnostics are about its declarations."""
    uses: dict[str, SymbolUse] = {}
    first_declarations: dict[str, _Formula] = {}
    diagnostics: list[Diagnostic] = []
    for formula, section in _formulas(document):
        html, meaning = mathml(formula.tex.text, formula.display), formula.meaning
        only = declared_symbol(html) if meaning is not None else None
        for symbol in (only,) if only is not None else symbols(html):
            use = uses.setdefault(symbol, SymbolUse(symbol, section))
            if meaning is not None and not use.meaning:
                uses[symbol] = SymbolUse(symbol, use.section, meaning.text, meaning.unit)
        if meaning is not None and html:
            diagnostics += _check_declaration(formula, only, first_declarations)
    return Parsed(DocumentSymbols(tuple(uses.values())) if uses else None, tuple(diagnostics))


def _formulas(document: model.Document) -> Iterator[tuple[_Formula, tuple[str, str]]]:
    """Yield all formulas, with the heading above; footnotes belong to none."""
    for blocks in (document.blocks, *(footnote.blocks for footnote in document.footnotes)):
        section = "", ""
        for block in model.walk_blocks(blocks):
            if isinstance(block, model.Heading) and block.level <= 3:
                section = block.anchor, " ".join(model.plain_text(block.children).split())
            for formula in model.block_formulas(block):
                yield formula, section


def _check_declaration(
    formula: _Formula, symbol: str | None, first_declarations: dict[str, _Formula]
) -> Iterator[Diagnostic]:
    """Report a declaration of no symbol, or of one declared before."""
    if symbol is None:
        message = f"`${formula.tex.text}$` is declared as a symbol, but is not a single one"
        help = "declare one letter with its accents and indices"
        yield diagnose("symbol-formula", formula.tex.span(), message, help=help)
        return
    first = first_declarations.setdefault(symbol, formula)
    if first is not formula:
        note = Note("first declared here", first.span)
        message = f"`${formula.tex.text}$` is declared twice in this text"
        help = "a reader looks for one meaning; give the other quantity another letter"
        yield diagnose("symbol-repeated", formula.span, message, help=help, notes=[note])


class CourseSymbol(Struct):
    """A symbol of the formulas of the lessons of a course."""

    first: SymbolUse
    owners: list[Owner] = field(default_factory=list)
    """The lessons that use it, in the order of the course."""
    meanings: dict[tuple[str, str], list[Owner]] = field(default_factory=dict)
    """The lessons that declare it, by its meaning and unit there."""


def used_symbols(library: Library) -> Iterator[tuple[Lesson, SymbolUse]]:
    """Yield the symbols of all lessons, in the order of the course."""
    for owner, summary in library.summaries("symbols"):
        if isinstance(owner, Lesson):
            for use in summary.uses:
                yield owner, use


def _course_symbols(library: Library) -> list[CourseSymbol]:
    rows: dict[str, CourseSymbol] = {}
    for owner, use in used_symbols(library):
        row = rows.setdefault(use.symbol, CourseSymbol(use))
        row.owners.append(owner)
        if use.meaning:
            row.meanings.setdefault((use.meaning, use.unit), []).append(owner)
    return sorted(rows.values(), key=lambda row: sort_key(row.first.symbol))


class MeaningView(Struct, frozen=True):
    """What a symbol stands for; `places` are the lessons that say so, if others differ."""

    text: str
    unit: str
    places: OwnerLinks | None


class SymbolView(Struct, frozen=True):
    """A symbol in the index."""

    symbol: Markup
    meanings: tuple[MeaningView, ...]
    first: OwnerLink
    section: str
    """The heading above its first use; empty before the first heading."""
    later_uses: OwnerLinks
    """The lessons that use it after the first one."""


def symbols_values(library: Library) -> dict[str, object]:
    """Return the values for the template of the index."""
    place = urls.Place("symbols/index.html")
    rows = [_symbol_view(library, place, row) for row in _course_symbols(library)]
    return {
        "declared": tuple(row for row in rows if row.meanings),
        "undeclared": tuple(row for row in rows if not row.meanings),
        "glossary": added_page(library, place, "glossary"),
    }


def _symbol_view(library: Library, place: urls.Place, row: CourseSymbol) -> SymbolView:
    anchor, section = row.first.section
    is_ambiguous = len(row.meanings) > 1
    return SymbolView(
        Markup(f"<math>{row.first.symbol}</math>"),
        tuple(
            MeaningView(text, unit, owner_links(place, owners) if is_ambiguous else None)
            for (text, unit), owners in row.meanings.items()
        ),
        owner_link(place, row.owners[0], anchor),
        section,
        owner_links(place, row.owners[1:]),
    )
