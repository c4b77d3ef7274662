"""The symbols in the formulas of a document, and what it declares of them.

Entry point: `document_symbols`. Symbols are read from formulas as they are typeset.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TypeAlias

from msgspec import Struct

from coursebuild.core import model
from coursebuild.core.features import Mathml
from coursebuild.core.text.diagnostics import Diagnostic, Note, Parsed, diagnose
from coursebuild.features.symbols.mathml import declared_symbol, symbols

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
