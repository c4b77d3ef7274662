"""The terms that a text is found by; queries are split into terms by the same rules.

1. Characters are brought to their compatible form, without marks (NFKD, so that `Iₓₓ` is `Ixx` and
   `é` is `e`).
2. The text is split into words, numbers, names in code (`data.qpos`, `mj_step`) and symbols.
3. The terms of a name are the name and its parts, of a Greek letter or a symbol its name, of a text
   in a script without spaces its pairs of characters.

`plain_formula(tex)`, such as `τ = I_xx dω/dt`, never fails: unknown commands are left out, and
unbalanced groups end where the TeX ends. `site/js/search/words.js` does the same; tests of both
read `site/tests/search-words.json`.
"""

from __future__ import annotations

import functools
import re
import unicodedata
from collections import Counter
from collections.abc import Iterator
from itertools import groupby
from typing import Literal

from coursebuild.api import regex

MAX_LENGTH = 48
"""The limit for terms, in characters; longer ones are data, which nobody types."""
_MAX_NUMBER_LENGTH = 12
PREFIX = 4
"""Characters at the beginning of a word that suffice to find it."""

_SYMBOLS = {
    **{"∂": ("partial",), "∇": ("nabla", "gradient"), "∫": ("integral", "int")},
    **{"∮": ("integral", "oint"), "∑": ("sum",), "∏": ("product", "prod")},
    **{"√": ("sqrt", "root"), "∞": ("infinity", "infty"), "×": ("times",), "⋅": ("cdot",)},
    **{"±": ("pm",), "≈": ("approx",), "≤": ("leq",), "≥": ("geq",), "∝": ("propto",)},
    **{"⊗": ("otimes",), "⊥": ("perp",), "∥": ("parallel",)},
}
"""Names of symbols, the usual one first."""

_GREEK = (
    "alpha beta gamma delta epsilon zeta eta theta iota kappa lambda mu nu xi omicron pi rho sigma"
    " tau upsilon phi chi psi omega"
).split()
GREEK = {
    **dict(zip("αβγδεζηθικλμνξοπρστυφχψω", _GREEK, strict=True)),
    **{"ς": "sigma", "ϵ": "epsilon", "ϑ": "theta", "ϕ": "phi", "ϖ": "pi", "ϱ": "rho"},
}
"""Names of the Greek letters, by the small letter."""

_UNSPACED = (
    *("\u0e00\u0eff", "\u1000\u109f", "\u1780\u17ff", "\u3005\u3007", "\u3040\u30ff"),
    *("\u3400\u4dbf", "\u4e00\u9fff", "\uf900\ufaff", "\U00020000\U0003ffff"),
)
"""First and last characters of scripts without spaces between words: Thai, Lao, Burmese, Khmer,
Kana, Han."""
_TOKEN = regex(
    r"[0-9]+(?:\.[0-9]+)*[eE][+-]?[0-9]+(?!\w)|\w+(?:\.\w+)*|[" + "".join(_SYMBOLS) + "]"
)
_NUMBER = regex(r"[0-9][0-9.eE+-]*\Z")
_SYLLABLE = 3
"""Characters; a name of shorter parts only, such as MuJoCo, has none."""
_SEAM = regex(
    r"(?<=[a-z])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])|(?<=[A-Za-z])(?=[0-9])|(?<=[0-9])(?=[A-Za-z])"
    r"|_+"
)
_FOREIGN = regex(r"[^\x00-\x7f]+")
_GENITIVE = regex("['’]s\\b")


def terms_of(text: str) -> list[str]:
    """Return the terms of a text, in order, with repeats."""
    if not text.isascii():
        text = _FOREIGN.sub(_without_marks, text)
    terms: list[str] = []
    for token in _TOKEN.findall(_GENITIVE.sub("", text)):
        name = token.strip("_")
        if token in _SYMBOLS:
            terms += _SYMBOLS[token]
        elif _NUMBER.match(name):
            terms += [name.lower()] if len(name) <= _MAX_NUMBER_LENGTH else []
        elif 0 < len(name) <= MAX_LENGTH:
            terms += dict.fromkeys(_split_name(name) if name.isascii() else _split_mixed(name))
    return terms


def shelf_of(term: str) -> str:
    """Return the beginning of a term that decides its file, so that similar terms share one.

    For a number it is the whole; for a name with dots the beginning of the last part, since very
    many names can have the same first part.
    """
    first = term[:1]
    if first.isascii():
        return term if first.isdecimal() else term.rpartition(".")[2][:PREFIX]
    return first if _script(first) == "unspaced" else term[:PREFIX]


