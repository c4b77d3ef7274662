"""TeX as a line of plain text: what a formula is found by, and how a search result shows it.

Entry point: `plain_formula(tex)`, such as `τ = I_xx dω/dt` and the names of the commands in it.

It never fails: what it does not know it leaves out of the text, and what does not balance ends
where the TeX ends. That a formula parses is checked elsewhere.
"""

from __future__ import annotations

import functools
import re
import unicodedata
from typing import TypeAlias

from coursebuild.core.pages.search.words import GREEK
from coursebuild.core.text.patterns import pattern

_PIECE = pattern(r"\\([A-Za-z]+)\*?|\\(.)|%[^\n]*|([{}^_&~'])|([^\\{}^_&~'%]+)", re.DOTALL)

_SIGNS = {
    **{"partial": "∂", "nabla": "∇", "int": "∫", "iint": "∬", "oint": "∮", "sum": "∑"},
    **{"prod": "∏", "infty": "∞", "times": "×", "cdot": "·", "pm": "±", "approx": "≈"},
    **{"le": "≤", "leq": "≤", "ge": "≥", "geq": "≥", "ne": "≠", "neq": "≠", "propto": "∝"},
    **{"to": "→", "rightarrow": "→", "Rightarrow": "⇒", "mapsto": "↦", "in": "∈", "ell": "ℓ"},
    **{"otimes": "⊗", "perp": "⊥", "parallel": "∥", "equiv": "≡", "sim": "∼", "ll": "≪"},
    **{"gg": "≫", "dots": "…", "ldots": "…", "cdots": "…", "circ": "°", "degree": "°"},
    **{"lVert": "‖", "rVert": "‖", "Vert": "‖", "langle": "⟨", "rangle": "⟩", "hbar": "ℏ"},
    **{"forall": "∀", "exists": "∃", "dagger": "†", "top": "⊤", "prime": "′", "mid": "|"},
}
_NAMED = frozenset(
    "sin cos tan cot sec csc arcsin arccos arctan sinh cosh tanh exp log ln lim max min sup inf det"
    " dim ker arg deg gcd Pr tr".split()
)
"""Functions, which are written as they are called."""
_STYLE = frozenset(
    "left right big Big bigg Bigg bigl bigr Bigl Bigr middle displaystyle textstyle scriptstyle"
    " limits nolimits quad qquad text textrm textit textbf mathrm mathbf mathit mathsf mathcal"
    " mathbb mathfrak mathtt boldsymbol bm symbf operatorname begin end nonumber notag label tag"
    " mathstrut strut phantom hphantom vphantom color textcolor mathop mathrel mathbin".split()
)
"""How things look: by these nobody searches."""
_SKIPPED = frozenset("begin end label tag color hspace vspace phantom hphantom vphantom".split())
"""Commands whose argument is no part of the formula."""
_VARIANTS = {"varepsilon": "ε", "vartheta": "ϑ", "varphi": "φ", "varrho": "ϱ", "varpi": "ϖ"}
_VARIANTS["varsigma"] = "ς"
_MATHEMATICAL = pattern("[\U0001d400-\U0001d7ff]")
# A blank is looked for first, what stands around it then: the other way about takes far longer.
_TIGHT = pattern(r" (?:(?<=[_^] )|(?=[_^]))")
_OPERATOR = pattern(r" (?<=[Δδ∂∇] )(?=[^\W\d])")
"""Between a difference or derivative and what it is of: they are one word, as `Δt`."""
_INNER = pattern(r" (?:(?<=[(\[|⟨] )|(?=[)\]⟩,;]))")


def _letters() -> dict[str, str]:
    found = dict(_VARIANTS)
    for letter, name in GREEK.items():
        found.setdefault(name, letter)
        found.setdefault(name.capitalize(), letter.upper())
    return {name: f" {letter} " for name, letter in found.items()}


_LETTERS = _letters()
"""What the commands of letters say, with blanks around."""
_SAID = {
    **{name: f" {sign} " for name, sign in _SIGNS.items()},
    **{name: f" {name} " for name in _NAMED},
    **{"quad": " ", "qquad": " "},
}
"""What other commands say that have no argument."""


