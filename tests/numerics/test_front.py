"""Which settings are worth their cost."""

from __future__ import annotations

import pytest

from coursebuild.numerics.front import front, verdict
from coursebuild.numerics.reports.bench import WorkPrecisionRow
from support.bench_reports import lost, row

Point = tuple[float, float] | None
"""Cost and error; `None`: a run that was lost."""


def placed(*points: Point) -> tuple[WorkPrecisionRow, ...]:
    """Rows of which the first is the scene's own, Euler at 2 ms, and others are RK4 at 10 ms."""
    found = []
    for n, point in enumerate(points):
        own = {"own": True} if n == 0 else {}
        name, timestep = ("Euler", 0.002) if n == 0 else ("RK4", 0.01)
        if point is None:
            found.append(lost(name, timestep, **own))
        else:
            found.append(row(name, timestep, cost=point[0], seen=point[1], **own))
    return front(found)


def on_it(*points: Point) -> list[bool]:
    return [one.front for one in placed(*points)]


def test_cheaper_and_more_accurate_is_better() -> None:
    found = placed((1, 1e-3), (0.5, 1e-5), (0.1, 0.3), (4, 1e-3), None)
    assert [one.front for one in found] == [False, True, True, False, False]
    assert [one.dominated_by for one in found] == [1, None, None, 1, None]
    found = placed((8, 8.0), (4, 4.0), (2, 2.0), (1, 1.0))
    assert [one.dominated_by for one in found] == [3, 3, 3, None], "it is on the front"


def test_small_differences_are_none() -> None:
    assert on_it((1, 1e-3), (1.02, 1e-3)) == [True, True]
    assert on_it((1, 1e-3), (1.02, 1.04e-3)) == [True, True]
    assert on_it((1, 1e-3), (1.2, 1e-3)) == [True, False]
    assert on_it((1, 1e-3), (1, 1.06e-3)) == [True, False]
    assert on_it((1, 1e-3), (0.98, 1.5e-3)) == [True, False], "its cost is no better"
    assert on_it((1, 1e-3), (0.5, 1.04e-3)) == [False, True]


def test_errors_of_zero_and_nothing_at_all() -> None:
    assert on_it((1, 0.0), (2, 0.0), (0.5, 1e-12)) == [True, False, True]
    assert on_it() == []
    assert on_it(None, None) == [False, False]


OWN = "no other setting is cheaper without being less accurate"
GONE = "the scene does not run under its own setting, Euler at 2 ms: the state is not finite"
SEEN = "a learner would notice its error, which is 2.5 times what can be seen"


@pytest.mark.parametrize(
    ("points", "better", "text"),
    [
        (
            ((1, 1e-3), (4, 1e-7)),
            None,
            f"{OWN}; a learner would not notice its error, which is 0.001 of what can be seen",
        ),
        (
            ((1, 2.5), (0.94, 2.5e-6)),
            1,
            f"RK4 at 10 ms is better: it takes 0.94 of the time and errs far less; {SEEN}; the "
            "cheapest without one that is seen is RK4 at 10 ms, at 0.94 times its cost",
        ),
        (((1, 2.5), (2, 2.4)), None, f"{OWN}; {SEEN}, and that of every other setting too"),
        ((None, (1, 2.0)), 1, f"{GONE}; RK4 at 10 ms is the most accurate that does"),
        ((None, None), None, GONE),
    ],
)
def test_verdicts(points: tuple[Point, ...], better: int | None, text: str) -> None:
    rows = placed(*points)
    found = verdict(rows, [None if one.seen is None else one.seen >= 1 for one in rows])
    assert (found.better, found.text) == (better, text)
    assert found.on_front == (better is None and points[0] is not None)


def test_a_verdict_where_an_error_is_not_known_or_nothing_was_timed() -> None:
    found = verdict(placed((1, 2.0), (0.5, 2.0)), [None, None])
    assert found.noticeable is None
    assert found.text == (
        "RK4 at 10 ms is better: it takes 0.5 of the time and errs no more; whether a learner "
        "would notice its error is not known"
    )
    found = verdict(front([row(own=True, cost=None, seen=0.5)]), [False])
    assert found.text.startswith("nothing was timed, so that no setting can be called better; a ")
