"""Verdicts: by columns, from several starts, and no more than is known."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import pytest
from msgspec.structs import replace

from mjbench.columns import Column
from mjbench.derive import derive_scenario, derive_seeds
from mjbench.judge import mark_luck
from mjbench.reports import Interval
from mjbench.reports.scene_report import ErrorParts, ScenarioReport, StableRow, WorkPrecisionRow
from mjbench.reports.shown_errors import SEEN, is_cheaper
from samples.reports import diverged_row, row, scenario

Point = tuple[float, float] | None
"""Cost and error; `None`: a run that was lost."""
Ratios = Sequence[Mapping[Column, float]] | None


def rows_of(*points: Point) -> list[WorkPrecisionRow]:
    """Rows of which the first is the scene's own, Euler at 2 ms, and others are RK4 at 10 ms."""
    rows = []
    for n, point in enumerate(points):
        fields: dict[str, Any] = {"own": n == 0, "position": None, "velocity": None}
        name, timestep = ("Euler", 0.002) if n == 0 else ("RK4", 0.01)
        if point is None:
            rows.append(diverged_row(name, timestep, own=n == 0))
        else:
            rows.append(row(name, timestep, cost=point[0], seen=point[1], **fields))
    return rows


def judged(rows: Sequence[WorkPrecisionRow], starts: Ratios = (), **fields: Any) -> ScenarioReport:
    return derive_scenario(scenario(rows, **fields), lambda _: starts)


def verdict_text(*points: Point, **fields: Any) -> str:
    return judged(rows_of(*points), **fields).verdict.text


def test_cheaper_and_more_accurate_is_better() -> None:
    rows = judged(rows_of((1, 1e-3), (0.5, 1e-5), (0.1, 0.3), (4, 1e-3), None)).rows
    assert [row.front for row in rows] == [False, True, True, False, False]
    assert [row.dominated_by for row in rows] == [1, None, None, 1, None]
    rows = judged(rows_of((8, 8.0), (4, 4.0), (2, 2.0), (1, 1.0))).rows
    assert [row.dominated_by for row in rows] == [3, 3, 3, None], "it is on the front"


def test_small_differences_are_none_and_lost_runs_are_on_no_front() -> None:
    own_point = (1, 1e-3)
    for points, on_front in (
        ((own_point, (1.02, 1.04e-3)), [True, True]),
        ((own_point, (1.2, 1e-3)), [True, False]),
        ((own_point, (1, 1.06e-3)), [True, False]),
        ((own_point, (0.98, 1.5e-3)), [True, False]),  # its cost is no better
        ((own_point, (0.5, 1.04e-3)), [False, True]),
        (((1, 0.0), (2, 0.0), (0.5, 1e-12)), [True, False, True]),
        ((None, None), [False, False]),
    ):
        assert [row.front for row in judged(rows_of(*points)).rows] == on_front, points
    for high, is_less in ((0.79, True), (0.8, False), (0.9, False)):
        assert is_cheaper(Interval(0.7, 0.6, high), Interval(1.0, 0.8, 1.2)) == is_less, high


OWN_BEST = "no other setting that was measured is cheaper without being less accurate"
OWN_FAILS = "the scene does not run under its own setting, Euler at 2 ms: the state is not finite"
ERROR_SEEN = "the scene's own error can be seen: it is 2.5 times what an eye can tell"


@pytest.mark.parametrize(
    ("points", "better", "text"),
    [
        (
            ((1, 1e-3), (4, 1e-7)),
            None,
            f"{OWN_BEST}; the scene's own error cannot be seen: it is 0.001 of what an eye can "
            "tell",
        ),
        (
            ((1, 2.5), (0.94, 2.5e-6)),
            1,
            f"RK4 at 10 ms is better: it takes 0.94 of the time and errs far less; {ERROR_SEEN}",
        ),
        (
            ((1, 2.5), (2, 2.4)),
            None,
            f"{OWN_BEST}; {ERROR_SEEN}",
        ),
        ((None, (1, 2.0)), 1, f"{OWN_FAILS}; RK4 at 10 ms is the most accurate that does"),
        ((None, None), None, OWN_FAILS),
    ],
)
def test_verdicts(points: tuple[Point, ...], better: int | None, text: str) -> None:
    verdict = judged(rows_of(*points)).verdict
    assert (verdict.better, verdict.text) == (better, text)


