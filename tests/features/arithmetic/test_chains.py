"""Arithmetic in formulas: correct numbers pass, a wrong digit is found, any text can be checked."""

from __future__ import annotations

from decimal import Decimal
from fractions import Fraction

from hypothesis import given, settings
from hypothesis import strategies as st

from coursebuild.core.text.units import find_unit
from coursebuild.features.arithmetic.chains import check_arithmetic
from coursebuild.features.arithmetic.evaluate import measure
from coursebuild.features.arithmetic.identities import check_identity
from coursebuild.features.arithmetic.real import Real
from coursebuild.features.arithmetic.symbol_comparison import SymbolQuantity

HOLDS = r"""
I_{zz} = \underbrace{0.0069333 + 2\cdot0.0014222}_{\text b} + 0.0070222 = 0.0168\ \mathrm{kg\,m^2}.
1\,000 + 2{,}500 = 3\,500
45^\circ = \pi/4
\left(1 + \tfrac12\right)^2 = 2.25
0.25 \approx 0.2
0.25 \approx 0.3
5\cdot9.81\ \mathrm N = 49\ \mathrm N, \quad 343 = \sqrt{1.4\cdot8.314\cdot293/0.029}
2^{53} = 9\,007\,199\,254\,740\,992
10\ \mathrm{mm}/2\ \mathrm{ms} = 5\ \mathrm{m/s}
\pi/\sqrt{40000\ \mathrm s^{-2}} = \pi/200\ \mathrm s = 15.7\ \mathrm{ms}
0.5/9.81\ \mathrm m = 5.1\ \mathrm{cm}
\begin{aligned} a &= 1 + 2 \\ &= 3 \end{aligned}
\mathrm e^{-2} \approx 0.135, \quad \sin^2 30^\circ = 0.25
-2^2 = -4
\sqrt[3]{8} = 2
\lvert -3\rvert = 3 < \pi < 4
\frac{6!}{2!\,4!} = \binom{6}{2} = \tbinom62 = 15, \quad -3!^2 = -36, \quad 0! = 1
\sum_{k=1}^{4} k^2 + 1 = 31, \quad \sum\limits_{i=1}^3\sum_{j=1}^i i\,j = 25
\sum_{n=0}^{10} \frac{1}{n!} \approx 2.7182818, \quad \prod_{i=1}^{5} i = 5!
2\times10^{-6} = 2\,\mathrm{ppm}, \quad 10^{-9} = 1\,\mathrm{ppb}
\sum_{i=1}^{3} 2^i\ \mathrm{m} = 14\ \mathrm m, \quad \sum_{i=3}^{2} i = 0
\qty{2}{\kilo\gram}\cdot\SI{3}{m/s^2} = \qty{6}{\newton}, \quad \num{12}\cdot\num{12} = 144
26! \approx 10^{26}, \quad 26^{25} \approx 10^{35}
"""
SILENT = r"""
e = 1
x \in [0, 1]
\ddot\theta = -\frac g\ell \sin\theta
\delta(0) = 0
\exp\tfrac12\boldsymbol\Omega = 1
\sum_i m_i = 3
\sum_{i=1}^{3} m_i = 3
\sum_{i=1}^\infty i^{-2} = \tfrac16\pi^2
"""
TOKENS = (
    r"0 1 2.5 , . + - * / ^ _ { } ( ) [ ] | = < & \\ \frac \sqrt \sin \pi \cdot \mathrm{kg} \int"
    r" \ell g m v \dot x t T \approx \omega_0 \mathrm{d}"
    r" ! \binom \sum_{m=1}^ \prod^2_"
).split()


def test_correct_arithmetic_passes_and_symbols_are_not_checked() -> None:
    failures = [
        (tex, comparisons)
        for texts, is_compared in ((HOLDS, True), (SILENT, False))
        for tex in texts.strip().splitlines()
        for comparisons in (check_arithmetic(tex),)
        if bool(comparisons) is not is_compared or any(c.kind != "holds" for c in comparisons)
    ]
    assert failures == []


