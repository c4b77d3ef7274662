from __future__ import annotations

import re
from dataclasses import replace

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from sample_lessons import (
    DIGITS,
    DIGITS_ELLIPSIS,
    ELLIPSIS,
    EXACT,
    VOLATILE,
    document,
    recording,
    recordings,
    table,
    told,
    within,
)

from coursebuild.diagnostics import Diagnostic, Edit
from coursebuild.model import Comparison, Filter, Recording
from coursebuild.scripts.compare import compare
from coursebuild.scripts.edit import apply_edits, updated_body
from coursebuild.source import Source


def edited(
    lesson: Recording,
    printed: str,
    comparison: Comparison = EXACT,
    filters: tuple[Filter, ...] = (),
    again: str | None = None,
) -> Recording:
    """The recording after its update; a second update has nothing to do."""
    edit = updated_body(lesson, comparison, filters, printed, printed if again is None else again)
    assert isinstance(edit, Edit), edit
    source = lesson.span.source
    text = apply_edits(source.text, [edit])
    assert text[: edit.span.start] == source.text[: edit.span.start]
    assert text[edit.span.start + len(edit.text) :] == source.text[edit.span.end :]
    (new,) = recordings(document(text, source.path, lesson.prefix))
    assert updated_body(new, comparison, filters, printed, printed) is None
    verdict = compare(new, comparison, filters, printed)
    assert verdict.status in ("verified", "volatile")
    return new


def body(
    recorded: str,
    printed: str,
    comparison: Comparison = EXACT,
    filters: tuple[Filter, ...] = (),
    **lesson: str,
) -> str:
    new = edited(recording(recorded, **lesson), printed, comparison, filters)
    start, end = new.body_span.start, new.body_span.end
    return new.span.source.text[start:end]


def refused(
    recorded: str,
    printed: str,
    comparison: Comparison = EXACT,
    again: str | None = None,
    **lesson: str,
) -> str:
    found = updated_body(
        recording(recorded, **lesson), comparison, (), printed, printed if again is None else again
    )
    assert isinstance(found, Diagnostic), found
    return told(found)


# ------------------------------------------------------------------------------------ new text


def test_the_output_is_written() -> None:
    assert body("a 1.5\nb", "a 2.5\nb\nc  \n\n\n") == "a 2.5\nb\nc\n"
    assert body("", "a\n") == "a\n"
    assert body("a\nb\nc", "\n\na") == "\n\na\n"


def test_the_whole_text_is_that_of_the_first_run() -> None:
    assert body("a 1.50\nb 2.50", "a 1.502\nb 2.6", DIGITS) == "a 1.502\nb 2.6\n"


def test_line_ends_and_prefixes_are_the_lesson_s() -> None:
    assert body("a", "b\n\nc", eol="\r\n") == "b\r\n\r\nc\r\n"
    assert body("a", "b\n\nc", eol="\r") == "b\r\rc\r"
    assert body("a", "b\r\n\r\nc", prefix="> ") == "> b\n>\n> c\n"
    assert body("a", " b\n\nc", prefix="   ", eol="\r\n") == "    b\r\n\r\n   c\r\n"
    assert body("", "b\n\nc", prefix=">   ") == ">   b\n>\n>   c\n"


def test_what_matches_is_left_alone() -> None:
    for recorded, printed, comparison in (
        ("a", "a\n", EXACT),
        ("a  ", "a", EXACT),
        ("a 1.50", "a 1.502", DIGITS),
        ("a ... b", "a x b", ELLIPSIS),
        ("a\n...", "a\nb", ELLIPSIS),
        ("took 1 s", "took 1 s", VOLATILE),
    ):
        assert updated_body(recording(recorded), comparison, (), printed, printed) is None


def test_volatile_text_is_refreshed_from_the_first_run() -> None:
    new = edited(recording("took 1 s"), "took 2 s\n", VOLATILE, again="took 3 s\n")
    assert new.body_span.text == "took 2 s\n"


