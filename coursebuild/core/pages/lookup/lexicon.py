"""What a document adds to the glossary and to the index of symbols.

Entry point: `lexicon(document, formulas)`; `misdeclared`, the mistakes of its declarations.

1. Each term gets the sentence that defines it, as HTML. Where that runs on into a formula on a line
   of its own, the formula comes with it. Links lose their addresses: the glossary stands elsewhere.
2. Symbols are read from the formulas as they are typeset.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

from markupsafe import Markup

from coursebuild.core.model import (
    Block,
    DefinedTerm,
    Document,
    Equation,
    Heading,
    Inline,
    Lexicon,
    Math,
    MathBlock,
    Meaning,
    NumberBinding,
    Paragraph,
    SymbolUse,
    Term,
    block_inlines,
    child_blocks,
    document_blocks,
    plain_text,
    walk_blocks,
    walk_inlines,
)
from coursebuild.core.model.lexicon import DefinitionPart
from coursebuild.core.model.results import Formula, MathError
from coursebuild.core.pages import formulas as typeset
from coursebuild.core.pages.equations import numbered
from coursebuild.core.pages.look import Look
from coursebuild.core.pages.lookup.sentences import runs_on, sentence_of
from coursebuild.core.pages.lookup.symbols import only_symbol, symbols
from coursebuild.core.pages.markup import render_inlines
from coursebuild.core.pages.plain import PlainContext
from coursebuild.core.pages.plainly import without_links
from coursebuild.core.text.diagnostics import Diagnostic, Note, diagnose

Formulas = Mapping[Formula, str | MathError]
_LOOK = Look(anchors=False)


def lexicon(document: Document, formulas: Formulas) -> Lexicon:
    """What a document adds; a formula that is not typeset counts for nothing."""

    def mathml(tex: str, display: bool) -> str:
        found = formulas.get(Formula(tex, display))
        return found if isinstance(found, str) else ""

    text = document.source.text
    terms = tuple(_terms(document, mathml)) if "]{" in text else ()
    equations = numbered(document, lambda tex: mathml(tex, True)) if "$$" in text else {}
    if "$" not in text:
        return Lexicon(terms)
    found = _symbols(document, mathml)
    return Lexicon(
        terms,
        tuple(found.uses.values()),
        tuple(found.sections),
        tuple(Equation(one.id, one.number) for one in equations.values()),
    )


# --- terms

_Mathml = Callable[[str, bool], str]


class _Excerpted(PlainContext):
    """The context of a sentence that is shown on another page."""

    def __init__(self, mathml: _Mathml) -> None:
        self._mathml = mathml

    def math(self, tex: str) -> Markup:
        found = self._mathml(tex, False)
        return Markup(typeset.breakable(found)) if found else super().math(tex)

    def display(self, tex: str, start: int) -> Markup:
        return Markup(self._mathml(tex, True)) or super().display(tex, start)

    def binding(self, binding: NumberBinding) -> Markup:
        return Markup.escape(binding.text)


def _terms(document: Document, mathml: _Mathml) -> Iterator[DefinedTerm]:
    context = _Excerpted(mathml)

    def html(inlines: tuple[Inline, ...]) -> str:
        return str(render_inlines(without_links(inlines), context, _LOOK))

    for siblings in _sibling_groups(document):
        for number, block in enumerate(siblings):
            if not isinstance(block, Paragraph):
                continue
            for term in walk_inlines(block.children):
                if not isinstance(term, Term):
                    continue
                following = siblings[number + 1] if number + 1 < len(siblings) else None
                title = Markup.escape(term.name) if term.renamed else html(term.children)
                pieces = tuple(_pieces(sentence_of(block.children, term), following, html, context))
                yield DefinedTerm(term.id, term.name, str(title), pieces)


def _pieces(
    sentence: tuple[Inline, ...],
    following: Block | None,
    html: Callable[[tuple[Inline, ...]], str],
    context: _Excerpted,
) -> Iterator[DefinitionPart]:
    """A sentence, cut at its displayed formulas."""
    line: list[Inline] = []
    for inline in sentence:
        if isinstance(inline, Math) and inline.display:
            yield DefinitionPart(html(tuple(line)).strip())
            yield DefinitionPart(str(context.display(inline.tex.text, 0)), display=True)
            line = []
        else:
            line.append(inline)
    if line:
        yield DefinitionPart(html(tuple(line)).strip())
    if isinstance(following, MathBlock) and following.tex.text and runs_on(sentence):
        yield DefinitionPart(str(context.display(following.tex.text, 0)), display=True)


def _sibling_groups(document: Document) -> Iterator[tuple[Block, ...]]:
    """All blocks of a document, those side by side together."""
    waiting = [document.blocks, *(note.blocks for note in document.footnotes)]
    while waiting:
        group = waiting.pop(0)
        yield group
        waiting += [child_blocks(block) for block in group]


# --- symbols


class _Symbols:
    """The symbols of a document, as far as it was looked at."""

    def __init__(self) -> None:
        self.uses: dict[str, SymbolUse] = {}
        self.sections: list[tuple[str, str]] = []
        self._heading: Heading | None = None
        self._section = -1
        """Index of the section of the heading, once a symbol stood there first."""

    def under(self, heading: Heading | None) -> None:
        """What follows stands under a heading, or under none."""
        self._heading, self._section = heading, -1

    def note(self, symbol: str, meaning: Meaning | None) -> None:
        """A symbol stands here, and may be said to mean something."""
        known = self.uses.get(symbol)
        if known is None:
            if self._section < 0 and self._heading is not None:
                title = " ".join(plain_text(self._heading.children).split())
                self._section = len(self.sections)
                self.sections.append((self._heading.anchor, title))
            self.uses[symbol] = known = SymbolUse(symbol, self._section)
        if meaning is not None and not known.meaning:
            self.uses[symbol] = SymbolUse(symbol, known.section, meaning.text, meaning.unit)


def _symbols(document: Document, mathml: _Mathml) -> _Symbols:
    found = _Symbols()
    for block in _blocks(document):
        if block is None or (isinstance(block, Heading) and block.level <= 3):
            found.under(block)
        for formula in () if block is None else _formulas_in(block):
            meaning = formula.meaning if isinstance(formula, Math) else None
            html = mathml(formula.tex.text, not isinstance(formula, Math) or formula.display)
            only = only_symbol(html) if meaning is not None else None
            for symbol in (only,) if only is not None else symbols(html):
                found.note(symbol, meaning)
    return found


def _blocks(document: Document) -> Iterator[Block | None]:
    """All blocks; `None` before the footnotes, which stand under no heading."""
    yield from walk_blocks(document.blocks)
    yield None
    for footnote in document.footnotes:
        yield from walk_blocks(footnote.blocks)


def _formulas_in(block: Block) -> Iterator[Math | MathBlock]:
    if isinstance(block, MathBlock):
        yield block
    for inline in walk_inlines(block_inlines(block)):
        if isinstance(inline, Math):
            yield inline


def misdeclared(document: Document, formulas: Formulas) -> tuple[Diagnostic, ...]:
    """Declarations of what is no symbol, and those of one symbol with two meanings."""
    if document.lexicon is not None or "${" not in document.source.text:
        return ()  # of a summary it was told where the whole was
    found: list[Diagnostic] = []
    first: dict[str, Math] = {}
    for block in document_blocks(document):
        for formula in _formulas_in(block):
            if isinstance(formula, Math) and formula.meaning is not None:
                html = formulas.get(Formula(formula.tex.text, False))
                if isinstance(html, str):
                    found += _misdeclared(formula, html, first)
    return tuple(found)


def _misdeclared(formula: Math, html: str, first: dict[str, Math]) -> Iterator[Diagnostic]:
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