def test_numbers_are_read_as_other_languages_write_them() -> None:
    kinds = {
        r"1{,}5 + 1 = 2{,}5": "holds",
        r"1{,}5 + 1 = 2{,}6": "wrong",
        r"\frac18 = 0{,}125": "holds",
        r"0{,}5 + 1{,}250 = 1{,}751": "wrong",
        r"2\pi\sqrt{1/9{,}81} \approx 2{,}006\ \mathrm s": "holds",
        r"2\pi\sqrt{10/98.1} \approx 2{,}006": "unread",
        r"1{,}250 + 1 = 1{,}251": "holds",
        r"1{,}250 + 1 = 1{,}252": "wrong",
    }
    arabic = str.maketrans("0123456789.", "".join(map(chr, [*range(0x660, 0x66A), 0x66B])))
    kinds |= {
        tex.translate(arabic): kind
        for tex, kind in (("1.5 + 1 = 2.5", "holds"), ("1 + 1 = 3", "wrong"))
    }
    for tex, kind in kinds.items():
        assert [comparison.kind for comparison in check_arithmetic(tex)] == [kind], tex
    (comparison,) = check_arithmetic("1{,}5 + 1 = 2{,}6")
    assert comparison.start == len("1{,}5 + 1 = ")


def test_a_whole_number_is_rounded_to_its_digits_where_decimals_give_it() -> None:
    for tex in (
        r"5\cdot9.81 = 48",
        r"2.5\cdot3.9 = 10",
        r"0.7\cdot2 = 1",
        r"2\pi\cdot50 = 315",
        r"7\cdot8 = 57",
    ):
        assert [comparison.kind for comparison in check_arithmetic(tex)] == ["wrong"], tex


def test_sides_without_a_numeral_are_compared_with_each_other() -> None:
    (comparison,) = check_arithmetic(r"\sqrt{2} = \sqrt{2.01}")
    assert comparison.message == "1.414213562 and 1.417744688 are not the same"


@given(st.lists(st.decimals(-1000, 1000, places=4), min_size=1, max_size=6), st.integers(-9, 9))
def test_a_sum_is_wrong_exactly_if_its_last_digit_is(terms: list[Decimal], off: int) -> None:
    result = sum(terms) + Decimal(off).scaleb(-4)
    tex = " + ".join(f"({term:f})" for term in terms) + f" = {result:f}"
    (comparison,) = check_arithmetic(tex)
    assert comparison.kind == ("wrong" if off else "holds")
    if off:
        assert tex[comparison.start : comparison.end].strip("-") == f"{abs(result):f}"


@given(st.lists(st.sampled_from(TOKENS), max_size=40).map(" ".join) | st.text(max_size=60))
def test_any_text_can_be_checked(tex: str) -> None:
    for comparison in (*check_arithmetic(tex), *check_arithmetic(tex, KNOWN, "ms")):
        assert 0 <= comparison.start <= comparison.end <= len(tex)


@settings(max_examples=60)
@given(st.lists(st.sampled_from((*TOKENS, "x", "x", "(x)")), max_size=20).map(" ".join))
def test_any_text_can_be_tried_as_an_identity(tex: str) -> None:
    for text in (tex, rf"\int_0^x {tex}\,\mathrm dx = \frac{{\mathrm d}}{{\mathrm dx}} {tex}"):
        for comparison in check_identity(text, {"x": (), "m": ()}):
            assert 0 <= comparison.start <= comparison.end <= len(text)


def test_functions_without_real_values_in_integrals_are_not_understood() -> None:
    for tex, reason in (
        (r"\int_0^x x!\,\mathrm dx = x", "it is of whole numbers only"),
        (r"\int_0^x \ln(-1 - x^2)\,\mathrm dx = x", "it is not a real number"),
        (r"\int_{-1}^{1} \frac{1}{x}\,\mathrm dx = x", "300 digits do not tell"),
        (r"\int_0^\infty x\,\mathrm dx = x", "nothing is computed up to infinity"),
    ):
        (comparison,) = check_identity(tex, {"x": ()})
        assert (comparison.kind, reason in comparison.message) == ("unread", True), tex


