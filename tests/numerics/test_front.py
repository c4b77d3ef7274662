"""Which settings are worth their cost."""

from __future__ import annotations

import pytest

from coursebuild.numerics.costs import FrontPoint, front, verdict
from coursebuild.numerics.reports import Interval
from coursebuild.numerics.reports.scene_report import WorkPrecisionRow
from support.bench_reports import diverged_row, row

Point = tuple[float, float] | None
"""Cost and error; `None`: a run that was lost."""


def rows_with_front(*points: Point) -> tuple[WorkPrecisionRow, ...]:
    """Rows of which the first is the scene's own, Euler at 2 ms, and others are RK4 at 10 ms."""
    rows = []
    for n, point in enumerate(points):
        is_own = {"own": True} if n == 0 else {}
        name, timestep = ("Euler", 0.002) if n == 0 else ("RK4", 0.01)
        if point is None:
            rows.append(diverged_row(name, timestep, **is_own))
        else:
            rows.append(row(name, timestep, cost=point[0], seen=point[1], **is_own))
    return front(rows)


def are_on_front(*points: Point) -> list[bool]:
    return [row.front for row in rows_with_front(*points)]


def test_cheaper_and_more_accurate_is_better() -> None:
    rows = rows_with_front((1, 1e-3), (0.5, 1e-5), (0.1, 0.3), (4, 1e-3), None)
    assert [row.front for row in rows] == [False, True, True, False, False]
    assert [row.dominated_by for row in rows] == [1, None, None, 1, None]
    rows = rows_with_front((8, 8.0), (4, 4.0), (2, 2.0), (1, 1.0))
    assert [row.dominated_by for row in rows] == [3, 3, 3, None], "it is on the front"


def test_small_differences_are_none() -> None:
    assert are_on_front((1, 1e-3), (1.02, 1e-3)) == [True, True]
    assert are_on_front((1, 1e-3), (1.02, 1.04e-3)) == [True, True]
    assert are_on_front((1, 1e-3), (1.2, 1e-3)) == [True, False]
    assert are_on_front((1, 1e-3), (1, 1.06e-3)) == [True, False]
    assert are_on_front((1, 1e-3), (0.98, 1.5e-3)) == [True, False], "its cost is no better"
    assert are_on_front((1, 1e-3), (0.5, 1.04e-3)) == [False, True]


def test_costs_that_timing_cannot_tell_apart_are_equal() -> None:
    own_point = FrontPoint(Interval(1.0, 0.8, 1.2), 1e-3)
    for high, is_cheaper in ((0.79, True), (0.8, False), (0.9, False)):
        rival = FrontPoint(Interval(0.7, 0.6, high), 1e-3)
        assert rival.is_cheaper(own_point) == rival.beats(own_point) == is_cheaper, high


def test_errors_of_zero_and_nothing_at_all() -> None:
    assert are_on_front((1, 0.0), (2, 0.0), (0.5, 1e-12)) == [True, False, True]
    assert are_on_front() == []
    assert are_on_front(None, None) == [False, False]


OWN_BEST = "no other setting is cheaper without being less accurate"
OWN_FAILS = "the scene does not run under its own setting, Euler at 2 ms: the state is not finite"
ERROR_SEEN = "a learner would notice its error, which is 2.5 times what can be seen"


@pytest.mark.parametrize(
    ("points", "better", "text"),
    [
        (
            ((1, 1e-3), (4, 1e-7)),
            None,
            f"{OWN_BEST}; a learner would not notice its error, which is 0.001 of what can be seen",
        ),
        (
            ((1, 2.5), (0.94, 2.5e-6)),
            1,
            f"RK4 at 10 ms is better: it takes 0.94 of the time and errs far less; {ERROR_SEEN}; "
            "the cheapest without one that is seen is RK4 at 10 ms, at 0.94 times its cost",
        ),
        (
            ((1, 2.5), (2, 2.4)),
            None,
            f"{OWN_BEST}; {ERROR_SEEN}, and that of every other setting too",
        ),
        ((None, (1, 2.0)), 1, f"{OWN_FAILS}; RK4 at 10 ms is the most accurate that does"),
        ((None, None), None, OWN_FAILS),
    ],
)
def test_verdicts(points: tuple[Point, ...], better: int | None, text: str) -> None:
    rows = rows_with_front(*points)
    judgement = verdict(rows, [None if row.seen is None else row.seen >= 1 for row in rows])
    assert (judgement.better, judgement.text) == (better, text)
    assert judgement.on_front == (better is None and points[0] is not None)


def test_a_verdict_where_an_error_is_not_known_or_nothing_was_timed() -> None:
    judgement = verdict(rows_with_front((1, 2.0), (0.5, 2.0)), [None, None])
    assert judgement.noticeable is None
    assert judgement.text == (
        "RK4 at 10 ms is better: it takes 0.5 of the time and errs no more; whether a learner "
        "would notice its error is not known"
    )
    judgement = verdict(front([row(own=True, cost=None, seen=0.5)]), [False])
    assert judgement.text.startswith(
        "nothing was timed, so that no setting can be called better; a "
    )