def test_a_tilde_fence_holds_backticks() -> None:
    assert body("a", "```\nb", fence="~~~") == "```\nb\n"
    assert body("a", "```\n~~~~\nb", fence="~~~~~") == "```\n~~~~\nb\n"
    assert body("a", "    ```\n```x\n``\nb") == "    ```\n```x\n``\nb\n"


def test_control_characters_are_kept() -> None:
    assert body("a", "\x1b[31mred\x1b[0m\x07\tb") == "\x1b[31mred\x1b[0m\x07\tb\n"


# ------------------------------------------------------------------------------------- refusals


def test_a_line_that_closes_the_fence() -> None:
    assert (
        refused("a", "x\n  `````  \n")
        == """\
output-not-updatable at 6:1 ````
  the output has a line that would close this fence
  help: open and close it with 6 backticks, then update again""".replace("````\n", "`" * 5 + "\n")
    )
    assert "with 4 tildes" in refused("a", "~~~", fence="~~~")


def test_a_nul() -> None:
    assert (
        refused("a", "x\nb\x00\n")
        == """\
output-not-updatable at 6:1 `````
  line 2 of the output has a NUL character, which Markdown cannot hold
  help: print text only"""
    )


def test_nothing_printed() -> None:
    for comparison in (EXACT, VOLATILE):
        assert (
            refused("a", " \n", comparison)
            == """\
output-not-updatable at 4:1 `Output:`
  the script printed nothing to record"""
        )


def test_runs_that_differ() -> None:
    assert (
        refused("a", "x 1\ny\nz 3\n", again="x 1\ny\nz 4\nnew\n")
        == """\
output-unstable at 4:1 `Output:`
  two runs of the script printed different lines
  note: line 3: `z 3` in one run, `z 4` in the next
  note: `new` was printed in the second run only
  help: make the script print the same each time (a fixed seed, no clock), \
put `volatile` on the fence, elide what varies by `ellipsis` and `...`, \
or filter it by `[[verify.filter]]` in content/course.toml"""
    )


def test_a_recording_that_matches_one_run_only_is_unstable() -> None:
    assert "`lost` was printed in the first run only" in refused("a\nlost", "a\nlost", again="a")
    text = refused(
        "a", "\n".join(f"{i}" for i in range(12)), again="\n".join(f"{i}x" for i in range(12))
    )
    assert "note: and 2 more lines" in text
    text = refused(
        "a", "\n".join(f"{i}" for i in range(11)), again="\n".join(f"{i}x" for i in range(11))
    )
    assert "note: and 1 more line\n" in text


def test_stable_is_what_the_comparison_takes() -> None:
    new = edited(recording("x 9.99"), "x 1.500", DIGITS, again="x 1.5004")
    assert new.body_span.text == "x 1.500\n"
    assert "output-unstable" in refused("x 9.99", "x 1.500", DIGITS, again="x 1.501")
    new = edited(recording("a 1\n..."), "a 2\n0x1", ELLIPSIS, again="a 2\n0x2")
    assert new.body_span.text == "a 2\n...\n"
    filters = (Filter("0x.", "0x"),)
    found = updated_body(recording("a"), EXACT, filters, "b 0x1", "b 0x2")
    assert isinstance(found, Edit) and found.text == "b 0x1\n"


# -------------------------------------------------------------------------------------- ellipsis


