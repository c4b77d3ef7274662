"""When a printed output matches the recorded one: modes, ellipsis, filters, outputs of any size."""

from __future__ import annotations

import random
import re
from decimal import Decimal

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coursebuild.core.model import Comparison, Filter
from coursebuild.core.model.results import DriftKind, Outcome, ScriptRun
from coursebuild.core.scripts.lines import MappedText, apply_filters
from coursebuild.pipeline.other_version import RunStanding, judge
from support.fixture_cases import fixture_tables
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

CASES = fixture_tables("comparisons")

COMPARISONS = {
    "exact": [EXACT],
    "digits": [DIGITS],
    "ellipsis": [ELLIPSIS, DIGITS_ELLIPSIS],
    "ellipsis_with_digits": [DIGITS_ELLIPSIS],
}


@pytest.mark.parametrize("mode", COMPARISONS)
def test_an_output_matches_by_its_mode(mode: str) -> None:
    for comparison in COMPARISONS[mode]:
        for recorded, printed, expected in CASES[mode]:
            assert matches(recorded, printed, comparison) is expected, (recorded, printed)


def test_an_output_matches_within_a_tolerance() -> None:
    for recorded, printed, rtol, atol, expected in CASES["tolerance"]:
        assert matches(recorded, printed, tolerance(rtol, atol)) is expected, (recorded, printed)


def test_columns_may_shift_where_a_number_gets_wider() -> None:
    for recorded, printed in CASES["columns"]:
        assert matches(recorded, printed, tolerance(atol="0.3")), (recorded, printed)
        assert matches(printed, recorded, tolerance(atol="0.3")), (recorded, printed)


def test_white_space_away_from_numbers_counts() -> None:
    for recorded in ("a 0.1", "0.1 %", "0.1 0.2", "0.1 m"):
        assert not matches(recorded, recorded.replace(" ", ""), tolerance(atol="0.3"))
    assert not matches("a  b 0.1", "a b 0.1", tolerance(atol="0.3"))


@pytest.mark.parametrize(("recorded", "printed", "rules"), CASES["filters"])
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


WORDS = st.sampled_from(
    ["a", "b c", "x=1.5", "1.5", "2", "-0.0", "nan", "...", "", "  ", "e-3", "|"]
)
OUTPUTS = st.lists(st.lists(WORDS, max_size=4).map(" ".join), max_size=6).map("\n".join)
FILTERS = st.lists(
    st.sampled_from([Filter(r"\d", r"<\g<0>>"), Filter(r"^a.*\n", ""), Filter("x", "")]), max_size=2
).map(tuple)
MODES = st.sampled_from([EXACT, DIGITS, tolerance("0.1", "0.1"), ELLIPSIS, DIGITS_ELLIPSIS])


@settings(max_examples=50)
@given(OUTPUTS, OUTPUTS, MODES, FILTERS)
def test_changes_have_true_places(
    recorded: str, printed: str, comparison: Comparison, filters: tuple[Filter, ...]
) -> None:
    result = verdict(recorded, printed, comparison, filters, prefix="> ", eol="\r\n")
    assert result.status in ("verified", "drift")
    assert bool(result.changes) == (result.status == "drift")
    for change in result.changes:
        change_values(change)
        assert result.recording.body_span.contains(change.span)


@settings(max_examples=50)
@given(OUTPUTS, OUTPUTS)
def test_ellipsis_takes_what_a_regular_expression_takes(recorded: str, printed: str) -> None:
    def output_lines(text: str) -> list[str]:
        return [line.rstrip() for line in text.rstrip().split("\n")] if text.strip() else []

    pattern = ""
    for line in output_lines(recorded):
        if line.strip() == "...":
            pattern += r"(?:[^\n]*\n)*"
        else:
            pattern += r"[^\n]*".join(re.escape(part) for part in line.split("...")) + r"\n"
    text = "".join(line + "\n" for line in output_lines(printed))
    expected = re.fullmatch(pattern, text) is not None
    assert matches(recorded, printed, ELLIPSIS) == expected


def test_a_script_that_ends_otherwise_when_it_is_repeated_is_unclear() -> None:
    good, failure = (
        RunStanding(ScriptRun("examples/a.py", outcome, status, "1\n", "", 0.1), is_compared=True)
        for status, outcome in enumerate((Outcome.OK, Outcome.FAILED))
    )
    assert judge(good, good, failure, "3.14.0") == ("unclear", "two runs of it there differed")
    assert judge(failure, good, failure, "3.14.0") == ("fails", "")


