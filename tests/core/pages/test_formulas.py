"""Where a line may break at a formula, and where not."""

from __future__ import annotations

import pytest

from coursebuild.core.pages.formulas import glue_formulas, split_formula

ROW = "<mrow><mi>alpha</mi><mrow><mi>beta</mi></mrow><mo>=</mo></mrow>"
END = "<mrow><mi>gamma</mi><mo>+</mo><mn>123456</mn></mrow>"


@pytest.mark.parametrize("space", ["", "<mspace/>"])
def test_a_long_formula_is_cut_between_its_outermost_rows(space: str) -> None:
    expected = f"<math>{ROW}</math><math>{space}{END}</math>"
    assert split_formula(f"<math>{ROW}{space}{END}</math>") == expected


@pytest.mark.parametrize(
    "mathml",
    [
        f"<math>{ROW}</math>",
        "<math><mrow><mi>a</mi><mo>=</mo></mrow><mrow><mi>b</mi></mrow></math>",
        f'<math display="block">{ROW}{END}</math>',
        f"<math>{ROW}{END}<mo>+</mo></math>",
    ],
)
def test_short_displayed_and_open_formulas_stay_whole(mathml: str) -> None:
    assert split_formula(mathml) == mathml


X = "<math><mi>x</mi></math>"
Y = "<math><mi>y</mi></math>"


@pytest.mark.parametrize(
    ("html", "expected"),
    [
        (f"axis {X}, {Y}.", f'axis <span class="held">{X},</span> <span class="held">{Y}.</span>'),
        (f"({X})", f'<span class="held">({X})</span>'),
        (f"{X}\u00a0m, to", f'<span class="held">{X}\u00a0m,</span> to'),
        (f"{Y}\u00a0kg<sup>2</sup>", f'<span class="held">{Y}\u00a0kg</span><sup>2</sup>'),
        (f"{X} m, {Y}\u00a0", f"{X} m, {Y}\u00a0"),
        (f"“{X}”, so", f'<span class="held">“{X}”,</span> so'),
        (f"{X} and {X}", f"{X} and {X}"),
        (f"({X}{Y}{X})!", f'<span class="held">({X}</span>{Y}<span class="held">{X})!</span>'),
        (f"{X}{Y},", f'{X}<span class="held">{Y},</span>'),
        (f"<p>{X}</p>", f"<p>{X}</p>"),
        (f'<math display="block">{X}</math>', f'<math display="block">{X}</math>'),
        ("no formula, here", "no formula, here"),
    ],
)  # fmt: skip
def test_punctuation_stays_on_the_line_of_its_formula(html: str, expected: str) -> None:
    assert glue_formulas(html) == expected


START, TWO = "of <math><mrow>", "<mn>2</mn>"
NOTE = '<annotation encoding="application/x-tex">=2</annotation></semantics></math>'


@pytest.mark.parametrize(
    ("html", "expected"),
    [
        (f"{START}<mo>=</mo>{TWO}</mrow>", f'{START}<mo lspace="0em">=</mo>{TWO}</mrow>'),
        (f"\n<math><semantics><mo>≈</mo>{TWO}", f'\n<math><semantics><mo lspace="0em">≈</mo>{TWO}'),
        (f"{TWO}<mo>&lt;</mo></mrow>{NOTE} 3", f'{TWO}<mo rspace="0em">&lt;</mo></mrow>{NOTE} 3'),
        ("a <math><mo>=</mo></math> b", 'a <math><mo lspace="0em" rspace="0em">=</mo></math> b'),
        *((unchanged, unchanged) for unchanged in (
            f"of {X}<math><mo>=</mo>{TWO}</math> m",
            f"of <math>{TWO}<mo>=</mo></math><math>{TWO}</math> m",
            f"of <math><mo>sin</mo>{TWO}</math> m",
            f'of <math><mo lspace="0em">−</mo>{TWO}</math> m',
        )),
    ],
)  # fmt: skip
def test_an_operator_beside_a_space_of_the_text_has_none(html: str, expected: str) -> None:
    assert glue_formulas(html) == expected
