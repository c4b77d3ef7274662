r"""Equalities of matrices, sums, integrals, logarithms, angles, complex and extreme numbers."""

from __future__ import annotations

import math
import random
from decimal import Decimal

import sympy

from benchmarks.formulas.notations import state
from benchmarks.formulas.terms import Case


def arrays(rng: random.Random) -> Case:
    """Determinants, products and lengths of vectors, and matrices that are the same."""
    a, b, c, d = (rng.randint(1, 9) for _ in range(4))
    off = rng.choice((0, 0, 1))
    determinant, product = a * d - b * c + off, a * c + b * d + off
    rows = rf"{a} & {b} \\ {c} & {d}"
    tex = rng.choice(
        (
            rf"\begin{{vmatrix}} {rows} \end{{vmatrix}} = {determinant}",
            rf"\det\begin{{pmatrix}} {rows} \end{{pmatrix}} = {determinant}",
            rf"\left|\begin{{array}}{{cc}} {rows} \end{{array}}\right| = {determinant}",
            rf"({a}, {b})\cdot({c}, {d}) = {product}",
            rf"({a}; {b})\cdot({c}; {d}) = {product}",
            rf"[{a}, {b}]\,[{c}, {d}]^\top = {product}",
            rf"\begin{{bmatrix}} {a} & {b} \end{{bmatrix}}"
            rf"\begin{{bmatrix}} {c} \\ {d} \end{{bmatrix}} = {product}",
            rf"\langle({a}, {b}), ({c}, {d})\rangle = {product}",
            rf"\lVert({3 * a}, {4 * a})\rVert = {5 * a + off}",
            rf"\|({3 * a}, {4 * a})\| = {5 * a + off}",
            rf"|({3 * a}, {4 * a})| = {5 * a + off}",
            rf"2\,({a}, {b}) = ({2 * a}, {2 * b + off})",
            rf"({a}\ {b})\,({c}\ {d})^T = {product}",
        )
    )
    return Case("arrays", tex, off == 0)


def series(rng: random.Random) -> Case:
    """Sums and products; of a product, a factor that follows may be in it or behind it."""
    k = sympy.Symbol("k")
    first, last = rng.randint(1, 4), rng.randint(4, 9)
    tex, term = rng.choice(
        (
            ("k", k),
            ("k^2", k**2),
            ("2k", 2 * k),
            (r"\frac{1}{k}", 1 / k),
            ("2^k", 2**k),
            ("k!", sympy.factorial(k)),
            (r"\frac{1}{k(k + 1)}", 1 / (k * (k + 1))),
            ("(-1)^k k", (-1) ** k * k),
            (r"\left(1 + \frac{1}{k}\right)", 1 + 1 / k),
        )
    )
    name, operation = rng.choice(((r"\sum", sympy.summation), (r"\prod", sympy.product)))
    value = operation(term, (k, first, last))
    tex = rf"{name}_{{k={first}}}^{{{last}}} {tex}"
    is_certain = True
    if rng.random() < 0.2:
        sign, number = rng.choice((r"\cdot", "/", r"\times")), rng.randint(2, 9)
        value = value / number if sign == "/" else value * number
        tex, is_certain = f"{tex} {sign} {number}", name == r"\sum"
    stated_number = value + rng.choice((0, 0, sympy.Rational(1, 10)))
    truth = stated_number == value if is_certain else None
    result = rf"\frac{{{abs(stated_number.p)}}}{{{stated_number.q}}}"
    return Case("series", f"{tex} = {'-' if stated_number < 0 else ''}{result}", truth)


def integrals(rng: random.Random) -> Case:
    """Integrals from zero to a symbol, tried as identities."""
    power, factor = rng.randint(1, 4), rng.randint(2, 5)
    off = rng.choice(("", "", r" + 10^{-9}\,x^2"))
    tex, truth = rng.choice(
        (
            (rf"\int_0^x t^{power}\,\mathrm dt = \frac{{x^{power + 1}}}{{{power + 1}}}", True),
            (
                rf"\int_0^x \sin({factor}t)\,\mathrm dt = \frac{{1 - \cos({factor}x)}}{{{factor}}}",
                True,
            ),
            (rf"\int_{{-x}}^x t^{2 * power - 1}\,\mathrm dt = 0", True),
            (
                rf"\int_0^x \exp({factor}t)\,\mathrm dt = \frac{{\exp({factor}x)}}{{{factor}}}",
                False,
            ),
            (r"\int_0^x \frac{1}{t}\,\mathrm dt = \ln(x)", None),
        )
    )
    truth = truth and not off
    return Case("integrals", tex + off, truth, domain="0 < x < 3")


