"""What settings cost, by a clock that does not tick by itself, and which are worth it."""

from __future__ import annotations

import random
from collections.abc import Callable

import mujoco
import pytest

from mjbench.costs import (
    MIN_ROUNDS,
    Job,
    costs,
    mark_luck,
    scenario_job,
    time_jobs,
    verdict,
)
from mjbench.problem import Scenario
from mjbench.reports import Interval
from mjbench.reports.scene_report import MeasuredSetting, WorkPrecisionRow
from mjbench.reports.shown_errors import FrontPoint, Quantity, front
from mjbench.scene import scenes
from samples.reports import diverged_row, row
from samples.surveys import NO_DECLARATIONS


class Machine:
    """A machine whose time passes with its work, and with what else it does."""

    def __init__(self, disturbed: Callable[[], float] = lambda: 1.0) -> None:
        self.now = 0.0
        self.disturbed = disturbed
        self.done: list[float] = []
        self.slowed: list[bool] = []

    def clock(self) -> int:
        return round(self.now)

    def job(self, cost: float) -> Job:
        def work() -> None:
            factor = self.disturbed()
            self.done.append(cost)
            self.slowed.append(factor > 1.2)
            self.now += cost * factor

        return work


class Neighbours:
    """Others who come in bursts, for longer than a job, and slow everything; and slow drift."""

    def __init__(self, seed: int) -> None:
        self.random = random.Random(seed)
        self.left = 0
        self.factor = self.drift = 1.0

    def __call__(self) -> float:
        if self.left == 0:
            busy = self.random.random() < 0.4
            self.left = self.random.randint(1, 25)
            self.factor = self.random.uniform(1.3, 4.0) if busy else 1.0
        self.left -= 1
        self.drift *= 1.0001
        jitter = abs(self.random.gauss(0.0, 0.01))
        spike = 8.0 if self.random.random() < 0.03 else 1.0
        return self.factor * self.drift * spike * (1 + jitter)


def test_a_quiet_machine_is_asked_as_seldom_as_can_be() -> None:
    machine = Machine()
    timings = time_jobs([machine.job(c) for c in (2e6, 1e6, 5e6)], 1, machine.clock)
    assert [timing.ratio for timing in timings] == [Interval(c, c, c) for c in (2.0, 1.0, 5.0)]
    assert [timing.nanoseconds.value for timing in timings] == [2e6, 1e6, 5e6]
    assert len(machine.done) == 3 * (MIN_ROUNDS + 1), "and once before, to warm up"


@pytest.mark.parametrize("seed", range(2))
def test_ratios_on_a_noisy_machine_lie_in_their_intervals(seed: int) -> None:
    true = [0.1, 0.97, 1.0, 1.05, 3.0, 20.0]
    inside = []
    for half in (0, 1):
        machine = Machine(Neighbours(2 * seed + half))
        timings = time_jobs([machine.job(1e7 * c) for c in true], 2, machine.clock)
        assert sum(machine.slowed) > 0.2 * len(machine.slowed), "there was noise"
        for timing, cost in zip(timings, true, strict=True):
            assert timing.ratio.value == pytest.approx(cost, rel=0.03)
            assert timing.ratio.half_width < 0.1
            inside.append(0.99 * timing.ratio.low <= cost <= 1.01 * timing.ratio.high)
    assert sum(inside) >= 10


def test_a_slow_model_is_not_timed_for_ever() -> None:
    machine = Machine(Neighbours(3))
    time_jobs([machine.job(c) for c in (2e9, 4e9)], 0, machine.clock)
    assert len(machine.done) == 2 * (MIN_ROUNDS + 1)


SPRING = """\
<mujoco>
  <option timestep="0.004"/>
  <worldbody>
    <body><joint type="slide" stiffness="10"/><geom size="0.1" mass="1"/></body>
  </worldbody>
  <keyframe><key qpos="0.2"/></keyframe>
</mujoco>
"""


