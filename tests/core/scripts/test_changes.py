"""The place, the class and the text of each change, in a report and on a page."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coursebuild.core.model import Comparison
from coursebuild.core.model.results import DriftKind
from coursebuild.core.scripts.compare import compare
from coursebuild.core.scripts.diff import diff_rows
from coursebuild.core.scripts.findings import drift_diagnostic
from coursebuild.core.text.diagnostics import Diagnostic
from coursebuild.report.text import Style, diagnostic_text
from support.sample_lessons import (
    DIGITS_ELLIPSIS,
    ELLIPSIS,
    EXACT,
    change_values,
    recording,
    table,
    verdict,
)

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


@pytest.mark.parametrize(
    ("recorded", "printed", "kind"),
    [
        ("6.641", "6.642", DriftKind.ROUNDING),
        ("6.641", "6.640", DriftKind.ROUNDING),
        ("6.641", "6.643", DriftKind.NUMERIC),
        ("6.641", "6.6421", DriftKind.NUMERIC),
        ("6.641", "6.6414", DriftKind.ROUNDING),
        ("6.999", "7.000", DriftKind.ROUNDING),
        ("-0.000", "0.001", DriftKind.ROUNDING),
        ("1.5e-3", "1.6e-3", DriftKind.ROUNDING),
        ("1.5e-3", "1.6e-2", DriftKind.NUMERIC),
        ("4", "5", DriftKind.NUMERIC),
        ("0.5", "0.50", DriftKind.TEXT),
        ("-0.000", "0.000", DriftKind.TEXT),
        ("nan", "0.5", DriftKind.NUMERIC),
        ("inf", "-inf", DriftKind.NUMERIC),
    ],
)
def test_classes_of_numbers(recorded: str, printed: str, kind: DriftKind) -> None:
    result = verdict(f"E {recorded} J", f"E {printed} J")
    assert [(c.kind, c.recorded, c.printed) for c in result.changes] == [(kind, recorded, printed)]


def test_enormous_errors_stay_finite() -> None:
    (change,) = verdict("E 1e-300", "E 1e300").changes
    assert change.relative_error is None and change.digits == 0


def test_white_space_is_named_only_where_nothing_else_differs() -> None:
    result = verdict("a   9.9 b", "a  10.9 b")
    assert [change_values(c) for c in result.changes] == [("numeric", "9.9", "10.9")]
    result = verdict("a   b", "a  b")
    assert [change_values(c) for c in result.changes] == [("text", "   ", "  ")]


def test_text_changes_are_small() -> None:
    result = verdict("the red box at 1.5 m", "the dark blue box at 1.5 m")
    assert [change_values(c) for c in result.changes] == [("text", "red", "dark blue")]
    result = verdict("E: 6.641 %", "E total: 6.702 %")
    assert [change_values(c) for c in result.changes] == [
        ("text", "", " total"),
        ("numeric", "6.641", "6.702"),
    ]


def test_missing_and_extra_lines() -> None:
    result = verdict("a one\nb two\nc three\nd four", "a one\nd four")
    assert [change_values(c) for c in result.changes] == [("missing lines", "b two\nc three", "")]
    assert result.changes[0].span.text == "b two\nc three"
    result = verdict("a one\nd four", "a one\nb two\nc three\nd four")
    assert [change_values(c) for c in result.changes] == [("extra lines", "", "b two\nc three")]
    assert (
        result.changes[0].span.line == 8
        and result.changes[0].span.start == result.changes[0].span.end
    )


def test_a_line_that_moved_is_missing_here_and_extra_there() -> None:
    result = verdict("x alpha\ny beta\nz gamma", "y beta\nz gamma\nx alpha")
    assert [c.kind.value for c in result.changes] == ["missing lines", "extra lines"]


def test_changes_beside_an_ellipsis() -> None:
    result = verdict("start\n...\nE 1.50\nend", "start\nfoo\nbar\nE 1.70\nend", ELLIPSIS)
    assert [change_values(c) for c in result.changes] == [("numeric", "1.50", "1.70")]
    result = verdict("t=... s, E 1.5 J", "t=0.1 s, E 2.5 J", ELLIPSIS)
    assert [change_values(c) for c in result.changes] == [("numeric", "1.5", "2.5")]
    result = verdict("t=... s, E", "u=0.1 s, F", ELLIPSIS)
    assert [change_values(c) for c in result.changes] == [("text", "t=... s, E", "u=0.1 s, F")]


def drift(recorded: str, printed: str, comparison: Comparison = EXACT) -> Diagnostic:
    return drift_diagnostic(compare(recording(recorded), comparison, printed), "4.2")


@pytest.mark.parametrize(
    ("recorded", "printed", "label"),
    [
        ("E 6.641", "E 6.702", "this run printed 6.702 (relative error 9.2e-03, 2 digits agree)"),
        ("E 1.0", "E 1.5", "this run printed 1.5 (relative error 5.0e-01, no digit agrees)"),
        ("E 1.00", "E 1.05", "this run printed 1.05 (relative error 5.0e-02, 1 digit agrees)"),
        ("E 1.00", "E 1.01", "this run printed 1.01 (relative error 1.0e-02, 2 digits agree)"),
        ("E 0.0", "E 1.5", "this run printed 1.5"),
        ("E 1.0", "E nan", "this run printed nan"),
        ("E 1e-9", "E 1e500", "this run printed 1e500"),
        ("E 1.0", "E 1.00", "this run printed 1.00 (the same value, written in another way)"),
        ("a red b", "a blue b", "this run printed `blue`"),
        ("a red b", "a b", "this run printed nothing here"),
        ("a b", "a red b", "this run printed `red`"),
        ("a   b", "a b", "this run printed white space of another width here"),
        ("a\nb c d", "a", "this run did not print this line"),
        ("a\nb\nc", "a", "this run did not print these 2 lines"),
        ("a", "a\nb", "this run printed `b` here"),
        ("a", "a\nb\nc", "this run printed `b` and 1 more line here"),
        ("a", "a\nb\nc\nd", "this run printed `b` and 2 more lines here"),
        ("a", "b" * 99, f"this run printed `{'b' * 59}…`"),
    ],
)
def test_labels(recorded: str, printed: str, label: str) -> None:
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


@pytest.mark.parametrize(
    ("recorded", "printed", "expected"),
    [
        ("pi 3.14\nn 2", "pi 3.14159\nn 3", [" pi 3.14", "-n [2]", "+n [3]"]),
        ("a\n...\nz 1", "a\nb\nc\nz 2", [" a", " ...", "-z [1]", "+z [2]"]),
        ("a 1\nb 2\nc 3", "a 1\nb 4\nc 3", [" a 1", "-b [2]", "+b [4]", " c 3"]),
        ("a 1\nb 2", "a 3\nb 4", ["-a [1]", "-b [2]", "+a [3]", "+b [4]"]),
        ("one\ntwo", "one", [" one", "-[two]"]),
        ("one", "one\ntwo", [" one", "+[two]"]),
        # half of their words make two lines one; what is between such is one after the other
        (
            "first\nmass one",
            "mass two\nlast",
            ["-[first]", "-mass [one]", "+mass [two]", "+[last]"],
        ),
        ("the mass is 3", "the mass was 3", ["-the mass [is] 3", "+the mass [was] 3"]),
        ("a\n\nb 1", "a\n\nb 2", [" a", " ", "-b [1]", "+b [2]"]),
    ],
)
def test_rows(recorded: str, printed: str, expected: list[str]) -> None:
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