@pytest.mark.parametrize(
    ("recorded", "printed", "expected"),
    [
        ("a 1\n...\nb 2", "a 3\nx\ny\nb 4", "a 3\n...\nb 4\n"),
        ("a 1\n...\nb 2", "a 3\nb 2", "a 3\n...\nb 2\n"),
        ("t=... s\na 1", "t=0.3 s\na 2", "t=... s\na 2\n"),
        ("t=... s, E=1.5 J", "t=0.3 s, E=2.5 J", "t=... s, E=2.5 J\n"),
        ("E 1.5 at t=...", "E 2.5 at t=0.3", "E 2.5 at t=...\n"),
        ("a\n...\n...\nb 1", "a\nb 2", "a\n...\n...\nb 2\n"),
        ("...\nb 1\nc", "x\nb 2\nc", "...\nb 2\nc\n"),
        ("a 1\n...", "a 2", "a 2\n...\n"),
        ("a\nb\nc\n...\nd", "a\nc\nx\nd", "a\nc\n...\nd\n"),
        ("a x\nb\n...\nz 1", "a x\nnew\nb\nw\nz 1", "a x\nnew\nb\n...\nz 1\n"),
    ],
)
@pytest.mark.parametrize("comparison", [ELLIPSIS, DIGITS_ELLIPSIS], ids=["exact", "digits"])
def test_ellipses_are_kept(
    recorded: str, printed: str, expected: str, comparison: Comparison
) -> None:
    assert body(recorded, printed, comparison) == expected


def test_under_digits_the_numbers_beside_an_ellipsis_are_brought_up_to_date() -> None:
    assert (
        body("a 1.50\n...\nb 2.50", "a 1.502\nx\nb 2.9", DIGITS_ELLIPSIS) == "a 1.502\n...\nb 2.9\n"
    )


def test_ellipses_that_cannot_be_kept() -> None:
    assert (
        refused("t=... s, E", "u=0.3 s, F", ELLIPSIS)
        == """\
output-not-updatable at 7:1 `t=... s, E`
  an output with `...` cannot be brought up to date here
  ^ this line no longer fits what the script prints
  help: write the line anew by hand, or take the `...` away and update again"""
    )
    assert (
        refused("a\n...\nthe end", "a\nx\ny", ELLIPSIS)
        == """\
output-not-updatable at 9:1 `the end`
  an output with `...` cannot be brought up to date here
  ^ this line was not printed where `...` is
  help: write the line anew by hand, or take the `...` away and update again"""
    )


# --------------------------------------------------------------------------------------- filters


def test_what_matches_by_a_filter_stays_as_written() -> None:
    filters = (Filter(r"\d+ ms", "T ms"), Filter(r"^#.*\n", ""))
    recorded = "# kept\nrun T ms\nE 1.5\n# also"
    printed = "# other\n# more\nrun 17 ms\nE 2.5\n"
    # What a filter deletes before a line goes with the line above it.
    assert body(recorded, printed, EXACT, filters) == "# kept\nrun T ms\nE 2.5\n"


def test_filters_see_no_white_space_at_ends() -> None:
    assert body("a", "x 1\ny  \n", EXACT, (Filter(r" +$", "!"),)) == "x 1\ny\n"
    assert body("", "b", EXACT, (Filter(r"^b.*\n", "c\n"),)) == "b\n"
    # All that was printed is filtered away, and so is what is recorded.
    assert updated_body(recording("b 1"), EXACT, (Filter(r"^b.*\n", ""),), "b 2", "b 3") is None


# ---------------------------------------------------------------------------------------- tables

HEAD = "| a | b | c |\n| --- | --- | --- |\n"


def table_after(
    rows: str, printed: str, comparison: Comparison = EXACT, filters: tuple[Filter, ...] = ()
) -> str:
    new = edited(table(HEAD + rows), printed, comparison, filters)
    return new.body_span.text.removeprefix(HEAD)


def test_the_numbers_of_a_table_are_replaced_in_place() -> None:
    rows = "| `RK4` | **−0.000 %** |  3.9e-11|\n| Euler | +6.641 % | 6.9e-04 |"
    printed = "RK4    -0.001 % of 3.9e-11\nEuler  +6.702 % of 7.5e-04\n"
    assert table_after(rows, printed) == (
        "| `RK4` | **−0.001 %** |  3.9e-11|\n| Euler | +6.702 % | 7.5e-04 |"
    )


