r"""Equalities as they are written: units, percent, commas, chains, remainders.

What writers mean by some of these is not certain. Such a formula has no truth, so that any verdict
on it is false: `9.81(2)` is a product or a number with its uncertainty, `2\tfrac12` a half of two
or more than it, and `100 + 10\%` has at least two values.
"""

from __future__ import annotations

import math
import random
from decimal import ROUND_HALF_EVEN, Decimal
from fractions import Fraction

import mpmath
import sympy

from benchmarks.formulas.terms import DIGITS, Case, compare, evaluate

LENGTHS = {
    "mm": Fraction(1, 1000),
    "cm": Fraction(1, 100),
    "km": Fraction(1000),
    r"\mu m": Fraction(1, 10**6),
    "in": Fraction(254, 10**4),
    "ft": Fraction(3048, 10**4),
    "m": Fraction(1),
}
TIMES = {"ms": Fraction(1, 1000), "s": Fraction(1), "min": Fraction(60), "h": Fraction(3600)}
MASSES = {"g": Fraction(1, 1000), "kg": Fraction(1), "mg": Fraction(1, 10**6)}
FORCES = {"N": Fraction(1), "kN": Fraction(1000), r"kg\,m/s^2": Fraction(1)}
QUANTITIES = (LENGTHS, TIMES, MASSES, FORCES)
OFF = (0, 0, 1, -1)


def decimal(rng: random.Random, places: int = 2) -> Decimal:
    """A positive number with so many decimals."""
    return Decimal(rng.randint(1, 10 ** (places + 2))).scaleb(-places)


def exact(number: Decimal) -> sympy.Rational:
    return sympy.Rational(str(number))


def state(rng: random.Random, value: sympy.Expr, places: int) -> tuple[str, bool]:
    """A number rounded to so many decimals, or off by one there; whether it is right."""
    step = Decimal(1).scaleb(-places)
    number = evaluate(value)
    assert number is not None
    result = Decimal(
        mpmath.nstr(number, DIGITS - 5, strip_zeros=False, min_fixed=-99, max_fixed=99)
    )
    result = result.quantize(step, ROUND_HALF_EVEN) + rng.choice(OFF) * step
    is_right = compare(sympy.Abs(exact(result) - value) * 2, exact(step)) in (-1, 0)
    return f"{result:f}", is_right


def units(rng: random.Random) -> Case:
    """Lengths, times, masses or forces in another unit, or in one that does not fit."""
    table = rng.choice(QUANTITIES)
    (name, size), (target, target_size) = rng.choice([*table.items()]), rng.choice([*table.items()])
    factor, number = rng.randint(2, 9), decimal(rng)
    ratio = size / target_size
    value = factor * exact(number) * sympy.Rational(ratio.numerator, ratio.denominator)
    text, is_right = state(rng, value, rng.randint(1, 4))
    if rng.random() < 0.2:
        target, is_right = rng.choice(("A", "mol", "K")), False
    tex = rf"{factor}\cdot{number:f}\ \mathrm{{{name}}} = {text}\ \mathrm{{{target}}}"
    return Case("units", tex, is_right)


def rates(rng: random.Random) -> Case:
    """Speeds, energies, scales, and cycles beside angles, which are wrong only in one reading."""
    a, b = rng.randint(2, 90), rng.randint(2, 9)
    speed, is_speed = state(rng, sympy.Rational(a, b) / sympy.Rational(36, 10), 2)
    energy, is_energy = state(rng, sympy.Rational(a * b, 1000), 3)
    kelvin, is_kelvin = state(rng, a + sympy.Rational("273.15"), 2)
    turns, is_turns = state(rng, sympy.Integer(a) * 2 * sympy.pi, 1)
    target = rng.choice((a, a + 1))
    tex, truth = rng.choice(
        (
            (
                rf"\frac{{{a}\ \mathrm{{km}}}}{{{b}\ \mathrm h}} = {speed}\ \mathrm{{m/s}}",
                is_speed,
            ),
            (
                rf"{a}\ \mathrm N\cdot{b}\ \mathrm m = {energy}\ \mathrm{{kJ}}",
                is_energy,
            ),
            (rf"{a}^\circ\mathrm C = {kelvin}\ \mathrm K", is_kelvin),
            (rf"{a}\ \mathrm{{Hz}} = {turns}\ \mathrm{{rad/s}}", is_turns or None),
            (rf"{a * 60}\ \mathrm{{rpm}} = {target}\ \mathrm{{Hz}}", a == target),
            (rf"{a}\ \mathrm m\ {b}\ \mathrm{{cm}} = {a * 100 + b}\ \mathrm{{cm}}", None),
            (rf"{a * b}\,\mathrm W\,\mathrm h = {target * b * 3600}\,\mathrm J", a == target),
            (rf"{a}\,\mathrm N + {b}\,\mathrm m = {a + b}", False),
        )
    )
    return Case("rates", tex, truth)