def test_costs_are_of_the_whole_scenario(monkeypatch: pytest.MonkeyPatch) -> None:
    """A clock that goes by what steps cost where the spring is: less and less, as it swings out."""
    model = mujoco.MjModel.from_xml_string(SPRING)
    (scene,) = scenes(model, NO_DECLARATIONS)
    machine, real = Machine(), mujoco.mj_step
    price = {mujoco.mjtIntegrator.mjINT_EULER: 300.0, mujoco.mjtIntegrator.mjINT_RK4: 1300.0}

    def step(model: mujoco.MjModel, data: mujoco.MjData, nstep: int = 1) -> None:
        machine.now += nstep * price[mujoco.mjtIntegrator(model.opt.integrator)]
        real(model, data, nstep)
        machine.now += 1e4 * abs(float(data.qpos[0]))

    monkeypatch.setattr(mujoco, "mj_step", step)
    settings = [MeasuredSetting(name, 0.004, "", 0, "") for name in ("RK4", "Euler")]
    timings = costs(model, scene, settings, 1, machine.clock)
    steps = round(scene.scenario.duration / 0.004)
    ends = []
    for integrator in (mujoco.mjtIntegrator.mjINT_RK4, mujoco.mjtIntegrator.mjINT_EULER):
        model.opt.integrator = integrator
        data = mujoco.MjData(model)
        mujoco.mj_resetDataKeyframe(model, data, 0)
        real(model, data, steps)
        ends.append(steps * price[integrator] + 1e4 * abs(float(data.qpos[0])))
    nanoseconds = [timing.nanoseconds.value for timing in timings]
    assert nanoseconds == pytest.approx(ends, rel=1e-4), "each to its own end"
    assert timings[0].ratio.value == pytest.approx(ends[0] / ends[1], rel=1e-4)


def test_a_run_in_which_bodies_sleep_is_the_same_each_time() -> None:
    """Data were made for a model that does not sleep, and hold who slept at the end."""
    model = mujoco.MjModel.from_xml_string("""<mujoco><worldbody><geom type="plane" size="1 1 1"/>
      <body pos="0 0 .1"><freejoint/><geom type="box" size=".1 .1 .1"/></body>
      <body pos="0 0 .9"><freejoint/><geom type="box" size=".1 .1 .1"/></body>
    </worldbody></mujoco>""")
    ends: list[bytes] = []
    advance = mujoco.mj_step

    def step(model: mujoco.MjModel, data: mujoco.MjData, nstep: int = 1) -> None:
        advance(model, data, nstep)
        ends.append(data.qpos.tobytes())

    job = scenario_job(model, [Scenario(1.0, 0.1)], 0.002)
    model.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_SLEEP)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(mujoco, "mj_step", step)
        for _ in range(3):
            job()
    data = mujoco.MjData(model)
    advance(model, data, 500)
    assert ends == [data.qpos.tobytes()] * 3


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


def test_cheaper_and_more_accurate_is_better() -> None:
    rows = rows_with_front((1, 1e-3), (0.5, 1e-5), (0.1, 0.3), (4, 1e-3), None)
    assert [row.front for row in rows] == [False, True, True, False, False]
    assert [row.dominated_by for row in rows] == [1, None, None, 1, None]
    rows = rows_with_front((8, 8.0), (4, 4.0), (2, 2.0), (1, 1.0))
    assert [row.dominated_by for row in rows] == [3, 3, 3, None], "it is on the front"


def test_small_differences_are_none_and_lost_runs_are_on_no_front() -> None:
    own_point = (1, 1e-3)
    for points, on_front in (
        ((own_point, (1.02, 1e-3)), [True, True]),
        ((own_point, (1.02, 1.04e-3)), [True, True]),
        ((own_point, (1.2, 1e-3)), [True, False]),
        ((own_point, (1, 1.06e-3)), [True, False]),
        ((own_point, (0.98, 1.5e-3)), [True, False]),  # its cost is no better
        ((own_point, (0.5, 1.04e-3)), [False, True]),
        (((1, 0.0), (2, 0.0), (0.5, 1e-12)), [True, False, True]),
        ((None, None), [False, False]),
        ((), []),
    ):
        assert [row.front for row in rows_with_front(*points)] == on_front, points


def test_costs_that_timing_cannot_tell_apart_are_equal() -> None:
    own_point = FrontPoint(Interval(1.0, 0.8, 1.2), 1e-3)
    for high, is_cheaper in ((0.79, True), (0.8, False), (0.9, False)):
        rival = FrontPoint(Interval(0.7, 0.6, high), 1e-3)
        assert rival.is_cheaper(own_point) == rival.beats(own_point) == is_cheaper, high