def logarithms(rng: random.Random) -> Case:
    r"""Logarithms whose base is said, is not, or is that of `\ln`."""
    base, power = rng.randint(2, 9), rng.randint(2, 9)
    off = rng.choice((0, 0, 1))
    tex, truth = rng.choice(
        (
            (rf"\log_{{{base}}} {base**power} = {power + off}", off == 0),
            (rf"\log_{base}({base**power}) = {power + off}", off == 0),
            (rf"\lg {10**power} = {power + off}", off == 0),
            (rf"\log {10**power} = {power}", None),
            (rf"\log_{{10}} 10^{{-{power}}} = -{power + off}", off == 0),
            (rf"\frac{{\ln {base**power}}}{{\ln {base}}} = {power + off}", off == 0),
            (rf"\ln({base}^{{{power}}}) = {power}\ln({base + off})", off == 0),
            (rf"\ln {base} + \ln {power} = \ln {base * power + off}", off == 0),
            (rf"\ln {base}^{power} = {power}\ln {base}", None if off else True),
            (rf"\ln(-{base}) = \ln {base}", None),
            (rf"\exp(\ln {base}) = {base + off}", off == 0),
        )
    )
    return Case("logarithms", tex, truth)


def angles(rng: random.Random) -> Case:
    """Degrees, with minutes, in functions and from inverse ones."""
    name = rng.choice(("sin", "cos", "tan"))
    degrees = rng.choice((rng.randint(1, 89), 30, 45, 60))
    angle = sympy.pi * degrees / 180
    value, is_value = state(rng, getattr(sympy, name)(angle), rng.randint(2, 9))
    radians, is_radians = state(rng, angle, 4)
    off = rng.choice((0, 0, 1))
    sign = rng.choice((r"^\circ", r"^{\circ}", "°"))
    tex, truth = rng.choice(
        (
            (rf"\{name} {degrees}{sign} \approx {value}", is_value),
            (rf"\{name}({degrees}{sign}) = {value}", is_value),
            (rf"{degrees}{sign} = {radians}\ \mathrm{{rad}}", is_radians),
            (
                rf"{degrees + off}{sign} = \frac{{{degrees}\pi}}{{180}}",
                off == 0,
            ),
            (rf"\arcsin\frac12 = {30 + off}{sign}", off == 0),
            (rf"\arctan 1 = {45 + off}{sign}", off == 0),
            (rf"\sin^{{-1}}(0.5) = {30 + off}{sign}", off == 0),
            (rf"\tan^{{-1}} 1 = {45 + off}{sign}", off == 0),
            (rf"\sin^2 {degrees}{sign} + \cos^2 {degrees + off}{sign} = 1", off == 0),
            (rf"{degrees}{sign}\,30' = {degrees + off}.5{sign}", off == 0),
            (rf"{degrees}{sign} + {degrees}{sign} = {2 * degrees + off}{sign}", off == 0),
            (
                rf"\sin\left({degrees}{sign} + {off}{sign}\right) = \cos {90 - degrees}{sign}",
                off == 0,
            ),
        )
    )
    return Case("angles", tex, truth)


def counts(rng: random.Random) -> Case:
    """Factorials and binomials, also of factorials, and double ones."""
    n = rng.randint(3, 12)
    k = rng.randint(1, n - 1)
    off = rng.choice((0, 0, 1))
    f = math.factorial
    tex = rng.choice(
        (
            rf"{n}! = {f(n) + off}",
            rf"\frac{{{n}!}}{{{k}!\,{n - k}!}} = \binom{{{n}}}{{{k}}} + {off}",
            rf"\binom{{{n}}}{{{k}}} = {math.comb(n, k) + off}",
            rf"{{{n} \choose {k}}} = {math.comb(n, k) + off}",
            rf"{n}!! = {math.prod(range(n, 0, -2)) + off}",
            rf"(3!)! = {720 + off}",
            rf"3!! = {3 + off}",
            rf"-{n}! = -{f(n) + off}",
            rf"{n}!/{k}! = {f(n) // f(k) + off}",
            rf"2^{{{3}!}} = {64 + off}",
            rf"2\cdot{n}! = {2 * f(n) + off}",
            rf"{n}!^2 = {f(n) ** 2 + off}",
            rf"\frac1{{{n}!}} = \frac1{{{f(n) + off}}}",
        )
    )
    return Case("counts", tex, off == 0)