def test_what_is_too_large_or_no_whole_number_is_not_understood() -> None:
    large, whole = "the numbers become too large", "it is of whole numbers only"
    reasons = {
        r"\sum_{i=1}^{5000} i = 1": large,
        r"\sum_{i=1}^{800}\sum_{j=1}^{800} i = 1": large,
        r"\prod_{i=1}^{900} 7^{999} = 1": large,
        "1000000! = 1": large,
        "2.5! = 3": whole,
        "(-2)! = 2": whole,
        r"\sum_{i=1}^{\pi} i = 3": "its limits are not two whole numbers",
        "3!! = 3": "`!` is not known",
    }
    for tex, reason in reasons.items():
        (comparison,) = check_arithmetic(tex)
        assert (comparison.kind, comparison.message) == ("unread", reason)


def test_what_can_be_meant_otherwise_is_not_judged() -> None:
    base_units = "the number without a unit may be in base units"
    reasons = {
        "(123) = (13)(12)": "two numbers stand side by side",
        "(1)(23) = (12)(3)": "two numbers stand side by side",
        "0 = 1": "there is nothing to compute",
        "3950/988 = 3": "`/` may be the division of whole numbers",
        r"T = 1/50\,\mathrm{Hz} = 20\,\mathrm{ms}": "its unit may be that of another part",
        r"2\cdot45 = 90^\circ": "its unit may be that of another part",
        r"\tfrac34\cdot100 = 75\,\%": "its unit may be that of another part",
        r"2\cdot3000 = 6\,\mathrm{km/s}": base_units,
        r"1/(4\cdot10^{-4}) \approx 2.5\,\mathrm{kHz}": base_units,
        r"-2\cdot96485\cdot1.10 = -212\ \mathrm{kJ/mol}": base_units,
        r"1.6\mathrm e{-19} = 1.6\times10^{-19}": "it may be a power of ten",
    }
    for tex, reason in reasons.items():
        (comparison,) = check_arithmetic(tex)
        assert (comparison.kind, comparison.message) == ("unread", reason)
    for tex in ("3950/988 = 4", r"\frac{7}{2} = 3", "1 + 0 = 0", r"2\cdot(13) = 36", "0.5 = 0.6"):
        (comparison,) = check_arithmetic(tex)
        assert comparison.kind == "wrong", tex
    for tex in (
        r"1/50\,\mathrm{Hz} = 30\,\mathrm{ms}",
        r"0.35 = 0.35\,\%",
        r"\pi/2 = 1.57^\circ",
        r"2\cdot3000 = 7\,\mathrm{km/s}",
    ):
        (comparison,) = check_arithmetic(tex)
        assert comparison.kind == "wrong", tex


def test_deep_nesting_is_not_understood() -> None:
    for tex in ("(" * 2400 + "1" + ")" * 2400, r"\sqrt" * 900 + "1", "1 + " * 1200 + "1"):
        (comparison,) = check_arithmetic(tex + " = 1")
        assert comparison.message == "it is too long"


IDENTITIES = r"""
\sin 2x = 2\sin x\,\cos x
\frac{\mathrm d}{\mathrm dx}\,\frac{x}{1 + x^2} = \frac{1 - x^2}{(1 + x^2)^2}
\frac{\mathrm d\,x^3}{\mathrm dx} = 3x^2
\int_0^x \cos x\,\mathrm dx = \sin x
\int x\,\mathrm e^{x}\,\mathrm dx = (x - 1)\,e^x
\int_{-1}^1 \sqrt{1 - x^2}\,\mathrm dx = \tfrac12\pi
(x^2)^{1/2} = |x|
\frac{\mathrm d}{\mathrm dx} \int_0^{x^2} \sin(x)\,\mathrm dx = 2x\,\sin(x^2)
\sum_{k=0}^{3} \binom{3}{k}\,x^k = (1 + x)^3
x! = x\,(x - 1)!
"""


def test_identities_hold() -> None:
    failures = [list(check_identity(tex, {"x": ()})) for tex in IDENTITIES.strip().splitlines()]
    assert failures == [[]] * len(failures)