OWN_BEST = "no other setting is cheaper without being less accurate"
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
        "RK4 at 10 ms is better: it takes 0.5 of the time and errs no more; "
        "whether the scene's own error can be seen is not known"
    )
    judgement = verdict(front([row(own=True, cost=None, seen=0.5)]), [False])
    assert judgement.text.startswith("nothing was timed, so no setting can be called better; ")


def ladder(*errors: float, own_number: int = 0) -> tuple[WorkPrecisionRow, ...]:
    """Rows of Euler at 4, 2, 1, … ms with these errors, each twice as dear as the one before."""
    rows = [
        row("Euler", 0.004 / 2**n, cost=2.0 ** (n - own_number), seen=error, own=n == own_number)
        for n, error in enumerate(errors)
    ]
    return mark_luck(rows, {"Euler": 0.0025}, Quantity("seen", "", 1e-6))


def test_errors_that_do_not_fall_or_belong_to_no_stable_run_are_luck() -> None:
    lucky = [bool(row.lucky) for row in ladder(8e-3, 4e-3, 2e-3, 1e-3)]
    assert lucky == [True, False, False, False]
    rows = ladder(8e-3, 1e-4, 2e-3, 1e-3)
    assert rows[0].lucky == "it is beyond its largest stable timestep, 2.5 ms"
    assert rows[1].lucky == "its error rises with shorter timesteps"
    assert [row.front for row in front(rows)] == [False, False, True, True]
    (lost,) = mark_luck([row(own=True, seen=1e-3)], {"Euler": 0.0}, Quantity("seen", ""))
    assert lost.lucky == "the shortest timestep that was tried is lost"
    # Below the floor of the reference nothing rises, or far below the error of the scene itself.
    exact = row("RK4", 0.004, cost=0.5, seen=2e-6), row("RK4", 0.001, cost=4.0, seen=3e-6)
    rows = mark_luck((row("Euler", 0.002, cost=1.0, seen=1e-3, own=True), *exact), {})
    assert [row.dominated_by for row in front(rows)] == [1, None, 1]
    assert [bool(row.lucky) for row in ladder(8e-3, 1e-7, 1e-6)] == [True, False, False]


def test_an_error_that_is_small_by_luck_recommends_nothing() -> None:
    rows = ladder(9.0, 0.5, 8.0, 4.0, 0.9, own_number=3)
    text = verdict(front(rows), [True, False, True, True, False]).text
    assert text.endswith("without one that is seen is Euler at 250 µs, at 2 times its cost")
    text = verdict(front(rows[:4]), [True, False, True, True]).text
    assert text.endswith("it is 4 times what an eye can tell")


def test_fewer_iterations_that_err_less_are_luck() -> None:
    solving = {"solver": "Newton", "cone": "elliptic"}
    few, many = (
        row("Euler", 0.002, iterations=n, seen=error, cost=cost, own=n == 100, **solving)
        for n, error, cost in ((1, 1e-4, 0.8), (100, 1.4e-4, 1.0))
    )
    few, many = front(mark_luck((few, many), {}))
    assert few.lucky == "its error rises with more iterations" and not few.front and many.front
    judgement = verdict((few, many), [False, False])
    assert judgement.on_front and judgement.text.startswith(
        "no difference that holds: Euler at 2 ms, 1 iteration takes 0.8 of the time and errs 1.4 "
        "times less here, but its error rises with more iterations; "
    )


def test_an_error_that_the_model_error_of_another_cone_cancels_is_luck() -> None:
    """The errors of a rolling ball against rolling: the cone's own error has the other sign."""
    for model_error, luck in ((0.006, "in small steps that cone errs no less"), (0.001, "")):
        elliptic, pyramidal = (
            row(
                "Euler",
                0.002,
                cost=1.0,
                seen=error,
                own=cone == "elliptic",
                cone=cone,
                model_error=least_error,
            )
            for cone, error, least_error in (
                ("elliptic", 1.55, 0.003),
                ("pyramidal", 1.04, model_error),
            )
        )
        rows = front(mark_luck((elliptic, pyramidal), {}))
        assert rows[1].lucky == luck
        assert (verdict(rows, [True, True]).better is None) is bool(luck)


