"""The terms that a text is found by; what a reader types goes through the same rules.

Entry points: `count_terms(text)`; `terms_of(text)`, the terms of a text in order; `shelf_of(term)`,
which decides what file of the index has a term.

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
from itertools import groupby
from typing import Literal

LONGEST = 48
"""Characters; longer runs are data, which nobody types."""
_LONGEST_NUMBER = 12
BEGINNING = 4
"""Characters by which words are found that begin with them."""

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
_TOKEN = re.compile(
    r"[0-9]+(?:\.[0-9]+)*[eE][+-]?[0-9]+(?!\w)|\w+(?:\.\w+)*|[" + "".join(_SYMBOLS) + "]"
)
_NUMBER = re.compile(r"[0-9][0-9.eE+-]*\Z")
_SEAM = re.compile(
    r"(?<=[a-z])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])|(?<=[A-Za-z])(?=[0-9])|(?<=[0-9])(?=[A-Za-z])"
    r"|_+"
)
_FOREIGN = re.compile(r"[^\x00-\x7f]+")
_GENITIVE = re.compile("['’]s\\b")


def terms_of(text: str) -> list[str]:
    """The terms of a text, in order, with repeats."""
    if not text.isascii():
        text = _FOREIGN.sub(_without_marks, text)
    return [term for token in _TOKEN.findall(_GENITIVE.sub("", text)) for term in _expanded(token)]


def shelf_of(term: str) -> str:
    """Terms with the same shelf stand in the same file: those that begin alike.

    Of a number it is the whole; of a name with dots the beginning of its last part, since very many
    may begin with the same one.
    """
    first = term[:1]
    if first.isascii():
        return term if first.isdecimal() else term.rpartition(".")[2][:BEGINNING]
    return first if _script(first) == "unspaced" else term[:BEGINNING]


def is_fuzzy(term: str) -> bool:
    """Whether a misspelt word may mean the term."""
    if not 3 <= len(term) <= 24 or "." in term:
        return False
    first = term[0]
    return not first.isdecimal() if first.isascii() else _script(first) != "unspaced"


def _script(character: str) -> Literal["greek", "unspaced", "other"]:
    if character < "\u0e00":
        return "greek" if "\u0370" <= character <= "\u03ff" else "other"
    return "unspaced" if any(row[0] <= character <= row[1] for row in _UNSPACED) else "other"


def _without_marks(run: re.Match[str]) -> str:
    """Characters that are not ASCII in their compatible form, without marks."""
    text = unicodedata.normalize("NFKD", run[0])
    return "".join(c for c in text if unicodedata.category(c)[0] != "M")


def _expanded(token: str) -> tuple[str, ...]:
    """The terms of a word, a name, a number or a symbol, each once."""
    if token in _SYMBOLS:
        return _SYMBOLS[token]
    token = token.strip("_")
    if len(token) > LONGEST or not token:
        return ()
    if _NUMBER.match(token):
        return (token.lower(),) if len(token) <= _LONGEST_NUMBER else ()
    return tuple(dict.fromkeys(_name(token) if token.isascii() else _mixed(token)))


def _name(token: str) -> Iterator[str]:
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
    runs = [(script, "".join(letters)) for script, letters in groupby(list(token), _script)]
    said: list[str] = []
    for script, run in runs:
        text = unicodedata.normalize("NFC", run.lower())
        if script == "unspaced":  # each character with its next one, and the last alone
            yield from (text[at : at + 2] for at in range(len(text)))
        elif script == "greek" and text in GREEK:
            said.append(GREEK[text])
            yield GREEK[text]
        else:
            word = text.replace("ς", "σ").strip("._")
            said.append(word)
            if len(word) > 1 or (word and len(runs) == 1):
                yield from _name(run.strip("._")) if word.isascii() else (word,)
    joined = "".join(said).replace("_", "")
    if len(said) > 1 and len(joined) <= LONGEST:
        yield joined


_CUT = bytes(
    code if code > 0x7F or bytes((code,)).isalnum() or code in b"_.+-'" else 0x20
    for code in range(256)
)
"""Makes blanks of what stands in no token; what is not ASCII has no byte below 128."""


def count_terms(text: str) -> dict[str, int]:
    """How often each term occurs."""
    found: dict[str, int] = {}
    runs = Counter(text.encode("utf-8", "surrogatepass").translate(_CUT).split())
    for run, times in runs.items():
        for term in _terms_of_run(run):
            found[term] = found.get(term, 0) + times
    return found


@functools.lru_cache(maxsize=1 << 15)
def _terms_of_run(run: bytes) -> tuple[str, ...]:
    """Most runs come again and again, and most are words of small letters."""
    if run.isalpha() and run.islower() and len(run) <= LONGEST:  # of ASCII
        return (run.decode(),)
    return tuple(terms_of(run.decode("utf-8", "surrogatepass")))
