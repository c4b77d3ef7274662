"""The symbols in the formulas of a document, and what it declares of them.

Entry point: `document_symbols`. Symbols are read from formulas as they are typeset.
"""

from __future__ import annotations

from collections.abc import Iterator

from msgspec import Struct

from coursebuild.core import model
from coursebuild.core.features import Mathml
from coursebuild.core.text.diagnostics import Diagnostic, Note, Parsed, diagnose
from coursebuild.features.symbols.mathml import only_symbol, symbols


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
    if "$" not in document.source.text:
        return Parsed(None)
    uses = _find_uses(document, mathml)
    has_declarations = "${" in document.source.text
    diagnostics = tuple(_check_declarations(document, mathml)) if has_declarations else ()
    return Parsed(DocumentSymbols(uses) if uses else None, diagnostics)


def _find_uses(document: model.Document, mathml: Mathml) -> tuple[SymbolUse, ...]:
    uses: dict[str, SymbolUse] = {}
    section = "", ""
    for block in _blocks(document):
        if block is None:
            section = "", ""
            continue
        if isinstance(block, model.Heading) and block.level <= 3:
            section = block.anchor, " ".join(model.plain_text(block.children).split())
        for formula in _formulas_in(block):
            html = mathml(formula.tex.text, not isinstance(formula, model.Math) or formula.display)
            meaning = formula.meaning if isinstance(formula, model.Math) else None
            only = only_symbol(html) if meaning is not None else None
            for symbol in (only,) if only is not None else symbols(html):
                use = uses.setdefault(symbol, SymbolUse(symbol, section))
                if meaning is not None and not use.meaning:
                    uses[symbol] = SymbolUse(symbol, use.section, meaning.text, meaning.unit)
    return tuple(uses.values())


def _blocks(document: model.Document) -> Iterator[model.Block | None]:
    """Yield all blocks, and `None` before the footnotes, which belong to no heading."""
    yield from model.walk_blocks(document.blocks)
    yield None
    for footnote in document.footnotes:
        yield from model.walk_blocks(footnote.blocks)


def _formulas_in(block: model.Block) -> Iterator[model.Math | model.MathBlock]:
    if isinstance(block, model.MathBlock):
        yield block
    for inline in model.walk_inlines(model.block_inlines(block)):
        if isinstance(inline, model.Math):
            yield inline


def _check_declarations(document: model.Document, mathml: Mathml) -> Iterator[Diagnostic]:
    """Yield a diagnostic for each declaration of no symbol, or of one declared before."""
    first: dict[str, model.Math] = {}
    for block in model.document_blocks(document):
        for formula in _formulas_in(block):
            if isinstance(formula, model.Math) and formula.meaning is not None:
                html = mathml(formula.tex.text, False)
                if html:
                    yield from _check_declaration(formula, html, first)


def _check_declaration(
    formula: model.Math, html: str, first: dict[str, model.Math]
) -> Iterator[Diagnostic]:
    symbol = only_symbol(html)
    if symbol is None:
        message = f"`${formula.tex.text}$` is not a single symbol, and is said to mean something"
        help = "declare one letter with its accents and indices"
        yield diagnose("symbol-formula", formula.tex.span(), message, help=help)
        return
    first_declaration = first.setdefault(symbol, formula)
    if first_declaration is not formula:
        note = Note("first declared here", first_declaration.span)
        message = f"`${formula.tex.text}$` is declared twice in this text"
        help = "a reader looks for one meaning; give the other quantity another letter"
        yield diagnose("symbol-repeated", formula.span, message, help=help, notes=[note])
