from __future__ import annotations

import random
import re
import time
from decimal import Decimal

import pytest
from hypothesis import given
from hypothesis import strategies as st
from sample_lessons import (
    DIGITS,
    DIGITS_ELLIPSIS,
    ELLIPSIS,
    EXACT,
    VOLATILE,
    course,
    document,
    ran,
    recording,
    within,
)

from coursebuild.model import Comparison, Filter
from coursebuild.results import Change, DriftKind, Outcome, Verdict
from coursebuild.scripts.compare import compare, verify


def verdict(
    recorded: str,
    printed: str,
    comparison: Comparison = EXACT,
    filters: tuple[Filter, ...] = (),
    **lesson: str,
) -> Verdict:
    return compare(recording(recorded, **lesson), comparison, filters, printed)


def matches(recorded: str, printed: str, comparison: Comparison = EXACT) -> bool:
    found = verdict(recorded, printed, comparison)
    assert found.status in ("verified", "drift")
    assert bool(found.changes) == (found.status == "drift") == bool(found.diff)
    return found.status == "verified"


def seen(change: Change) -> tuple[str, str, str, int]:
    """Class, recorded text, printed text, line of the output; the span must hold what it names."""
    if change.kind in (DriftKind.ROUNDING, DriftKind.NUMERIC, DriftKind.TEXT):
        assert change.span.text == change.recorded
    return change.kind.value, change.recorded, change.ran, change.ran_line


# ---------------------------------------------------------------------------------------- modes


def test_exact_is_the_same_text() -> None:
    assert matches("a 1.0\nb", "a 1.0\nb\n")
    assert not matches("a 1.0", "a 1.00")
    assert not matches("a  b", "a b")
    assert not matches("0.000", "-0.000")


def test_white_space_at_ends_does_not_count() -> None:
    assert matches("a  \nb", "a\nb \t\n\n  \n\n")
    assert matches("a\n\n\n", "a\n")
    assert not matches("a\n\nb", "a\nb")
    assert not matches("a", "\na")


def test_line_ends_do_not_count() -> None:
    for eol in ("\n", "\r\n", "\r"):
        for printed in ("a\nb\n", "a\r\nb\r\n", "a\rb"):
            found = compare(recording("a\nb", eol=eol), EXACT, (), printed)
            assert found.status == "verified"


def test_other_line_separators_are_characters() -> None:
    assert matches("a\u2028b", "a\u2028b")
    assert not matches("a\u2028b", "a\nb")
    assert matches("a\x0cb\x85c", "a\x0cb\x85c")


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
        ("1.5+2.0j", "1.52+1.98j", True),
        ("1.5+0.0j", "1.5-0.0j", True),
    ],
)
def test_digits(recorded: str, printed: str, expected: bool) -> None:
    assert matches(recorded, printed, DIGITS) is expected


