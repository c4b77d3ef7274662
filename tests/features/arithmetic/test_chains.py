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
from support.fixture_cases import fixture_tables

CHAINS = fixture_tables("chains")
TOKENS = (
    r"0 1 2.5 , . + - * / ^ _ { } ( ) [ ] | = < & \\ \frac \sqrt \sin \pi \cdot \mathrm{kg} \int"
    r" \ell g m v \dot x t T \approx \omega_0 \mathrm{d}"
    r" ! \binom \sum_{m=1}^ \prod^2_"
).split()


def test_correct_arithmetic_passes_and_symbols_are_not_checked() -> None:
    failures = [
        (tex, comparisons)
        for texts, is_compared in ((CHAINS["holds"], True), (CHAINS["silent"], False))
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


def test_identities_hold() -> None:
    texts = CHAINS["identities"].strip().splitlines()
    failures = [list(check_identity(tex, {"x": ()})) for tex in texts]
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


def test_a_form_with_two_readings_is_not_judged() -> None:
    for tex in CHAINS["doubtful"].strip().splitlines():
        assert {c.kind for c in check_arithmetic(tex)} <= {"unread"}, tex
    thousands = check_arithmetic("1.250 + 500 = 1.750", comma=True)
    assert {c.kind for c in thousands} <= {"unread"}
    assert {c.kind for c in check_arithmetic("1.250 + 500 = 1.750")} == {"wrong"}


def test_what_no_decimal_can_hold_is_rounded_after_an_equals_sign() -> None:
    for texts, kind in ((CHAINS["rounded"], "holds"), (CHAINS["wrongly_rounded"], "wrong")):
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
    for tex in CHAINS["commas_of_two_readings"].strip().splitlines():
        assert {c.kind for c in check_arithmetic(tex, comma=True)} <= {"unread"}, tex
    assert {c.kind for c in check_arithmetic("2,5 + 1 = 3,6", comma=True)} <= {"unread"}
    assert {c.kind for c in check_arithmetic(r"2{,}5 + 1 = 3{,}6", comma=True)} == {"wrong"}


def test_symbols_with_values_are_computed_and_units_compared() -> None:
    for texts, expected in (
        (CHAINS["computed"], {"holds"}),
        (CHAINS["wrong"], {"wrong"}),
        (CHAINS["not_judged"], set()),
    ):
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
