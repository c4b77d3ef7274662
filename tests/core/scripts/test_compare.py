"""When a printed output matches the recorded one: modes, ellipsis, filters."""

from __future__ import annotations

import pytest

from coursebuild.core.model import Comparison, Filter
from support.sample_lessons import (
    DIGITS,
    DIGITS_ELLIPSIS,
    ELLIPSIS,
    EXACT,
    change_values,
    matches,
    tolerance,
    verdict,
)

# ---------------------------------------------------------------------------------------- modes


@pytest.mark.parametrize(
    ("recorded", "printed", "expected"),
    [
        ("a 1.0\nb", "a 1.0\nb\n", True),
        ("a 1.0", "a 1.00", False),
        ("a  b", "a b", False),
        ("0.000", "-0.000", False),
        ("a  \nb", "a\nb \t\n\n  \n\n", True),
        ("a\n\nb", "a\nb", False),
        ("a", "\na", False),
        ("a\nb", "a\r\nb\r", True),
        ("a\u2028b", "a\nb", False),
        ("a\x0cb\x85c", "a\x0cb\x85c", True),
        ("a ... c", "a b c", False),
    ],
)
def test_exact(recorded: str, printed: str, expected: bool) -> None:
    assert matches(recorded, printed) is expected


@pytest.mark.parametrize(
    ("recorded", "printed", "expected"),
    [
        ("3.14", "3.1449", True),
        ("3.14", "3.149", False),
        ("3.14", "3.145", True),
        ("3.14", "3.135", True),
        ("3.14", "3.1450000000000000000000001", False),
        ("1.5e-3", "0.00155", True),
        ("1.5e-3", "1.551e-3", False),
        ("3.9e-11", "3.94e-11", True),
        ("3.9e-11", "4.0e-11", False),
        ("-0.000", "0.000", True),
        ("-0.000", "+0.0004", True),
        ("0.", "0.4", True),
        ("+6.641", "6.641", True),
        ("6.641", "-6.641", False),
        ("4 flips", "4 flips", True),
        ("4 flips", "5 flips", False),
        ("4 flips", "4.0 flips", False),
        ("4.0 flips", "4 flips", False),
        ("+4", "4", False),
        ("nan", "nan", True),
        ("nan", "NaN", False),
        ("inf", "1.0", False),
        ("1.0", "nan", False),
        ("v3.14.0", "v3.14.1", False),
        ("2026-11-20", "2026-11-21", False),
        ("x 3.14 y", "x 3.1402 z", False),
        ("12.5ms", "12.52ms", True),
        ("12.5ms", "12.52 ms", False),
        ("a 1.0", "a \0", False),
        ("x5 1.5j", "x5+1.5j", False),
        ("1.5+2.0j", "1.52+1.98j", True),
        ("1.5+0.0j", "1.5-0.0j", True),
    ],
)
def test_digits(recorded: str, printed: str, expected: bool) -> None:
    assert matches(recorded, printed, DIGITS) is expected


@pytest.mark.parametrize(
    ("recorded", "printed", "comparison", "expected"),
    [
        ("1.0", "1.000001", tolerance("1e-6"), True),
        ("1.0", "1.0000010000000000000000001", tolerance("1e-6"), False),
        ("100", "101", tolerance("0.01"), True),
        ("100", "102", tolerance("0.01"), False),
        ("101", "100", tolerance("0.01"), True),
        ("0", "1e-13", tolerance("1e-6", "1e-12"), True),
        ("0", "1e-11", tolerance("1e-6", "1e-12"), False),
        ("0.3", "0.1", tolerance(atol="0.2"), True),
        ("-1.0", "1.0", tolerance("1"), False),
        ("nan", "nan", tolerance("1e-6"), True),
        ("nan", "NaN", tolerance("1e-6"), True),
        ("nan", "0.0", tolerance("1e9", "1e9"), False),
        ("inf", "inf", tolerance("1e-6"), True),
        ("inf", "-inf", tolerance("1e-6"), False),
        ("inf", "Infinity", tolerance("1e-6"), True),
        ("1e300", "inf", tolerance("1"), False),
        ("4 flips", "4.0 flips", tolerance("1e-6"), True),
        ("a 1", "b 1", tolerance("1"), False),
        ("1.2.3", "1.2.4", tolerance("1"), False),
        ("1 2", "1", tolerance("1"), False),
    ],
)
def test_tolerance(recorded: str, printed: str, comparison: Comparison, expected: bool) -> None:
    assert matches(recorded, printed, comparison) is expected


@pytest.mark.parametrize(
    ("recorded", "printed"),
    [
        ("[ 0.1 -0.2]", "[-0.0 -0.2]"),
        ("[0.1 0.2]", "[ 0.1  0.2 ]"),
        ("   9.9 x", "  10.1 x"),
        ("9.9 x", " 9.9 x"),
        ("Euler   9.9 %", "Euler  10.1 %"),
        ("x= 0.10", "x=-0.05"),
        ("array([ 0.1, 0.2])", "array([0.1,  0.2])"),
        ("| 0.1 | 0.2 |", "|0.1  |0.2  |"),
        ("0.1       foo", "0.12 foo"),
        ("[[ 0.1  0.2]", "[[0.1 0.2]"),
        ("[ nan 1.0]", "[nan   1.0]"),
        ("a\t0.1", "a 0.1"),
    ],
)
def test_columns_may_shift_where_a_number_gets_wider(recorded: str, printed: str) -> None:
    assert matches(recorded, printed, tolerance(atol="0.3"))
    assert matches(printed, recorded, tolerance(atol="0.3"))


