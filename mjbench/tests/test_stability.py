"""The largest stable timesteps, beside theory."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np
import pytest
from msgspec.structs import replace

from mjbench import stability
from mjbench.declarations import Declarations, DeclaredScenario, Place, is_multiple
from mjbench.detector import RunStatus
from mjbench.linearization import Theory, find_rest, find_theory
from mjbench.loop import Loop, TimeLimitError
from mjbench.parts import Parts
from mjbench.pilot import run_pilot
from mjbench.problem import STANDARD, Integrator, Scenario, Setup
from mjbench.problems import all_problems
from mjbench.reports.scene_report import StableRow
from mjbench.scene import scenes
from mjbench.simulation import compile_model, simulate, with_integrator
from mjbench.stability import (
    Laboratory,
    StabilityTrial,
    boundaries,
    boundary,
    search_row,
    stable_rows,
    with_energy_bound,
)
from mjbench.stability_runs import KeptMotion, run_trial
from samples.runs import attempt

pytestmark = pytest.mark.long


def test_a_boundary_is_found_beside_theory() -> None:
    problem = replace(all_problems()["damped-spring-0.1"], search=(0.1, 1.0), span=200.0)
    lines = {line.integrator: line for line in boundaries(problem)}
    assert {integrator.value for integrator in Integrator} == set(lines), "damping: eulerdamp"
    for integrator in (Integrator.EULER, Integrator.EULER_EXPLICIT, Integrator.RK4):
        line = lines[integrator.value]
        assert line.largest == pytest.approx(line.theory, rel=0.01)
        assert line.monotone and "reached" in line.reason
        assert line.duration == problem.span == 200


def test_where_all_or_none_is_stable() -> None:
    problem = replace(all_problems()["damped-spring-1"], search=(0.2, 0.5), span=100.0)
    line = boundary(problem, Integrator.DISCRETE)
    assert (line.largest, line.searched) == ("all", (0.2, 0.5))
    assert (line.bracket, line.theory, line.formula) == (None, "all", DISCRETE)
    line = boundary(replace(problem, search=(0.6, 2.0)), Integrator.EULER)
    assert line.largest == "none"
    assert boundaries(replace(problem, search=None)) == ()
    undamped = replace(all_problems()["damped-spring-0"], search=(0.2, 0.3), span=10.0)
    assert Integrator.EULER_EXPLICIT.value not in {row.integrator for row in boundaries(undamped)}


DISCRETE = "implicit in positions and velocities"


def search(
    lost: Callable[[int, float, float], bool],
    interval: tuple[float, float],
    starts: int = 3,
    snap: Callable[[float], float] = float,
) -> StableRow:
    """What a laboratory finds whose runs from a start, at a timestep and over a time, are lost."""

    def run(start: int, step: float, span: float) -> StabilityTrial:
        status = RunStatus.DIVERGED if lost(start, step, span) else RunStatus.OK
        return StabilityTrial(step, status)

    setup = Setup(scenario=Scenario(5.0, 5.0))
    laboratory = Laboratory(run, 5.0, starts, snap=snap)
    return search_row(laboratory, Integrator.RK4, interval, setup, Theory())


@pytest.mark.parametrize(
    ("island", "largest"),
    [
        ((50.0, 57.7), 50.0),
        ((11.0, 12.7), 11.0),  # a fifth of it
        ((8.0, 9.3), 8.0),
        ((70.0, 90.0), 62.0),
    ],
)
def test_the_largest_is_below_everything_that_is_lost(
    island: tuple[float, float], largest: float
) -> None:
    low, high = island
    row = search(lambda _, step, span: low < step < high or 62 < step < 100, (1.0, 1000.0))
    assert isinstance(row.largest, float) and row.largest == pytest.approx(largest, rel=2e-4)
    assert row.largest <= largest
    assert row.islands is not None and row.islands[1] == pytest.approx(1000.0)
    assert row.searched[0] <= max(1.001, largest / 7)
    assert row.bracket is not None and row.bracket[0] <= row.largest <= row.bracket[1]


def test_narrow_islands_below_the_limit_are_looked_for() -> None:
    """They lie between timesteps of the grid, as where a ball strikes in a phase of a step."""
    for low, high in ((40.0, 41.0), (38.1, 38.9)):
        row = search(lambda _, step, __: low < step < high or step > 50, (1.0, 1000.0))  # noqa: B023
        assert row.largest == pytest.approx(low, rel=2e-4)
    row = search(lambda _, step, __: 600 < step < 620, (1.0, 1000.0))
    assert row.largest == pytest.approx(600, rel=2e-4), "though all of the grid is stable"


def test_below_the_period_of_a_controller_only_its_divisors_are_tried() -> None:
    """At others commands are late, from one period to the next by another part of a step."""
    loop, steps = Loop("policy.py", compile("", "", "exec"), 0.1), set()

    def is_lost(_: int, step: float, __: float) -> bool:
        steps.add(step)
        return step > 0.04

    row = search(is_lost, (0.001, 1.0), snap=loop.timestep_below)
    assert row.largest == pytest.approx(0.1 / 3)
    assert all(is_multiple(0.1, step) or step > 0.1 for step in steps)


def test_a_limit_is_known_as_far_as_spans_and_starts_agree() -> None:
    """Over twice the time it is lost a little earlier, and from one of the starts much earlier."""
    row = search(lambda _, step, span: step > 25.4 + 0.4 / span, (1.0, 1000.0))
    assert row.bracket == pytest.approx((25.44, 25.48), abs=5e-3)
    row = search(lambda start, step, _: step > (19 if start == 2 else 25.4), (1.0, 1000.0))
    assert row.bracket == pytest.approx((19, 25.4), rel=1e-2)
    row = search(lambda start, step, _: start == 1 and step > 500, (1.0, 1000.0))
    assert row.largest == "all" and row.bracket == pytest.approx((500, 1000), rel=1e-2)
    row = search(lambda _, step, __: step > 25.4 and not 60 < step < 80, (1.0, 1000.0))
    assert row.islands is not None and 60 < row.islands[0] <= row.islands[1] < 80


def test_what_grows_or_falls_farther_in_a_longer_time_is_not_lost() -> None:
    ball = """<mujoco><worldbody><body pos="0 0 10"><joint type="slide" axis="0 0 1"/>
    <geom size="0.1" mass="1"/></body></worldbody></mujoco>"""
    # It doubles every 1.4 s, under any method: twice the duration shows 148 times as much.
    excited = """<mujoco><option timestep="0.005" gravity="0 0 0"/><worldbody><body>
    <joint type="slide" stiffness="25" damping="-1"/><geom size="0.1" mass="1"/></body>
    </worldbody></mujoco>"""
    rows = [*rows_of(ball, stable_for=6.0, search=(0.005, 0.05)).values()]
    rows += rows_of(excited, qpos=(0.1,), stable_for=10.0, search=(0.005, 0.02)).values()
    for row in rows:
        assert (row.largest, row.bracket) == ("all", None), row.integrator


def test_the_energy_that_nothing_can_raise_is_that_of_the_beginning() -> None:
    """The first run, in steps of Euler's method, has more now and then."""
    mjcf = """<mujoco><option timestep="0.01"/><worldbody><body><joint axis="0 1 0"/>
    <inertial pos="1 0 0" mass="1" diaginertia="1 1 1"/></body></worldbody></mujoco>"""
    model = mujoco.MjModel.from_xml_string(mjcf)
    table = DeclaredScenario("s", table=Place("m.xml"), duration=2.0, qvel=(1.0,))
    (scene,) = scenes(model, Declarations("m.xml", (table,)))
    assert run_pilot(model, scene).peaks.energy == 1.0, "½ (1 + 1) 1²"