def test_verdicts_claim_only_what_holds() -> None:
    rows = front(ladder(8e-3, 4e-3, 2e-3, 1e-3, own_number=3)[1:])
    assert verdict(rows, [False] * 3).on_front
    small = (
        row("Euler", 0.002, cost=1.0, seen=1e-3, own=True),
        row("implicit", 0.002, cost=0.93, seen=0.94e-3),
    )
    text = verdict(front(small), [False] * 2).text
    assert text.startswith("no difference that holds: implicit at 2 ms takes 0.93 of the time")
    large = (small[0], row("RK4", 0.008, cost=0.5, seen=1e-6))
    assert verdict(front(large), [False] * 2).better == 1
    text = verdict(front(large), [False] * 2, Quantity("seen", "", 1e-6)).text
    assert "errs 1000 times less, or more: " in text
    judgement = verdict(front(large), [False] * 2, holds=lambda s: s.integrator != "RK4")
    assert judgement.better is None and judgement.text.startswith(
        "no difference that holds: RK4 at 8 ms takes 0.5 of the time and errs 1000 times less "
        "here, but is no better from starts nearby; "
    )


def test_verdicts_say_no_less_and_no_more_than_the_table() -> None:
    slightly_worse = verdict(rows_with_front((1, 0.97), (0.6, 1.01)), [False, True]).text
    assert "takes 0.6 of the time and errs hardly more; " in slightly_worse
    as_dear = verdict(rows_with_front((1, 3.5), (1.02, 0.04)), [True, False]).text
    assert "it takes about as long and errs 88 times less; " in as_dear
    assert as_dear.endswith("without one that is seen is RK4 at 10 ms, at about its cost")
    exact = verdict(rows_with_front((1, 0.0), (2, 1e-9)), [False, False]).text
    assert exact.endswith("; the scene's own setting makes no error")
    resting = verdict(rows_with_front((1, 0.0), (0.1, 0.0)), [False, False])
    assert resting.better is None and not resting.on_front
    assert resting.text == "no setting can be called better: none errs, as where nothing moves"


def test_what_is_not_resolved_makes_no_setting_better() -> None:
    rows = rows_with_front((1, 2.0), (0.5, 2.0))
    judgement = verdict(rows, [None, None], Quantity("seen", "", 2.0))
    assert judgement.better is None and not judgement.on_front
    assert judgement.text == (
        "no setting can be called better: the reference resolves no error of RK4 at 10 ms, or of "
        "the scene's own setting; whether the scene's own error can be seen is not known"
    )
    rows = rows_with_front((1, 1e-9), (0.5, 1e-9))
    judgement = verdict(rows, [False, False], Quantity("seen", "", 1e-9))
    assert judgement.better == 1, "what nobody can see may as well be cheap"
    assert judgement.text == (
        "RK4 at 10 ms is better: it takes 0.5 of the time and errs no more, as far as the "
        "reference resolves; the scene's own error cannot be seen: it is less than 1e-09 of what "
        "an eye can tell"
    )


def test_where_the_own_setting_is_lost_the_others_are_weighed() -> None:
    rows = rows_with_front(None, (2, 1e-5), (0.5, 1e-3))
    words = "RK4 at 10 ms the cheapest without an error that is seen, at 0.25 of its cost"
    assert f"is the most accurate that does, {words}" in verdict(rows, [None] * 3).text
    text = verdict(rows_with_front(None, (2, 1e-5), (0.5, 170.0)), [None] * 3).text
    assert text.endswith("is the most accurate that does"), "a wrong motion is not cheap"


def test_chaotic_scene_is_judged_by_how_long_runs_last() -> None:
    rows = (
        row("Euler", 0.002, cost=1.0, seen=None, own=True, parted=2.4),
        row("RK4", 0.002, cost=4.0, seen=None, parted=12.4),
    )
    text = verdict(rows, [True, True], horizon_error="2 mm").text
    assert text == (
        "the motion is chaotic: it is 2 mm from the exact one at 2.4 s, under RK4 at 2 ms at 12.4 s"
    )
    lucky_row = row("Euler", 0.004, cost=0.5, seen=None, parted=20.0)
    text = verdict(mark_luck((*rows, lucky_row), {}), [True] * 3).text
    assert text.endswith(" at 2.4 s, under RK4 at 2 ms at 12.4 s"), "shorter timesteps are worse"
    whole_row = row("Euler", 0.004, cost=0.5, seen=0.1)
    marked_rows = mark_luck((*rows, whole_row), {})
    assert [r.lucky for r in marked_rows] == ["", "", "with shorter timesteps it is off sooner"]
    assert verdict(marked_rows, [True, True, False]).text.endswith(" at 12.4 s")
