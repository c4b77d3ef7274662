"""The symbols in the formulas of a document, what it declares of them, and the index of all.

A symbol is a letter with all that belongs to it: accents (`q̇`), a subscript of letters, numbers
and words (`I_zz`), and superscripts that are primes, stars, signs or words. Other superscripts are
operations: powers, transposition, inversion. Only quantities have symbols: numbers, operators,
names of functions, upright Latin letters (units and differentials) and the like are none.

A symbol is given as MathML in its shortest form, so that symbols that look the same are equal. In
the index those come first whose meaning a lesson declares.
"""

from __future__ import annotations

import functools
import unicodedata
from collections.abc import Iterator
from html import escape
from typing import TypeAlias
from xml.etree import ElementTree

from markupsafe import Markup
from msgspec import Struct, field
from msgspec.structs import replace

from coursebuild.api import (
    Diagnostic,
    Feature,
    Lesson,
    Library,
    Mathml,
    Note,
    PageKind,
    Parsed,
    diagnose,
    model,
    urls,
)
from coursebuild.core.checks.formulas import parse_mathml
from coursebuild.core.model import Owner
from coursebuild.core.pages import document_inputs
from coursebuild.core.pages.document_inputs import OwnerLink, OwnerLinks
from coursebuild.core.pages.numbering import UNNAMED, fill_in, name_outside

Element = ElementTree.Element

_PRIMES = frozenset("′″‴*∗⋆★†‡+−±∓∥⟂⊥∘°")
"""Superscripts that are a part of the symbol."""
_PRIME_GLYPHS = frozenset("′″‴")
"""Primes, whose glyphs are raised already; see `formulas.css`."""
_SIGNS = frozenset("+−±∓∗*")
"""Signs that are operators unless they are alone."""
_NO_SYMBOLS = frozenset("∂∇∞⊤⊥ℝℂℕℤℚ∅…⋯⋮⋱")
"""Letters in MathML that are no quantities."""
_TRANSPOSE_SIGNS = frozenset("T𝖳𝐓")
_ACCENTS = frozenset("˙¨⃛⃜ˆ^~˜¯‾ˉ→⃗´`˘ˇ˚")
_ACCENT_ELEMENTS = ("mover", "munder")
_SCRIPTS = ("msub", "msup", "msubsup")
_LEAVES = frozenset(("mo", "mn", "mspace", "mtext", "annotation"))
_SYMBOLS = frozenset(("mi", *_ACCENT_ELEMENTS, *_SCRIPTS))
_WRAPPERS = frozenset(("mrow", "mpadded", "mstyle", "semantics", "math", "mphantom"))


@functools.lru_cache(maxsize=1024)
def symbols(mathml: str) -> tuple[str, ...]:
    """Return the symbols of a formula in their order, each once."""
    root = parse_mathml(mathml) if "<mi" in mathml else None  # without letters it has none
    symbols: dict[str, None] = {}
    if root is not None:
        _collect(root, symbols)
    return tuple(symbols)


def only_symbol(mathml: str) -> str | None:
    """Return the symbol that is the whole formula; `None` if that is anything else."""
    root = parse_mathml(mathml)
    return None if root is None else _symbol(_unwrap(root), is_declared=True)


def declared_symbol(mathml: str) -> str | None:
    """Return the symbol that a formula declares: itself, or the left side of `m = 2 kg`."""
    only = only_symbol(mathml)
    is_value = only is None and "<mo>=</mo>" in mathml and len(symbols(mathml)) == 1
    return symbols(mathml)[0] if is_value else only


def _children(element: Element) -> list[Element]:
    return [child for child in element if child.tag not in ("annotation", "mspace")]


def _unwrap(element: Element) -> Element:
    while element.tag in _WRAPPERS:
        children = _children(element)
        if len(children) != 1:
            break
        element = children[0]
    return element


def _collect(element: Element, symbols: dict[str, None]) -> None:
    symbol = _symbol(element) if element.tag in _SYMBOLS else None
    if symbol is None:
        for child in element:
            if child.tag not in _LEAVES:
                _collect(child, symbols)
        return
    symbols[symbol] = None
    bare = _unwrap(element)
    if bare.tag not in ("msup", "msubsup") or _mark(bare[-1]) is not None:
        return
    if "".join(bare[-1].itertext()) not in _TRANSPOSE_SIGNS:  # an operation, and no symbol
        _collect(bare[-1], symbols)


