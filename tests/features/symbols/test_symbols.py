"""The symbols of formulas, from the MathML of the typesetter."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator

import pytest
from hypothesis import given
from hypothesis import strategies as st

from coursebuild.core.model.results import Formula
from coursebuild.core.run.v8 import MathEngine
from coursebuild.features.symbols.uses import only_symbol, sort_key, symbols

Typeset = Callable[[str], str]


@pytest.fixture(scope="module")
def typeset() -> Iterator[Typeset]:
    engine = MathEngine()

    def make(tex: str) -> str:
        mathml = engine.typeset([Formula(tex, False)])[0]
        assert isinstance(mathml, str), mathml
        return mathml

    yield make
    engine.close()


def read(mathml: str) -> list[str]:
    """Return symbols as text, indices after `_`, other superscripts after `^`."""
    return [symbol_text(symbol) for symbol in symbols(mathml)]


def symbol_text(symbol: str) -> str:
    base = r"(<mover>.*?</mover>|<mi[ >].*?</mi>)"
    text = re.sub(rf"<msub(?:sup)?>{base}", r"\1_", symbol)
    text = re.sub(rf"<msup>{base}", r"\1^", text)
    return re.sub(r"<[^>]*>", "", text)


@pytest.mark.parametrize(
    ("tex", "expected"),
    [
        (r"\omega", ["ω"]),
        (r"I_{zz}", ["I_zz"]),
        (r"\dot q", ["q˙"]),
        (r"\ddot\omega_1", ["ω¨_1"]),
        (r"\mathbf{R}\,\boldsymbol\omega", ["𝐑", "𝝎"]),
        (r"R \ne \mathbf R \ne \mathcal R", ["R", "𝐑", "ℛ"]),
        (r"\hat{\mathbf n}^\top \vec v", ["𝐧ˆ", "v→"]),
        (r"x_1^2 + x_1^3 + x_2", ["x_1", "x_2"]),
        (r"A^{-1} B^T C^\top D^\mathsf{T}", ["A", "B", "C", "D"]),
        (r"x^* + x' + x'' + x^+ + x^{\text{ref}}", ["x^∗", "x^′", "x^′′", "x^+", "x^ref"]),
        (r"v_\text{max} + v_{\mathrm{cm}} + x_{\max}", ["v_max", "v_cm", "x_max"]),
        (r"q_{k+1} - q_k", ["q", "q_k"]),
        (r"e^{\sigma t}", ["e", "σ", "t"]),
        (r"\int_0^T f(x)\,\mathrm dx", ["T", "f", "x"]),
        (r"\sum_{i=1}^n m_i", ["i", "n", "m_i"]),
        (r"\sin\theta + \operatorname{Re} z", ["θ", "z"]),
        (r"9.81\ \mathrm{m\,s^{-2}}", []),
        (r"\frac{\partial f}{\partial x} + \nabla g", ["f", "x", "g"]),
        (r"\mathbb R^3", []),
        (r"\lim_{h\to 0} \frac1h", ["h"]),
        (r"\sqrt{\ell}\,\hbar", ["ℓ", "ℏ"]),
        (r"\begin{pmatrix} a & b \\ c & d\end{pmatrix}", ["a", "b", "c", "d"]),
        (r"a / b \text{ if } c", ["a", "b", "c"]),
        (r"\underbrace{F}_{\text{force}}", ["F"]),
        (r"1 + 2", []),
    ],
)
def test_the_symbols_of_a_formula(typeset: Typeset, tex: str, expected: list[str]) -> None:
    assert read(typeset(tex)) == expected


def test_a_symbol_does_not_depend_on_its_formula(typeset: Typeset) -> None:
    alone = symbols(typeset(r"\dot q_1"))
    assert len(alone) == 1
    for tex in (r"-\dot q_1", r"\dot{q}_{1}^2", r"\tfrac12 m\dot q_1", r"e^{\dot q_1}"):
        assert alone[0] in symbols(typeset(tex)), tex


SINGLE_SYMBOLS = r"\omega \mathbf{c}_k x^* \tilde{I}_{xy} I_{zz} \Delta \ell".split()
NAMES = r"\mathrm{Re} \mathit{St}".split()
NO_SYMBOL = r"mg v^2 A^\top I=1 1 \frac{a}{b}".split()


def test_a_single_symbol_equals_that_of_a_formula(typeset: Typeset) -> None:
    for tex in SINGLE_SYMBOLS:
        assert symbols(typeset(f"1 + {tex}")) == (only_symbol(typeset(tex)),)
    assert [tex for tex in (*NAMES, *NO_SYMBOL) if only_symbol(typeset(tex))] == NAMES
    assert only_symbol("<math></math>") is None


def test_latin_comes_first_then_greek_each_letter_with_its_kin(typeset: Typeset) -> None:
    tex = [r"\omega", r"\mathbf b", "B", "b", r"\alpha", r"b_1", "a", r"\dot a", r"\ell", "m"]
    symbols_in_order = sorted((symbols(typeset(letter))[0] for letter in tex), key=sort_key)
    assert [symbol_text(symbol) for symbol in symbols_in_order] == [
        "a",
        "a˙",
        "B",
        "b",
        "b_1",
        "𝐛",
        "ℓ",
        "m",
        "α",
        "ω",
    ]


@given(st.text())
def test_any_text_can_be_looked_through_for_symbols(text: str) -> None:
    assert symbols(text) == () or text.startswith("<")
    symbols(f"<math><mi>{text}</mi></math>")
    sort_key(text)
