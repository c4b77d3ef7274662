"""What settings cost, by a clock that does not tick by itself."""

from __future__ import annotations

import random
from collections.abc import Callable

import mujoco
import pytest

from mjbench.costs import MIN_ROUNDS, QUICK_MIN_ROUNDS, Job, costs, scenario_job, time_jobs
from mjbench.problem import Scenario
from mjbench.reports import Interval
from mjbench.reports.scene_report import MeasuredSetting
from mjbench.scene import scenes
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
    assert len(machine.done) == 3 * MIN_ROUNDS


@pytest.mark.parametrize("seed", (3, 9))
def test_ratios_on_a_noisy_machine_lie_in_their_intervals(seed: int) -> None:
    true = [0.1, 0.97, 1.0, 1.05, 3.0, 20.0]
    inside = []
    for half in (0, 1):
        machine = Machine(Neighbours(seed + half))
        timings = time_jobs([machine.job(1e7 * c) for c in true], 2, machine.clock)
        assert sum(machine.slowed) > 0.2 * len(machine.slowed), "there was noise"
        for timing, cost in zip(timings, true, strict=True):
            assert timing.ratio.value == pytest.approx(cost, rel=0.03)
            assert timing.ratio.half_width < 0.1
            inside.append(0.99 * timing.ratio.low <= cost <= 1.01 * timing.ratio.high)
    assert sum(inside) >= 10


def test_a_slow_model_is_not_timed_for_ever() -> None:
    for is_quick, rounds in ((False, MIN_ROUNDS), (True, QUICK_MIN_ROUNDS)):
        machine = Machine(Neighbours(3))
        time_jobs([machine.job(c) for c in (2e9, 4e9)], 0, machine.clock, quick=is_quick)
        assert len(machine.done) == 2 * rounds
    machine = Machine(Neighbours(3))
    time_jobs([machine.job(c) for c in (2e6, 4e6)], 0, machine.clock, quick=True)
    assert len(machine.done) >= 2 * MIN_ROUNDS, "what takes little is timed as often as ever"


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