def test_white_space_away_from_numbers_counts() -> None:
    for recorded in ("a 0.1", "0.1 %", "0.1 0.2", "0.1 m"):
        assert not matches(recorded, recorded.replace(" ", ""), tolerance(atol="0.3"))
    assert not matches("a  b 0.1", "a b 0.1", tolerance(atol="0.3"))


# ------------------------------------------------------------------------------------- ellipsis


@pytest.mark.parametrize(
    ("recorded", "printed", "expected"),
    [
        ("a ... c", "a b c", True),
        ("a ... c", "a  c", True),
        ("a ... c", "a c", False),
        ("a...c", "ac", True),
        ("a...b...c", "a b b c", True),
        ("a...b...c", "a c b", False),
        ("ab...ba", "aba", False),
        ("...", "", True),
        ("...", "a\nb\nc", True),
        ("a\n...", "a", True),
        ("a\n...\nc", "a\nc", True),
        ("a\n...\nc", "a\nb\nb\nc", True),
        ("a\n...\nc", "a\nb\nd", False),
        ("a\n...\nb\n...\nc", "a\nx\nb\ny\nb\nc", True),
        ("...\nb", "b\nb\nb", True),
        ("...\nb", "b\nc", False),
        ("b\n...", "c\nb", False),
        ("a\n...\n...\nb", "a\nb", True),
        ("  ...\nb", "a\nb", True),
        ("a\n...\na", "a", False),
        ("a...", "a\nb", False),
        ("...a", "xa", True),
        ("....", ".", True),
        ("x...y...", "xy", True),
        ("[0. ... 9.]", "[0. ... 9.]", True),
    ],
)
def test_ellipsis(recorded: str, printed: str, expected: bool) -> None:
    assert matches(recorded, printed, ELLIPSIS) is expected
    assert matches(recorded, printed, DIGITS_ELLIPSIS) is expected


@pytest.mark.parametrize(
    ("recorded", "printed", "expected"),
    [
        ("x = 3.14 ... E = 0.50", "x = 3.1402 and so on E = 0.502", True),
        ("x = 3.14 ... E = 0.50", "x = 3.15 and so on E = 0.502", False),
        ("x = 3.14 ... E = 0.50", "x = 3.14 and so on E = 0.51", False),
        ("pi = 3.1...", "pi = 3.19", True),
        ("pi = 3.1...", "pi = 3.2", False),
        ("a 0.50 ...", "a 0.501", True),
        ("a ... 0.50", "a b= 0.501", True),
        ("a 0.10 ... 0.10 b", "a 0.102 0.3 0.4 0.099 b", True),
        ("a 0.10 ... 0.10 ... 0.30", "a 0.10 0.2 0.1 0.2 0.30", True),
        ("a 0.10 ... 0.1 ... 0.30", "a 0.10 0.2 0.2 0.2 0.30", False),
        ("0.10\n...\n0.20", "0.101\nfoo\n0.199", True),
        ("0.10\n...\n0.20", "0.101\nfoo\n0.21", False),
        ("i 1\n...\ni 9", "i 1\ni 2\ni 9", True),
    ],
)
def test_ellipsis_with_digits(recorded: str, printed: str, expected: bool) -> None:
    assert matches(recorded, printed, DIGITS_ELLIPSIS) is expected


# --------------------------------------------------------------------------------------- filters


@pytest.mark.parametrize(
    ("recorded", "printed", "rules"),
    [
        ("<body at 0x7f>", "<body at 0xab>", [(r"0x[0-9a-f]+", "0x…")]),
        ("<body at 0x…>", "<body at 0xab>", [(r"0x[0-9a-f]+", "0x…")]),
        ("took TIME", "took 12 s", [(r"took \d+ s", "took T"), (r" T\b", " TIME")]),
        ("a\nb", "a\nWarning: x\nWarning: y\nb\n", [(r"^Warning:.*\n", "")]),
    ],
)
def test_filters(recorded: str, printed: str, rules: list[tuple[str, str]]) -> None:
    filters = tuple(Filter(*rule) for rule in rules)
    assert verdict(recorded, printed, EXACT, filters).status == "verified"


def test_places_behind_filters_are_true() -> None:
    filters = (Filter(r"0x[0-9a-f]+", "somewhere"), Filter(r"^#.*\n", ""))
    lesson = "# one\nat 0x1 E 1.5 b\n# two\nat 0x22 F 2.5"
    result = verdict(lesson, "at 0x333 E 1.5 b\n# more\nat 0x4 F 2.6", EXACT, filters)
    assert [change_values(c) for c in result.changes] == [("rounding", "2.5", "2.6")]
    (change,) = result.changes
    assert change.span.source.line_text(change.span.line) == "at 0x22 F 2.5"
    assert change.span.column == len("at 0x22 F ") + 1


def test_a_change_inside_a_replacement_covers_all_that_it_replaced() -> None:
    shorter = Filter(r"(\d\.\d)\d+", r"\1")
    result = verdict("E 6.6411 J", "E 6.7022 J", EXACT, (shorter,))
    assert [change_values(c) for c in result.changes] == [("rounding", "6.6411", "6.7022")]