def complexes(rng: random.Random) -> Case:
    """Complex numbers, and real roots of negative ones."""
    a, b, c, d = (rng.randint(1, 9) for _ in range(4))
    off = rng.choice((0, 0, 1))
    i = rng.choice(("i", r"\mathrm i", r"\mathrm{i}", r"\mathrm j", "j", r"\imath"))
    tex = rng.choice(
        (
            rf"{i}^2 = {-1 - off}",
            rf"|{3 * a} + {4 * a}{i}| = {5 * a + off}",
            rf"({a} + {b}{i})({c} + {d}{i}) = {a * c - b * d + off} + {a * d + b * c}{i}",
            rf"({a} + {b}{i})({a} - {b}{i}) = {a**2 + b**2 + off}",
            rf"\sqrt{{-{a**2}}} = {a + off}{i}",
            rf"\sqrt{{-{a**2}}}\,\sqrt{{-{b**2}}} = -{a * b + off}",
            rf"\mathrm e^{{{i}\pi}} = {-1 - off}",
            rf"e^{{{i}\pi}} + 1 = {off}",
            rf"{a}{i}\cdot{b}{i} = -{a * b + off}",
            rf"{a}\,{i}\cdot{b}\,{i} = -{a * b + off}",
            rf"\sqrt[3]{{-{a**3}}} = -{a + off}",
            rf"(-{a**3})^{{1/3}} = -{a + off}",
            rf"\operatorname{{Re}}({a} + {b}{i}) = {a + off}",
            rf"\ln(-1) = {1 + off}\,{i}\pi" if off else rf"\ln(-1) = {i}\pi",
        )
    )
    return Case("complexes", tex, off == 0)


def cuts(rng: random.Random) -> Case:
    """Inverse and hyperbolic functions at the ends of where they are real, and beside them."""
    near = rf"10^{{-{rng.randint(5, 70)}}}"
    a = rng.randint(1, 40)
    tex, truth = rng.choice(
        (
            (rf"\arcsin(1 - {near}) = \frac{{\pi}}{{2}}", False),
            (rf"\arcsin(1 + {near}) = \frac{{\pi}}{{2}}", None),
            (rf"\arccos(-1 + {near}) < \pi", True),
            (rf"\arccos(-1 - {near}) = \pi", None),
            (r"\arccos(-1) = \pi", True),
            (rf"\sqrt{{{near} - {near}}} = 0", True),
            (rf"\sqrt{{-{near}}} = 0", None),
            (rf"\ln(1 + {near}) > 0", True),
            (rf"\ln(1 + {near}) = {near}", False),
            (rf"\ln({near} - {near}) = 0", None),
            (rf"\tanh({a}) = 1", False),
            (rf"\tanh({a + 20}) \approx 1.000", True),
            (rf"\cosh({a})^2 - \sinh({a})^2 = 1", True),
            (rf"\cosh({a}) = \sinh({a})", False),
            (rf"\sinh({a}) + \cosh({a}) = \exp({a})", True),
            (rf"\arctan({near}) < {near}", True),
            (rf"\arctan(10^{{{a}}}) = \frac{{\pi}}{{2}}", False),
            (rf"\operatorname{{arsinh}}(\sinh({a})) = {a}", True),
            (rf"|\!-{a}| = {a}", True),
            (rf"0^0 = {a}", None),
            (rf"\frac{{1}}{{{near} - {near}}} = {a}", None),
        )
    )
    return Case("cuts", tex, truth)


def extremes(rng: random.Random) -> Case:
    """Huge and tiny exponents, towers, signs before powers, and powers without their braces."""
    a, b = rng.randint(20, 4000), rng.randint(20, 4000)
    off = rng.choice((0, 0, 1))
    small = rng.randint(2, 9)
    tex, truth = rng.choice(
        (
            (rf"10^{{{a}}}\cdot10^{{-{b}}} = 10^{{{a - b + off}}}", off == 0),
            (rf"\frac{{2^{{{a}}}}}{{2^{{{b}}}}} = 2^{{{a - b + off}}}", off == 0),
            (rf"\mathrm e^{{-{a}}} = 0", False),
            (rf"\mathrm e^{{-{a}}} \approx 0.00", True),
            (rf"10^{{-{a}}} > 0", True),
            (rf"(1 + 10^{{-{a}}})^2 = 1 + 2\cdot10^{{-{a}}}", False),
            (rf"(1 + 10^{{-{a}}})^2 > 1 + 2\cdot10^{{-{a}}}", True),
            (rf"2^{{3^{small}}} = 2^{{{3**small + off}}}", off == 0),
            (rf"-{small}^2 = {small**2 if off else -(small**2)}", off == 0),
            (rf"(-{small})^2 = {-(small**2) if off else small**2}", off == 0),
            (rf"(-1)^{{{a}}} = {1 if (a + off) % 2 == 0 else -1}", off == 0),
            (rf"10^{small}{small} = {10 ** (11 * small)}", None),
            (rf"10^-{small} = {Decimal(10) ** -small:f}", None),
            (rf"{small}e{small} = {small * 10**small}", None),
            (rf"10^{{{a}}} + 1 = 10^{{{a}}}", False),
            (rf"10^{{{a}}} \approx 1\cdot10^{{{a + off}}}", off == 0),
            (rf"\sqrt{{10^{{{2 * a}}}}} = 10^{{{a + off}}}", off == 0),
            (rf"2^{{{small}\cdot{small}}} = (2^{small})^{small}", True),
        )
    )
    return Case("extremes", tex, truth)


KINDS = (
    *(arrays, series, integrals, logarithms),
    *(angles, counts, complexes, cuts, extremes),
)
