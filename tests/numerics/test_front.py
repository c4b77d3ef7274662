"""Which settings are worth their cost."""

from __future__ import annotations

import pytest

from coursebuild.numerics.front import FrontPoint, front, verdict
from coursebuild.numerics.reports.bench import MeasuredSetting, RowVerdict

EULER, RK4 = MeasuredSetting("Euler", 0.002, "", 0, ""), MeasuredSetting("RK4", 0.01, "", 0, "")


def on_it(*points: tuple[float, float] | None) -> list[bool]:
    found = front([None if one is None else FrontPoint(*one) for one in points])
    return [place.front for place in found]


def test_cheaper_and_more_accurate_is_better() -> None:
    points = [
        FrontPoint(1, 1e-3),
        FrontPoint(0.5, 1e-5),
        FrontPoint(0.1, 0.3),
        FrontPoint(4, 1e-3),
        None,
    ]
    found = front(points)
    assert [place.front for place in found] == [False, True, True, False, False]
    assert [place.dominated_by for place in found] == [1, None, None, 1, None]


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


def test_what_dominates_is_on_the_front() -> None:
    points = [FrontPoint(8, 8.0), FrontPoint(4, 4.0), FrontPoint(2, 2.0), FrontPoint(1, 1.0)]
    assert [place.dominated_by for place in front(points)] == [3, 3, 3, None]


def judged(
    points: list[FrontPoint | None], seen: float | None, reasons: tuple[str, ...] = ()
) -> RowVerdict:
    return verdict([EULER, RK4], points, front(points), 0, seen, reasons)


def test_a_verdict_on_a_good_choice() -> None:
    found = judged([FrontPoint(1, 1e-3), FrontPoint(4, 1e-7)], 1e-3)
    assert (found.on_front, found.better, found.noticeable) == (True, None, False)
    assert found.text == (
        "no other setting is cheaper without being less accurate; a learner would not notice its "
        "error, which is 0.001 of what can be seen"
    )


def test_a_verdict_on_a_bad_one() -> None:
    found = judged([FrontPoint(1, 2.5), FrontPoint(0.94, 2.5e-6)], 2.5)
    assert (found.on_front, found.better, found.noticeable) == (False, 1, True)
    assert found.cost_ratio == pytest.approx(0.94)
    assert found.error_ratio == pytest.approx(1e-6)
    assert found.text == (
        "RK4 at 10 ms is better: it takes 0.94 of the time and errs far less; a learner would "
        "notice its error, which is 2.5 times what can be seen"
    )


def test_a_verdict_names_what_would_be_enough() -> None:
    points: list[FrontPoint | None] = [FrontPoint(0.5, 50), FrontPoint(2, 1e-6)]
    found = verdict([EULER, RK4], points, front(points), 0, 50, (), 1)
    assert found.text.endswith(
        "a learner would notice its error, which is 50 times what can be seen; the cheapest "
        "without one that is seen is RK4 at 10 ms, at 4 times its cost"
    )
    found = verdict([EULER, RK4], points, front(points), 0, 50, (), hopeless=True)
    assert found.text.endswith("times what can be seen, and that of every other setting too")
    found = verdict([EULER, RK4], points, front(points), 0, 0.5, (), 1)
    assert found.text.endswith("which is 0.5 of what can be seen")


def test_a_verdict_where_too_little_is_known() -> None:
    found = judged([FrontPoint(1, 2.0), FrontPoint(0.5, 2.0)], None)
    assert found.noticeable is None
    assert found.text == (
        "RK4 at 10 ms is better: it takes 0.5 of the time and errs no more; whether a learner "
        "would notice its error is not known"
    )


def test_a_verdict_where_the_scene_does_not_run() -> None:
    found = judged([None, FrontPoint(1, 2.0)], None, ("the state is not finite",))
    assert (found.on_front, found.better, found.cost_ratio) == (False, 1, None)
    assert found.text == (
        "the scene does not run under its own setting, Euler at 2 ms: the state is not finite; "
        "RK4 at 10 ms is the most accurate that does"
    )
    assert judged([None, None], None, ("it hangs",)).text.endswith("Euler at 2 ms: it hangs")


def test_a_verdict_where_nothing_was_timed() -> None:
    found = judged([None, None], 0.5)
    assert (found.on_front, found.noticeable) == (False, False)
    assert found.text.startswith("nothing was timed, so that no setting can be called better; a ")