def test_energies_of_a_first_run_that_gains_energy_bound_nothing() -> None:
    """Euler's method loses a top that spins at 200 rad/s at every timestep."""
    mjcf = """<mujoco><option gravity="0 0 0"/><worldbody><body><joint type="ball"/>
    <inertial pos="0 0 0" mass="1" diaginertia="0.006 0.006 0.0004"/></body></worldbody></mujoco>"""
    model = mujoco.MjModel.from_xml_string(mjcf)
    start = {"qvel": (0.0, 20.0, 200.0), "duration": 2.0}
    table = DeclaredScenario("s", table=Place("m.xml"), timesteps=(5e-4,), **start)
    (scene,) = scenes(model, Declarations("m.xml", (table,)))
    energy = 0.5 * (0.006 * 20**2 + 0.0004 * 200**2)
    setup = run_pilot(model, scene).setup
    assert setup.energy_bound == pytest.approx(11 * energy, rel=1e-6)


def test_a_rest_about_which_forces_have_two_laws_has_no_theory() -> None:
    """A muscle activates in other times than it deactivates; a post just touches a plane.

    A mean of both sides would give limits all the same, with digits that mean nothing.
    """
    muscle = """<joint name="j" type="slide" stiffness="60" damping="2"/><geom size=".1"/></body>
    </worldbody><actuator><muscle joint="j" force="50" lengthrange="-.4 .4"/></actuator>"""
    post = """<joint type="slide" axis="0 0 1" stiffness="9"/><joint axis="0 1 0" stiffness="9"/>
    <geom type="cylinder" size=".1 .5"/></body><geom type="plane" size="1 1 1"/></worldbody>"""
    head = '<mujoco><option gravity="0 0 0"/><worldbody><body pos="0 0 .5">'
    for rest in (muscle, post):
        model = mujoco.MjModel.from_xml_string(f"{head}{rest}</mujoco>")
        assert find_rest(model, Scenario(1.0, 0.1)) is None


