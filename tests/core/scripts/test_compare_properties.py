"""Properties of the comparison that hold for all outputs."""

from __future__ import annotations

import re
from decimal import Decimal

from hypothesis import given, settings
from hypothesis import strategies as st

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

WORDS = st.sampled_from(
    ["a", "b c", "x=1.5", "1.5", "2", "-0.0", "nan", "...", "", "  ", "e-3", "|"]
)
OUTPUTS = st.lists(st.lists(WORDS, max_size=4).map(" ".join), max_size=6).map("\n".join)
FILTERS = st.lists(
    st.sampled_from([Filter(r"\d", r"<\g<0>>"), Filter(r"^a.*\n", ""), Filter("x", "")]),
    max_size=2,
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