def masked(**rival: Any) -> list[WorkPrecisionRow]:
    """A block under the pyramid, whose error all rows share, and a stone that falls beside it."""
    newton = {"solver": "Newton", "iterations": 100, "cone": "pyramidal", "velocity": None}
    baseline = {
        "seen": 8.27,
        "step_error": 0.1,
        "position": (0.0049, 0.0049),
        **newton,
        "own": True,
    }
    rival_fields = {**baseline, "own": False, "position": (0.0102, 0.0102), **rival}
    return [
        row("Euler", 0.002, cost=1.0, **baseline),
        row("implicit", 1 / 240, cost=0.47, **rival_fields),
    ]


CONES = {"pyramidal": 8.17, "elliptic": 0.0}


def test_an_error_that_all_share_does_not_hide_one_that_doubles() -> None:
    verdict = judged(masked(), contact_model=CONES).verdict
    assert verdict.better is None and verdict.text.startswith(
        "no setting is better: implicit at 4.16667 ms takes 0.47 of the time, but the error of "
        "position is 2.1 times as large over the whole run; "
    )
    assert judged(masked(position=(0.005, 0.005)), contact_model=CONES).verdict.better == 1


def test_a_factor_over_an_error_that_is_not_resolved_is_the_least() -> None:
    """Of the own error only a bound is known, here 0.005: the other is at least twice as large."""
    rows = masked(position=(0.0102, 0.0102))
    rows[0] = replace(rows[0], position=(0.005, 0.005))
    text = judged(rows, contact_model=CONES, floor=5e-4).verdict.text
    assert "but the error of position is at least 2 times as large over the whole run; " in text
    rows = masked(position=(0.004, 0.004))
    text = judged(rows, [{("position", "over the whole run"): 1.4}], floor=5e-4).verdict.text
    assert "the error of position is 1 to 1.4 times as large" in text, "not at least once"


def test_halves_count_as_much_as_the_whole() -> None:
    halves = {"position": (0.001, 0.0049)}
    rows = masked(position=(0.0049, 0.0049), halves={"position": (0.0017, 0.0049)})
    rows[0] = replace(rows[0], halves=halves)
    report = judged(rows, contact_model=CONES)
    assert report.verdict.better is None
    reason = "the error of position is 1.7 times as large in its first half"
    assert reason in report.verdict.text


def test_what_is_worse_from_starts_nearby_is_not_better() -> None:
    column = ("step_error", "over the whole run")
    for starts, said_of in (
        (
            [{column: 0.9}, {column: 1.4}],
            "what is seen of steps is 0.9 to 1.4 times as large over",
        ),
        ([{column: 1.3}], "what is seen of steps is 1 to 1.3 times as large"),
        ([{("lost", "over the whole run"): math.inf}], "it is lost"),
    ):
        verdict = judged(masked(position=(0.0049, 0.0049)), starts, contact_model=CONES).verdict
        assert verdict.better is None
        assert f"here, but from starts nearby {said_of}" in verdict.text
    rows, draws = masked(position=(0.0049, 0.0049)), ("joint.damping = 0.1",)
    text = judged(rows, [{column: 1.4}], contact_model=CONES, drawn=draws).verdict.text
    assert "here, but from starts nearby or with drawn parameters what is seen" in text
    verdict = judged(masked(position=(0.0049, 0.0049)), None, contact_model=CONES).verdict
    assert verdict.better is None
    assert "whether that holds from starts nearby was not measured" in verdict.text


def test_what_is_better_under_one_seed_and_worse_under_another_is_not_better() -> None:
    good = masked(position=(0.0049, 0.0049))
    seeds = [
        replace(judged(rows, contact_model=CONES), name=f"seed-{n}")
        for n, rows in enumerate((good, masked()), 1)
    ]
    assert [seed.verdict.better for seed in seeds] == [1, None]
    names = ["seed-1", "seed-2"]
    first, second = derive_seeds(seeds, names)
    assert second == seeds[1]
    reason = "in seed-2 the error of position is 2.1 times as large over the whole run"
    claim = "no difference that holds: here implicit at 4.16667 ms takes 0.47 of the time and errs "
    assert first.verdict.text.startswith(f"{claim}no more in any column, but {reason}; ")
    assert first.verdict.better is None
    assert any(reason in line for line in first.verdict.lines)
    alike = [replace(seeds[0], name=name) for name in ("seed-1", "seed-2")]
    assert list(derive_seeds(alike, names)) == alike
    (alone,) = derive_seeds(alike[:1], names)
    assert "here; whether that holds in seed-2 was not measured; " in alone.verdict.text
    assert alone.verdict.better is None
    lost = masked(status="diverged", reasons=("it is not finite",))
    lost_report = replace(judged(lost, contact_model=CONES), name="seed-2")
    (first, _) = derive_seeds([seeds[0], lost_report], names)
    assert ", but in seed-2 it is lost; " in first.verdict.text


