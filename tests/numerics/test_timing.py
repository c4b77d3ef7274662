"""What steps cost, by a clock that does not tick by itself."""

from __future__ import annotations

import random
from collections.abc import Callable

import mujoco
import pytest

from coursebuild.numerics.engine import full_state
from coursebuild.numerics.pilot import pilot
from coursebuild.numerics.reports.bench import MeasuredSetting
from coursebuild.numerics.scene import scenes
from coursebuild.numerics.timing import FEWEST, Batch, Job, costs, step_times, timed


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
    found = timed([machine.job(c) for c in (2e6, 1e6, 5e6)], 1, machine.clock)
    assert [one.ratio for one in found] == [2.0, 1.0, 5.0]
    assert [one.least for one in found] == [2e6, 1e6, 5e6]
    assert [one.spread for one in found] == [1.0, 1.0, 1.0]
    assert found[0].rounds == FEWEST
    assert found[0].uncertainty == 0.0
    found = timed([machine.job(c) for c in (3e6, 5e6)], 0, machine.clock, idle=[1e6, 1e6])
    assert found[1].ratio == 2.0, "what is not to be timed is taken off"


@pytest.mark.parametrize("seed", range(2))
def test_ratios_repeat_on_a_noisy_machine(seed: int) -> None:
    true = [0.1, 0.97, 1.0, 1.05, 3.0, 20.0]
    runs = []
    for half in (0, 1):
        machine = Machine(Neighbours(2 * seed + half))
        found = timed([machine.job(1e6 * c) for c in true], 2, machine.clock)
        runs.append([one.ratio for one in found])
        assert sum(machine.slowed) > 0.2 * len(machine.slowed), "there was noise"
        for one, cost in zip(found, true, strict=True):
            assert one.ratio == pytest.approx(cost, rel=0.02)
            assert one.uncertainty < 0.1
    assert runs[0] == pytest.approx(runs[1], rel=0.05)


def test_without_end_there_is_a_cap() -> None:
    machine = Machine(Neighbours(3))
    found = timed([machine.job(c) for c in (1e6, 2e6)], 0, machine.clock, most=20, enough=0.0)
    assert found[1].rounds == 20


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
    """A step has a price, a call has one too: what is told is the price of all steps."""
    model = mujoco.MjModel.from_xml_string(SPRING)
    (scene,) = scenes(model, None)
    first = pilot(model, scene)
    machine = Machine()
    price = {mujoco.mjtIntegrator.mjINT_EULER: 300.0, mujoco.mjtIntegrator.mjINT_RK4: 1300.0}

    def step(model: mujoco.MjModel, data: mujoco.MjData, nstep: int = 1) -> None:
        machine.now += 900.0 + nstep * price[mujoco.mjtIntegrator(model.opt.integrator)]

    monkeypatch.setattr(mujoco, "mj_step", step)
    chosen = [
        MeasuredSetting(name, h, "", 0, "")
        for name in ("RK4", "Euler")
        for h in (0.008, 0.004, 0.001)
    ]
    found = costs(model, first, chosen, 4, machine.clock)
    expected = [price * 0.004 / h for price in (13 / 3, 1.0) for h in (0.008, 0.004, 0.001)]
    assert [one.ratio for one in found] == pytest.approx(expected, rel=1e-4)
    assert [one.least for one in found] == pytest.approx([1300] * 3 + [300] * 3, rel=1e-4)


def test_a_model_beside_a_changed_one(monkeypatch: pytest.MonkeyPatch) -> None:
    """On a clock that goes by the steps made, three times as fast for one model."""
    models = [mujoco.MjModel.from_xml_string(SPRING) for _ in range(2)]
    datas = [mujoco.MjData(model) for model in models]
    whole, changed = (
        Batch(model, data, [full_state(model, data)], 64)
        for model, data in zip(models, datas, strict=True)
    )
    machine, noise = Machine(), random.Random(0)

    def step(model: mujoco.MjModel, data: mujoco.MjData, nstep: int = 1) -> None:
        machine.now += nstep * (3e5 if model is models[0] else 1e5) * noise.uniform(1.0, 1.02)

    monkeypatch.setattr(mujoco, "mj_step", step)
    found, _ = step_times((whole, changed), 1, machine.clock)
    assert found.ratio == pytest.approx(3.0, rel=0.02)
    equal, _ = step_times((whole, whole), 1, machine.clock, quick=True)
    assert equal.ratio == pytest.approx(1.0, abs=0.03)
    assert all(one.least == 0 for one in step_times((whole, changed), 1, lambda: 0, quick=True))
