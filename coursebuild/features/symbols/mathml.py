"""Finds the symbols of a formula.

Entry points: `symbols(mathml)`; `only_symbol(mathml)`, for a formula of a single one;
`declared_symbol(mathml)`; `sort_key(symbol)`.

A symbol is a letter with all that belongs to it: accents (`q̇`), a subscript of letters, numbers and
words (`I_zz`), and superscripts that are primes, stars, signs or words. Other superscripts are
operations: powers, transposition, inversion. Only quantities have symbols: numbers, operators,
names of functions, upright Latin letters (units and differentials) and the like are none.

A symbol is given as MathML in its shortest form, so that symbols that look the same are equal.
"""

from __future__ import annotations

import functools
import unicodedata
from collections.abc import Iterator
from html import escape
from xml.etree import ElementTree

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
    root = _parse(mathml) if "<mi" in mathml else None  # without letters it has none
    symbols: dict[str, None] = {}
    if root is not None:
        _collect(root, symbols)
    return tuple(symbols)


def only_symbol(mathml: str) -> str | None:
    """Return the symbol that is the whole formula; `None` if that is anything else."""
    root = _parse(mathml)
    return None if root is None else _symbol(_unwrap(root), is_declared=True)


def declared_symbol(mathml: str) -> str | None:
    """Return the symbol that a formula declares: itself, or the left side of `m = 2 kg`."""
    only = only_symbol(mathml)
    is_value = only is None and "<mo>=</mo>" in mathml and len(symbols(mathml)) == 1
    return symbols(mathml)[0] if is_value else only


def _parse(mathml: str) -> Element | None:
    try:
        return ElementTree.fromstring(mathml)
    except ElementTree.ParseError:  # characters that XML does not have
        return None


def _children(element: Element) -> list[Element]:
    return [child for child in element if child.tag not in ("annotation", "mspace")]


def _unwrap(element: Element) -> Element:
    """Return the element inside wrappers that have a single child."""
    while element.tag in _WRAPPERS:
        children = _children(element)
        if len(children) != 1:
            break
        element = children[0]
    return element


def _collect(element: Element, symbols: dict[str, None]) -> None:
    """Add the symbols of an element."""
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
        return _accented_symbol(bare, is_declared=is_declared)
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
    if not is_declared and _is_latin(text) and (is_upright or (text.isascii() and len(text) > 1)):
        return None
    variant = ' mathvariant="normal"' if is_upright else ""
    return f"<mi{variant}>{escape(text)}</mi>"


def _is_latin(text: str) -> bool:
    return text.isascii() or all(unicodedata.name(char, "").startswith("LATIN") for char in text)


def _accented_symbol(element: Element, *, is_declared: bool) -> str | None:
    """Return a symbol with an accent."""
    base, mark = _symbol(element[0], is_declared=is_declared), _unwrap(element[1])
    text = mark.text or ""
    if base is None or mark.tag != "mo" or not set(text) or not set(text) <= _ACCENTS:
        return None
    return f"<{element.tag}>{base}<mo>{escape(text)}</mo></{element.tag}>"


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
    root = _parse(symbol)
    text = "" if root is None else "".join(root.itertext())
    letter = _base_letter(root) if root is not None else ""
    plain = unicodedata.normalize("NFKC", letter)
    name = unicodedata.name(plain[:1] or " ", "")
    script = next((n for n, part in enumerate(("LATIN", "GREEK")) if part in name), 2)
    if script == 2 and plain in "ℓℏ":
        script = 0
    return (script, plain.casefold(), plain, letter, len(symbol), text, symbol)


def _base_letter(element: Element) -> str:
    while len(element):
        element = element[0]
    return element.text or ""
