r"""Splits a formula into statements, each a chain of sides with relations between them.

Entry point: `read_statements(tex)`. A formula is split at commas, wide spaces and arrows into
statements, and a statement at its relations into sides, all outside braces and brackets. A side
that is not understood holds the reason, and the other sides are read all the same.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import cached_property, lru_cache

from msgspec import Struct

from coursebuild.api import regex
from coursebuild.core.checks.formulas import SYMBOLS
from coursebuild.features.arithmetic.expressions import CONSTANTS, Expression, NotUnderstood
from coursebuild.features.arithmetic.tex import SPACE, TOKEN, read_expression

_MAX_LENGTH = 5_000
_DIGITS = regex("[0-9],[0-9]")
_COMMA = regex(r"([0-9]+)\{,\}([0-9]+)")
_PLAIN_COMMA = regex(r"(?<=[0-9]),(?=[0-9])")
_COMMA_OF_TWO = regex(r"[0-9],[0-9]|[0-9](?:,|\{,\})\([0-9]")
_POINT = regex(r"(?<=[0-9])\s*\.\s*(?=[0-9])")
_CERTAIN_COMMA = regex(r"(?<![0-9.])0\{,\}[0-9]|[0-9]\{,\}(?:[0-9]{1,2}|[0-9]{4,})(?![0-9])")
"""A comma that parts no thousands."""
_ARABIC = {zero + n: str(n) for zero in (0x660, 0x6F0) for n in range(10)} | {0x66B: "."}
"""Digits and the decimal sign, as they are written in Arabic and Persian."""
_ENVIRONMENT = regex(r"\\(?:begin|end)\{(?:aligned|split|align\*?|gathered|equation\*?)\}")
_WORDS = regex(
    r"\\(?:mathrm|text|textrm|begin|end|(?:qty|SI)\{[^{}]*\})\s*(?:\{[^{}]*\}|\w)"
    rf"|\\(?!(?:{'|'.join(SYMBOLS - {'pi', 'infty'})})(?![A-Za-z]))[A-Za-z]+"
)
"""Commands and words whose letters are no symbols."""
_MAY_BE_NUMERIC = regex(r"[0-9e]|\\pi")
"""A digit, or a part of one of `CONSTANTS`."""
_SYMBOL = regex(r"(?<![\\A-Za-z])e*[A-DF-Za-df-z]")
"""A letter that is a symbol, unless it stands in a word."""
_MAY_HOLD_WORDS = regex(r"\\(?:math|text|operatorname|begin|underbrace|overbrace|sum|prod|qty|SI)")
_RELATIONS = {
    **{sign: sign for sign in "=<>"},
    **dict.fromkeys((r"\approx", r"\simeq", "≈"), "≈"),
    **dict.fromkeys((r"\le", r"\leq", r"\leqslant", "≤"), "≤"),
    **dict.fromkeys((r"\ge", r"\geq", r"\geqslant", "≥"), "≥"),
    **dict.fromkeys((r"\ne", r"\neq", "≠"), "≠"),
    r"\coloneqq": "=",
    **dict.fromkeys((r"\equiv", "≡"), "≡"),
    **{rf"\{name}": "?" for name in ("sim", "propto", "ll", "gg", "in", "lesssim", "gtrsim")},
}
_CUTS = frozenset(
    r", ; \\ \quad \qquad \to \mapsto \implies \iff \Rightarrow \Leftrightarrow"
    r" \rightarrow \Longrightarrow".split()
)
_OPENING = frozenset(("{", "(", "[", r"\{", r"\begin", r"\langle"))
_CLOSING = frozenset(("}", ")", "]", r"\}", r"\end", r"\rangle"))


class FormulaSide(Struct, frozen=True, dict=True):
    """One side of a relation. It is parsed when it is asked about, as most are not."""

    tex: str
    """The TeX of the whole formula."""
    start: int
    end: int

    @cached_property
    def expression(self) -> Expression | NotUnderstood:
        """What it says, or why it is not understood."""
        try:
            return read_expression(self.tex, self.start, self.end)
        except NotUnderstood as reason:
            return reason

    @cached_property
    def is_numeric(self) -> bool:
        """Whether it has numbers and no symbols; a guess if it is not understood."""
        text = self.tex[self.start : self.end]
        if not _MAY_BE_NUMERIC.search(text):
            return False
        if _SYMBOL.search(text) and not _MAY_HOLD_WORDS.search(text):
            return False
        if isinstance(self.expression, NotUnderstood):
            rest = _WORDS.sub("", text)
            return re.search("[0-9]", rest) is not None and re.search("[A-Za-z]", rest) is None
        parts = self.expression.walk()
        has_symbol = any(part.kind == "symbol" and part.text not in CONSTANTS for part in parts)
        return not has_symbol and not self.expression.has("derivative", "integral")

    def get_expression(self) -> Expression:
        """Return the expression.

        Raises:
            NotUnderstood: the side is not understood.
        """
        if isinstance(self.expression, NotUnderstood):
            raise self.expression
        return self.expression


class Statement(Struct, frozen=True):
    """Sides with the relations between them: `=`, `≈`, `<` …, or `?` for any other.

    `≡` may be of remainders, and is an equation only where an identity is asked for.
    """

    sides: tuple[FormulaSide, ...]
    relations: tuple[str, ...]


def point_decimals(tex: str, comma: bool = False) -> str:
    """Return a formula of the same length, with points for the commas before decimals.

    `comma`: such a comma is that of its language, and need not stand in braces. In other languages
    `1{,}250` is a thousand.
    """
    tex = tex.translate(_ARABIC)
    if comma:
        return _PLAIN_COMMA.sub(".", _COMMA.sub(r"\1.\2  ", tex))
    return _COMMA.sub(r"\1.\2  ", tex) if _CERTAIN_COMMA.search(tex) else tex


def second_reading(tex: str) -> str:
    """How the signs in numbers may be meant where commas stand before decimals; empty if not."""
    if _COMMA_OF_TWO.search(tex):
        return "a comma in it may part two numbers"
    return "a point in it may part thousands or factors" if _POINT.search(tex) else ""


@lru_cache(maxsize=2048)
def read_statements(tex: str, comma: bool = False) -> tuple[Statement, ...]:
    """Return the statements of a formula; none if it is too long."""
    if len(tex) > _MAX_LENGTH:
        return ()
    tex = point_decimals(tex, comma)
    tex = _ENVIRONMENT.sub(lambda match: " " * len(match[0]), tex)
    statements: list[Statement] = []
    sides: list[FormulaSide] = []
    relations: list[str] = []
    for start, end, sign in _split_sides(tex):
        if SPACE.sub("", tex[start:end]).strip("."):
            sides.append(FormulaSide(tex, start, end))
        if sign:
            relations.append(_RELATIONS[sign])
            continue
        if sides and len(relations) == len(sides) - 1:
            statements.append(Statement(tuple(sides), tuple(relations)))
        sides, relations = [], []
    return tuple(statements)


def _split_sides(tex: str) -> Iterator[tuple[int, int, str]]:
    """Yield the range of each side, and the relation after it; empty at the end of a statement."""
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
                continue  # the next row continues the statement
        if sign == "," and _DIGITS.match(tex, token.start() - 1):
            continue  # a comma between digits, which `read_expression` refuses
        if sign in _RELATIONS or sign in _CUTS:
            yield start, token.start(), sign if sign in _RELATIONS else ""
            start = token.end()
    yield start, len(tex), ""
