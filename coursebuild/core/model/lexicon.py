"""What a document adds to the glossary and to the index of symbols, and its formulas by their ids.

Entry point: `Lexicon`. It is made where the formulas of a document are typeset, and goes with the
document's summary.
"""

from __future__ import annotations

from msgspec import Struct


class DefinitionPart(Struct, frozen=True):
    """A part of a definition, as HTML; `display`: a formula on a line of its own."""

    html: str
    display: bool = False


class DefinedTerm(Struct, frozen=True):
    """A term, and what the text says of it where it defines it."""

    id: str
    name: str
    title: str
    """The name as HTML."""
    definition: tuple[DefinitionPart, ...]


class SymbolUse(Struct, frozen=True):
    """A symbol of the formulas of a document, where it stands first."""

    symbol: str
    """MathML in its shortest form: two symbols that look the same are the same text."""
    section: int
    """Index into the document's sections; -1 before the first."""
    meaning: str = ""
    """What the document says that it stands for."""
    unit: str = ""


class Equation(Struct, frozen=True):
    """A formula on a line of its own."""

    id: str
    """Its anchor."""
    number: str = ""
    """Of one with a label: `3`."""


class Lexicon(Struct, frozen=True):
    """See the module; everything in the order of the text."""

    terms: tuple[DefinedTerm, ...] = ()
    symbols: tuple[SymbolUse, ...] = ()
    """Each once."""
    sections: tuple[tuple[str, str], ...] = ()
    """Anchors and texts of the headings under which symbols stand first."""
    equations: tuple[Equation, ...] = ()

    @property
    def numbers(self) -> dict[str, str]:
        """Numbers of formulas, by the id."""
        return {equation.id: equation.number for equation in self.equations if equation.number}