def test_a_table_under_digits_keeps_its_decimals() -> None:
    rows = "| Euler | 6.6 | 7e-04 |\n| RK4 | −1.25 | 4 |"
    printed = "Euler +6.7021 9.12e-04\nRK4 -2.349 5\n"
    assert table_after(rows, printed, DIGITS) == "| Euler | 6.7 | 9e-04 |\n| RK4 | −2.35 | 5 |"
    assert table_after(rows, printed, within("0.01")) == (
        "| Euler | +6.7021 | 9.12e-04 |\n| RK4 | −2.349 | 5 |"
    )


def test_a_table_that_matches_is_left_alone() -> None:
    for comparison in (EXACT, VOLATILE):
        assert updated_body(table(HEAD + "| x | 1.5 | |"), comparison, (), "x 1.5", "x 1.5") is None


def test_a_row_without_a_line_is_refused() -> None:
    found = updated_body(
        table(HEAD + "| x | 1.5 | |\n| **y** | 2.5 | |"), EXACT, (), "x 2.5", "x 2.5"
    )
    assert isinstance(found, Diagnostic)
    assert (
        told(found)
        == """\
output-not-updatable at 10:3 `**y** | 2.5`
  no line of this run has the cells of this row in order
  help: bring the row up to date by hand"""
    )


def test_a_table_of_runs_that_differ() -> None:
    found = updated_body(table(HEAD + "| x | 1.5 | |"), EXACT, (), "x 2.5", "x 2.6")
    assert isinstance(found, Diagnostic)
    assert (
        told(found)
        == """\
output-unstable at 5:1 `Output:`
  two runs of the script printed different lines
  note: line 1: `x 2.5` in one run, `x 2.6` in the next
  help: make the script print the same each time (a fixed seed, no clock), \
or record the output in a `text` fence with `volatile`"""
    )


def test_lines_that_no_row_shows_may_differ_between_runs() -> None:
    found = updated_body(table(HEAD + "| x | 1.5 | |"), EXACT, (), "x 2.5\nt 1", "x 2.5\nt 2")
    assert isinstance(found, Edit) and found.text == "2.5"


# ----------------------------------------------------------------------------------------- edits


def edits_of(text: str, *changes: tuple[int, int, str]) -> list[Edit]:
    source = Source("a.md", text)
    return [Edit(source.span(start, end), new) for start, end, new in changes]


def test_edits_are_applied_by_offset() -> None:
    edits = edits_of("abcdef", (4, 5, "X"), (0, 1, ""), (1, 3, "YZW"), (6, 6, "!"))
    assert apply_edits("abcdef", edits) == "YZWdXf!"
    assert apply_edits("abc", []) == "abc"
    assert apply_edits("abc", edits_of("abc", (1, 1, "X"), (1, 2, "Y"))) == "aXYc"


@pytest.mark.parametrize(
    "changes",
    [[(0, 2, ""), (1, 3, "")], [(1, 1, "x"), (1, 1, "y")], [(0, 3, ""), (1, 1, "x")], [(2, 1, "")]],
)
def test_edits_that_overlap_are_a_bug(changes: list[tuple[int, int, str]]) -> None:
    with pytest.raises(ValueError, match="edits overlap at offset"):
        apply_edits("abcdef", edits_of("abcdef", *changes))


def test_edits_of_another_text_are_a_bug() -> None:
    with pytest.raises(ValueError, match=re.escape("an edit of another text than a.md is now")):
        apply_edits("abcdef", edits_of("abc", (0, 1, "x")))


# ------------------------------------------------------------------------------------ properties

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


