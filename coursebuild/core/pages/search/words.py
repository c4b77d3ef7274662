"""The terms that a text is found by; what a reader types goes through the same rules.

Entry points: `terms_of(text)`, the terms of a text in order; `shelf_of(term)`, what decides which
file of the index has a term.

1. Characters are brought to their compatible form, without marks (NFKD, so that `Iₓₓ` is `Ixx` and
   `é` is `e`).
2. The text is cut into words, numbers, names of code (`data.qpos`, `mj_step`) and symbols.
3. A name gives itself and its parts, a Greek letter or a symbol its name, a run of a script without
   spaces its pairs of characters.

`site/js/search/words.js` does the same; `site/tests/search-words.json` holds both to it.
"""

from __future__ import annotations

import functools
import re
import unicodedata
from collections import Counter
from collections.abc import Iterator

from coursebuild.core.text.patterns import pattern

LONGEST = 48
"""Characters; longer runs are data, which nobody types."""
_LONGEST_NUMBER = 12
BEGINNING = 4
"""Characters by which words are found that begin with them."""

_SYMBOLS = {
    "∂": ("partial",),
    "∇": ("nabla", "gradient"),
    "∫": ("integral", "int"),
    "∮": ("integral", "oint"),
    "∑": ("sum",),
    "∏": ("product", "prod"),
    "√": ("sqrt", "root"),
    "∞": ("infinity", "infty"),
    "×": ("times",),
    "⋅": ("cdot",),
    "±": ("pm",),
    "≈": ("approx",),
    "≤": ("leq",),
    "≥": ("geq",),
    "∝": ("propto",),
    "⊗": ("otimes",),
    "⊥": ("perp",),
    "∥": ("parallel",),
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

_ROWS = (
    "\u0e00-\u0eff\u1000-\u109f\u1780-\u17ff\u3005-\u3007\u3040-\u30ff"
    "\u3400-\u4dbf\u4e00-\u9fff\uf900-\ufaff\U00020000-\U0003ffff"
)
"""Scripts without spaces between words: Thai, Lao, Burmese, Khmer, Kana, Han."""
_FIRST_ROW = "\u0e00"
"""The first of their characters. To compile a set takes as long as there are characters in it, so
these are used only for text that may have one."""
_ROW = pattern(f"[{_ROWS}]")
_TOKEN = pattern(
    r"[0-9]+(?:\.[0-9]+)*[eE][+-]?[0-9]+(?!\w)|\w+(?:\.\w+)*|[" + "".join(_SYMBOLS) + "]"
)
_ASCII = "[A-Za-z0-9_]"
_ASCII_TOKEN = pattern(
    rf"[A-Za-z_]{_ASCII}*+(?:\.{_ASCII}++)*+|[0-9]+(?:\.[0-9]+)*[eE][+-]?[0-9]+(?!{_ASCII})"
    rf"|[0-9]{_ASCII}*+(?:\.{_ASCII}++)*+"
)
"""The same in text without other characters, found faster."""
_RUN = pattern(f"([{_ROWS}]+)|([\u0370-\u03ff]+)|[^{_ROWS}\u0370-\u03ff]+")
_WESTERN_RUN = pattern("((?!))?([\u0370-\u03ff]+)|[^\u0370-\u03ff]+")
"""The same for text without such scripts."""
_NUMBER = pattern(r"[0-9][0-9.eE+-]*\Z")
_SEAM = pattern(
    r"(?<=[a-z])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])|(?<=[A-Za-z])(?=[0-9])|(?<=[0-9])(?=[A-Za-z])"
    r"|_+"
)
_FOREIGN = pattern(r"[^\x00-\x7f]+")
_GENITIVE = pattern("['’]s\\b")
_SIMPLE = pattern(r"[a-z]+\Z")


def terms_of(text: str) -> list[str]:
    """The terms of a text, in order, with repeats."""
    return [term for token in _tokens(text) for term in _expanded(token)]


def shelf_of(term: str) -> str:
    """Terms with the same shelf stand in the same file: those that begin alike.

    Of a number it is the whole; of a name with dots the beginning of its last part, since very many
    may begin with the same one.
    """
    first = term[:1]
    if first.isascii():
        return term if first.isdecimal() else term.rpartition(".")[2][:BEGINNING]
    return first if _is_row(first) else term[:BEGINNING]


def is_fuzzy(term: str) -> bool:
    """Whether a misspelt word may mean the term."""
    if not 3 <= len(term) <= 24 or "." in term:
        return False
    first = term[0]
    return not first.isdecimal() if first.isascii() else not _is_row(first)


def _is_row(character: str) -> bool:
    """Whether it belongs to a script without spaces."""
    return character >= _FIRST_ROW and _ROW.match(character) is not None


def _tokens(text: str) -> list[str]:
    if not text.isascii():
        text = _FOREIGN.sub(_compatible, text)
    if "'s" in text or "’s" in text:
        text = _GENITIVE.sub("", text)
    return (_ASCII_TOKEN if text.isascii() else _TOKEN).findall(text)


def _compatible(run: re.Match[str]) -> str:
    return _folded(run[0])


@functools.lru_cache(maxsize=1 << 12)
def _folded(run: str) -> str:
    """Characters that are not ASCII in their compatible form, without marks."""
    text = unicodedata.normalize("NFKD", run)
    return "".join(c for c in text if unicodedata.category(c)[0] != "M")


@functools.lru_cache(maxsize=1 << 12)
def _expanded(token: str) -> tuple[str, ...]:
    """The terms of a word, a name, a number or a symbol, each once."""
    if _SIMPLE.match(token):
        return (token,) if len(token) <= LONGEST else ()
    if token in _SYMBOLS:
        return _SYMBOLS[token]
    token = token.strip("_")
    if len(token) > LONGEST or not token:
        return ()
    if _NUMBER.match(token):
        return (token.lower(),) if len(token) <= _LONGEST_NUMBER else ()
    if token.isascii():
        return tuple(dict.fromkeys(_latin(token)))
    return tuple(dict.fromkeys(_mixed(token)))


def _latin(token: str) -> Iterator[str]:
    """A name, and what it is put together from."""
    yield token.lower()
    for name in filter(None, (name.strip("_") for name in token.split("."))):
        if len(name) > 1:
            yield name.lower()
        parts = [part.lower() for part in _SEAM.split(name) if part]
        if len(parts) > 1:
            if "_" in name:
                yield name.lower().replace("_", "")
            yield from (part for part in parts if len(part) > 1)


def _mixed(token: str) -> Iterator[str]:
    """A word with letters of other scripts."""
    runs = list((_RUN if max(token) >= _FIRST_ROW else _WESTERN_RUN).finditer(token))
    said: list[str] = []
    for run in runs:
        text = unicodedata.normalize("NFC", run[0].lower())
        if run[1]:
            yield from _pairs(text)
        elif run[2] and len(text) == 1 and text in GREEK:
            said.append(GREEK[text])
            yield GREEK[text]
        else:
            word = text.replace("ς", "σ").strip("._")
            said.append(word)
            if len(word) > 1 or (word and len(runs) == 1):
                yield from _latin(run[0].strip("._")) if word.isascii() else (word,)
    joined = "".join(said).replace("_", "")
    if len(said) > 1 and len(joined) <= LONGEST:
        yield joined


def _pairs(run: str) -> Iterator[str]:
    """Each character with its next one, and the last alone."""
    yield from (run[at : at + 2] for at in range(len(run)))


_MOST = 1 << 14
"""Runs that are remembered."""
_INNER = b"_.+-'"
"""What may stand in a token, or decides where one ends, beside letters and digits."""
_CUT = bytes(
    code if code > 0x7F or bytes((code,)).isalnum() or code in _INNER else 0x20
    for code in range(256)
)
"""Makes blanks of the other signs; what is not ASCII has no byte below 128."""


def runs(text: str) -> Counter[bytes]:
    """The runs of a text in UTF-8, and how often each occurs."""
    return Counter(text.encode("utf-8", "surrogatepass").translate(_CUT).split())


class _Terms(dict[bytes, tuple[str, ...]]):
    """The terms of runs, in order and with repeats."""

    def __missing__(self, run: bytes) -> tuple[str, ...]:
        if run.isalpha() and run.islower() and len(run) <= LONGEST:  # ASCII, as most are
            found: tuple[str, ...] = (run.decode(),)
        else:
            found = tuple(terms_of(run.decode("utf-8", "surrogatepass")))
        if len(self) >= _MOST:
            self.clear()
        self[run] = found
        return found


TERMS = _Terms()
"""The terms of every run; those that were asked for are remembered."""


def counted(text: str) -> dict[str, int]:
    """How often each term occurs."""
    found: dict[str, int] = {}
    for run, times in runs(text).items():
        for term in TERMS[run]:
            found[term] = found.get(term, 0) + times
    return found
