"""Numbers in text: where they are, what they are worth, and how they are rounded."""

from __future__ import annotations

from decimal import Decimal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from coursebuild.core.scripts.numbers import (
    Number,
    round_like,
    scan,
    scan_prose,
)
from support.growth import processor_time_growth


def texts(text: str) -> list[str]:
    return [number.text for number in scan(text)]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("kinetic energy  +6.641 %", ["+6.641"]),
        ("-.5 and .25", ["-.5", ".25"]),
        ("[0.073333 0.026667 0.      ]", ["0.073333", "0.026667", "0."]),
        ("[-1. 2.]", ["-1.", "2."]),
        ("1e-3 3.9E-11 1.e+00 2e5", ["1e-3", "3.9E-11", "1.e+00", "2e5"]),
        ("took 12.5ms, 3x faster, 45deg", ["12.5", "3", "45"]),
        ("6 %", ["6"]),
        ("x=1.5 y=-2", ["1.5", "-2"]),
        (
            "(1+2j) 1.5-0.5j [1.+2.j 3.e-05-4.j]",
            ["1", "+2", "1.5", "-0.5", *"1. +2.".split(), "3.e-05", "-4."],
        ),
        ("1.0-2.0", ["1.0", "2.0"]),
        ("1.5±0.02 1.5+-0.02 1.5+/-0.02", ["1.5", "0.02", "1.5", "-0.02", "1.5", "-0.02"]),
        ("nan -inf inf NaN Infinity", ["nan", "-inf", "inf", "NaN", "Infinity"]),
        ("step 3/10, ratio 1:2", ["3", "10", "1", "2"]),
        ("\u22126.04", ["\u22126.04"]),
        ("|0.5|", ["0.5"]),
        ("0:1.5", ["0", "1.5"]),
        ("found 5.", ["5."]),
        ("0, 1,2", ["0", "1", "2"]),
        ("a - 1, a -1, x[0]-1, 3-x", ["1", "-1", "0", "1", "3"]),
        ("1... [0. 1. ... 8. 9.]", ["1", "0.", "1.", "8.", "9."]),
        ("3 × 10 m, 2 × 105", ["3", "10", "2", "105"]),
        ("9" * 1000, ["9" * 1000]),
    ],
)
def test_numbers_are_found(text: str, expected: list[str]) -> None:
    assert texts(text) == expected
    assert [number.text for number in scan_prose(text)] == expected


@pytest.mark.parametrize(
    "text",
    [
        "v3.14.0",
        "MuJoCo 3.14.0",
        "3.14.0rc1",
        "0x1f 0xff 0b101 0o17",
        "x1 l4_2_inertia.py axis2",
        "2026-11-20 2026-11-20T10:30:05Z 11/20/2026 20.11.2026",
        "10:30:05 00:00:12.345",
        "127.0.0.1:8000",
        "3fa9e12 0deadbeef 1234567e89ab",
        "550e8400-e29b-41d4-a716-446655440000",
        "4x4 12ab34 1_000",
        "UTF-8 sha-256 mujoco-3.14",
        "10-20 555-1234",
        "nano info infer np.nan",
        "1e99999 1e-12345",
        "9" * 1001,
        "x[1_0]",
        "kg m^2 s^-2 x^0.5",
        "\u0663\u0664",
    ],
)
def test_text_stays_text(text: str) -> None:
    assert texts(text) == []


@pytest.mark.parametrize(
    ("text", "value", "place"),
    [
        ("3.9 × 10⁻¹¹", "3.9e-11", -12),
        ("3.9×10^-11", "3.9e-11", -12),
        ("1.5 · 10^{6}", "1.5e6", 5),
        ("\u22122·10\u00b3", "-2e3", 3),
        ("1e\u22125", "1e-5", -5),
    ],
)
def test_powers_of_ten_in_prose(text: str, value: str, place: int) -> None:
    (number,) = scan_prose(text)
    assert (number.value, number.place, number.is_integer) == (Decimal(value), place, False)
    assert number.text == text


@pytest.mark.parametrize(
    ("sample", "value", "expected"),
    [
        ("+6.6", "6.702", "+6.7"),
        ("6.6", "-6.65", "-6.6"),
        ("-.5", "0.25", ".2"),
        ("0.", "3.6", "4."),
        ("1.0e-04", "0.000249", "2.5e-04"),
        ("1.0e-04", "0.9996", "1.0e+00"),
        ("9.9e-4", "0.000996", "1.0e-3"),
        ("\u22126.0", "-7.77", "\u22127.8"),
        ("-0.0", "-0.01", "0.0"),
        ("4", "5.5", "6"),
        ("1e3", "2345", "2e3"),
    ],
)
def test_rounding_in_the_notation_of_another_number(sample: str, value: str, expected: str) -> None:
    assert round_like(scan(sample)[0], Decimal(value)) == expected


@given(st.text())
def test_scanning_never_fails_and_spans_slice_back(text: str) -> None:
    end = 0
    for number in scan_prose(text):
        assert end <= number.start < number.end
        assert text[number.start : number.end] == number.text
        end = number.end


@given(st.floats(), st.sampled_from(["", ".3f", "e", ".1e", "g", "+.6g", ".0f"]))
def test_every_way_to_print_a_float_is_one_number(value: float, spec: str) -> None:
    printed = format(value, spec)
    numbers: tuple[Number, ...] = scan(f"x: {printed} m")
    assert [n.text for n in numbers] == ([printed] if len(printed) <= 1000 else [])


PIECES = ["1-", "00:", "1", "1.1111", "1+", "a", "1 ", "1e", "1f", "-", "1/", ".", "a-1", "nan"]


@pytest.mark.site
def test_scanning_repeated_text_takes_linear_time() -> None:
    """Measured by time: the work of one expression shows in no count of calls."""

    def growth(piece: str) -> float:
        return processor_time_growth(lambda size: scan(piece * (size // len(piece)) + "x"), 2048)

    growths = {piece: growth(piece) for piece in [*PIECES, "1.2.3-"]}
    assert {piece: growth for piece, growth in growths.items() if growth > 24} == {}
