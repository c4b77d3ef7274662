"""The place, the class and the text of each change."""

from __future__ import annotations

import pytest

from coursebuild.core.model.results import DriftKind
from support.sample_lessons import (
    ELLIPSIS,
    change_values,
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
