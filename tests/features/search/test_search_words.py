"""The terms of texts and formulas; the browser's half of these rules is tested under Node."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from coursebuild.features.search.words import (
    count_terms,
    is_fuzzy,
    plain_formula,
    shelf_of,
    terms_of,
)

SHARED_CASES = json.loads(
    (Path(__file__).parents[3] / "site" / "tests" / "search-words.json").read_text("utf-8")
)


def test_terms_are_those_that_the_browser_makes() -> None:
    assert [[text, terms_of(text)] for text, _ in SHARED_CASES["terms"]] == SHARED_CASES["terms"]


def test_lengths_of_terms() -> None:
    words = {length: "a" * length for length in (2, 3, 24, 25, 48, 49)}
    assert [n for n, word in words.items() if terms_of(word) == [word]] == [2, 3, 24, 25, 48]
    assert [n for n, word in words.items() if is_fuzzy(word)] == [3, 24]


def test_shelves_are_those_of_the_browser() -> None:
    for term, shelf, fuzzy, _ in SHARED_CASES["shelves"]:
        assert (shelf_of(term), is_fuzzy(term)) == (shelf, fuzzy), term


PARTS = (
    *("a", "s", "'s", "’s", "é", "λ", "\n", ".", "_", "1", "1e-5", "2.5E+3x", "E", "e+", " ", "×"),
    *("…", "–", "ﬁ", "ſ", "\x1c", "½", "a\u0301", "\u0301", "İ", "中文", "x.y", "__a__", "1.2.3"),
)


@given(st.text() | st.lists(st.sampled_from(PARTS), max_size=20).map("".join))
def test_any_text_has_terms_that_lines_can_hold(text: str) -> None:
    terms = terms_of(text)
    assert count_terms(text) == {term: terms.count(term) for term in terms}
    for term in terms:
        assert term and not {" ", "\n", "\0"} & {*term}
        assert shelf_of(term)


@pytest.mark.parametrize(
    ("formula", "text", "names"),
    [
        (r"I_{xx}", "I_xx", ()),
        (r"\boldsymbol{\tau} = I\dot{\omega} + \omega\times(I\omega)", "τ = I ω + ω × (I ω)", ...),
        (r"\frac{1}{2} m v^2", "1/2 m v^2", ("frac",)),
        (r"\frac12", "1/2", ("frac",)),
        (r"\dfrac{a + b}{\sqrt{c d}}", "(a + b)/(√(c d))", ("dfrac", "sqrt")),
        (r"\frac{\partial L}{\partial \dot q_i}", "(∂L)/(∂q_i)", ("frac", "partial", "dot")),
        (r"x(t + \Delta t)", "x(t + Δt)", ()),
        (r"\begin{pmatrix} a & b \\ c & d \end{pmatrix}", "a b c d", ()),
        (r"v = 3\,\text{m s}^{-1}", "v = 3 m s^(-1)", ()),
        (r"\sum_{i=1}^{n} m_i", "∑_(i=1)^n m_i", ("sum",)),
        (r"\sin\theta \approx \theta % small", "sin θ ≈ θ", ("sin", "approx")),
        (r"\mathbf{R}^{\mathsf T}", "R^T", ()),
        (r"\phantom{x} y \label{eq:a}", "y", ()),
        (r"\unknown{z}", "z", ("unknown",)),
        (r"\omega'", "ω ′", ()),
        ("a < b & c", "a < b c", ()),
        ("", "", ()),
        ("}{}}", "", ()),
        ("x^", "x^", ()),
        (r"\frac{a", "a/", ("frac",)),
        ("{" * 3000 + "x" + "}" * 3000, "x", ()),
    ],
)
def test_a_formula_as_text(formula: str, text: str, names: tuple[str, ...]) -> None:
    plain_text, plain_names = plain_formula(formula)
    assert plain_text == text
    assert names is ... or plain_names == names


@given(st.text(alphabet=r"\{}_^&~'% abαomegfrct1-+=()", max_size=60))
def test_any_formula_can_be_read(formula: str) -> None:
    text, names = plain_formula(formula)
    assert "{" not in text or r"\{" in formula
    assert all(name.isalpha() for name in names)