ARM = """<mujoco><option timestep="0.002" gravity="0 0 0"/><worldbody><body>
<joint name="j" axis="0 1 0" {}/><inertial pos="0 0 0" mass="10" diaginertia="13.33 13.33 13.33"/>
</body></worldbody>{}</mujoco>"""
SERVO = '<actuator><position joint="j" kp="2e5" kv="1500"/></actuator>'


def rows_of(mjcf: str, parts: Parts | None = None, **fields: Any) -> dict[str, StableRow]:
    model = mujoco.MjModel.from_xml_string(mjcf)
    table = DeclaredScenario("s", table=Place("m.xml"), duration=2.0, **fields)
    (scene,) = scenes(model, Declarations("m.xml", (table,)))
    fine = with_integrator(model, Integrator.RK4, min(scene.timesteps))
    states = simulate(Setup(scenario=scene.scenario), fine).states
    rows = stable_rows(model, run_pilot(model, scene), states, parts or Parts(), quick=True)
    return {row.integrator: row for row in rows}


def test_a_cut_search_keeps_what_the_own_start_showed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def rows_until(shortest: float, starts: int) -> tuple[dict[str, StableRow], dict[str, str]]:
        def run_until(setup: Setup, model: Any, *rest: Any, start: int) -> StabilityTrial:
            if model.opt.timestep < shortest or start >= starts:
                raise TimeLimitError
            return run_trial(setup, model, *rest, start=start)

        monkeypatch.setattr(stability, "run_trial", run_until)
        parts = Parts()
        rows = rows_of(ARM.format("", SERVO), parts, qpos=(0.1,), sample=0.02)
        return rows, {part.part.partition(" of ")[2]: part.reason for part in parts.failures}

    rows, reasons = rows_until(0.01, starts=3)
    assert rows == {} and set(reasons.values()) == {"not enough time"}
    rows, reasons = rows_until(0.0, starts=1)
    assert reasons == {f"{name} from starts nearby": "not enough time" for name in rows}
    assert isinstance(near := rows["Euler"].near, float) and near < 0.0104


def test_a_servo_is_stable_as_far_as_the_spring_and_damper_that_it_is() -> None:
    """Linear theory: 10.468 ms where damping is explicit, 25.468 where implicit, RK4 21.585."""
    servo = rows_of(ARM.format("", SERVO), qpos=(0.0,), controls=((0.1,),), hold=2.0)
    spring = rows_of(ARM.format('stiffness="2e5" damping="1500"', ""), qpos=(0.1,))
    for rows, expected in (
        (servo, {"Euler": 10.468, "implicit": 25.468, "RK4": 21.585}),
        (spring, {"Euler": 25.468, "implicit": 25.468, "RK4": 21.585}),
    ):
        for name, limit in expected.items():
            row = rows[name]
            assert row.theory == pytest.approx(limit * 1e-3, rel=1e-4), name
            assert row.bracket is not None
            assert row.bracket == pytest.approx((limit * 1e-3,) * 2, rel=0.012), name
        assert (rows["discrete"].theory, rows["discrete"].largest) == ("all", "all")