def percents(rng: random.Random) -> Case:
    """Percent of a number, of a quotient, and added to a number, which says two things."""
    rate, whole = decimal(rng, 1), rng.randint(2, 400)
    share, is_share = state(rng, exact(rate) / 100, 3)
    part, is_part = state(rng, exact(rate) * whole / 100, 2)
    quotient, is_quotient = state(rng, sympy.Rational(100 * 7, whole), 1)
    total = Decimal(whole) * (1 + rate / 100)
    unit = rng.choice(("", r"\ \mathrm{kg}"))
    tex, truth = rng.choice(
        (
            (rf"{rate}\% = {share}", is_share),
            (rf"{rate}\%\cdot{whole}{unit} = {part}{unit}", is_part),
            (rf"\frac{{7}}{{{whole}}} \approx {quotient}\%", is_quotient),
            (rf"{whole}{unit} + {rate}\% = {total:f}{unit}", None),
            (rf"{whole} - {rate}\% = {Decimal(whole) * (1 - rate / 100):f}", None),
            (rf"{rate}\% + {rate}\% = {rng.choice((2, 3)) * rate}\%", "choose"),
        )
    )
    if truth == "choose":
        truth = tex.endswith(rf"= {2 * rate}\%")
    return Case("percents", tex, truth)


def uncertainties(rng: random.Random) -> Case:
    r"""Numbers with a digit in brackets, with `\pm`, and mixed numbers: all may be meant twice."""
    number, digit = decimal(rng), rng.randint(2, 9)
    numerator, whole = rng.randint(1, digit - 1), rng.randint(1, 20)
    minus = rng.choice(("", "-"))
    command = rng.choice((r"\frac", r"\tfrac", r"\dfrac"))
    fraction = rf"{command}{{{numerator}}}{{{digit}}}"
    sides = rng.choice(
        (
            (f"{number}({digit})", number, number * digit),
            (f"{number}({digit})\\ \\mathrm m", f"{number} \\mathrm m", number * digit),
            (f"{number}({digit})\\cdot10^{{3}}", number * 1000, number * digit * 1000),
            (rf"{number} \pm {digit}", number + digit, number - digit),
            (rf"2\cdot({number} \pm {digit})", rf"{2 * number} \pm {2 * digit}", 2 * number),
            (rf"{minus}{whole}{fraction}", Decimal(whole) * numerator, f"{whole}.5"),
            (rf"{minus}{whole}\,{fraction}\ \mathrm m", f"{whole}.5\\ \\mathrm m", whole),
            (rf"\sqrt{{{digit**2}}}", rf"\pm{digit}", rf"\pm {digit + 1}"),
        )
    )
    order = sides[0], rng.choice(sides[1:])
    return Case("uncertainties", " = ".join(map(str, rng.sample(order, 2))), None)


def commas(rng: random.Random) -> Case:
    """Decimal commas, with points or commas for thousands, in languages with either."""
    comma = rng.random() < 0.6
    places = rng.choice((1, 2, 3, 4))
    first, second = decimal(rng, places), decimal(rng, places)
    if comma and rng.random() < 0.3:  # 1.000 + 500 = 1.500
        counts = [rng.randint(1000, 9000), rng.randint(100, 900)]
        counts.append(sum(counts) + rng.choice((0, 100)))
        tex = "{} + {} = {}".format(*(f"{n:,}".replace(",", ".") for n in counts))
        return Case("commas", tex, sum(counts[:2]) == counts[2], comma=True)
    off = rng.choice((0, 1)) * Decimal(1).scaleb(-places)
    total = first + second + off
    sign = "{,}" if not comma or rng.random() < 0.5 else ","
    texts = [f"{number:f}".replace(".", sign) for number in (first, second, total)]
    return Case("commas", f"{texts[0]} + {texts[1]} = {texts[2]}", off == 0, comma=comma)