def test_gains_are_told_with_their_spread() -> None:
    starts = [{("step_error", "over the whole run"): ratio} for ratio in (0.4, 0.5)]
    rows = masked(position=(0.0049, 0.0049), step_error=0.05)
    text = judged(rows, starts, contact_model=CONES).verdict.text
    assert "errs 2 to 2.5 times less (what is seen of steps over the whole run); " in text


def test_the_error_is_taken_apart_and_what_mends_it_is_named() -> None:
    cone = row(
        "Euler", 0.002, cost=1.23, seen=0.1, step_error=0.1, position=(0.0049, 0.0049),
        velocity=None, solver="Newton", iterations=100, cone="elliptic",
    )  # fmt: skip
    parts = ErrorParts(0.1, 0.01, 8.17, 1e-9, 0.001)
    report = judged([*masked(), cone], contact_model=CONES, parts=parts)
    assert report.parts is not None and report.parts.dominant == "contact_model"
    mend = "Euler at 2 ms, elliptic cone errs 83 times less in all and takes 1.2 times as long"
    assert report.parts.mend == mend
    assert report.verdict.lines[1].endswith(
        "and by at most 8.3 with the model of contacts; most of it is the model of contacts': "
        + mend
    )
    small = judged(masked(), contact_model=CONES, parts=ErrorParts(1e-4, None, None, None, 0.001))
    assert small.parts is not None and small.parts.dominant == "", "none is resolved"
    hit = judged(rows_of((1, 0.6)), parts=ErrorParts(0.3, None, None, 1.28, 0.6))
    assert hit.parts is not None and not hit.parts.dominant, "what it errs by is not resolved"


def test_what_is_off_before_the_horizon_is_not_better() -> None:
    none = {"position": None, "step_error": None, "seen": None}
    off = masked(**none, parted=0.9)
    assert judged(off, contact_model=CONES).verdict.better is None
    good = judged(masked(position=(0.0049, 0.0049)), contact_model=CONES)
    (first, _) = derive_seeds([good, replace(judged(off, contact_model=CONES), name="b")], ["b"])
    assert ", but in b it is off at 0.9 s; " in first.verdict.text


def test_a_start_inside_something_is_told_before_any_error() -> None:
    lines = judged(rows_of((1, 0.5)), overlaps="the world and wheel by 0.0921 m").verdict.lines
    assert lines[0].endswith(
        "; it begins with one inside the other: the world and wheel by 0.0921 m"
    )
    assert "begins" not in judged(rows_of((1, 0.5))).verdict.lines[0]


def test_five_lines_say_speed_error_verdict_and_limits() -> None:
    limit = StableRow(
        "Euler", 0.0181, (1e-3, 0.1), None, 1.0, None, bracket=(0.0181, 0.0181),
        near=0.007, near_reason="off by 0.1 rad at 0.8 s", through=0.012,
    )  # fmt: skip
    lines = judged(rows_of((1, 0.5)), stable=(limit,)).verdict.lines
    assert len(lines) == 5
    assert lines[0] == "Euler at 2 ms: 100 times real time"
    assert lines[3] == (
        "Euler stays bounded at the steps tried to 18.1 ms; near the motion of small steps "
        "at the steps tried to 7 ms (off by 0.1 rad at 0.8 s); with nothing going through "
        "at the steps tried to 12 ms"
    )
    assert lines[4] == "not known: the error was not taken apart"
    all_stay = replace(
        limit, bracket=None, largest="all", near="all", near_reason="", through="all"
    )
    lines = judged(rows_of((1, 0.5)), stable=(all_stay,)).verdict.lines
    assert lines[3] == (
        "Euler stays bounded, near the motion of small steps and with nothing going through at "
        "every step tried, to 100 ms"
    )
    lost = replace(limit, near=0.0183, near_reason="it is lost", through="all")
    lines = judged(rows_of((1, 0.5)), stable=(lost,)).verdict.lines
    assert lines[3] == "Euler stays bounded at the steps tried to 18.1 ms", "the rest says no more"


