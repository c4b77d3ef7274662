"""Which settings are worth their cost."""

from __future__ import annotations

import pytest

from coursebuild.numerics.front import front, verdict
from coursebuild.numerics.reports.bench import RowVerdict, WorkPrecisionRow
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


def judged(*points: Point, known: bool = True) -> RowVerdict:
    rows = placed(*points)
    return verdict(rows, [one.seen >= 1 if known and one.seen else None for one in rows])


def test_a_verdict_on_a_good_choice() -> None:
    found = judged((1, 1e-3), (4, 1e-7))
    assert (found.on_front, found.better, found.noticeable) == (True, None, False)
    assert found.text == (
        "no other setting is cheaper without being less accurate; a learner would not notice its "
        "error, which is 0.001 of what can be seen"
    )


def test_a_verdict_on_a_bad_one() -> None:
    found = judged((1, 2.5), (0.94, 2.5e-6))
    assert (found.on_front, found.better, found.noticeable) == (False, 1, True)
    assert found.cost_ratio == pytest.approx(0.94)
    assert found.error_ratio == pytest.approx(1e-6)
    assert found.text == (
        "RK4 at 10 ms is better: it takes 0.94 of the time and errs far less; a learner would "
        "notice its error, which is 2.5 times what can be seen; the cheapest without one that is "
        "seen is RK4 at 10 ms, at 0.94 times its cost"
    )


def test_a_verdict_names_what_would_be_enough() -> None:
    assert judged((0.5, 50), (2, 1e-6)).text.endswith(
        "a learner would notice its error, which is 50 times what can be seen; the cheapest "
        "without one that is seen is RK4 at 10 ms, at 4 times its cost"
    )
    hopeless = judged((0.5, 50), (2, 5))
    assert hopeless.text.endswith("times what can be seen, and that of every other setting too")
    assert judged((0.5, 0.5), (2, 1e-6)).text.endswith("which is 0.5 of what can be seen")


def test_a_verdict_where_too_little_is_known() -> None:
    found = judged((1, 2.0), (0.5, 2.0), known=False)
    assert found.noticeable is None
    assert found.text == (
        "RK4 at 10 ms is better: it takes 0.5 of the time and errs no more; whether a learner "
        "would notice its error is not known"
    )


def test_a_verdict_where_the_scene_does_not_run() -> None:
    found = judged(None, (1, 2.0))
    assert (found.on_front, found.better, found.cost_ratio) == (False, 1, None)
    assert found.text == (
        "the scene does not run under its own setting, Euler at 2 ms: the state is not finite; "
        "RK4 at 10 ms is the most accurate that does"
    )
    assert judged(None, None).text.endswith("Euler at 2 ms: the state is not finite")


def test_a_verdict_where_nothing_was_timed() -> None:
    found = verdict(front([row(own=True, cost=None, seen=0.5)]), [False])
    assert (found.on_front, found.noticeable) == (False, False)
    assert found.text.startswith("nothing was timed, so that no setting can be called better; a ")