def is_fuzzy(term: str) -> bool:
    """Whether the term can be proposed for a misspelt word."""
    if not 3 <= len(term) <= 24 or "." in term:
        return False
    first = term[0]
    return not first.isdecimal() if first.isascii() else _script(first) != "unspaced"


def _script(character: str) -> Literal["greek", "unspaced", "other"]:
    if character < "\u0e00":
        return "greek" if "\u0370" <= character <= "\u03ff" else "other"
    return "unspaced" if any(row[0] <= character <= row[1] for row in _UNSPACED) else "other"


def _without_marks(run: re.Match[str]) -> str:
    """Return characters that are not ASCII in their compatible form, without marks."""
    text = unicodedata.normalize("NFKD", run[0])
    return "".join(c for c in text if unicodedata.category(c)[0] != "M")


def _split_name(token: str) -> Iterator[str]:
    yield token.lower()
    for name in filter(None, (name.strip("_") for name in token.split("."))):
        if len(name) > 1:
            yield name.lower()
        parts = [part.lower() for part in _SEAM.split(name) if part]
        if name.isalpha() and max(map(len, parts)) < _SYLLABLE:
            continue
        if len(parts) > 1:
            if "_" in name:
                yield name.lower().replace("_", "")
            yield from (part for part in parts if len(part) > 1)


def _split_mixed(token: str) -> Iterator[str]:
    runs = [(script, "".join(letters)) for script, letters in groupby(list(token), _script)]
    words: list[str] = []
    for script, run in runs:
        text = unicodedata.normalize("NFC", run.lower())
        if script == "unspaced":  # each character with its next one, and the last alone
            yield from (text[at : at + 2] for at in range(len(text)))
        elif script == "greek" and text in GREEK:
            words.append(GREEK[text])
            yield GREEK[text]
        else:
            word = text.replace("ς", "σ").strip("._")
            words.append(word)
            if len(word) > 1 or (word and len(runs) == 1):
                yield from _split_name(run.strip("._")) if word.isascii() else (word,)
    whole = "".join(words).replace("_", "")
    if len(words) > 1 and len(whole) <= MAX_LENGTH:
        yield whole


_TO_BLANKS = bytes(
    code if code > 0x7F or bytes((code,)).isalnum() or code in b"_.+-'" else 0x20
    for code in range(256)
)
"""Turns bytes that are in no token into blanks; characters beyond ASCII have no byte below 128."""


def count_terms(text: str) -> dict[str, int]:
    """Return how often each term occurs."""
    counts: dict[str, int] = {}
    runs = Counter(text.encode("utf-8", "surrogatepass").translate(_TO_BLANKS).split())
    for run, times in runs.items():
        for term in _terms_of_run(run):
            counts[term] = counts.get(term, 0) + times
    return counts


@functools.lru_cache(maxsize=1 << 15)
def _terms_of_run(run: bytes) -> tuple[str, ...]:
    """Cached and with a fast path, since most runs are frequent words in lower case."""
    if run.isalpha() and run.islower() and len(run) <= MAX_LENGTH:  # ASCII
        return (run.decode(),)
    return tuple(terms_of(run.decode("utf-8", "surrogatepass")))


_PIECE = regex(r"%[^\n]*|\\([A-Za-z]+)\*?|\\.|\s+|.", re.DOTALL)
"""A comment, a command, another character after a backslash, blanks, or a character."""

