"""Whatever was recorded and printed: after an update the recording matches, or it is refused."""

from __future__ import annotations

import re

from hypothesis import assume, given, settings
from hypothesis import strategies as st
from msgspec.structs import replace

from coursebuild.core.model import Comparison, Filter
from coursebuild.core.scripts.compare import compare
from coursebuild.core.scripts.edit import update_body
from coursebuild.core.text.diagnostics import Diagnostic, Edit
from support.sample_lessons import (
    DIGITS,
    DIGITS_ELLIPSIS,
    ELLIPSIS,
    EXACT,
    VOLATILE,
    recording,
    tolerance,
    update,
)

CHARACTERS = st.characters(exclude_categories=["Cs"], exclude_characters="\x00\n\r")
LINES = st.one_of(
    st.text(CHARACTERS, max_size=12),
    st.sampled_from(
        ["", "a 1.5", "a 1.6", "b", "[ 0.1 -0.2]", "x=3 y", "c  ", "\td", "e-3 nan", "``", "> q"]
    ),
)
OUTPUTS = st.lists(LINES, min_size=1, max_size=7).map("\n".join)
PREFIXES = st.sampled_from(["", "> ", "   ", ">   ", "> > "])
EOLS = st.sampled_from(["\n", "\r\n"])
RULES = st.lists(
    st.sampled_from(
        [Filter(r"\d\.\d", "N"), Filter(r"^b.*\n", ""), Filter("x", "y"), Filter(r" +$", "")]
    ),
    max_size=2,
).map(tuple)


def assume_writable(recorded: str, printed: str) -> None:
    lines = (recorded + "\n" + printed).split("\n")
    assume(printed.strip() and not any(re.match(r" {0,3}```", line) for line in lines))


@settings(max_examples=50)
@given(
    OUTPUTS,
    OUTPUTS,
    st.sampled_from([EXACT, DIGITS, VOLATILE, tolerance("0.05", "0.05")]),
    RULES,
    PREFIXES,
    EOLS,
)
def test_after_an_update_the_recording_matches(
    recorded: str,
    printed: str,
    comparison: Comparison,
    filters: tuple[Filter, ...],
    prefix: str,
    eol: str,
) -> None:
    assume_writable(recorded, printed)
    lesson = recording(recorded, prefix=prefix, eol=eol)
    comparison = replace(comparison, course_filters=filters)
    outcome = update_body(lesson, comparison, printed)
    if outcome is None:
        assert compare(lesson, comparison, printed).status != "drift"
    else:
        new = update(lesson, printed, comparison, filters)
        if not filters:
            assert compare(new, EXACT, printed).status == "verified"


ELLIPTIC = st.lists(
    st.one_of(LINES, st.sampled_from(["...", "a ... b", "a 1.5 ...", "x=... y", "... 1.5"])),
    max_size=7,
).map("\n".join)


@settings(max_examples=50)
@given(ELLIPTIC, OUTPUTS, st.sampled_from([ELLIPSIS, DIGITS_ELLIPSIS]), PREFIXES, EOLS)
def test_an_update_with_ellipses_is_right_or_refused(
    recorded: str, printed: str, comparison: Comparison, prefix: str, eol: str
) -> None:
    assume_writable(recorded, printed)
    lesson = recording(recorded, prefix=prefix, eol=eol)
    outcome = update_body(lesson, comparison, printed)
    if isinstance(outcome, Edit):
        update(lesson, printed, comparison)
    elif isinstance(outcome, Diagnostic):
        assert outcome.rule == "output-not-updatable"
        assert "..." in recorded
