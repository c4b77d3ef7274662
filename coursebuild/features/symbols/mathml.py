"""The symbols of a formula, as the eye reads them.

Entry points: `symbols(mathml)`; `only_symbol(mathml)`, where a formula is nothing but one;
`sort_key(symbol)`.

A symbol is a letter with what belongs to it: accents (`q̇`), a subscript of letters, numbers and
words (`I_zz`), and of superscripts primes, stars, signs and words. Other superscripts are done to
the symbol: powers, transposition, inversion. What is no quantity is no symbol: numbers, operators,
names of functions, upright Latin letters (units and differentials) and the like.

A symbol is given as MathML in its shortest form, so that two that look the same are the same text.
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
_RAISED = frozenset("′″‴")
"""Which stand high already; see `formulas.css`."""
_SIGNS = frozenset("+−±∓∗*")
"""Which calculate where they do not stand alone."""
_NO_SYMBOLS = frozenset("∂∇∞⊤⊥ℝℂℕℤℚ∅…⋯⋮⋱")
"""Letters to MathML, and no quantities."""
_TRANSPOSED = frozenset("T𝖳𝐓")
_ACCENTS = frozenset("˙¨⃛⃜ˆ^~˜¯‾ˉ→⃗´`˘ˇ˚")
_MARKED = ("mover", "munder")
_SCRIPTS = ("msub", "msup", "msubsup")
_LEAVES = frozenset(("mo", "mn", "mspace", "mtext", "annotation"))
_SYMBOLS = frozenset(("mi", *_MARKED, *_SCRIPTS))
_WRAPPERS = frozenset(("mrow", "mpadded", "mstyle", "semantics", "math", "mphantom"))


@functools.lru_cache(maxsize=1024)
def symbols(mathml: str) -> tuple[str, ...]:
    """The symbols of a formula in their order, each once."""
    root = _parsed(mathml) if "<mi" in mathml else None  # without letters it has none
    found: dict[str, None] = {}
    if root is not None:
        _collect(root, found)
    return tuple(found)


def only_symbol(mathml: str) -> str | None:
    """The symbol that a formula consists of; `None` where it is more, or none."""
    root = _parsed(mathml)
    return None if root is None else _symbol(_bare(root), declared=True)


def _parsed(mathml: str) -> Element | None:
    try:
        return ElementTree.fromstring(mathml)
    except ElementTree.ParseError:  # of characters that XML does not have
        return None


def _children(element: Element) -> list[Element]:
    return [child for child in element if child.tag not in ("annotation", "mspace")]


def _bare(element: Element) -> Element:
    """What is in elements around a single other one."""
    while element.tag in _WRAPPERS:
        children = _children(element)
        if len(children) != 1:
            break
        element = children[0]
    return element


def _collect(element: Element, found: dict[str, None]) -> None:
    """Add the symbols inside an element."""
    symbol = _symbol(element) if element.tag in _SYMBOLS else None
    if symbol is None:
        for child in element:
            if child.tag not in _LEAVES:
                _collect(child, found)
        return
    found[symbol] = None
    bare = _bare(element)
    if bare.tag not in ("msup", "msubsup") or _mark(bare[-1]) is not None:
        return
    if "".join(bare[-1].itertext()) not in _TRANSPOSED:  # which is done to it
        _collect(bare[-1], found)


def _symbol(element: Element, *, declared: bool = False) -> str | None:
    """The symbol that an element is, if it is one; a declared one may be any letter."""
    bare = _bare(element)
    if bare.tag == "mi":
        return _letter(bare.text or "", bare.get("mathvariant") == "normal", declared)
    if bare.tag in _MARKED:
        return _accented(bare, declared=declared)
    if bare.tag not in _SCRIPTS:
        return None
    base = _symbol(bare[0], declared=declared)
    if base is None:
        return None
    below = _index(bare[1]) if bare.tag != "msup" else None
    above = _mark(bare[-1]) if bare.tag != "msub" else None
    if declared and bare.tag != "msub" and above is None:
        return None
    if below is None and above is None:
        return base
    name = f"m{'' if below is None else 'sub'}{'' if above is None else 'sup'}"
    return f"<{name}>{base}{below or ''}{above or ''}</{name}>"


@functools.lru_cache(maxsize=1024)
def _letter(text: str, upright: bool, declared: bool) -> str | None:
    if not any(map(str.isalpha, text)) or (text in _NO_SYMBOLS and not declared):
        return None
    if not declared and _is_latin(text) and (upright or (text.isascii() and len(text) > 1)):
        return None
    variant = ' mathvariant="normal"' if upright else ""
    return f"<mi{variant}>{escape(text)}</mi>"


def _is_latin(text: str) -> bool:
    return text.isascii() or all(unicodedata.name(char, "").startswith("LATIN") for char in text)


def _accented(element: Element, *, declared: bool) -> str | None:
    """A symbol with an accent."""
    base, mark = _symbol(element[0], declared=declared), _bare(element[1])
    text = mark.text or ""
    if base is None or mark.tag != "mo" or not set(text) or not set(text) <= _ACCENTS:
        return None
    return f"<{element.tag}>{base}<mo>{escape(text)}</mo></{element.tag}>"


def _index(element: Element) -> str | None:
    """A subscript that names: letters, numbers and words, with commas between; no calculation."""
    parts = list(_index_parts(element))
    signs = [part for part in parts if part is not None and part[4:-5] in _SIGNS]
    if not parts or None in parts or (signs and len(parts) > 1):
        return None
    inner = "".join(part for part in parts if part)
    return inner if len(parts) == 1 else f"<mrow>{inner}</mrow>"


def _index_parts(element: Element) -> Iterator[str | None]:
    bare = _bare(element)
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
    elif bare.tag in (*_SCRIPTS, *_MARKED):
        yield _symbol(bare, declared=True)
    else:
        yield None


def _mark(element: Element) -> str | None:
    """A superscript that belongs to the symbol: primes, stars, a sign, words."""
    bare = _bare(element)
    text = "".join(bare.itertext()).strip()
    if bare.tag == "mtext" and text:
        return f"<mtext>{escape(text)}</mtext>"
    parts = _children(bare) if bare.tag == "mrow" else [bare]
    if text and set(text) <= _PRIMES and all(part.tag == "mo" for part in parts):
        prime = ' class="tml-prime"' if set(text) <= _RAISED else ""
        return f"<mo{prime}>{escape(text)}</mo>"
    return None


def sort_key(symbol: str) -> tuple[object, ...]:
    """Latin letters, then Greek, then others; a letter plain, then in other shapes, then marked."""
    root = _parsed(symbol)
    text = "" if root is None else "".join(root.itertext())
    first = _base(root) if root is not None else ""
    plain = unicodedata.normalize("NFKC", first)
    name = unicodedata.name(plain[:1] or " ", "")
    script = next((n for n, part in enumerate(("LATIN", "GREEK")) if part in name), 2)
    if script == 2 and plain in "ℓℏ":
        script = 0
    return (script, plain.casefold(), plain, first, len(symbol), text, symbol)


def _base(element: Element) -> str:
    while len(element):
        element = element[0]
    return element.text or ""