def ladder(*errors: float, own_number: int = 0) -> tuple[WorkPrecisionRow, ...]:
    """Rows of Euler at 4, 2, 1, … ms with these errors, each twice as dear as the one before."""
    none = {"position": None, "velocity": None}
    rows = [
        row(
            "Euler", 0.004 / 2**n, cost=2.0 ** (n - own_number), seen=e, own=n == own_number, **none
        )
        for n, e in enumerate(errors)
    ]
    return mark_luck(rows, {"Euler": 0.0025}, replace(SEEN, least=1e-6))


def test_errors_that_do_not_fall_or_belong_to_no_stable_run_are_luck() -> None:
    lucky = [bool(row.lucky) for row in ladder(8e-3, 4e-3, 2e-3, 1e-3)]
    assert lucky == [True, False, False, False]
    rows = ladder(8e-3, 1e-4, 2e-3, 1e-3)
    assert rows[0].lucky == "it is beyond its largest stable timestep, 2.5 ms"
    assert rows[1].lucky == "its error rises with shorter timesteps"
    (lost,) = mark_luck([row(own=True, seen=1e-3)], {"Euler": 0.0}, SEEN)
    assert lost.lucky == "the shortest timestep that was tried is lost"
    assert [bool(row.lucky) for row in ladder(8e-3, 1e-7, 1e-6)] == [True, False, False]


def test_fewer_iterations_that_err_less_are_luck() -> None:
    solving = {"solver": "Newton", "cone": "elliptic", "position": None, "velocity": None}
    few, many = (
        row("Euler", 0.002, iterations=n, seen=error, cost=cost, own=n == 100, **solving)
        for n, error, cost in ((1, 1e-4, 0.8), (100, 1.4e-4, 1.0))
    )
    report = judged([few, many])
    assert report.rows[0].lucky == "its error rises with more iterations"
    assert report.verdict.text.startswith(
        "no difference that holds: Euler at 2 ms, 1 iteration takes 0.8 of the time and errs 1.4 "
        "times less (what is seen over the whole run) here, but its error rises with more "
        "iterations"
    )


def test_what_timing_cannot_tell_is_no_advantage() -> None:
    """An interval that holds 1 is no saving, and a setting that seems dearer is not as cheap."""
    rows = rows_of((1, 2.5), (0.9, 0.5))
    rows[1] = replace(rows[1], cost=Interval(0.9, 0.7, 1.3))
    assert "better: it takes about as long and errs 5 times less" in judged(rows).verdict.text
    rows[1] = replace(rows[1], cost=Interval(1.3, 0.7, 1.9))
    assert judged(rows).verdict.better is None


def test_what_mends_an_error_says_what_it_makes_worse() -> None:
    rows = rows_of((1, 2.5), (0.5, 1.0))
    rows = [replace(r, velocity=(v, v)) for r, v in zip(rows, (0.1, 0.3), strict=True)]
    report = judged(rows, parts=ErrorParts(2.5, None, None, 1e-9, 0.001))
    assert report.parts is not None and report.parts.mend == (
        "RK4 at 10 ms errs 2.5 times less in all and takes 0.5 of the time, but the error of "
        "velocity is 3 times as large over the whole run"
    )


def test_a_mend_that_errs_less_than_is_known_errs_at_least_so_many_times_less() -> None:
    rows, parts = rows_of((1, 0.6), (0.5, 0.25)), ErrorParts(0.6, None, None, 1e-9, 0.25)
    report = judged(rows, least_seen=0.25, parts=parts)
    assert report.parts is not None
    assert report.parts.mend.startswith("RK4 at 10 ms errs at least 2.4 times less in all")
    rows, parts = rows_of((1, 0.6), (1.04, 1e-9)), ErrorParts(0.6, None, None, 1e-9, 1e-9)
    mend = "RK4 at 10 ms errs over 10000 times less in all and takes about as long"
    for least in (1e-8, 1e-10):
        parts = judged(rows, least_seen=least, parts=parts).parts
        assert parts is not None and parts.mend == mend
    assert judged(rows_of((1, 0.0)), parts=parts).verdict.lines[1] == "it makes no error"


