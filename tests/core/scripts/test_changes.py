"""Differences between what is recorded and what is printed, and how they are told."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coursebuild.core.model import Comparison
from coursebuild.core.model.lesson_record import Addresses
from coursebuild.core.model.results import ScriptRun
from coursebuild.core.scripts.bindings import check_bindings
from coursebuild.core.scripts.compare import compare, verify
from coursebuild.core.scripts.diff import diff_rows
from coursebuild.core.scripts.findings import drift_diagnostic
from coursebuild.core.scripts.printed_outputs import PrintedOutputs
from coursebuild.core.text.diagnostics import Diagnostic
from coursebuild.report.text import Style, diagnostic_text
from support.fixture_cases import fixture_tables
from support.sample_lessons import (
    DIGITS_ELLIPSIS,
    ELLIPSIS,
    EXACT,
    change_values,
    course,
    describe,
    document,
    make_run,
    recording,
    table,
    verdict,
)

CASES = fixture_tables("changes")

ENERGY = """\
conservation over 20 s:
  RK4           kinetic energy  -0.000 %   3.9e-11
  Euler         kinetic energy  +6.641 %   6.9e-04
  implicit      kinetic energy  -6.040 %   6.4e-04"""


@pytest.mark.parametrize("prefix", ["> ", "   ", ">   "])
@pytest.mark.parametrize("eol", ["\n", "\r\n"])
def test_places_in_nested_fences(prefix: str, eol: str) -> None:
    result = verdict(ENERGY, ENERGY.replace("6.9e-04", "7.0e-04"), prefix=prefix, eol=eol)
    (change,) = result.changes
    assert change_values(change) == ("rounding", "6.9e-04", "7.0e-04")
    assert (change.span.line, change.span.column) == (9, 44 + len(prefix))


def test_classes_of_numbers() -> None:
    for recorded, printed, kind in CASES["classes"]:
        result = verdict(f"E {recorded} J", f"E {printed} J")
        assert [change_values(c) for c in result.changes] == [(kind, recorded, printed)]


def test_enormous_errors_stay_finite() -> None:
    (change,) = verdict("E 1e-300", "E 1e300").changes
    assert change.relative_error is None and change.digits == 0


def test_changes() -> None:
    comparisons = {"exact": EXACT, "ellipsis": ELLIPSIS}
    for recorded, printed, mode, changes in CASES["changes"]:
        result = verdict(recorded, printed, comparisons[mode])
        assert [list(change_values(change)) for change in result.changes] == changes


def test_missing_and_extra_lines_have_places() -> None:
    (missing,) = verdict("a one\nb two\nc three\nd four", "a one\nd four").changes
    assert missing.span.text == "b two\nc three"
    (extra,) = verdict("a one\nd four", "a one\nb two\nc three\nd four").changes
    assert (extra.span.line, extra.span.text) == (8, "")


def drift(recorded: str, printed: str, comparison: Comparison = EXACT) -> Diagnostic:
    return drift_diagnostic(compare(recording(recorded), comparison, printed), "4.2")


def test_labels() -> None:
    for recorded, printed, label in CASES["labels"]:
        assert drift(recorded, printed).label == label


def test_a_drift_is_reported_in_ten_lines() -> None:
    lines = "\n".join(f"row {i} = {i}.5" for i in range(40))
    diagnostic = drift(lines, lines.replace(".5", ".7"))
    assert diagnostic.message == "recorded output differs from this run (numeric: 40)"
    assert [note.message for note in diagnostic.notes] == [
        "recorded 1.5; this run printed 1.7 (relative error 1.3e-01, no digit agrees)",
        "recorded 2.5; this run printed 2.7 (relative error 8.0e-02, 1 digit agrees)",
        "recorded 3.5; this run printed 3.7 (relative error 5.7e-02, 1 digit agrees)",
        "and 36 more differences",
    ]
    assert len(diagnostic_text(diagnostic, Style()).split("\n")) == 10


def rows(recorded: str, printed: str) -> list[str]:
    """Each row as text; what changed is in brackets."""
    block = recording(recorded)
    verdict = compare(block, DIGITS_ELLIPSIS, printed)
    return [
        mark + "".join(f"[{text}]" if is_changed else text for text, is_changed in parts)
        for mark, parts in diff_rows(verdict, printed)
    ]


def test_rows() -> None:
    for recorded, printed, expected in CASES["rows"]:
        assert rows(recorded, printed) == expected


def test_rows_of_a_table_are_the_cells_that_changed() -> None:
    block = table("| n | x |\n| --- | --- |\n| 1 | 2.5 |")
    verdict = compare(block, EXACT, "1 3.5\n")
    cell_rows = [(mark, parts[0][0]) for mark, parts in diff_rows(verdict, "1 3.5\n")]
    assert cell_rows == [("-", "2.5"), ("+", "3.5")]


# No digits beside spaces: `1` and ` 1` are the same number, shown as it was recorded.
LINE = st.text("ab1", max_size=6) | st.text("ab ", max_size=6).map(str.rstrip)
LINES = st.lists(LINE, min_size=1, max_size=6)


@settings(max_examples=50)
@given(LINES, LINES)
def test_the_rows_are_both_texts(recorded: list[str], printed: list[str]) -> None:
    """Without added rows they are the recorded text; without removed rows, the printed one."""
    recorded_text, printed_text = "\n".join(recorded).rstrip("\n"), "\n".join(printed).rstrip("\n")
    if (
        not recorded_text
        or compare(recording(recorded_text), DIGITS_ELLIPSIS, printed_text).status != "drift"
    ):
        return
    lines = [row.replace("[", "").replace("]", "") for row in rows(recorded_text, printed_text)]
    assert [row[1:] for row in lines if row[0] != "+"] == recorded_text.split("\n")
    assert [row[1:] for row in lines if row[0] != "-"] == (
        printed_text.split("\n") if printed_text else []
    )


PENDULUM = "period   2.006 s\nhalf     1.003 s\n"


def lesson(prose: str, output: str, fence: str = "text") -> str:
    body = output if output.startswith("|") else f"```{fence}\n{output}```\n"
    return f"```python file=examples/a.py\nprint(1)\n```\n\nOutput:\n\n{body}\n{prose}\n"


def check(addresses: Addresses, text: str, *runs: ScriptRun) -> tuple[Diagnostic, ...]:
    page = document(text)
    verdicts = verify(course(page), runs)
    return check_bindings(page, PrintedOutputs(verdicts, runs, ["examples/a.py"]), addresses)


def mismatch_after(binding: str, before: str, now: str, fence: str = "text") -> Diagnostic:
    """The diagnostic of a binding after a new output is recorded.

    Before that, the old recording is compared with the new run, as before an update is accepted.
    """
    prose = f"`{binding}`{{out}}"
    addresses: Addresses = {}
    assert check(addresses, lesson(prose, before, fence), make_run(before)) == ()
    assert check(addresses, lesson(prose, before, fence), make_run(now)) == ()
    (diagnostic,) = check(addresses, lesson(prose, now, fence), make_run(now))
    proposals = [edit.text for edit in diagnostic.edits]
    for text in proposals:  # the proposal holds
        assert check(addresses, lesson(f"`{text}`{{out}}", now, fence), make_run(now)) == ()
    return diagnostic


def test_wording_of_a_mismatch() -> None:
    diagnostic = mismatch_after("2.006 s", PENDULUM, "period   2.950 s\nhalf     1.975 s\n")
    assert (
        describe(diagnostic)
        == """\