def test_a_state_of_an_actuator_that_nothing_excites_is_lost_from_starts_nearby() -> None:
    """A filter of 20 ms is explicit under Euler: it is unstable beyond 40 ms."""
    actuator = '<actuator><general joint="j" dyntype="filter" dynprm="0.02" gainprm="4000"/>'
    mjcf = ARM.format('stiffness="4000" damping="200"', actuator + "</actuator>")
    row = rows_of(mjcf, qpos=(0.1,), controls=((0.0,),), hold=2.0)["Euler"]
    assert row.theory == pytest.approx(0.04, rel=1e-5)
    assert row.bracket is not None and row.bracket[0] == pytest.approx(0.04, rel=0.02)
    assert row.bracket[1] > 0.05


def test_theory_at_rest_is_that_of_formulas() -> None:
    mismatches = []
    for problem in (p for p in all_problems().values() if p.limit is not None and p.case != 3):
        model = compile_model(problem.mjcf, Integrator.RK4, min(problem.timesteps))
        theory = find_theory(model, problem.scenario, None)
        for integrator in STANDARD:
            computed, exact = theory.limit(integrator, (1e-4, 10.0)), problem.limit(integrator)
            assert computed is not None and exact is not None, problem.name
            if computed.timestep != pytest.approx(exact.timestep, rel=1e-4):
                mismatches.append((problem.name, integrator, computed.timestep, exact.timestep))
    assert mismatches == []


def test_theory_of_models_that_sleep_or_lie_exactly_still() -> None:
    """A model with sleep has the limits that it has awake, and `discrete` none for springs."""
    discs = """<mujoco><option gravity="0 0 0" sleep_tolerance="0.1"><flag sleep="{}"/></option>
    <worldbody>{}</worldbody></mujoco>"""
    bodies = "".join(
        f'<body pos="{n} 0 0"><joint axis="1 0 0" stiffness="{stiffness}"/>'
        '<inertial pos="0 0 0" mass="1" diaginertia=".01 .01 .01"/></body>'
        for n, stiffness in enumerate((1, 4))
    )
    exact = 2 / 20  # 2 / ω of the faster disc, which lies still
    for sleep in ("disable", "enable"):
        model = mujoco.MjModel.from_xml_string(discs.format(sleep, bodies))
        scenario = Scenario(2.0, 0.04, qpos=(0.2, 0.0))
        theory = find_theory(model, scenario, None)
        for integrator, limit in ((Integrator.EULER, exact), (Integrator.RK4, exact * 2**0.5)):
            computed = theory.limit(integrator, (1e-3, 1.0))
            assert computed is not None and computed.timestep == pytest.approx(limit, rel=1e-5)
        computed = theory.limit(Integrator.DISCRETE, (1e-3, 1.0))
        assert computed is not None and computed.timestep == math.inf


def test_what_is_unstable_by_itself_has_no_theory_at_rest() -> None:
    problem = all_problems()["pendulum-hinge-179"]
    model = compile_model(problem.mjcf, Integrator.RK4, min(problem.timesteps))
    hanging = find_theory(model, problem.scenario, None).limit(Integrator.EULER, (1e-3, 1.0))
    assert hanging is not None and hanging.timestep == pytest.approx(0.6417, rel=1e-3)
    assert find_rest(model, replace(problem.scenario, qpos=(math.pi,))) is None, "upright"


def test_a_setting_that_mujoco_refuses_is_told_as_that() -> None:
    asleep = """<mujoco><option><flag sleep="enable" island="disable"/></option><worldbody><body>
      <freejoint/><geom size=".1"/></body></worldbody></mujoco>"""
    model = with_integrator(mujoco.MjModel.from_xml_string(asleep), Integrator.DISCRETE, 0.002)
    trial = run_trial(Setup(scenario=Scenario(0.02, 0.02)), model, 0.02)
    assert (trial.status, trial.reason) == (RunStatus.REFUSED, "MuJoCo does not run it")


TOPPLING = """<mujoco><option timestep="0.002"/><worldbody><body>
  <joint type="slide" axis="0 0 1" stiffness="{}"/><geom size=".1" mass="1e4" contype="0"/>
  <body><joint axis="0 1 0"/><geom size=".02" pos="0 0 .1" mass=".1" contype="0"/></body>
</body></worldbody></mujoco>"""


def test_what_stays_bounded_may_leave_the_motion_of_small_steps() -> None:
    """The drive's energy bounds nothing of the bob, and its rest hanging is never visited."""
    rows = rows_of(TOPPLING.format("1e8"), qpos=(0.05, 0.2), search=(2e-4, 1e-2))
    discrete = rows["discrete"]
    assert discrete.largest == "all" and discrete.theory is None
    assert discrete.near == "none" and discrete.near_reason.startswith("off by 0.1 rad")
    assert {row.through for row in rows.values()} == {None}, "nothing can touch"