@functools.lru_cache(maxsize=1024)
def plain_formula(tex: str) -> tuple[str, tuple[str, ...]]:
    """The formula as text, and the names of its commands, each once, in order."""
    reader = _Reader(tex)
    text = " ".join(reader.until_end().split())
    if " " in text:
        text = _INNER.sub("", _TIGHT.sub("", text))
    if not text.isascii():
        text = _OPERATOR.sub("", text)
        text = _MATHEMATICAL.sub(lambda m: unicodedata.normalize("NFKC", m[0]), text)
    return text, tuple(dict.fromkeys(reader.names))


_Piece: TypeAlias = tuple[str, str, str, str]
"""The name of a command, another character after a backslash, a mark, or a run of others."""


class _Reader:
    """Reads pieces from left to right."""

    def __init__(self, tex: str) -> None:
        self._pieces: list[_Piece] = _PIECE.findall(tex)
        if "%" in tex:
            self._pieces = [piece for piece in self._pieces if any(piece)]  # no comments
        self._at = 0
        self._depth = 0
        self.names: list[str] = []

    def until_end(self) -> str:
        """The rest, whatever closes in it."""
        parts: list[str] = []
        while self._at < len(self._pieces):
            parts.append(self._group())
            self._at += 1  # a brace that closes nothing
        return " ".join(parts)

    def _group(self) -> str:
        """Up to the brace that closes, which is left."""
        pieces, end = self._pieces, len(self._pieces)
        parts: list[str] = []
        while self._at < end:
            piece = pieces[self._at]
            run = piece[3]
            if not run:
                if piece[2] == "}":
                    break
                self._at += 1
                run = self._said(piece)
            else:
                self._at += 1
            parts.append(run)
        return "".join(parts)

    def _said(self, piece: _Piece) -> str:
        """What a piece says that was just taken, with what belongs to it."""
        name, escaped, mark, run = piece
        if name:
            return self._command(name)
        if escaped:
            return " " if escaped.isspace() or escaped in ",;:!\\" else escaped
        match mark:
            case "{":
                return self._closed()
            case "^" | "_":
                return mark + _bracketed(self._argument())
            case "&" | "~":
                return " "
            case "'":
                return "′"
            case _:
                return run

    def _closed(self) -> str:
        self._depth += 1
        # Beyond any depth that a formula has, the rest is read flat: TeX may be made to be deep.
        inner = self._group() if self._depth < 64 else ""
        self._depth -= 1
        if self._at < len(self._pieces) and self._pieces[self._at][2] == "}":
            self._at += 1
        return inner

    def _argument(self) -> str:
        """The next group or item; of a run of letters the first."""
        pieces, at, end = self._pieces, self._at, len(self._pieces)
        while at < end and pieces[at][3].isspace():
            at += 1
        self._at = at
        if at >= end or pieces[at][2] == "}":
            return ""
        piece = pieces[at]
        if not piece[3]:
            self._at += 1
            return self._said(piece).strip()
        text = piece[3].lstrip()
        if len(text) > 1:  # what follows the first character stays
            pieces[at] = ("", "", "", text[1:])
        else:
            self._at += 1
        return text[:1]

    def _command(self, name: str) -> str:
        letter = _LETTERS.get(name)
        if letter is not None:
            return letter
        if name not in _STYLE:
            self.names.append(name)
        said = _SAID.get(name)
        if said is not None:
            return said
        if name in ("frac", "dfrac", "tfrac", "cfrac"):
            top = _bracketed(self._argument())
            return f" {top}/{_bracketed(self._argument())} "
        if name == "sqrt":
            return f"√{_bracketed(self._argument())}"
        if name in _SKIPPED:
            self._argument()
            return " "
        return ""


def _bracketed(text: str) -> str:
    """In brackets, unless it is one word or sign."""
    text = text.strip()
    return f"({text})" if len(text) > 1 and not text.isalnum() else text
