r"""What a formula states: statements, each a chain of sides with relations between them.

Entry point: `read_statements(tex)`. A formula is cut at commas, wide spaces and arrows into
statements, and a statement at its relations into sides, all outside of braces and brackets. A side
that is not understood says why, and its neighbours are read all the same.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Iterator

from msgspec import Struct

from coursebuild.features.arithmetic.expressions import CONSTANTS, Expression, NotUnderstood
from coursebuild.features.arithmetic.tex import GREEK, SPACE, TOKEN, read_expression

_LONG = 5_000
_DIGITS = re.compile("[0-9],[0-9]")
_ENVIRONMENT = re.compile(r"\\(?:begin|end)\{(?:aligned|split|align\*?|gathered|equation\*?)\}")
_WORDS = re.compile(
    r"\\(?:mathrm|text|textrm|begin|end)\s*(?:\{[^{}]*\}|\w)"
    rf"|\\(?!(?:{'|'.join(GREEK - {'pi', 'infty'})})(?![A-Za-z]))[A-Za-z]+"
)
"""What has letters that are no symbols."""
_RELATIONS = {
    **{sign: sign for sign in "=<>"},
    **dict.fromkeys((r"\approx", r"\simeq", "≈"), "≈"),
    **dict.fromkeys((r"\le", r"\leq", r"\leqslant", "≤"), "≤"),
    **dict.fromkeys((r"\ge", r"\geq", r"\geqslant", "≥"), "≥"),
    **dict.fromkeys((r"\ne", r"\neq", "≠"), "≠"),
    **dict.fromkeys((r"\equiv", r"\coloneqq"), "="),
    **{rf"\{name}": "?" for name in ("sim", "propto", "ll", "gg", "in", "lesssim", "gtrsim")},
}
_CUTS = frozenset(
    r", ; \\ \quad \qquad \to \mapsto \implies \iff \Rightarrow \Leftrightarrow"
    r" \rightarrow \Longrightarrow".split()
)
_OPENING = frozenset(("{", "(", "[", r"\{", r"\begin", r"\langle"))
_CLOSING = frozenset(("}", ")", "]", r"\}", r"\end", r"\rangle"))


class FormulaSide(Struct, frozen=True):
    """One side of a relation, and where it stands in the TeX."""

    start: int
    end: int
    expression: Expression | NotUnderstood

    numeric: bool
    """Whether it shows numbers and no symbols, as far as can be told."""

    def understood(self) -> Expression:
        """The expression.

        Raises:
            NotUnderstood: it is none.
        """
        if isinstance(self.expression, NotUnderstood):
            raise self.expression
        return self.expression


class Statement(Struct, frozen=True):
    """Sides with the relations between them: `=`, `≈`, `<` …, or `?` for one of other kinds."""

    sides: tuple[FormulaSide, ...]
    relations: tuple[str, ...]


@functools.lru_cache(maxsize=256)
def read_statements(tex: str) -> tuple[Statement, ...]:
    """What a formula states."""
    return tuple(_statements(tex)) if len(tex) <= _LONG else ()


def _statements(tex: str) -> Iterator[Statement]:
    tex = _ENVIRONMENT.sub(lambda found: " " * len(found[0]), tex)
    sides: list[FormulaSide] = []
    relations: list[str] = []
    for start, end, sign in _pieces(tex):
        if SPACE.sub("", tex[start:end]).strip("."):
            sides.append(_side(tex, start, end))
        if sign:
            relations.append(_RELATIONS[sign])
            continue
        if sides and len(relations) == len(sides) - 1:
            yield Statement(tuple(sides), tuple(relations))
        sides, relations = [], []


def _pieces(tex: str) -> Iterator[tuple[int, int, str]]:
    """Where the pieces of a formula stand, and the relation after each; empty at other cuts."""
    depth, start = 0, 0
    for token in TOKEN.finditer(tex):
        sign = token[0]
        depth += (sign in _OPENING) - (sign in _CLOSING)
        if depth > 0:
            continue
        if sign == r"\\":
            space = SPACE.match(tex, token.end())
            after = TOKEN.match(tex, space.end() if space else token.end())
            if after is not None and after[0] in _RELATIONS:
                continue  # the next row goes on with what is before it
        if sign == "," and _DIGITS.match(tex, token.start() - 1):
            continue  # which may stand for a point, or for nothing
        if sign in _RELATIONS or sign in _CUTS:
            yield start, token.start(), sign if sign in _RELATIONS else ""
            start = token.end()
    yield start, len(tex), ""


def _side(tex: str, start: int, end: int) -> FormulaSide:
    try:
        found = read_expression(tex, start, end)
    except NotUnderstood as reason:
        rest = _WORDS.sub("", tex[start:end])
        numeric = re.search("[0-9]", rest) is not None and re.search("[A-Za-z]", rest) is None
        return FormulaSide(start, end, reason, numeric)
    symbols = (one.text for one in found.walk() if one.kind == "symbol")
    numeric = all(name in CONSTANTS for name in symbols) and not found.has("derivative", "integral")
    return FormulaSide(start, end, found, numeric)
