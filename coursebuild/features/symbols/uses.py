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
    """A symbol of the formulas of a document, where it stands first."""

    symbol: str
    """MathML in its shortest form: two symbols that look the same are the same text."""
    section: tuple[str, str]
    """Anchor and text of the heading under which it stands; empty before the first."""
    meaning: str = ""
    """What the document says that it stands for."""
    unit: str = ""


class DocumentSymbols(Struct, frozen=True):
    """The symbols of a document in the order of its text, each once."""

    uses: tuple[SymbolUse, ...]


def document_symbols(document: model.Document, mathml: Mathml) -> Parsed[DocumentSymbols | None]:
    """The symbols of a document, and what is wrong in its declarations."""
    if "$" not in document.source.text:
        return Parsed(None)
    uses = _uses(document, mathml)
    wrong = tuple(_misdeclared(document, mathml)) if "${" in document.source.text else ()
    return Parsed(DocumentSymbols(uses) if uses else None, wrong)


def _uses(document: model.Document, mathml: Mathml) -> tuple[SymbolUse, ...]:
    found: dict[str, SymbolUse] = {}
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
                known = found.setdefault(symbol, SymbolUse(symbol, section))
                if meaning is not None and not known.meaning:
                    said = meaning.text, meaning.unit
                    found[symbol] = SymbolUse(symbol, known.section, *said)
    return tuple(found.values())


def _blocks(document: model.Document) -> Iterator[model.Block | None]:
    """All blocks; `None` before the footnotes, which stand under no heading."""
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


def _misdeclared(document: model.Document, mathml: Mathml) -> Iterator[Diagnostic]:
    """Declarations of what is no symbol, and those of one symbol with two meanings."""
    first: dict[str, model.Math] = {}
    for block in model.document_blocks(document):
        for formula in _formulas_in(block):
            if isinstance(formula, model.Math) and formula.meaning is not None:
                html = mathml(formula.tex.text, False)
                if html:
                    yield from _declaration(formula, html, first)


def _declaration(
    formula: model.Math, html: str, first: dict[str, model.Math]
) -> Iterator[Diagnostic]:
    symbol = only_symbol(html)
    if symbol is None:
        message = f"`${formula.tex.text}$` is not a single symbol, and is said to mean something"
        help = "declare one letter with its accents and indices"
        yield diagnose("symbol-formula", formula.tex.span(), message, help=help)
        return
    before = first.setdefault(symbol, formula)
    if before is not formula:
        note = Note("first declared here", before.span)
        message = f"`${formula.tex.text}$` is declared twice in this text"
        help = "a reader looks for one meaning; give the other quantity another letter"
        yield diagnose("symbol-repeated", formula.span, message, help=help, notes=[note])