def symbols(*rows: tuple[str, str, str]) -> tuple[SymbolQuantity, ...]:
    """Return symbols from names, units and values, which may be empty."""
    quantities = []
    for name, unit_text, value in rows:
        unit = find_unit(unit_text)
        assert unit is not None
        decimals = len(value.partition(".")[2])
        quantities.append(
            SymbolQuantity(
                name,
                unit_text,
                unit,
                Real.of(value) * measure(unit) if value else None,
                Real.of(Fraction(10) ** -decimals) * measure(unit) if decimals else None,
                f"{value} {unit_text}",
            )
        )
    return tuple(quantities)


KNOWN = symbols(
    (r"\ell", "m", "1"),
    ("g", "m/s^2", "9.81"),
    ("m", "kg", "2"),
    ("v", "m/s", "4.43"),
    (r"\omega_{0}", "rad/s", "3.13"),
    (r"\theta", "deg", "30"),
    ("h", "s", "0.002"),
    (r"m_{eff}", "kg", "0.5"),
    ("T", "s", ""),
    ("E", "J", ""),
    ("x", "m", ""),
    ("t", "s", ""),
)
COMPUTED = r"""
T = 2\pi\sqrt{\frac{\ell}{g}} \approx 2.006
2\pi\sqrt{\ell/g} = 2\pi\sqrt{1/9.81} = 2.006\ \mathrm s
T = 2\pi\sqrt{\ell/g} \approx 2006\ \mathrm{ms}
T \approx 2\pi\sqrt{\ell/g} \approx 2
E = \tfrac12 m v^2 = 19.6\ \mathrm J
m g \ell = \frac12 m v^2
\omega_0 = \sqrt{g/\ell}
\omega_{0}^2\,\ell = 9.8
\theta = 30^\circ
\theta = 30
\sin\theta = 0.5
h = 2.0 \times 10^{-3}
h = 2\ \mathrm{ms}
m_\text{eff}/m = m_{\text{eff}}/m = 25\,\%
\frac{v^2}{2 g \ell} - 1 \approx 0.02\,\%
\tfrac12g\,(0.1\ \mathrm s)^2 = 49.05\ \mathrm{mm}
g\,(0.1\ \mathrm s)^2 = 0.0981\ \mathrm m
(2 + 1)(0.5) = 1.5
"""
WRONG = r"""
26^{25} \approx 10^{34}
T = 2\pi\sqrt{\ell/g} \approx 2.060
2\pi\sqrt{\ell/g} = 2\pi\sqrt{1/9.91}
T = 2\pi\sqrt{\ell/g} \approx 2.006\ \mathrm m
m g \ell = \frac12 m v
\omega_0 = \sqrt{g/\ell} + 0.1\ \mathrm{rad/s}
m g \ell = m v^2
h = 2.0 \times 10^{-4}
\theta = 31
m_\text{eff}/m = 20\,\%
E = m v
x = v\,t + \ell\,t
\sin t = 1
\dot x = \ell
\frac{\mathrm dx}{\mathrm dt} = x
x < 2\ \mathrm s
"""
NOT_JUDGED = r"""
x = v\,t
\ddot x = g
\frac{\mathrm dx}{\mathrm dt} = v
E \propto v
m > 3
x = 1 + t
E = 9.81\,m
y = v + x
x \to 0
"""
DOUBTFUL = r"""
2(3)(0.5) = 3
9.81(2) = 9.81
\prod_{k=1}^3 k\cdot 2 = 12
\prod_{k=1}^3 k\ \mathrm m = 6\ \mathrm m
200\ \mathrm g + 10\,\% = 220\ \mathrm g
1\ \mathrm{Hz} = 1\ \mathrm{rad/s}
3\,\mathrm h(2) = 6
7 + 8 = 3 \quad(\mathrm{mod}\ 12)
1 + 1 = 3, \quad \text{which is false}
"""


def test_a_form_with_two_readings_is_not_judged() -> None:
    for tex in DOUBTFUL.strip().splitlines():
        assert {c.kind for c in check_arithmetic(tex)} <= {"unread"}, tex
    thousands = check_arithmetic("1.250 + 500 = 1.750", comma=True)
    assert {c.kind for c in thousands} <= {"unread"}
    assert {c.kind for c in check_arithmetic("1.250 + 500 = 1.750")} == {"wrong"}