_SIGNS = {
    **{"partial": "∂", "nabla": "∇", "int": "∫", "iint": "∬", "oint": "∮", "sum": "∑"},
    **{"prod": "∏", "infty": "∞", "times": "×", "cdot": "·", "pm": "±", "approx": "≈"},
    **{"le": "≤", "leq": "≤", "ge": "≥", "geq": "≥", "ne": "≠", "neq": "≠", "propto": "∝"},
    **{"to": "→", "rightarrow": "→", "Rightarrow": "⇒", "mapsto": "↦", "in": "∈", "ell": "ℓ"},
    **{"otimes": "⊗", "perp": "⊥", "parallel": "∥", "equiv": "≡", "sim": "∼", "ll": "≪"},
    **{"gg": "≫", "dots": "…", "ldots": "…", "cdots": "…", "circ": "°", "degree": "°"},
    **{"lVert": "‖", "rVert": "‖", "Vert": "‖", "langle": "⟨", "rangle": "⟩", "hbar": "ℏ"},
    **{"forall": "∀", "exists": "∃", "dagger": "†", "top": "⊤", "prime": "′", "mid": "|"},
    **{"quad": "", "qquad": ""},
}
_FUNCTIONS = (
    "sin cos tan cot sec csc arcsin arccos arctan sinh cosh tanh exp log ln lim max min sup inf det"
    " dim ker arg deg gcd Pr tr"
).split()
_TEXTS = _SIGNS | {name: name for name in _FUNCTIONS}
_STYLE = frozenset(
    "left right big Big bigg Bigg bigl bigr Bigl Bigr middle displaystyle textstyle scriptstyle"
    " limits nolimits quad qquad text textrm textit textbf mathrm mathbf mathit mathsf mathcal"
    " mathbb mathfrak mathtt boldsymbol bm symbf operatorname begin end nonumber notag label tag"
    " mathstrut strut phantom hphantom vphantom color textcolor mathop mathrel mathbin".split()
)
"""Commands for the look of a formula: nobody searches by their names."""
_SKIPPED_COMMANDS = frozenset(
    "begin end label tag color hspace vspace phantom hphantom vphantom".split()
)
"""Commands whose argument is not part of the formula's text."""
_LETTERS = {
    **{name: letter for letter, name in reversed(GREEK.items())},
    **{name.capitalize(): letter.upper() for letter, name in reversed(GREEK.items())},
    **{"varepsilon": "ε", "vartheta": "ϑ", "varphi": "φ", "varrho": "ϱ", "varpi": "ϖ"},
    "varsigma": "ς",
}
_MATHEMATICAL = regex("[\U0001d400-\U0001d7ff]")
# The blank is matched first and its neighbours then: the other order is far slower.
_TIGHT = regex(r" (?:(?<=[_^(\[|⟨] )|(?=[_^)\]⟩,;]))")
_OPERATOR = regex(r" (?<=[Δδ∂∇] )(?=[^\W\d])")
"""The blank after a sign such as Δ or ∂: with its operand it is one word, as `Δt`."""


@functools.lru_cache(maxsize=1024)
def plain_formula(tex: str) -> tuple[str, tuple[str, ...]]:
    """Return a formula as text, and the names of its commands, each once, in order."""
    reader = _Reader(tex)
    text = _TIGHT.sub("", " ".join(reader.read().split()))
    if not text.isascii():
        text = _OPERATOR.sub("", text)
        text = _MATHEMATICAL.sub(lambda m: unicodedata.normalize("NFKC", m[0]), text)
    return text, tuple(dict.fromkeys(reader.names))


class _Reader:
    def __init__(self, tex: str) -> None:
        self._pieces = [match for match in _PIECE.finditer(tex) if match[0][0] != "%"]
        self._at = 0
        self._depth = 0
        self.names: list[str] = []

    def read(self) -> str:
        """Return the text of the formula, past braces that close nothing."""
        parts: list[str] = []
        while self._at < len(self._pieces):
            parts.append(self._group())
            self._at += 1  # a brace that closes nothing
        return " ".join(parts)

    def _next(self) -> str:
        return self._pieces[self._at][0] if self._at < len(self._pieces) else ""

    def _group(self) -> str:
        parts: list[str] = []
        while self._next() not in ("", "}"):
            parts.append(self._item())
        return "".join(parts)

    def _item(self) -> str:
        match = self._pieces[self._at]
        self._at += 1
        piece = match[0]
        if match[1]:
            return self._command(match[1])
        if piece[0] == "\\" and len(piece) > 1:
            return " " if piece[1].isspace() or piece[1] in ",;:!\\" else piece[1]
        if piece == "{":
            self._depth += 1
            # Beyond the depth of any real formula groups are read flat, against stack overflows.
            inner = self._group() if self._depth < 64 else ""
            self._depth -= 1
            if self._next() == "}":
                self._at += 1
            return inner
        if piece in ("^", "_"):
            return piece + _add_brackets(self._argument())
        return {"&": " ", "~": " ", "'": "′", "\\": ""}.get(piece, piece)

    def _argument(self) -> str:
        while self._next().isspace():
            self._at += 1
        return "" if self._next() in ("", "}") else self._item().strip()

    def _command(self, name: str) -> str:
        if name in _LETTERS:
            return f" {_LETTERS[name]} "
        if name not in _STYLE:
            self.names.append(name)
        if name in _TEXTS:
            return f" {_TEXTS[name]} "
        if name in ("frac", "dfrac", "tfrac", "cfrac"):
            top = _add_brackets(self._argument())
            return f" {top}/{_add_brackets(self._argument())} "
        if name == "sqrt":
            return f"√{_add_brackets(self._argument())}"
        if name in _SKIPPED_COMMANDS:
            self._argument()
            return " "
        return ""


def _add_brackets(text: str) -> str:
    text = text.strip()
    return f"({text})" if len(text) > 1 and not text.isalnum() else text