binding-mismatch at 12:2 `2.006 s`
  `2.006 s` is not what `examples/a.py` printed, rounded to the digits shown
  ^ 2.950 is printed there now, in `period 2.950 s`
  help: write `2.950 s`"""
    )
    diagnostic = mismatch_after("2.006", PENDULUM, "half   1.975 s\nwhole   2.006 s\n")
    assert (
        describe(diagnostic)
        == """\
binding-mismatch at 12:2 `2.006`
  the line that showed `2.006` is no longer printed: `period # s`
  note at 9:9 `2.006`: `{out="whole"}` chooses `whole 2.006 s`
  help: bind it anew: choose the words before it, as in `{out="tau"}`"""
    )


@pytest.mark.parametrize(("binding", "before", "now", "printed", "better"), CASES["proposals"])
def test_what_stands_at_the_address_is_proposed(
    binding: str, before: str, now: str, printed: str, better: str
) -> None:
    diagnostic = mismatch_after(binding, before + "\n", now + "\n")
    if not printed:
        assert "is no longer printed: " in diagnostic.message
    else:
        assert diagnostic.label.startswith(f"{printed} ")
    assert diagnostic.help == (f"write `{better}`" if better else diagnostic.help)
    assert [edit.text for edit in diagnostic.edits] == [better][: bool(better)]


@pytest.mark.parametrize(("before", "now", "successor"), CASES["successors"])
def test_which_line_is_the_same(before: str, now: str, successor: str) -> None:
    diagnostic = mismatch_after("2.5", before + "\n", now + "\n")
    assert [edit.text for edit in diagnostic.edits] == [successor][: bool(successor)]


def test_lines_left_out_by_an_ellipsis_have_addresses_too() -> None:
    addresses: Addresses = {}
    text = lesson("`7.5`{out}", "start\n...\nend 1.5\n", "text ellipsis")
    assert check(addresses, text, make_run("start\nx 7.52\nend 1.5\n")) == ()
    (diagnostic,) = check(addresses, text, make_run("start\nx 9.52\ny 7.5\nend 1.5\n"))
    assert diagnostic.help == "write `9.5`"


def test_an_old_number_beside_another_name_does_not_hold() -> None:
    addresses: Addresses = {}
    assert check(addresses, lesson("`2.006`{out}", PENDULUM), make_run(PENDULUM)) == ()
    now = "period   4.012 s\nhalf     2.006 s\n"
    (diagnostic,) = check(addresses, lesson("`2.006`{out}", now), make_run(now))
    assert diagnostic.help == "write `4.012`"


@pytest.mark.parametrize(("binding", "printed", "nearest"), CASES["nearest"])
def test_without_an_address_the_nearest_number_is_named(
    binding: str, printed: str, nearest: str
) -> None:
    text = lesson(f"`{binding}`{{out}}", printed + "\n")
    (diagnostic,) = check({}, text, make_run(printed + "\n"))
    assert (
        diagnostic.label.replace("values are", "value is")
        == f"the nearest printed value is {nearest}"
    )
    assert diagnostic.edits == ()


NUMBER = st.integers(1000, 9999).map(lambda n: f"{n / 100:.2f}")


@settings(max_examples=50)
@given(
    st.lists(NUMBER, min_size=2, max_size=6, unique=True), st.randoms(use_true_random=False),
    st.data(),
)  # fmt: skip
def test_a_named_number_is_never_taken_for_another(
    numbers: list[str], random: object, data: st.DataObject
) -> None:
    """Lines with names of their own, in any order, with others between them, none a heading."""
    names = [f"{chr(97 + k)} is" for k in range(len(numbers))]
    before = "".join(f"{name} {number}\n" for name, number in zip(names, numbers, strict=True))
    new_numbers = data.draw(st.lists(NUMBER, min_size=len(names), max_size=len(names), unique=True))
    rows = [f"{name} {number}\n" for name, number in zip(names, new_numbers, strict=True)]
    rows += data.draw(st.lists(st.sampled_from(["less 4\n", "more 17\n"]), max_size=2, unique=True))
    now = "".join(data.draw(st.permutations(rows)))
    if numbers[0] in new_numbers:
        return
    diagnostic = mismatch_after(numbers[0], before, now)
    assert [edit.text for edit in diagnostic.edits] == [new_numbers[0]]