@pytest.mark.parametrize(
    ("recorded", "printed", "comparison", "expected"),
    [
        ("1.0", "1.000001", within("1e-6"), True),
        ("1.0", "1.0000010000000000000000001", within("1e-6"), False),
        ("100", "101", within("0.01"), True),
        ("100", "102", within("0.01"), False),
        ("101", "100", within("0.01"), True),
        ("0", "1e-13", within("1e-6", "1e-12"), True),
        ("0", "1e-11", within("1e-6", "1e-12"), False),
        ("0.3", "0.1", within(atol="0.2"), True),
        ("-1.0", "1.0", within("1"), False),
        ("nan", "nan", within("1e-6"), True),
        ("nan", "NaN", within("1e-6"), True),
        ("nan", "0.0", within("1e9", "1e9"), False),
        ("inf", "inf", within("1e-6"), True),
        ("inf", "-inf", within("1e-6"), False),
        ("inf", "Infinity", within("1e-6"), True),
        ("1e300", "inf", within("1"), False),
        ("4 flips", "4.0 flips", within("1e-6"), True),
        ("a 1", "b 1", within("1"), False),
        ("1.2.3", "1.2.4", within("1"), False),
        ("1 2", "1", within("1"), False),
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
    assert matches(recorded, printed, within(atol="0.3"))
    assert matches(printed, recorded, within(atol="0.3"))


@pytest.mark.parametrize(
    ("recorded", "printed"),
    [
        ("a 0.1", "a0.1"),
        ("0.1 %", "0.1%"),
        ("0.1 0.2", "0.10.2"),
        ("a  b 0.1", "a b 0.1"),
        ("0.1 m", "0.1m"),
        ("  a 0.1", "a 0.1"),
    ],
)
def test_white_space_away_from_numbers_counts(recorded: str, printed: str) -> None:
    assert not matches(recorded, printed, within(atol="0.3"))


def test_volatile_is_not_compared() -> None:
    found = verdict("took 1 s", "took 2 s", VOLATILE)
    assert (found.status, found.changes, found.diff) == ("volatile", (), "")


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
    ],
)
def test_ellipsis(recorded: str, printed: str, expected: bool) -> None:
    assert matches(recorded, printed, ELLIPSIS) is expected
    assert matches(recorded, printed, DIGITS_ELLIPSIS) is expected


def test_dots_are_dots_without_the_key() -> None:
    assert not matches("a ... c", "a b c")
    assert not matches("...", "a", DIGITS)
    assert matches("[0. ... 9.]", "[0. ... 9.]")


