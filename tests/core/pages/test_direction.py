"""The direction of languages, and how their text and numbers are set."""

from __future__ import annotations

import re
from html import unescape

import pytest
from hypothesis import given
from hypothesis import strategies as st

from coursebuild.core.pages.quantities import (
    join_units,
    split_quantities,
    text_html,
    unit_length,
)
from coursebuild.core.pages.strings import direction
from support.rendered_course import MAP, Make

LANGUAGES = {
    "rtl": "ar ar-EG AR he iw fa fa-IR ur yi ps sd ug dv ckb ks az-Arab uz-Arab-AF en-Hebr pa-PK"
    " nqo syr ku-IQ",
    "ltr": "en de pt-BR zh-Hant az pa ku uz ur-Latn ar-Latn ks-Deva sr-Cyrl xx en-x-arab"
    " de-u-nu-arab tr mt so",
}


@pytest.mark.parametrize("side", LANGUAGES)
def test_the_direction_of_a_language_is_that_of_its_script(side: str) -> None:
    assert [code for code in LANGUAGES[side].split() if direction(code) != side] == []


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("a mass of 5 kg falls", "a mass of 5\u00a0kg falls"),
        ("9.81 m/s² and 3 N·m", "9.81\u00a0m/s² and 3\u00a0N·m"),
        ("20 % of 3 ms", "20\u00a0% of 3\u00a0ms"),
        ("3 minutes, 5 metres, 2 of them", "3 minutes, 5 metres, 2 of them"),
        ("see 4.2 and 4.3", "see 4.2 and 4.3"),
        ("30 °C, 2 kΩ, 4 µm, 4 μm", "30\u00a0°C, 2\u00a0kΩ, 4\u00a0µm, 4\u00a0μm"),
        ("in 2 steps a 5 kg\nbox", "in 2 steps a 5\u00a0kg\nbox"),
        ("3 kg m² of 4 N m s/rad", "3\u00a0kg\u00a0m² of 4\u00a0N\u00a0m\u00a0s/rad"),
        ("5 kg mass, 2 m in 3 s more", "5\u00a0kg mass, 2\u00a0m in 3\u00a0s more"),
    ],
)
def test_numbers_keep_their_units(text: str, expected: str) -> None:
    assert join_units(text) == expected


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("التسارع -9.81 m/s² هنا", ["-9.81 m/s²"]),
        ("من −3 إلى +4.5", ["−3", "+4.5"]),
        ("القيمة +3.2×10^-4 فقط", ["+3.2×10^-4"]),
        ("الكتلة 2 kg، ثم 3", ["2 kg"]),
        ("MuJoCo 3.14 و MuJoCo 3 kg", []),
        ("2024-11-20", []),
    ],
)
def test_quantities_in_text_from_the_right(text: str, expected: list[str]) -> None:
    pieces = list(split_quantities(text))
    assert [piece for piece, is_quantity in pieces if is_quantity] == expected
    assert "".join(piece for piece, _ in pieces) == text


@given(st.text(alphabet="0123456789.,-+−×^ kgms²/°%بة\u00a0<&"))
def test_finding_quantities_loses_no_character(text: str) -> None:
    assert "".join(piece for piece, _ in split_quantities(text)) == text
    assert join_units(text).replace("\u00a0", " ") == text.replace("\u00a0", " ")
    assert 0 <= unit_length(text) <= len(text)

    for side in ("ltr", "rtl"):
        html = str(text_html(text, side))
        assert unescape(re.sub("</?bdi[^>]*>", "", html)) == join_units(text)


def test_pages_say_their_direction_and_hold_numbers_and_units_together(make: Make) -> None:
    hebrew = MAP.replace('"en"', '"he"').replace("A body falls.", "-3 m")
    course = make("It is $x$ kg and $y$ kilos.", course=hebrew)
    page = course.site()["lessons/0.1-falling.html"].decode()
    assert '<html lang="he" dir="rtl" ' in page
    assert '<p class="lead"><bdi dir="ltr">-3\u00a0m</bdi></p>' in page
    math = '<math class="inline"><mi>x</mi></math>'
    assert f'<bdi dir="ltr">{math}\u00a0kg</bdi> and ' in course.html()
    assert course.html().count("<bdi") == 1
    assert f"{math}\u00a0kg and " in make("It is $x$ kg and $y$ kilos.").html()