def chains(rng: random.Random) -> Case:
    """Several relations in a row, of which one may be wrong."""
    first, second = decimal(rng), decimal(rng)
    factor = rng.randint(2, 9)
    value = exact(first) * exact(second) + factor
    rounded, is_right = state(rng, value, 1)
    full = first * second + factor
    stated_number = full + rng.choice((0, 0, 0, Decimal("0.01")))
    is_right &= abs(Decimal(rounded) - stated_number) * 2 <= Decimal("0.1")
    links = rng.choice(
        (
            rf"{first}\cdot{second} + {factor} = {stated_number:f} \approx {rounded}",
            rf"{factor} + {first}\cdot{second} = {stated_number:f} \approx {rounded} < {full + 9}",
            rf"\begin{{aligned}} {first}\cdot{second} + {factor} &= {stated_number:f} \\"
            rf" &\approx {rounded} \end{{aligned}}",
        )
    )
    return Case("chains", links, is_right and stated_number == full)


def remainders(rng: random.Random) -> Case:
    """Equalities up to multiples of a number, in the ways that this is written."""
    modulus, rest, times = rng.randint(3, 30), rng.randint(0, 2), rng.randint(1, 9)
    first = rng.randint(1, 40)
    second = modulus * times + rest - first
    stated_number = rest + rng.choice((0, 0, 1))
    pattern = rng.choice(
        (
            r"{} + {} \equiv {} \pmod{{{}}}",
            r"{} + {} = {} \pmod{{{}}}",
            r"{} + {} = {} \quad(\mathrm{{mod}}\ {})",
            r"{} + {} = {} \qquad (\text{{mod }} {})",
            r"{} + {} = {}\;(\bmod\;{})",
            r"{} + {} = {}\ (\operatorname{{mod}} {})",
            r"{} + {} = {} \mod {}",
            r"{} + {} = {},\quad \text{{modulo }} {}",
            r"({} + {}) \bmod {3} = {2}",
        )
    )
    if "{2}" in pattern:
        tex = rf"({first} + {second}) \bmod {modulus} = {stated_number}"
    else:
        tex = pattern.format(first, second, stated_number, modulus)
    return Case("remainders", tex, stated_number == rest)


def doubtful(rng: random.Random) -> Case:
    """What is typeset in another way than it is typed, or read in two ways."""
    a, b, c = (rng.randint(2, 9) for _ in range(3))
    tex, truth = rng.choice(
        (
            (rf"{a * b}/{b}({c}) = {a * c}", None),
            (rf"{a}/{b}\cdot{c} = {Fraction(a, b * c)}", None),
            (rf"{a * b} \div {b}({c} + 1) = {a * (c + 1)}", None),
            (r"\frac13 = 0.\overline{3}", True),
            (r"\frac13 = 0.\bar3", True),
            (r"1 = 0.999\ldots", True),
            (rf"\sqrt{a**2}{b} = {a * b}", None),
            (r"1010_2 = 10", True),
            (r"(1010)_2 + 1 = 11", True),
            (r"1010 = 10", None),
            (rf"{a} - -{b} = {a + b}", True),
            (rf"||{a}| - |{b}|| = {abs(a - b)}", True),
            (rf"|-{a}|{b}|-{c}| = {a * b * c}", None),
            (rf"\lfloor {a}.5 \rfloor = {a}", True),
            (rf"\gcd({a * c}, {b * c}) = {math.gcd(a, b) * c}", True),
            (rf"\max({a}, {b}) = {max(a, b)}", True),
            (rf"{a * b + 1}/{b} = {(a * b + 1) // b}", None),
            (rf"{a}\text{{:}}{b} = {Fraction(a, b)}", None),
            (rf"\sin {a}\pi/{b} = 0", None),
            (rf"\sin {a}\cdot{b} = 0", None),
            (rf"{a}\,{b} = {a * b}", None),
            (rf"{a}\ {b} = {a * b}", None),
            (rf"({a}\,{b})({c}\,{a}) = ({b}\,{c})", None),
            (rf"{a}^{{\circ}}{b} = {a * b}", None),
            (rf"{a}\mathrm{{h}}({b}) = {a * b}", None),
            (rf"{a}\,\mathrm{{C}}_{b} = {math.comb(a, min(a, b))}", None),
            (rf"{{}}_{a}\mathrm C_{b} = {math.comb(a, min(a, b))}", None),
            (rf"f({a}) = {b}", None),
            (rf"{a} + {b} = {a + b + 1} \quad\text{{is false}}", None),
            (rf"\text{{In }}\mathbb F_2:\quad {a} + {b} = {(a + b) % 2}", None),
        )
    )
    return Case("doubtful", tex, truth)


KINDS = (units, rates, percents, uncertainties, commas, chains, remainders, doubtful)