ROUNDED = r"""
\frac{1}{2\pi\cdot 10^4\cdot 10^{-7}} = 159\ \mathrm{Hz}
230\sqrt2 = 325
2/3 = 67\,\%
37\,^\circ\mathrm C = 310\ \mathrm K
10^5\ \mathrm{Pa} = 750\ \mathrm{mmHg}
1\ \mathrm{pc} = 206265\ \mathrm{au}
1\ \mathrm{MB} = 1024\ \mathrm{KB}
1\ \mathrm{GB} = 1000\ \mathrm{MB}
"""
WRONGLY_ROUNDED = r"""
230\sqrt2 = 326
2/3 = 76\,\%
\sqrt{10} = 3
2^{10} = 1000
99/2 = 50
37\,^\circ\mathrm C = 311\ \mathrm K
1\ \mathrm{in} = 25\ \mathrm{mm}
2\ \mathrm{MB} = 3000\ \mathrm{KB}
"""
COMMAS_OF_TWO_READINGS = r"""
0,(3) = \frac13
0{,}1(6) = \frac16
2.3.5 = 30
2.3 = 6
"""


def test_what_no_decimal_can_hold_is_rounded_after_an_equals_sign() -> None:
    for texts, kind in ((ROUNDED, "holds"), (WRONGLY_ROUNDED, "wrong")):
        for tex in texts.strip().splitlines():
            assert {c.kind for c in check_arithmetic(tex)} == {kind}, tex


def test_how_many_one_is_of_a_word_is_said_and_not_computed() -> None:
    for tex in (
        r"1\text{ dozen} = 12",
        r"24 = 2\text{ dozen}",
        r"3 \cdot 2\text{ pairs} = 12",
        r"4\ \mathrm{min^{1/2}} = 31",
        r"1\ \mathrm{mol} = 6.022\times10^{23}",
    ):
        assert {c.kind for c in check_arithmetic(tex)} == {"unread"}
    for tex in (r"2\cdot6 = 13\text{ eggs}", r"1\ \mathrm m = 99\ \mathrm{cm}"):
        assert {c.kind for c in check_arithmetic(tex)} == {"wrong"}


def test_periods_and_points_between_factors_are_not_judged_beside_commas() -> None:
    for tex in COMMAS_OF_TWO_READINGS.strip().splitlines():
        assert {c.kind for c in check_arithmetic(tex, comma=True)} <= {"unread"}, tex
    assert {c.kind for c in check_arithmetic("2,5 + 1 = 3,6", comma=True)} <= {"unread"}
    assert {c.kind for c in check_arithmetic(r"2{,}5 + 1 = 3{,}6", comma=True)} == {"wrong"}


def test_symbols_with_values_are_computed_and_units_compared() -> None:
    for texts, expected in ((COMPUTED, {"holds"}), (WRONG, {"wrong"}), (NOT_JUDGED, set())):
        for tex in texts.strip().splitlines():
            kinds = {c.kind for c in check_arithmetic(tex, KNOWN)}
            kinds -= {"holds"} if expected == {"wrong"} else set()
            assert kinds == expected, tex


def test_what_is_claimed_of_symbols_and_cannot_be_computed_is_said() -> None:
    for tex, reason in (
        (r"\mathbf v = 3.0", "it is a vector"),
        ("l/g = 0.1", "`l` has no value here"),
        (r"m x = 0.1", "`x` has no value here"),
        (r"m^T m = 4", "it may be a transpose"),
        (r"v(2)^2 = 4", "it may be a product or a function of this"),
        (r"(v - 2.43)/m = 1", "a number in it may leave out its unit"),
    ):
        assert [(c.kind, c.message) for c in check_arithmetic(tex, KNOWN)] == [("unread", reason)]


def test_a_unit_after_the_formula_is_that_of_its_last_number() -> None:
    tex = r"2\pi\sqrt{\ell/g} \approx 2006"
    (comparison,) = check_arithmetic(tex, KNOWN, "ms")
    assert comparison.kind == "holds"
    (comparison,) = check_arithmetic(tex, KNOWN, "kg")
    assert comparison.message == "`time` is held against `mass`"