def _symbol(element: Element, *, is_declared: bool = False) -> str | None:
    """Return the symbol that an element is, if any; a declared one can be any letter."""
    bare = _unwrap(element)
    if bare.tag == "mi":
        return _letter(bare.text or "", bare.get("mathvariant") == "normal", is_declared)
    if bare.tag in _ACCENT_ELEMENTS:
        letter, sign = _symbol(bare[0], is_declared=is_declared), _unwrap(bare[1])
        accent = sign.text or ""
        if letter is None or sign.tag != "mo" or not accent or not set(accent) <= _ACCENTS:
            return None
        return f"<{bare.tag}>{letter}<mo>{escape(accent)}</mo></{bare.tag}>"
    if bare.tag not in _SCRIPTS:
        return None
    base = _symbol(bare[0], is_declared=is_declared)
    if base is None:
        return None
    index = _index(bare[1]) if bare.tag != "msup" else None
    mark = _mark(bare[-1]) if bare.tag != "msub" else None
    if is_declared and bare.tag != "msub" and mark is None:
        return None
    if index is None and mark is None:
        return base
    name = f"m{'' if index is None else 'sub'}{'' if mark is None else 'sup'}"
    return f"<{name}>{base}{index or ''}{mark or ''}</{name}>"


@functools.lru_cache(maxsize=1024)
def _letter(text: str, is_upright: bool, is_declared: bool) -> str | None:
    if not any(map(str.isalpha, text)) or (text in _NO_SYMBOLS and not is_declared):
        return None
    is_latin = all(unicodedata.name(char, "").startswith("LATIN") for char in text)
    is_word = is_upright or (text.isascii() and len(text) > 1)
    if not is_declared and is_word and (text.isascii() or is_latin):
        return None
    variant = ' mathvariant="normal"' if is_upright else ""
    return f"<mi{variant}>{escape(text)}</mi>"


def _index(element: Element) -> str | None:
    """Return a subscript that is part of a name: letters, numbers, words, commas; no operators."""
    parts = list(_index_parts(element))
    signs = [part for part in parts if part is not None and part[4:-5] in _SIGNS]
    if not parts or None in parts or (signs and len(parts) > 1):
        return None
    inner = "".join(part for part in parts if part)
    return inner if len(parts) == 1 else f"<mrow>{inner}</mrow>"


def _index_parts(element: Element) -> Iterator[str | None]:
    bare = _unwrap(element)
    text = (bare.text or "").strip()
    if bare.tag == "mrow":
        for child in _children(bare):
            yield from _index_parts(child)
    elif bare.tag in ("mi", "mn", "mtext") and text:
        upright = ' mathvariant="normal"' if bare.get("mathvariant") == "normal" else ""
        yield f"<{bare.tag}{upright}>{escape(text)}</{bare.tag}>"
    elif bare.tag == "mo" and text in ("\u2061", ""):  # an application of a function: `max`
        return
    elif bare.tag == "mo" and (text in ",;/|" or set(text) <= _PRIMES):
        yield f"<mo>{escape(text)}</mo>"
    elif bare.tag in (*_SCRIPTS, *_ACCENT_ELEMENTS):
        yield _symbol(bare, is_declared=True)
    else:
        yield None


def _mark(element: Element) -> str | None:
    """Return a superscript that belongs to the symbol: primes, stars, a sign, words."""
    bare = _unwrap(element)
    text = "".join(bare.itertext()).strip()
    if bare.tag == "mtext" and text:
        return f"<mtext>{escape(text)}</mtext>"
    parts = _children(bare) if bare.tag == "mrow" else [bare]
    if text and set(text) <= _PRIMES and all(part.tag == "mo" for part in parts):
        prime = ' class="tml-prime"' if set(text) <= _PRIME_GLYPHS else ""
        return f"<mo{prime}>{escape(text)}</mo>"
    return None


def sort_key(symbol: str) -> tuple[object, ...]:
    """Sort Latin letters before Greek and others; plain letters before other shapes and marks."""
    root = parse_mathml(symbol)
    text = "" if root is None else "".join(root.itertext())
    while root is not None and len(root):
        root = root[0]
    letter = "" if root is None else root.text or ""
    plain = unicodedata.normalize("NFKC", letter)
    name = unicodedata.name(plain[:1] or " ", "")
    script = next((n for n, part in enumerate(("LATIN", "GREEK")) if part in name), 2)
    if script == 2 and plain in "ℓℏ":
        script = 0
    return (script, plain.casefold(), plain, letter, len(symbol), text, symbol)


