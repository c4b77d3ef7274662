r"""Hold the arithmetic of formulas against SymPy, on equalities and identities that nobody wrote.

Run: python benchmarks/equalities.py [--count 10000] [--seed 1]

Formulas are made by kinds, half of them false: sums that cancel, zeros and poles, roots and inverse
functions on either branch, results that are off by one in their last digit or less, identities that
hold on one side only. Each is written in TeX and, independently of our reader, as an expression of
SymPy, which says at 60 digits whether it is true. A verdict of `coursebuild` is false if SymPy says
otherwise; where it says "not computed", nothing is decided. What has no value is not to be judged.
"""

from __future__ import annotations

import argparse
import random
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from decimal import ROUND_HALF_EVEN, Decimal, localcontext
from pathlib import Path
from typing import NamedTuple

import mpmath
import sympy

sys.path[:0] = [str(Path(__file__).resolve().parents[1])]

from coursebuild.features.arithmetic.chains import check_arithmetic  # noqa: E402
from coursebuild.features.arithmetic.identities import check_identity, read_domain  # noqa: E402

DIGITS = 60
mpmath.mp.dps = DIGITS
EQUAL = mpmath.mpf(10) ** -45
NOTHING = mpmath.mpf(10) ** -400
"""What SymPy, which adds digits up to 2000 until 60 are right, leaves of zero is less."""
X, Y = sympy.symbols("x y", real=True)


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
    """A formula, and whether it is true; `None` if it has no value."""

    kind: str
    tex: str
    truth: bool | None
    domain: str | None = None
    """Of an identity."""


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


# --- kinds of equalities between numbers


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


# --- identities


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


KINDS = (fractions, rounded, edges, cancellation, zeros, branches, orders, identities)


def make_cases(count: int, seed: int) -> Iterator[Case]:
    """Make formulas, as many of each kind."""
    rng = random.Random(seed)
    for number in range(count):
        yield KINDS[number % len(KINDS)](rng)


def judge(case: Case) -> bool | None:
    """Whether the tool holds a formula to be true; `None` if it does not tell."""
    if case.domain is None:
        kinds = {comparison.kind for comparison in check_arithmetic(case.tex)}
    else:
        comparisons = check_identity(case.tex, {"x": (), "y": ()}, read_domain(case.domain))
        kinds = {comparison.kind for comparison in comparisons} or {"holds"}
    if "wrong" in kinds:
        return False
    return True if kinds == {"holds"} else None


def main() -> None:
    """Print false verdicts, and how much is decided, by kind."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--count", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    counts: dict[str, Counter[str]] = {kind.__name__: Counter() for kind in KINDS}
    seconds: Counter[str] = Counter()
    for case in make_cases(options.count, options.seed):
        start = time.perf_counter()
        verdict = judge(case)
        seconds[case.kind] += time.perf_counter() - start
        row = counts[case.kind]
        row["all"] += 1
        row[str(case.truth)] += 1
        row["decided"] += verdict is not None
        if verdict is not None and verdict is not case.truth:
            row["false"] += 1
            print(f"false verdict: {verdict}, SymPy: {case.truth}: {case.tex}  {case.domain or ''}")
    titles = ("kind", "all", "true", "false", "no value", "decided", "wrong", "ms")
    print("{:<14}{:>7}{:>7}{:>7}{:>10}{:>9}{:>7}{:>8}".format(*titles))
    for kind, row in (*counts.items(), ("all", sum(counts.values(), Counter()))):
        time_spent = seconds[kind] if kind != "all" else seconds.total()
        share = f"{100 * row['decided'] / max(row['all'] - row['None'], 1):.1f} %"
        print(
            f"{kind:<14}{row['all']:>7}{row['True']:>7}{row['False']:>7}{row['None']:>10}{share:>9}"
            f"{row['false']:>7}{1000 * time_spent / max(row['all'], 1):>8.2f}"
        )


if __name__ == "__main__":
    main()
