"""The symbols of formulas, from the MathML of the typesetter."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from coursebuild.core.model.results import Formula
from coursebuild.core.run.typesetting import MathEngine
from coursebuild.features.symbols import only_symbol, sort_key, symbols
from support.fixture_cases import check_lines

Typeset = Callable[[str], str]


@pytest.fixture(scope="module")
def typeset() -> Typeset:
    engine = MathEngine()

    def make(tex: str) -> str:
        mathml = engine.typeset([Formula(tex, False)])[0]
        assert isinstance(mathml, str), mathml
        return mathml

    return make


def read(mathml: str) -> list[str]:
    """Return symbols as text, indices after `_`, other superscripts after `^`."""
    return [symbol_text(symbol) for symbol in symbols(mathml)]


def symbol_text(symbol: str) -> str:
    base = r"(<mover>.*?</mover>|<mi[ >].*?</mi>)"
    text = re.sub(rf"<msub(?:sup)?>{base}", r"\1_", symbol)
    text = re.sub(rf"<msup>{base}", r"\1^", text)
    return re.sub(r"<[^>]*>", "", text)


def test_the_symbols_of_a_formula(typeset: Typeset, rewriting: bool) -> None:
    path = Path(__file__).with_name("formulas.md")
    check_lines(path, lambda tex: [" ".join(read(typeset(tex)))], rewriting=rewriting)


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