_Formula: TypeAlias = model.Math | model.MathBlock


class SymbolUse(Struct, frozen=True):
    """A symbol in the formulas of a document, with the place of its first use."""

    symbol: str
    """MathML in its shortest form: symbols that look the same are equal."""
    section: tuple[str, str]
    """Anchor and text of the heading above it; empty before the first heading."""
    targets: tuple[model.Target, ...] = ()
    """Where links without a text lead in that heading; each is `UNNAMED` there."""
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
    for formula, section, targets in _formulas(document):
        html, meaning = mathml(formula.tex.text, formula.display), formula.meaning
        only = declared_symbol(html) if meaning is not None else None
        for symbol in (only,) if only is not None else symbols(html):
            use = uses.setdefault(symbol, SymbolUse(symbol, section, targets))
            if meaning is not None and not use.meaning:
                uses[symbol] = replace(use, meaning=meaning.text, unit=meaning.unit)
        if meaning is None or not html:
            continue
        if only is None:
            message = f"`${formula.tex.text}$` is declared as a symbol, but is not a single one"
            help = "declare one letter with its accents and indices"
            diagnostics.append(diagnose("symbol-formula", formula.tex.span(), message, help=help))
        elif (first := first_declarations.setdefault(only, formula)) is not formula:
            notes = [Note("first declared here", first.span)]
            message = f"`${formula.tex.text}$` is declared twice in this text"
            help = "a reader looks for one meaning; give the other quantity another letter"
            place = formula.span
            diagnostics.append(diagnose("symbol-repeated", place, message, help=help, notes=notes))
    return Parsed(DocumentSymbols(tuple(uses.values())) if uses else None, tuple(diagnostics))


def _formulas(
    document: model.Document,
) -> Iterator[tuple[_Formula, tuple[str, str], tuple[model.Target, ...]]]:
    """Yield all formulas, with the heading above and what it refers to; footnotes have none."""
    targets: list[model.Target] = []
    formulas: dict[int, list[_Formula]] = {}
    for block, formula in model.find_formulas(document):
        formulas.setdefault(id(block), []).append(formula)

    def reference(target: model.Target) -> str:
        targets.append(target)
        return UNNAMED

    for blocks in (document.blocks, *(footnote.blocks for footnote in document.footnotes)):
        section = "", ""
        targets.clear()
        for block in model.walk_blocks(blocks):
            if isinstance(block, model.Heading) and block.level <= 3:
                targets.clear()
                text = model.plain_text(model.without_links(block.children, reference))
                section = block.anchor, " ".join(text.split())
            for formula in formulas.get(id(block), ()):
                yield formula, section, tuple(targets)


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
    symbols: dict[str, CourseSymbol] = {}
    for owner, use in used_symbols(library):
        row = symbols.setdefault(use.symbol, CourseSymbol(use))
        row.owners.append(owner)
        if use.meaning:
            row.meanings.setdefault((use.meaning, use.unit), []).append(owner)
    rows: list[SymbolView] = []
    for row in sorted(symbols.values(), key=lambda row: sort_key(row.first.symbol)):
        anchor, section = row.first.section
        names = (name_outside(library, row.owners[0], target) for target in row.first.targets)
        is_ambiguous = len(row.meanings) > 1
        rows.append(
            SymbolView(
                Markup(f"<math>{row.first.symbol}</math>"),
                tuple(
                    MeaningView(
                        text,
                        unit,
                        document_inputs.owner_links(place, owners) if is_ambiguous else None,
                    )
                    for (text, unit), owners in row.meanings.items()
                ),
                document_inputs.owner_link(place, row.owners[0], anchor),
                fill_in(section, names),
                document_inputs.owner_links(place, row.owners[1:]),
            )
        )
    return {
        "declared": tuple(row for row in rows if row.meanings),
        "undeclared": tuple(row for row in rows if not row.meanings),
        "glossary": document_inputs.added_page(library, place, "glossary"),
    }


FEATURE = Feature(
    name="symbols",
    summary=document_symbols,
    pages=(
        PageKind(
            name="symbols",
            values=symbols_values,
            exists=lambda library: any(used_symbols(library)),
            order=30,
        ),
    ),
)