def test_verdicts_claim_only_what_holds() -> None:
    small = [
        row("Euler", 0.002, cost=1.0, seen=1e-3, own=True, velocity=None, position=None),
        row("implicit", 0.002, cost=0.93, seen=0.94e-3, velocity=None, position=None),
    ]
    text = judged(small).verdict.text
    assert text.startswith("no difference that holds: implicit at 2 ms takes 0.93 of the time")
    assert "errs 1000 times less" in verdict_text((1, 1e-3), (0.5, 1e-6))
    assert "errs at least 1000 times less" in verdict_text((1, 1e-3), (0.5, 1e-6), least_seen=1e-6)
    resting = judged(rows_of((1, 0.0), (0.1, 0.0))).verdict
    assert resting.better is None
    assert resting.text == "no setting can be called better: none errs, as where nothing moves"
    untimed = judged([row(own=True, cost=None, seen=0.5)]).verdict.text
    assert untimed.startswith("nothing was timed, so no setting can be called better; ")


def test_what_leaves_the_motion_of_small_steps_is_not_better() -> None:
    """The reference resolves no error of positions, but runs were seen to leave it beyond 3 ms."""
    rows = [replace(r, position=(0.005, 0.005)) for r in masked()]
    quick = replace(rows[0].setting, iterations=1)
    rows.append(replace(rows[0], own=False, setting=quick, step_error=0.2))
    fields: dict[str, Any] = {"contact_model": CONES, "floor": 5e-4, "least_seen": 0.1}
    text = judged(rows, **fields).verdict.text
    better = "implicit at 4.16667 ms is better: it takes 0.47 of the time and errs no more in any "
    assert text.startswith(f"{better}column, as far as the reference resolves; ")
    limits = (0.001, 0.1), None, 1.0, None
    stable = [StableRow(name, "all", *limits, near=0.003) for name in ("Euler", "implicit")]
    verdict = judged(rows, stable=tuple(stable), **fields).verdict
    assert verdict.better is None and (
        "but implicit leaves the motion of small steps at some timesteps beyond 3 ms"
        in verdict.text
    )


def test_rounding_after_an_error_is_gone_makes_no_setting_better() -> None:
    """Two weights fall steadily after a jolt: what is left of its error is rounding."""
    rows = rows_of((1, 0.6), (1, 0.6))
    for n, end in enumerate((5e-6, 3e-6)):
        rows[n] = replace(rows[n], velocity=(0.4, end), halves={"velocity": (0.4, end)})
    assert judged(rows).verdict.better is None


def test_what_is_not_resolved_makes_no_setting_better() -> None:
    verdict = judged(rows_of((1, 2.0), (0.5, 2.0)), least_seen=2.0).verdict
    assert verdict.better is None
    assert verdict.text == (
        "no setting can be called better: the reference resolves no error of RK4 at 10 ms, or of "
        "the scene's own setting; whether the scene's own error can be seen is not known"
    )
    verdict = judged(rows_of((1, 1e-9), (0.5, 1e-9)), least_seen=1e-9).verdict
    assert verdict.better == 1, "what nobody can see may as well be cheap"
    assert ", as far as the reference resolves; " in verdict.text


def test_chaotic_scene_is_judged_by_how_long_runs_last() -> None:
    none = {"position": None, "velocity": None}
    rows = [
        row("Euler", 0.002, cost=1.0, seen=None, own=True, parted=2.4, **none),
        row("RK4", 0.002, cost=4.0, seen=None, parted=12.4, **none),
    ]
    text = judged(rows, horizon_error={"m": 0.002}).verdict.text
    assert text == ("the motion is chaotic: off by 0.002 m at 2.4 s, under RK4 at 2 ms at 12.4 s")
    assert judged(rows, horizon_error={"m": 0.002}).verdict.lines[1] == text, "once"
    whole_row = row("Euler", 0.004, cost=0.5, seen=0.1, **none)
    report = judged([*rows, whole_row])
    assert report.rows[2].lucky == "with shorter timesteps it is off sooner"
    assert report.verdict.text.endswith(" at 12.4 s")
