"""Identities between symbols, on domains where they hold or do not."""

from __future__ import annotations

import random
from collections.abc import Callable
from typing import NamedTuple

import mpmath
import sympy

from benchmarks.formulas.terms import DIGITS, EQUAL, Case

X, Y = sympy.symbols("x y", real=True)


class Identity(NamedTuple):
    """Two sides in TeX and for SymPy, and the domain in which they are the same."""

    left: str
    right: str
    values: tuple[str, str]
    domain: str = ""


IDENTITIES = (
    Identity(r"\sin 2x", r"2\sin x\,\cos x", ("sin(2*x)", "2*sin(x)*cos(x)")),
    Identity(r"\cos(x)^2 + \sin(x)^2", "1", ("cos(x)**2 + sin(x)**2", "1")),
    Identity(
        r"\cos(x + y)",
        r"\cos x\cos y - \sin x\sin y",
        ("cos(x + y)", "cos(x)*cos(y) - sin(x)*sin(y)"),
    ),
    Identity(r"\mathrm e^{x + y}", r"\mathrm e^x\,\mathrm e^y", ("exp(x + y)", "exp(x)*exp(y)")),
    Identity("(x + y)^2", "x^2 + 2x y + y^2", ("(x + y)**2", "x**2 + 2*x*y + y**2")),
    Identity(r"\frac{x^2 - y^2}{x - y}", "x + y", ("(x**2 - y**2)/(x - y)", "x + y")),
    Identity(r"\sqrt{x^2}", "|x|", ("sqrt(x**2)", "Abs(x)")),
    Identity(r"\sqrt{x^2}", "x", ("sqrt(x**2)", "x"), r"x \ge 0"),
    Identity("|x|", "-x", ("Abs(x)", "-x"), r"x \le 0"),
    Identity(r"\ln(x^2)", r"2\ln(x)", ("log(x**2)", "2*log(x)"), "x > 0"),
    Identity(
        r"\sqrt{x}\,\sqrt{y}", r"\sqrt{x y}", ("sqrt(x)*sqrt(y)", "sqrt(x*y)"), "x > 0, y > 0"
    ),
    Identity(r"\arcsin(\sin(x))", "x", ("asin(sin(x))", "x"), "-1.5 < x < 1.5"),
    Identity(
        r"\arctan(\frac{1}{x})",
        r"\frac{\pi}{2} - \arctan(x)",
        ("atan(1/x)", "pi/2 - atan(x)"),
        "x > 0",
    ),
    Identity(r"\cosh(x)^2 - \sinh(x)^2", "1", ("cosh(x)**2 - sinh(x)**2", "1")),
    Identity(
        r"\frac{\mathrm d}{\mathrm dx}\,\bigl(x^2\sin(x)\bigr)",
        r"2x\sin(x) + x^2\cos(x)",
        ("diff(x**2*sin(x), x)", "2*x*sin(x) + x**2*cos(x)"),
    ),
    Identity(
        r"\frac{\mathrm d}{\mathrm dx}\,\arctan(x)",
        r"\frac{1}{1 + x^2}",
        ("diff(atan(x), x)", "1/(1 + x**2)"),
    ),
    Identity(r"(x^2)^{1/2}\,|y|", "|x y|", ("sqrt(x**2)*Abs(y)", "Abs(x*y)")),
)
SLIPS: tuple[tuple[str, Callable[[sympy.Expr], sympy.Expr]], ...] = (
    (r"{} + 10^{{-15}}", lambda v: v + sympy.Rational(10) ** -15),
    (r"{} + 10^{{-30}}\,x^2", lambda v: v + sympy.Rational(10) ** -30 * X**2),
    (r"-\left({}\right)", lambda v: -v),
    (r"2\cdot\left({}\right)", lambda v: 2 * v),
    (r"\left|{}\right|", sympy.Abs),
    (r"{} + \sin(x)^{{20}}", lambda v: v + sympy.sin(X) ** 20),
    (r"{} + \frac{{|x| - x}}{{2}}", lambda v: v + (sympy.Abs(X) - X) / 2),
)


def identities(rng: random.Random) -> Case:
    """An identity, or one with a slip, in its domain or where it may not hold."""
    identity = rng.choice(IDENTITIES)
    left_value, value = (sympy.sympify(side, {"x": X, "y": Y}) for side in identity.values)
    right = identity.right
    domain = identity.domain
    factor = rng.choice(("1", str(rng.randint(2, 9)), f"0.{rng.randint(1, 9)}"))
    if rng.random() < 0.4:
        pattern, change = rng.choice(SLIPS)
        right, value = pattern.format(right), change(value)
    if rng.random() < 0.3:
        domain = rng.choice(("", "x > 0", "x < 0", "0 < x < 1", "x > 1, y < 0", "y > x"))
    tex = rf"{factor}\cdot\left({identity.left}\right) = {factor}\cdot\left({right}\right)"
    return Case("identities", tex, holds_in(left_value, value, domain), domain)


CONDITIONS: dict[str, Callable[[float, float], bool]] = {
    "": lambda x, y: True,
    "x > 0": lambda x, y: x > 0,
    "x < 0": lambda x, y: x < 0,
    r"x \ge 0": lambda x, y: x >= 0,
    r"x \le 0": lambda x, y: x <= 0,
    "0 < x < 1": lambda x, y: 0 < x < 1,
    "-1.5 < x < 1.5": lambda x, y: -1.5 < x < 1.5,
    "x > 0, y > 0": lambda x, y: x > 0 and y > 0,
    "x > 1, y < 0": lambda x, y: x > 1 and y < 0,
    "y > x": lambda x, y: y > x,
}
SIZES = (0.0, 1e-6, 0.07, 0.31, 0.77, 1.21, 1.93, 3.3, 25.0)
GRID = [sign * size for size in SIZES for sign in (1, -1)]


def real(name: str) -> Callable[[mpmath.mpf], mpmath.mpf]:
    """A function of mpmath, of which complex values are none."""

    def function(place: mpmath.mpf) -> mpmath.mpf:
        value = getattr(mpmath, name)(place)
        if mpmath.im(value):
            raise ValueError
        return value

    return function


REAL = {name: real(name) for name in ("sqrt", "log", "asin", "acos")}


def holds_in(left: sympy.Expr, right: sympy.Expr, domain: str) -> bool | None:
    """Whether two sides agree at all points of a grid at which both are numbers."""
    functions = [sympy.lambdify((X, Y), side, [REAL, "mpmath"]) for side in (left, right)]
    count = 0
    with mpmath.workdps(2 * DIGITS):
        for x in GRID:
            for y in (0.53, -1.7, 2.9):
                if not CONDITIONS[domain](x, y):
                    continue
                try:
                    sides = [f(mpmath.mpf(x), mpmath.mpf(y)) for f in functions]
                except (ZeroDivisionError, ValueError):
                    continue
                if not all(map(mpmath.isfinite, sides)):
                    continue
                count += 1
                if abs(sides[0] - sides[1]) > EQUAL * max(map(abs, (*sides, EQUAL))):
                    return False
    return True if count else None


KINDS = (identities,)
