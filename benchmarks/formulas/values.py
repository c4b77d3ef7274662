"""Equalities and inequalities between numbers: what cancels, poles, branches, last digits."""

from __future__ import annotations

import random
from decimal import ROUND_HALF_EVEN, Decimal, localcontext

import mpmath
import sympy

from benchmarks.formulas.terms import (
    DIGITS,
    PI,
    Case,
    call,
    compare,
    evaluate,
    number,
    power_of_ten,
    random_term,
    root,
    size,
)


def fractions(rng: random.Random) -> Case:
    """A sum of fractions, and its exact value or one beside it."""
    terms = [number(f"{rng.randint(1, 40)}") / number(f"{rng.randint(2, 40)}") for _ in range(3)]
    total = terms[0] + terms[1] - terms[2]
    off = rng.choice((0, 0, 1, -1))
    stated_number = total.value + sympy.Rational(off, total.value.q * rng.choice((1, 10, 1000)))
    sign = "-" if stated_number < 0 else ""
    tex = rf"{total.tex} = {sign}\frac{{{abs(stated_number.p)}}}{{{stated_number.q}}}"
    return Case("fractions", tex, compare(total.value, stated_number) == 0)


def rounded(rng: random.Random) -> Case:
    """A result to its digits, or off by one in the last."""
    term = random_term(rng, rng.randint(1, 3))
    value = evaluate(term.value)
    if value is None or not 1e-6 < abs(value) < 1e12:
        return Case("rounded", rf"{term.tex} \approx 1.5", None if value is None else False)
    with localcontext() as context:
        context.prec = 2 * DIGITS
        exact = Decimal(mpmath.nstr(value, DIGITS - 5, strip_zeros=False))
        step = Decimal(1).scaleb(min(exact.adjusted() - rng.randint(1, 25), -1))
        stated_number = exact.quantize(step, ROUND_HALF_EVEN) + rng.choice((0, 0, 1, -1)) * step
        return Case(
            "rounded",
            rf"{term.tex} \approx {stated_number:f}",
            2 * abs(stated_number - exact) <= step,
        )


def edges(rng: random.Random) -> Case:
    """A number at the edge of what another may be rounded from, or a hair beside it."""
    step = Decimal(1).scaleb(-rng.randint(1, 8))
    stated_number = rng.randint(-(10**6), 10**6) * step
    number = (
        stated_number + step / 2 * rng.choice((1, -1)) + step.scaleb(-12) * rng.choice((-1, 0, 1))
    )
    truth = 2 * abs(stated_number - number) <= step
    return Case("edges", f"{number:f} = {stated_number:f}", truth)


def cancellation(rng: random.Random) -> Case:
    """What is left where nearly all cancels: right, zero, or another number."""
    small = rng.randint(3, 40)
    h = power_of_ten(-small)
    unit, double = number("1"), number("2")
    term, limit = rng.choice(
        (
            ((unit - call("cos", h)) / power_of_ten(-2 * small), "0.5"),
            (call("ln", unit + h) / h, "1.0"),
            ((call("exp", h) - unit) / h, "1.0"),
            ((call("tan", h) - call("sin", h)) / power_of_ten(-3 * small), "0.5"),
            ((root(unit + h) - unit) / h, "0.5"),
            ((unit + h - unit) / h, "1.0"),
            ((root(double + h) - root(double)) * root(double) / h, "0.50"),
        )
    )
    stated_number = rng.choice((limit, limit, "0", "0.0", "0.4", "1.1"))
    numbers = Decimal(stated_number), evaluate(term.value)
    step = mpmath.mpf(10) ** -len(stated_number.partition(".")[2])
    gap = 2 * abs(numbers[1] - mpmath.mpf(stated_number))
    truth = gap <= step if "." in stated_number else gap == 0
    return Case("cancellation", f"{term.tex} = {stated_number}", bool(truth))


def zeros(rng: random.Random) -> Case:
    """Zeros and poles of functions, and what is beside them."""
    turns = number(str(rng.randint(1, 30))) * PI
    half = number(str(2 * rng.randint(1, 30) - 1)) * PI / number("2")
    off = power_of_ten(-rng.randint(5, 55))
    name, place = rng.choice((("sin", turns), ("cos", half), ("tan", turns), ("tan", half)))
    if rng.random() < 0.5:
        place = place + off
    term = call(name, place)
    if rng.random() < 0.3:
        term = number("1") / term
    sign = compare(term.value, sympy.Integer(0))
    relation, holds = rng.choice(
        (("=", (0,)), (r"\le", (-1, 0)), (r"\ge", (0, 1)), ("<", (-1,)), (r"\ne", (-1, 1)))
    )
    return Case("zeros", f"{term.tex} {relation} 0", None if sign is None else sign in holds)


def branches(rng: random.Random) -> Case:
    """Roots and inverse functions of what they invert, on either branch."""
    place = number(rng.choice((str(rng.randint(1, 9)), f"0.{rng.randint(1, 9)}")))
    inner = number("0") - place if rng.random() < 0.5 else place
    term = rng.choice(
        (
            root(inner**2),
            size(inner),
            call("arcsin", call("sin", inner)),
            call("arccos", call("cos", inner)),
            call("arctan", call("tan", inner)),
            call("ln", call("exp", inner)),
            call("exp", call("ln", inner)),
            root(inner) ** 2,
        )
    )
    stated_number = rng.choice((inner, place, inner + power_of_ten(-rng.randint(5, 30))))
    sign = compare(term.value, stated_number.value)
    return Case(
        "branches", f"{term.tex} = {stated_number.tex}", None if sign is None else sign == 0
    )


def orders(rng: random.Random) -> Case:
    """Inequalities of numbers that are as good as the same, or not."""
    left = random_term(rng, 2)
    value = evaluate(left.value)
    if value is None or not 1e-6 < abs(value) < 1e12:
        return Case("orders", f"{left.tex} < {left.tex}", None if value is None else False)
    digits = mpmath.nstr(value, rng.randint(2, 40), min_fixed=-99, max_fixed=99)
    relation, holds = rng.choice(
        (("<", (-1,)), (">", (1,)), (r"\le", (-1, 0)), (r"\ge", (0, 1)), (r"\ne", (-1, 1)))
    )
    sign = compare(left.value, sympy.Rational(digits))
    return Case("orders", f"{left.tex} {relation} {digits}", sign in holds)


KINDS = (fractions, rounded, edges, cancellation, zeros, branches, orders)
