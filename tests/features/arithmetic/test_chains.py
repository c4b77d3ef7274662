"""Arithmetic in formulas: correct numbers pass, a wrong digit is found, any text can be checked."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from decimal import Decimal
from fractions import Fraction

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coursebuild.core.text.units import find_unit
from coursebuild.features.arithmetic.chains import check_arithmetic
from coursebuild.features.arithmetic.evaluate import FormulaComparison, measure
from coursebuild.features.arithmetic.identities import check_identity
from coursebuild.features.arithmetic.real import Real
from coursebuild.features.arithmetic.symbol_comparison import SymbolQuantity
from support.fixture_cases import FIXTURES, check_lines

TOKENS = (
    r"0 1 2.5 , . + - * / ^ _ { } ( ) [ ] | = < & \\ \frac \sqrt \sin \pi \cdot \mathrm{kg} \int"
    r" \ell g m v \dot x t T \approx \omega_0 \mathrm{d}"
    r" ! \binom \sum_{m=1}^ \prod^2_"
).split()


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


def test_deep_nesting_is_not_understood() -> None:
    for tex in ("(" * 2400 + "1" + ")" * 2400, r"\sqrt" * 900 + "1", "1 + " * 1200 + "1"):
        (comparison,) = check_arithmetic(tex + " = 1")
        assert comparison.message == "it is too long"


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


def test_a_unit_after_the_formula_is_that_of_its_last_number() -> None:
    tex = r"2\pi\sqrt{\ell/g} \approx 2006"
    (comparison,) = check_arithmetic(tex, KNOWN, "ms")
    assert comparison.kind == "holds"
    (comparison,) = check_arithmetic(tex, KNOWN, "kg")
    assert comparison.message == "`time` is held against `mass`"


CHECKS: dict[str, Callable[[str], Iterable[FormulaComparison]]] = {
    "plain": check_arithmetic,
    "comma": lambda tex: check_arithmetic(tex, comma=True),
    "symbols": lambda tex: check_arithmetic(tex, KNOWN),
    "identities": lambda tex: check_identity(tex, {"x": ()}),
}
"""By the files of `tests/fixtures/arithmetic`; `comma`: where a language has decimal commas."""


@pytest.mark.parametrize("name", CHECKS)
def test_each_comparison_of_a_chain_has_its_verdict(name: str, rewriting: bool) -> None:
    def convert(tex: str) -> Iterable[str]:
        for comparison in CHECKS[name](tex):
            part = tex[comparison.start : comparison.end]
            yield comparison.kind + (
                f" `{part}`: {comparison.message}" if comparison.message else ""
            )

    check_lines(FIXTURES / f"arithmetic/{name}.md", convert, rewriting=rewriting)
