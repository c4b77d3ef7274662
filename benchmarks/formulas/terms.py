"""Expressions in TeX and, independently of our reader, in SymPy; their values at 60 digits."""

from __future__ import annotations

import random
from typing import NamedTuple

import mpmath
import sympy

DIGITS = 60
mpmath.mp.dps = DIGITS
EQUAL = mpmath.mpf(10) ** -45
NOTHING = mpmath.mpf(10) ** -400
"""What SymPy, which adds digits up to 2000 until 60 are right, leaves of zero is less."""


class Term(NamedTuple):
    """An expression in TeX, in brackets where it is a sum, and in SymPy."""

    tex: str
    value: sympy.Expr

    def __add__(self, right: Term) -> Term:
        return Term(rf"\left({self.tex} + {right.tex}\right)", self.value + right.value)

    def __sub__(self, right: Term) -> Term:
        return Term(rf"\left({self.tex} - {right.tex}\right)", self.value - right.value)

    def __mul__(self, right: Term) -> Term:
        return Term(rf"{self.tex}\cdot{right.tex}", self.value * right.value)

    def __truediv__(self, right: Term) -> Term:
        return Term(rf"\frac{{{self.tex}}}{{{right.tex}}}", self.value / right.value)

    def __pow__(self, exponent: int) -> Term:
        return Term(rf"\left({self.tex}\right)^{{{exponent}}}", self.value**exponent)


class Case(NamedTuple):
    """A formula, and whether it is true; `None` if it has no value, or may mean several."""

    kind: str
    tex: str
    truth: bool | None
    domain: str | None = None
    """Of an identity."""
    comma: bool = False
    """Whether it stands in a language with decimal commas."""


PI = Term(r"\pi", sympy.pi)
FUNCTIONS = {
    **{name: getattr(sympy, name) for name in "sin cos tan sinh cosh tanh exp".split()},
    "arctan": sympy.atan,
    "arcsin": sympy.asin,
    "arccos": sympy.acos,
    "ln": sympy.log,
}


def number(text: str) -> Term:
    """A number as it is written, exactly."""
    return Term(text, sympy.Rational(text))


def power_of_ten(exponent: int) -> Term:
    return Term(f"10^{{{exponent}}}", sympy.Rational(10) ** exponent)


def call(name: str, argument: Term) -> Term:
    return Term(rf"\{name}({argument.tex})", FUNCTIONS[name](argument.value))


def root(argument: Term) -> Term:
    return Term(rf"\sqrt{{{argument.tex}}}", sympy.sqrt(argument.value))


def size(argument: Term) -> Term:
    return Term(rf"|{argument.tex}|", sympy.Abs(argument.value))


def random_term(rng: random.Random, depth: int) -> Term:
    """Numbers, roots and functions, nested a few times."""
    if depth == 0:
        whole = str(rng.choice([n for n in range(1, 21) if n != 10]))  # 10^2 may be rounded
        return number(rng.choice((whole, f"{rng.randint(1, 99)}.{rng.randint(1, 9)}")))
    first = random_term(rng, depth - 1)
    match rng.randrange(8):
        case 0:
            return first + random_term(rng, depth - 1)
        case 1:
            return first - random_term(rng, depth - 1)
        case 2:
            return first * random_term(rng, depth - 1)
        case 3:
            return first / random_term(rng, depth - 1)
        case 4:
            return root(first)
        case 5:
            return first**2
        case _:
            return call(rng.choice(("sin", "cos", "arctan", "tanh", "ln")), first)


def evaluate(expression: sympy.Expr) -> mpmath.mpf | None:
    """The value at 60 digits; `None` for what is no real number."""
    value = sympy.N(expression, DIGITS, maxn=2000)
    if not value.is_real or not value.is_finite:
        return None
    return mpmath.mpf(sympy.Float(value, DIGITS)._mpf_)


def compare(left: sympy.Expr, right: sympy.Expr) -> int | None:
    """The sign of a difference; `None` if a side is no real number."""
    sides = evaluate(left), evaluate(right)
    if sides[0] is None or sides[1] is None:
        return None
    difference = evaluate(left - right)
    assert difference is not None
    return 0 if abs(difference) < NOTHING else int(mpmath.sign(difference))