@settings(max_examples=50)
@given(st.integers(-(10**6), 10**6), st.integers(1, 6))
def test_the_border_of_digits_is_exact(value: int, places: int) -> None:
    number = Decimal(value).scaleb(-places)
    half = Decimal(5).scaleb(-places - 1)
    little = Decimal(1).scaleb(-places - 12)
    assert matches(f"{number:f}", f"{number + half:f}", DIGITS)
    assert matches(f"{number:f}", f"{number - half:f}", DIGITS)
    assert not matches(f"{number:f}", f"{number + half + little:f}", DIGITS)
    assert not matches(f"{number:f}", f"{number - half - little:f}", DIGITS)


def numbers(count: int, seed: int) -> list[str]:
    chance = random.Random(seed)
    return [
        f"row {chance.random():.6f} {chance.random():.3e} {chance.randint(0, 9)}"
        for _ in range(count)
    ]


def test_a_few_changes_among_thousands_of_lines_are_found() -> None:
    rows = numbers(4000, 1)
    new_rows = [*rows[:10], "new", *rows[10:2000], *rows[2003:3600], "row 9.5 1e-3 77"]
    result = verdict("\n".join(rows), "\n".join([*new_rows, *rows[3601:]]))
    assert [change.kind for change in result.changes] == [
        DriftKind.EXTRA,
        DriftKind.MISSING,
        *[DriftKind.NUMERIC] * 3,
    ]
    assert [change.printed for change in result.changes[2:]] == ["9.5", "1e-3", "77"]


def test_thousands_of_lines_that_all_differ_are_compared_in_step() -> None:
    recorded, printed = "\n".join(numbers(2000, 1)), "\n".join(numbers(2000, 2))
    result = verdict(recorded, printed, DIGITS_ELLIPSIS)
    assert len({change.span.line for change in result.changes}) > 1990


def test_large_outputs_of_every_shape() -> None:
    rows = numbers(2000, 1)
    ellipses = "\n".join(["a", "...", "b x...y 1.5", "..."] * 400)
    output = "\n".join(["a", "b x 2 y 1.52", "c"] * 560)
    for recorded, printed, comparison, status in (
        ("\n".join(rows), "\n".join(random.Random(3).sample(rows, 2000)), EXACT, "drift"),
        ("\n".join(["a", "b"] * 1000), "\n".join(["b", "b", "a"] * 700), EXACT, "drift"),
        (ellipses, output, DIGITS_ELLIPSIS, "verified"),
        (ellipses + "\nend", output, DIGITS_ELLIPSIS, "drift"),
        ("...\n" + "a\n" * 400 + "b\n...", "a\n" * 800, ELLIPSIS, "drift"),
        ("0.125 " * 4000, "0.1250 " + "0.125 " * 3999, DIGITS, "verified"),
        ("0.125 " * 2000, "0.126 x " + "0.125 " * 1998, EXACT, "drift"),
        ("0.5 ... " * 500 + "end", "0.5  " * 2000 + "end", DIGITS_ELLIPSIS, "verified"),
        ("...1.0 " + "0.5 " * 500 + "2.0...", "0.5 " * 2000, DIGITS_ELLIPSIS, "drift"),
        ("a\nb", "a" + "\n" * 20_000 + "b", EXACT, "drift"),
        ("a", "a" + " " * 100_000 + "\n" * 100_000, EXACT, "verified"),
        ("a", "a" + " " * 100_000 + "b", EXACT, "drift"),
    ):
        result = verdict(recorded, printed, comparison)
        assert result.status == status, (recorded[:40], printed[:40])


TEXTS = st.text(alphabet="ab1 \n-x", max_size=30)
PATTERNS = st.sampled_from(
    [
        ("a", "xyz"),
        ("b+", ""),
        (r"\d", r"<\g<0>>"),
        ("x*", "-"),
        (r"^a.*\n", ""),
        ("$", "!"),
        (r"(a)|b", r"\1"),
    ]
)


@given(TEXTS, st.lists(PATTERNS, max_size=4))
def test_filtering_is_substitution(text: str, rules: list[tuple[str, str]]) -> None:
    expected = text
    for pattern, replacement in rules:
        expected = re.sub(pattern, replacement, expected, flags=re.MULTILINE)
    mapped = apply_filters(MappedText.copy(text), [Filter(*rule) for rule in rules])
    assert mapped.text == expected


def test_origin_of_replacements_inside_replacements() -> None:
    first = MappedText.copy("_abcde_").replace_ranges({(1, 6): "AB"})
    second = first.replace_ranges({(2, 2): "x"})
    assert second.text == "_AxB_"
    assert [second.origin(1, end) for end in (2, 3, 4, 5)] == [(1, 6)] * 3 + [(1, 7)]


def test_a_filter_ends_where_backtracking_would_not() -> None:
    text = "a" * 5000 + "b"
    rules = (Filter(r"(a+)+$", ""), Filter(r"(a|a)*c", ""), Filter("(a*)*b$", "end"))
    assert apply_filters(MappedText.copy(text), rules).text == "end"