@pytest.mark.parametrize(
    ("recorded", "printed", "expected"),
    [
        ("x = 3.14 ... E = 0.50", "x = 3.1402 and so on E = 0.502", True),
        ("x = 3.14 ... E = 0.50", "x = 3.15 and so on E = 0.502", False),
        ("x = 3.14 ... E = 0.50", "x = 3.14 and so on E = 0.51", False),
        ("pi = 3.1...", "pi = 3.19", True),
        ("pi = 3.1...", "pi = 3.2", False),
        ("...59 done 0.50", "3.14159 done 0.501", True),
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


def test_ellipsis_with_tolerance() -> None:
    assert matches("n 100 ... m", "n 101 or so m", within("0.01", ellipsis=True))
    assert not matches("n 100 ... m", "n 103 or so m", within("0.01", ellipsis=True))


# --------------------------------------------------------------------------------------- filters


def test_filters_apply_to_both_sides() -> None:
    address = Filter(r"0x[0-9a-f]+", "0x…")
    assert verdict("<body at 0x7f>", "<body at 0xab>", EXACT, (address,)).status == "verified"
    assert verdict("<body at 0x…>", "<body at 0xab>", EXACT, (address,)).status == "verified"


def test_filters_come_one_after_the_other() -> None:
    filters = (Filter(r"took \d+ s", "took T"), Filter(r" T\b", " TIME"))
    assert verdict("took TIME", "took 12 s", EXACT, filters).status == "verified"


def test_a_filter_can_drop_lines() -> None:
    warning = Filter(r"^Warning:.*\n", "")
    assert verdict("a\nb", "a\nWarning: x\nWarning: y\nb\n", EXACT, (warning,)).status == "verified"


def test_groups_and_empty_matches() -> None:
    swap = Filter(r"(\w)-(\w)?", r"\2\1")
    assert verdict("ba c", "a-b c-", EXACT, (swap,)).status == "verified"


def test_places_behind_filters_are_true() -> None:
    filters = (Filter(r"0x[0-9a-f]+", "somewhere"), Filter(r"^#.*\n", ""))
    lesson = "# one\nat 0x1 E 1.5 b\n# two\nat 0x22 F 2.5"
    found = verdict(lesson, "at 0x333 E 1.5 b\n# more\nat 0x4 F 2.6", EXACT, filters)
    assert [seen(c) for c in found.changes] == [("numeric", "2.5", "2.6", 3)] or [
        seen(c) for c in found.changes
    ] == [("rounding", "2.5", "2.6", 3)]
    (change,) = found.changes
    assert change.span.source.line_text(change.span.line) == "at 0x22 F 2.5"
    assert change.span.column == len("at 0x22 F ") + 1


def test_a_change_inside_what_a_filter_wrote_is_all_that_it_replaced() -> None:
    shorter = Filter(r"(\d\.\d)\d+", r"\1")
    found = verdict("E 6.6411 J", "E 6.7022 J", EXACT, (shorter,))
    assert [seen(c) for c in found.changes] == [("rounding", "6.6411", "6.7022", 1)]


# --------------------------------------------------------------------------------------- changes

ENERGY = """\
conservation over 20 s:
  RK4           kinetic energy  -0.000 %   3.9e-11
  Euler         kinetic energy  +6.641 %   6.9e-04
  implicit      kinetic energy  -6.040 %   6.4e-04"""


def test_a_drifted_number_is_that_number_in_that_line() -> None:
    found = verdict(ENERGY, ENERGY.replace("+6.641", "+6.702"))
    (change,) = found.changes
    assert seen(change) == ("numeric", "+6.641", "+6.702", 3)
    assert (change.span.line, change.span.column) == (9, 33)
    assert f"{change.relative_error:.1e}" == "9.2e-03"
    assert change.digits == 2


@pytest.mark.parametrize("prefix", ["> ", "   ", ">   "])
@pytest.mark.parametrize("eol", ["\n", "\r\n"])
def test_places_in_nested_fences(prefix: str, eol: str) -> None:
    found = verdict(ENERGY, ENERGY.replace("6.9e-04", "7.0e-04"), prefix=prefix, eol=eol)
    (change,) = found.changes
    assert seen(change) == ("rounding", "6.9e-04", "7.0e-04", 3)
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
    found = verdict(f"E {recorded} J", f"E {printed} J")
    assert [(c.kind, c.recorded, c.ran) for c in found.changes] == [(kind, recorded, printed)]


def test_zero_recorded_has_no_relative_error() -> None:
    (change,) = verdict("E 0.0", "E 0.5").changes
    assert (change.relative_error, change.digits) == (None, None)


def test_enormous_errors_stay_finite() -> None:
    (change,) = verdict("E 1e-300", "E 1e300").changes
    assert change.relative_error is None and change.digits == 0


def test_every_number_of_a_line_is_compared() -> None:
    found = verdict("[0.1 0.2 0.3]", "[0.1 0.25 0.4]")
    assert [seen(c) for c in found.changes] == [
        ("rounding", "0.2", "0.25", 1),
        ("rounding", "0.3", "0.4", 1),
    ]


def test_white_space_is_named_only_where_nothing_else_differs() -> None:
    found = verdict("a   9.9 b", "a  10.9 b")
    assert [seen(c) for c in found.changes] == [("numeric", "9.9", "10.9", 1)]
    found = verdict("a   b", "a  b")
    assert [seen(c) for c in found.changes] == [("text", "   ", "  ", 1)]


def test_text_changes_are_small() -> None:
    found = verdict("the red box at 1.5 m", "the dark blue box at 1.5 m")
    assert [seen(c) for c in found.changes] == [("text", "red", "dark blue", 1)]
    found = verdict("E: 6.641 %", "E total: 6.702 %")
    assert [seen(c) for c in found.changes] == [
        ("text", "", " total", 1),
        ("numeric", "6.641", "6.702", 1),
    ]


def test_missing_and_extra_lines() -> None:
    found = verdict("a one\nb two\nc three\nd four", "a one\nd four")
    assert [seen(c) for c in found.changes] == [("missing lines", "b two\nc three", "", 0)]
    assert found.changes[0].span.text == "b two\nc three"
    found = verdict("a one\nd four", "a one\nb two\nc three\nd four")
    assert [seen(c) for c in found.changes] == [("extra lines", "", "b two\nc three", 2)]
    assert (
        found.changes[0].span.line == 8 and found.changes[0].span.start == found.changes[0].span.end
    )


def test_extra_lines_at_the_end_stand_after_the_last() -> None:
    (change,) = verdict("a one", "a one\nb two").changes
    assert seen(change) == ("extra lines", "", "b two", 2)
    assert (change.span.line, change.span.column) == (7, 6)


def test_an_empty_recording() -> None:
    (change,) = verdict("", "a\nb").changes
    assert seen(change) == ("extra lines", "", "a\nb", 1)
    assert change.span.line == 7


def test_a_drifted_table_of_equal_rows_with_one_more() -> None:
    rows = [f"{i}  {i * i / 10:.2f}" for i in range(8)]
    longer = [*rows[:3], "2.5  0.62", *rows[3:]]
    found = verdict("\n".join(rows), "\n".join(longer))
    assert [seen(c) for c in found.changes] == [("extra lines", "", "2.5  0.62", 4)]


def test_a_line_that_moved_is_missing_here_and_extra_there() -> None:
    found = verdict("x alpha\ny beta\nz gamma", "y beta\nz gamma\nx alpha")
    assert [c.kind.value for c in found.changes] == ["missing lines", "extra lines"]


def test_changes_beside_an_ellipsis() -> None:
    found = verdict("start\n...\nE 1.50\nend", "start\nfoo\nbar\nE 1.70\nend", ELLIPSIS)
    assert [seen(c) for c in found.changes] == [("numeric", "1.50", "1.70", 4)]
    found = verdict("t=... s, E 1.5 J", "t=0.1 s, E 2.5 J", ELLIPSIS)
    assert [seen(c) for c in found.changes] == [("numeric", "1.5", "2.5", 1)]
    found = verdict("t=... s, E", "u=0.1 s, F", ELLIPSIS)
    assert [seen(c) for c in found.changes] == [("text", "t=... s, E", "u=0.1 s, F", 1)]


def test_the_diff_is_unified() -> None:
    found = verdict("a\nb\nc 1.5\nd\ne\nf\ng 2\nh", "a\nb\nc 1.6\nd\ne\nf\nh\ni")
    assert (
        found.diff
        == """\
--- recorded
+++ this run
@@ -1,5 +1,5 @@
 a
 b
-c 1.5
+c 1.6
 d
 e
@@ -5,4 +5,4 @@
 e
 f
-g 2
 h
+i"""
        or found.diff
        == """\
--- recorded
+++ this run
@@ -1,8 +1,8 @@
 a
 b
-c 1.5
+c 1.6
 d
 e
 f
-g 2
 h
+i"""
    )


def test_lines_that_match_by_value_are_context_in_the_diff() -> None:
    found = verdict("a 1.5\nb 2.5", "a 1.51\nb 3.5", DIGITS)
    assert (
        found.diff
        == """\
--- recorded
+++ this run
@@ -1,2 +1,2 @@
 a 1.5
-b 2.5
+b 3.5"""
    )


def test_the_diff_has_a_readable_size() -> None:
    found = verdict("\n".join(f"a {i} " + "x" * 500 for i in range(100)), "b")
    lines = found.diff.split("\n")
    assert len(lines) == 43 and all(len(line) <= 161 for line in lines)
    assert lines[-1] == "… and 62 more lines"


# ------------------------------------------------------------------------------------- the course


def test_every_recording_gets_a_verdict() -> None:
    text = """\
```python file=examples/a.py
1
```

Output:

```text
one
```

Output:

```text volatile
two
```

```python file=examples/b.py
2
```

Output:

```text digits
1.5
```
"""
    here = course(document(text))
    runs = (ran("one\n"), ran("1.52\n", path="examples/b.py"))
    assert [v.status for v in verify(here, runs)] == ["verified", "volatile", "verified"]
    assert [v.status for v in verify(here, runs[:1])] == ["verified", "volatile", "unchecked"]
    failed = (ran("one\n", outcome=Outcome.FAILED, status=1), ran("", path="examples/b.py"))
    assert [v.status for v in verify(here, failed)] == ["unchecked"] * 3


def test_the_course_s_comparison_is_the_default() -> None:
    text = "```python file=examples/a.py\n1\n```\n\nOutput:\n\n```text\n1.5\n```\n"
    (found,) = verify(course(document(text), comparison=DIGITS), (ran("1.52"),))
    assert (found.status, found.comparison) == ("verified", DIGITS)


# ----------------------------------------------------------------------------------- properties

WORDS = st.sampled_from(
    ["a", "b c", "x=1.5", "1.5", "2", "-0.0", "nan", "...", "", "  ", "e-3", "|"]
)
OUTPUTS = st.lists(st.lists(WORDS, max_size=4).map(" ".join), max_size=6).map("\n".join)
MODES = st.sampled_from([EXACT, DIGITS, within("0.1", "0.1"), ELLIPSIS, DIGITS_ELLIPSIS])


@given(OUTPUTS, MODES)
def test_every_output_matches_itself(output: str, comparison: Comparison) -> None:
    assert verdict(output, output, comparison).status == "verified"


@given(OUTPUTS, OUTPUTS, MODES)
def test_changes_have_true_places(recorded: str, printed: str, comparison: Comparison) -> None:
    found = verdict(recorded, printed, comparison, prefix="> ", eol="\r\n")
    assert found.status in ("verified", "drift")
    assert bool(found.changes) == (found.status == "drift") == bool(found.diff)
    lines = printed.split("\n")
    for change in found.changes:
        seen(change)
        assert found.recording.body_span.contains(change.span)
        if change.kind is not DriftKind.MISSING:
            assert change.ran.split("\n")[0] in lines[change.ran_line - 1]


@given(OUTPUTS, OUTPUTS)
def test_exact_is_equality_of_stripped_lines(recorded: str, printed: str) -> None:
    def bare(text: str) -> list[str]:
        return [line.rstrip() for line in text.rstrip().split("\n")]

    assert matches(recorded, printed) == (bare(recorded) == bare(printed))


@given(OUTPUTS, OUTPUTS)
def test_ellipsis_takes_what_a_regular_expression_takes(recorded: str, printed: str) -> None:
    def bare(text: str) -> list[str]:
        return [line.rstrip() for line in text.rstrip().split("\n")] if text.strip() else []

    pattern = ""
    for line in bare(recorded):
        if line.strip() == "...":
            pattern += r"(?:[^\n]*\n)*"
        else:
            pattern += r"[^\n]*".join(re.escape(part) for part in line.split("...")) + r"\n"
    text = "".join(line + "\n" for line in bare(printed))
    expected = re.fullmatch(pattern, text) is not None
    assert matches(recorded, printed, ELLIPSIS) == expected


@given(
    st.lists(st.floats(-1e6, 1e6, allow_subnormal=False), min_size=1, max_size=8), st.integers(0, 6)
)
def test_digits_takes_every_value_that_rounds_to_the_recorded_one(
    values: list[float], places: int
) -> None:
    recorded = " ".join(f"{value:.{places}e}" for value in values)
    printed = " ".join(repr(value) for value in values)
    assert matches(f"[{recorded}]", f"[{printed}]", DIGITS)


@given(st.integers(-(10**6), 10**6), st.integers(1, 6))
def test_the_border_of_digits_is_exact(value: int, places: int) -> None:
    number = Decimal(value).scaleb(-places)
    half = Decimal(5).scaleb(-places - 1)
    little = Decimal(1).scaleb(-places - 12)
    assert matches(f"{number:f}", f"{number + half:f}", DIGITS)
    assert matches(f"{number:f}", f"{number - half:f}", DIGITS)
    assert not matches(f"{number:f}", f"{number + half + little:f}", DIGITS)
    assert not matches(f"{number:f}", f"{number - half - little:f}", DIGITS)


# ------------------------------------------------------------------------------------------ size


def quickly(seconds: float, recorded: str, printed: str, comparison: Comparison) -> Verdict:
    lesson = recording(recorded)
    start = time.perf_counter()
    found = compare(lesson, comparison, (), printed)
    assert time.perf_counter() - start < seconds
    return found


def numbers(count: int, seed: int) -> list[str]:
    chance = random.Random(seed)
    return [
        f"row {chance.random():.6f} {chance.random():.3e} {chance.randint(0, 9)}"
        for _ in range(count)
    ]


@pytest.mark.parametrize("comparison", [EXACT, DIGITS, DIGITS_ELLIPSIS], ids=str)
def test_ten_thousand_lines_that_all_differ(comparison: Comparison) -> None:
    rows, others = numbers(10_000, 1), numbers(10_000, 2)
    found = quickly(20, "\n".join(rows), "\n".join(others), comparison)
    assert len({c.span.line for c in found.changes}) > 9_900
    found = quickly(20, "\n".join(rows), "\n".join(others[:7000]), comparison)
    assert found.changes[-1].kind is DriftKind.MISSING


def test_ten_thousand_lines_with_a_few_changes() -> None:
    rows = numbers(10_000, 1)
    changed = [
        *rows[:100],
        "new",
        *rows[100:5000],
        *rows[5003:9000],
        "row 9.5 1e-3 77",
        *rows[9001:],
    ]
    found = quickly(20, "\n".join(rows), "\n".join(changed), EXACT)
    assert [c.kind for c in found.changes] == [
        DriftKind.EXTRA,
        DriftKind.MISSING,
        DriftKind.NUMERIC,
        DriftKind.NUMERIC,
        DriftKind.NUMERIC,
    ]
    assert [c.ran for c in found.changes[2:]] == ["9.5", "1e-3", "77"]


def test_lines_without_order() -> None:
    rows = numbers(10_000, 1)
    shuffled = random.Random(3).sample(rows, len(rows))
    quickly(30, "\n".join(rows), "\n".join(shuffled), EXACT)


def test_many_equal_lines() -> None:
    quickly(20, "\n".join(["a", "b"] * 5000), "\n".join(["b", "b", "a"] * 3500), EXACT)


def test_many_ellipses() -> None:
    recorded = "\n".join(["a", "...", "b x...y 1.5", "..."] * 2500)
    printed = "\n".join(["a", "b x 2 y 1.52", "c"] * 3500)
    assert quickly(20, recorded, printed, DIGITS_ELLIPSIS).status == "verified"
    assert quickly(30, recorded + "\nend", printed, DIGITS_ELLIPSIS).status == "drift"


def test_long_blocks_that_nearly_fit() -> None:
    recorded = "...\n" + "a\n" * 5000 + "b\n..."
    quickly(20, recorded, "a\n" * 10_000, ELLIPSIS)


def test_one_enormous_line() -> None:
    line = "0.125 " * 60_000
    assert quickly(20, line, line.replace("0.125", "0.1250", 1), DIGITS).status == "verified"
    found = quickly(30, line, line.replace("0.125 0.125", "0.126 x", 1), EXACT)
    assert found.status == "drift"


def test_a_line_of_ellipses() -> None:
    recorded = "0.5 ... " * 10_000 + "end"
    assert quickly(20, recorded, "0.5  " * 40_000 + "end", DIGITS_ELLIPSIS).status == "verified"
    quickly(20, "...1.0 " + "0.5 " * 10_000 + "2.0...", "0.5 " * 40_000, DIGITS_ELLIPSIS)
    quickly(20, "..." + "0.5 " * 10_000 + "2.0 ...", "0.5 " * 40_000, DIGITS_ELLIPSIS)


def test_hundreds_of_thousands_of_lines() -> None:
    quickly(20, "a\nb", "a" + "\n" * 2**18 + "b", EXACT)
    quickly(30, "a\nb", "a\n" * 2**18, EXACT)