@given(
    OUTPUTS,
    OUTPUTS,
    st.sampled_from([EXACT, DIGITS, VOLATILE, within("0.05", "0.05")]),
    RULES,
    PREFIXES,
    EOLS,
)
def test_after_an_update_all_is_well(
    recorded: str,
    printed: str,
    comparison: Comparison,
    filters: tuple[Filter, ...],
    prefix: str,
    eol: str,
) -> None:
    assume(printed.strip())
    assume(
        not any(re.match(r" {0,3}```", line) for line in (recorded + "\n" + printed).split("\n"))
    )
    lesson = recording(recorded, prefix=prefix, eol=eol)
    found = updated_body(lesson, comparison, filters, printed, printed)
    if found is None:
        assert compare(lesson, comparison, filters, printed).status != "drift"
    else:
        new = edited(lesson, printed, comparison, filters)
        if not filters:
            assert compare(new, EXACT, (), printed).status == "verified"


MARKED = st.lists(
    st.one_of(LINES, st.sampled_from(["...", "a ... b", "a 1.5 ...", "x=... y", "... 1.5"])),
    max_size=7,
).map("\n".join)


@given(MARKED, OUTPUTS, st.sampled_from([ELLIPSIS, DIGITS_ELLIPSIS]), PREFIXES, EOLS)
def test_an_update_with_ellipses_is_right_or_refused(
    recorded: str, printed: str, comparison: Comparison, prefix: str, eol: str
) -> None:
    assume(printed.strip())
    assume(
        not any(re.match(r" {0,3}```", line) for line in (recorded + "\n" + printed).split("\n"))
    )
    lesson = recording(recorded, prefix=prefix, eol=eol)
    found = updated_body(lesson, comparison, (), printed, printed)
    if isinstance(found, Edit):
        edited(lesson, printed, comparison)
    elif isinstance(found, Diagnostic):
        assert found.rule == "output-not-updatable"
        assert "..." in recorded


@given(OUTPUTS, OUTPUTS, OUTPUTS)
def test_what_two_runs_disagree_on_is_never_written(recorded: str, first: str, second: str) -> None:
    assume(
        first.strip()
        and not any(re.match(r" {0,3}```", line) for line in (recorded + "\n" + first).split("\n"))
    )
    lesson = recording(recorded)
    found = updated_body(lesson, EXACT, (), first, second)
    same = compare(recording(first), EXACT, (), second).status == "verified"
    if isinstance(found, Diagnostic):
        assert not same and found.rule == "output-unstable"
    else:
        assert same


CELLS = st.sampled_from(["Euler", "`RK4`", "**1.5 %**", "−2.50", "3.9e-11", "4", "x 7"])


@given(
    st.lists(st.tuples(CELLS, CELLS, CELLS), min_size=1, max_size=4),
    st.lists(
        st.sampled_from(["Euler 1.6 % -2.51 4", "RK4 1.5 % 3.8e-11 5", "x 7 x 8 -9.25", "4"]),
        min_size=1,
        max_size=5,
    ),
    st.sampled_from([EXACT, DIGITS, within("0.5")]),
)
def test_tables_are_updated_right_or_refused(
    rows: list[tuple[str, str, str]], lines: list[str], comparison: Comparison
) -> None:
    lesson = table(HEAD + "\n".join(f"| {a} | {b} | {c} |" for a, b, c in rows))
    printed = "\n".join(lines)
    found = updated_body(lesson, comparison, (), printed, printed)
    if isinstance(found, Edit):
        edited(lesson, printed, comparison)
    elif isinstance(found, Diagnostic):
        assert found.rule == "output-not-updatable"
    else:
        assert compare(lesson, comparison, (), printed).status == "verified"


def test_a_body_span_inside_a_line_is_widened() -> None:
    """Whether a parser's span begins before or after the prefix, whole lines are replaced."""
    lesson = recording("a\nb", prefix="> ")
    inner = replace(
        lesson.body_span, start=lesson.body_span.start + 2, end=lesson.body_span.end + 2
    )
    edit = updated_body(replace(lesson, body_span=inner), EXACT, (), "c", "c")
    assert isinstance(edit, Edit) and (edit.span, edit.text) == (lesson.body_span, "> c\n")