def test_a_motion_that_dies_is_not_near_however_small_it_was() -> None:
    """The pivot moves by 0.012 m, less than a tenth of the extent: `discrete` stops it."""
    discrete = rows_of(TOPPLING.format("1e8"), qpos=(0.005, 0.0), search=(2e-4, 1e-2))["discrete"]
    assert discrete.largest == "all"
    assert discrete.near == "none" and "or 0.00299 m at " in discrete.near_reason


def test_a_long_step_is_compared_where_it_ends() -> None:
    """RK4 is exact in free fall, and at 0.2 s it is not where samples at 0.18 and 0.22 s are."""
    xml = """<mujoco><option timestep="{}" integrator="RK4"/><worldbody><body>
    <joint name="z" type="slide" axis="0 0 1"/><geom size=".1" mass="1"/></body></worldbody>
    </mujoco>"""
    models = {h: mujoco.MjModel.from_xml_string(xml.format(h)) for h in (0.02, 0.1)}
    setup = Setup(scenario=Scenario(0.6, 0.02, (0.0,), (0.0,)))
    motion = KeptMotion(simulate(setup, models[0.02]).states, np.array([1e-6]), "1e-6 m")
    assert run_trial(setup, models[0.1], 0.6, motion).astray == ""


def test_commands_that_come_late_are_told() -> None:
    """They change at 0.2 s: a step of 0.03 s begins at 0.21 s."""
    xml = """<mujoco><option timestep="{}" gravity="0 0 0"/><worldbody><body>
    <joint name="x" type="slide"/><geom size=".1" mass="1"/></body></worldbody>
    <actuator><motor joint="x"/></actuator></mujoco>"""
    scenario = Scenario(0.4, 0.1, (0.0,), (0.0,), controls=((10.0,), (-10.0,)), hold=0.2)
    setup = Setup(scenario=scenario)
    models = {h: mujoco.MjModel.from_xml_string(xml.format(h)) for h in (1e-4, 0.02, 0.03)}
    motion = KeptMotion(simulate(setup, models[1e-4]).states, np.array([1e-3]), "0.001 m")
    texts = {h: run_trial(setup, models[h], 0.4, motion).astray for h in (0.02, 0.03)}
    assert texts[0.02] == "off by 0.001 m at 0.1 s"
    assert texts[0.03] == "off by 0.001 m at 0.09 s", "before any command changes"
    motion = replace(motion, units=np.array([0.02]), far="0.02 m")
    astray = run_trial(setup, models[0.03], 0.4, motion).astray
    assert astray == "off by 0.02 m at 0.21 s, with commands up to a step late"


def test_energy_that_cannot_be_is_instability() -> None:
    """Of all that a swinging chain has, 0.25 J, it had 300 J after 2,000 steps of 7.5 ms."""
    chain = with_energy_bound(all_problems()["chain-balls"])
    rest = 6 * 7 / 2 * 0.1 * 9.81 * 0.1  # J below the pivot when it hangs
    assert chain.energy_bound + rest == pytest.approx(11 * 0.26, rel=0.1)
    trial = attempt(chain, Integrator.EULER, 7.5e-3)
    assert trial.status is RunStatus.SLOW_GROWTH
    assert attempt(chain, Integrator.EULER, 2e-3).stable
    servo = with_energy_bound(all_problems()["stiff-servo-1"])
    assert servo.energy_bound == math.inf, "a motor drives it"


def test_all_timesteps_run_for_the_same_time() -> None:
    """A body that leaves its bounds at the end of that time, whatever divides it."""
    drifting = replace(
        all_problems()["damped-spring-0"],
        mjcf="<mujoco><option gravity='0 0 0'/><worldbody><body><joint type='slide'/>"
        "<geom size='.1'/></body></worldbody></mujoco>",
        scenario=Scenario(0.4, 0.1, (0.0,), (1.0,)),
        span=0.39,
        position_bound=0.385,
    )
    steps = [part * 0.39 / n for n in range(2, 60) for part in (1.0, 1.01)]
    assert [step for step in steps if attempt(drifting, Integrator.EULER, step).stable] == []
    assert attempt(replace(drifting, span=0.38), Integrator.EULER, 0.01).stable
