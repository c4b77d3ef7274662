"""New outputs as edits of a lesson's text, and what is refused."""

from __future__ import annotations

import re

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from msgspec.structs import replace

from coursebuild.core.model import Comparison, Filter
from coursebuild.core.scripts.compare import compare
from coursebuild.core.scripts.edit import apply_edits, update_body
from coursebuild.core.text.diagnostics import Diagnostic, Edit
from coursebuild.core.text.source import Source
from support.fixture_cases import fixture_tables
from support.sample_lessons import (
    DIGITS,
    DIGITS_ELLIPSIS,
    ELLIPSIS,
    EXACT,
    VOLATILE,
    body,
    recording,
    refusal_text,
    tolerance,
    update,
)

CASES = fixture_tables("updates")

SECONDS = Comparison(volatile="[0-9.]+ s")

# ------------------------------------------------------------------------------------ new text


def test_the_output_is_written_as_the_lesson_is() -> None:
    for recorded, printed, style, expected in CASES["plain"]:
        assert body(recorded, printed, **style) == expected


def test_what_matches_is_left_alone() -> None:
    for recorded, printed, comparison in (
        ("a", "a\n", EXACT),
        ("a  ", "a", EXACT),
        ("a 1.50", "a 1.502", DIGITS),
        ("a ... b", "a x b", ELLIPSIS),
        ("a\n...", "a\nb", ELLIPSIS),
        ("took 1 s", "took  23 s", VOLATILE),
        ("took   1.5 s, E 2", "took 23.5 s, E 2", SECONDS),
    ):
        assert update_body(recording(recorded), comparison, printed) is None


def test_volatile_text_is_refreshed_where_more_than_its_numbers_changed() -> None:
    new = update(recording("took 1 s"), "needed 2 s\n", VOLATILE)
    assert new.body_span.text == "needed 2 s\n"


def test_what_varies_is_written_with_the_rest_of_its_line_only() -> None:
    recorded, printed = "a 1 s, E 2\nb 1 s\n", "a 7 s, E 3\nb 7 s\n"
    new = update(recording(recorded), printed, SECONDS)
    assert new.body_span.text == "a 7 s, E 3\nb 1 s\n"


# ------------------------------------------------------------------------------------- refusals


def test_what_cannot_be_recorded_is_refused() -> None:
    assert refusal_text("a", "x\nb\x00\n").split("\n")[1:] == [
        "  line 2 of the output has a NUL character, which Markdown cannot hold",
        "  help: print text only",
    ]
    for comparison in (EXACT, VOLATILE):
        refusal = refusal_text("a", " \n", comparison)
        assert refusal.endswith("`Output:`\n  the script printed nothing to record")


# -------------------------------------------------------------------------------------- ellipsis


@pytest.mark.parametrize(("recorded", "printed", "expected"), CASES["ellipses"])
@pytest.mark.parametrize("comparison", [ELLIPSIS, DIGITS_ELLIPSIS], ids=["exact", "digits"])
def test_ellipses_are_kept(
    recorded: str, printed: str, expected: str, comparison: Comparison
) -> None:
    assert body(recorded, printed, comparison) == expected


# --------------------------------------------------------------------------------------- filters


def test_what_matches_by_a_filter_stays_as_written() -> None:
    filters = (Filter(r"\d+ ms", "T ms"), Filter(r"^#.*\n", ""))
    recorded = "# kept\nrun T ms\nE 1.5\n# also"
    printed = "# other\n# more\nrun 17 ms\nE 2.5\n"
    # What a filter deletes before a line goes with the line above it.
    assert body(recorded, printed, EXACT, filters) == "# kept\nrun T ms\nE 2.5\n"


# ----------------------------------------------------------------------------------------- edits


def test_edits_that_overlap_or_are_of_another_text_are_refused() -> None:
    def apply_changes(*changes: tuple[int, int, str], text: str = "abcdef") -> str:
        source = Source("a.md", text)
        return apply_edits("abcdef", [Edit(source.span(a, b), new) for a, b, new in changes])

    assert (
        apply_changes((4, 5, "X"), (0, 1, ""), (1, 3, "YZW"), (6, 6, "!"), (3, 3, "-"))
        == "YZW-dXf!"
    )
    for first, second in (
        ((0, 2, ""), (1, 3, "")),
        ((1, 1, "x"), (1, 1, "y")),
        ((0, 3, ""), (1, 1, "")),
    ):
        with pytest.raises(ValueError, match="edits overlap at offset 1 of"):
            apply_changes(first, second)
    with pytest.raises(ValueError, match=r"an edit of another text than a\.md is now"):
        apply_changes((0, 1, "x"), text="abc")


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
