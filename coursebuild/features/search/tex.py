"""Writes TeX as a line of plain text, by which a formula is found and shown in search results.

Entry point: `plain_formula(tex)`: a text such as `τ = I_xx dω/dt`, and the names of the commands.

It never fails: unknown commands are left out of the text, and unbalanced groups end where the TeX
ends. Whether a formula is valid is checked elsewhere.
"""

from __future__ import annotations

import functools
import re
import unicodedata

from coursebuild.features.search.words import GREEK

_PIECE = re.compile(r"%[^\n]*|\\([A-Za-z]+)\*?|\\.|\s+|.", re.DOTALL)
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
"""Functions that are written with their names."""
_TEXTS = _SIGNS | {name: name for name in _FUNCTIONS}
"""The texts of commands without arguments."""
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
_MATHEMATICAL = re.compile("[\U0001d400-\U0001d7ff]")
# The blank is matched first and its neighbours then: the other order is far slower.
_TIGHT = re.compile(r" (?:(?<=[_^(\[|⟨] )|(?=[_^)\]⟩,;]))")
_OPERATOR = re.compile(r" (?<=[Δδ∂∇] )(?=[^\W\d])")
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
    """Reads pieces from left to right."""

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
        """Return the next piece; empty at the end."""
        return self._pieces[self._at][0] if self._at < len(self._pieces) else ""

    def _group(self) -> str:
        """Read up to the closing brace, which is left."""
        parts: list[str] = []
        while self._next() not in ("", "}"):
            parts.append(self._item())
        return "".join(parts)

    def _item(self) -> str:
        """Read the next piece with its arguments."""
        match = self._pieces[self._at]
        self._at += 1
        piece = match[0]
        if match[1]:
            return self._command(match[1])
        if piece[0] == "\\" and len(piece) > 1:
            return " " if piece[1].isspace() or piece[1] in ",;:!\\" else piece[1]
        if piece == "{":
            return self._rest_of_group()
        if piece in ("^", "_"):
            return piece + _add_brackets(self._argument())
        return {"&": " ", "~": " ", "'": "′", "\\": ""}.get(piece, piece)

    def _rest_of_group(self) -> str:
        self._depth += 1
        # Beyond the depth of any real formula groups are read flat, against stack overflows.
        inner = self._group() if self._depth < 64 else ""
        self._depth -= 1
        if self._next() == "}":
            self._at += 1
        return inner

    def _argument(self) -> str:
        """Read the next group or item."""
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
    """Put a text in brackets, unless it is one word or sign."""
    text = text.strip()
    return f"({text})" if len(text) > 1 and not text.isalnum() else text
