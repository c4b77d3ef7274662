"""Divergence never passes as success, and measuring does not disturb a run."""

from __future__ import annotations

import math
from typing import Any

import mujoco
import numpy as np
import pytest
from msgspec.structs import replace

from mjbench.cases import measure
from mjbench.detector import Peaks, RunStatus, driving_force, judge, update_peaks
from mjbench.linearization import find_theory
from mjbench.pilot import longer_setup, run_pilot
from mjbench.problem import Integrator, Scenario, Setup
from mjbench.problems import all_problems
from mjbench.scene import scenes
from mjbench.simulation import advance, compile_model, refsafe_active, simulate
from mjbench.stability_runs import run_trial
from samples.surveys import parse_declared

SPRING = """
<mujoco>
  <option gravity="0 0 0"/>
  <worldbody>
    <body><joint type="slide" stiffness="100"/><geom size="0.1" mass="1"/></body>
  </worldbody>
</mujoco>
"""


BOUNDS = Setup(scenario=Scenario(1.0, 1.0), position_bound=1.0, velocity_bound=10.0)


def spring_data(timestep: float, qpos: float = 0.0, qvel: float = 0.0) -> tuple[Any, Any]:
    model = mujoco.MjModel.from_xml_string(SPRING)
    model.opt.timestep = timestep
    data = mujoco.MjData(model)
    data.qpos[0], data.qvel[0] = qpos, qvel
    return model, data


def test_a_run_that_was_reset_and_ends_with_error_zero_is_lost() -> None:
    model, data = spring_data(0.3, qvel=1.0)
    advance(model, data, 1000)
    assert data.qpos[0] == 0.0 == data.qvel[0]  # as if it had come to rest
    assert judge(data).reasons == ("MuJoCo warned of bad accelerations",)


def test_a_slow_growth_without_any_warning_is_seen() -> None:
    model, data = spring_data(0.2002, qpos=0.5)
    advance(model, data, 130)
    assert abs(data.qpos[0]) > 100
    assert not any(warning.number for warning in data.warning)
    judgement = judge(data, setup=BOUNDS)
    assert judgement.status is RunStatus.SLOW_GROWTH
    assert any(reason.startswith("positions reached") for reason in judgement.reasons)


def test_a_state_that_was_no_number_on_the_way_is_lost() -> None:
    _, data = spring_data(0.01)
    peaks = Peaks()
    for value in (0.1, np.nan, 0.2):
        data.qpos[0] = value
        peaks = update_peaks(data, peaks)
    judgement = judge(data, peaks)
    assert (judgement.status, *judgement.reasons) == (RunStatus.DIVERGED, "the state is not finite")


BALL = """<mujoco><worldbody><geom type="plane" size="1 1 .1"/>{wall}
  <body name="ball" pos="0 0 {height}"><freejoint/><geom type="sphere" size=".01037"/></body>
</worldbody></mujoco>"""


def drop(height: float, timestep: float, wall: str = "", seconds: float = 1.0) -> Any:
    model = mujoco.MjModel.from_xml_string(BALL.format(height=height, wall=wall))
    model.opt.timestep = timestep
    sample = round(0.05 / timestep) * timestep
    count = round(seconds / sample)
    return simulate(Setup(scenario=Scenario(count * sample, sample)), model)


def test_a_small_ball_that_dips_to_its_middle_and_rests_is_not_lost() -> None:
    for timestep in (0.0005, 0.002, 0.005, 0.01):
        run = drop(0.11037, timestep)
        assert run.judgement.ok and (run.sunk > 0.9 or timestep > 0.001), timestep
        assert abs(run.states.qpos[-1, 2] - 0.0103) < 1e-3, "it lies on the floor"


def test_what_comes_out_on_the_other_side_or_stays_inside_went_through() -> None:
    wall = """<body name="wall" pos="0 0 1"><geom type="box" size=".5 .5 .005" mass="1"
      solref=".05 1"/></body>"""
    fast = drop(3.0, 0.001, wall)
    assert fast.judgement.status is RunStatus.THROUGH
    (reason,) = fast.judgement.reasons
    assert reason.startswith("ball and wall went through each other, at 0.6")
    slow = drop(1.03, 0.001, wall)
    assert slow.judgement.ok, "it comes to lie on the wall"
    inside = """<mujoco><option gravity="0 0 0"/><worldbody><geom size=".2"/>
      <body name="leg"><joint type="slide" damping="9e9"/><geom size=".02" pos=".1 0 0"/></body>
      </worldbody></mujoco>"""
    model = mujoco.MjModel.from_xml_string(inside)
    run = simulate(Setup(scenario=Scenario(0.1, 0.02)), model)
    assert run.judgement.reasons == ("the world and leg stay inside each other at the end",)
    setup = Setup(scenario=Scenario(0.1, 0.02), passing=run.passing)
    assert simulate(setup, model).judgement.ok, "as in small steps"


def test_what_sinks_in_after_the_scenario_is_not_lost_in_longer_runs() -> None:
    """A ball falls for 0.45 s, then into a floor so soft that its middle is below the surface."""
    mjcf = """<mujoco><worldbody><geom type="plane" size="1 1 1" solref="0.2 1"/><body pos="0 0 1">
    <freejoint/><geom size=".05" mass="1"/></body></worldbody></mujoco>"""
    model = mujoco.MjModel.from_xml_string(mjcf)
    (scene,) = scenes(model, parse_declared('[[scenario]]\nname = "s"\nduration = 0.4\n'))
    pilot = run_pilot(model, scene)
    bounds = [longer_setup(model, pilot, span).sunk_bound for span in (0.4, 0.8)]
    assert bounds[0] == 1.0 and bounds[1] > 2.0, "it sinks by more than its diameter"


def test_no_error_is_given_for_a_run_that_was_lost() -> None:
    problem = all_problems()["damped-spring-0"]
    fast = replace(problem, mjcf=problem.mjcf.replace('stiffness="100"', 'stiffness="1e6"'))
    line = measure(fast, Integrator.RK4, 0.02)
    assert (line.status, line.position, line.velocity) == ("diverged", None, None)


def test_where_energy_can_be_judged() -> None:
    """Only where nothing drives the motion: no actuator, no wind, nothing that is not counted."""
    motor = '<motor joint="j"/>'
    servo = '<position joint="j" kp="9"/>'
    none, pushed = Scenario(1.0, 1.0), Scenario(1.0, 1.0, controls=((0.5,),))
    keyed = Scenario(1.0, 1.0, keyframe=0)
    key = '<keyframe><key ctrl="1"/></keyframe>'
    for actuator, option, joint, rest, scenario, causes in (
        ("", "", "", "", none, ""),
        (motor, "", "", "", none, ""),
        (motor, "", "", "", Scenario(1.0, 1.0, controls=((0.0,),)), ""),
        (motor, "", "", "", pushed, "actuators act"),
        (motor, "", "", key, keyed, "actuators act"),
        (servo, "", "", "", none, "actuators act"),
        (servo, '<flag actuation="disable"/>', "", "", none, ""),
        ("", "", 'damping="2" frictionloss="1"', "", none, ""),
        ("", "", 'damping="2 -1"', "", none, "damping is negative"),
        ('<motor joint="j" damping="-1"/>', "", "", "", none, "damping is negative"),
        ('<motor joint="j" ctrlrange="1 2"/>', "", "", "", none, "actuators act"),
        ('<motor joint="j" forcerange="1 2"/>', "", "", "", none, "actuators act"),
        ("", "", 'damping="-2"', "", none, "damping is negative"),
    ):
        text = f"""<mujoco><option>{option}</option><worldbody><body>
            <joint name="j" {joint}/><geom size=".1"/></body></worldbody>
            <actuator>{actuator}</actuator>{rest}</mujoco>"""
        model = mujoco.MjModel.from_xml_string(text)
        assert driving_force(model, scenario) == causes, (actuator, option, joint)
    model.dof_damping[:] = 0
    model.opt.wind[0], model.body_gravcomp[1] = 1.0, 1.0
    assert driving_force(model, none) == "gravity is compensated", "wind is nothing in a vacuum"
    model.opt.density = 1.2
    assert driving_force(model, none) == "wind blows, gravity is compensated"
    model.opt.wind[0], model.body_gravcomp[1] = 0.0, 0.0
    assert driving_force(model, none) == ""
    for field, cause in (
        (model.geom_fluid, "a fluid stores energy"),
        (model.geom_surfacevel, "a surface moves"),
        (model.geom_adhesion, "contacts adhere"),
    ):
        field.flat[0] = 1.0
        assert driving_force(model, none) == cause
        field.flat[0] = 0.0


def test_a_state_that_shot_up_and_came_back_is_seen() -> None:
    # A rod's transverse velocity grows to 1e6 rad/s, turns the axial one down, and decays again.
    problem = all_problems()["thin-rod"]
    assert problem.limit is not None
    limit = problem.limit(Integrator.RK4)
    assert limit is not None
    timestep = 3.1 / math.sqrt(8) * limit.timestep
    model = compile_model(problem.mjcf, Integrator.RK4, timestep)
    assert not run_trial(problem, model, problem.span).stable


def test_warnings_are_counted_and_not_printed(capfd: pytest.CaptureFixture[str]) -> None:
    model, data = spring_data(0.3, qvel=1.0)
    before = mujoco.get_mju_user_warning()
    advance(model, data, 100)
    assert data.warning[int(mujoco.mjtWarning.mjWARN_BADQACC)].number == 1
    assert capfd.readouterr() == ("", "")
    assert mujoco.get_mju_user_warning() is before


def test_measuring_does_not_disturb_the_run() -> None:
    problem = all_problems()["stack-10"]
    run = simulate(problem, compile_model(problem.mjcf, Integrator.EULER, 1e-3))
    model = compile_model(problem.mjcf, Integrator.EULER, 1e-3)
    data = mujoco.MjData(model)
    data.qpos[:] = problem.scenario.qpos
    mujoco.mj_step(model, data, round(problem.scenario.duration / 1e-3))
    assert np.array_equal(run.states.qpos[-1], data.qpos)
    assert np.array_equal(run.states.qvel[-1], data.qvel)


def test_refsafe_is_told() -> None:
    for name, timestep, active in (
        ("stack-1", 2e-3, False),
        ("stack-1", 2.1e-3, True),
        ("elastic-impact", 1.0, False),  # a stiffness
        ("soft-equality-1", 1.0, False),  # switched off
        ("pendulum-connect-90", 0.0101, True),
        ("pendulum-connect-90", 0.01, False),
        ("tumbling-box", 1.0, False),  # contact is off
        ("damped-spring-1", 1.0, False),
    ):
        model = compile_model(all_problems()[name].mjcf, Integrator.EULER, timestep)
        assert refsafe_active(model) is active, (name, timestep)
    stack = compile_model(all_problems()["stack-1"].mjcf, Integrator.EULER, 2.1e-3)
    assert not refsafe_active(stack, contact=False), "where nothing touches, nothing is softened"
    for attributes in ('limited="true" range="-1 1"', 'frictionloss="1"'):
        joint = f"<joint type='slide' {attributes}/>"
        text = f"<mujoco><worldbody><body>{joint}<geom size='.1'/></body></worldbody></mujoco>"
        assert refsafe_active(compile_model(text, Integrator.EULER, 0.011)), attributes
        assert not refsafe_active(compile_model(text, Integrator.EULER, 0.009)), attributes


def test_theory_ends_where_longer_steps_have_another_rest() -> None:
    """Beyond 10 ms contacts are softer, and a block sinks deeper; a servo knows nothing of it."""
    servo = """<body pos="2 0 1"><joint axis="0 1 0" stiffness="2e4" damping="100"/>
    <geom size=".1" pos=".3 0 0" mass="1"/></body>"""
    block = """<geom type="plane" size="1 1 1"/><body pos="0 0 .1"><freejoint/>
    <geom type="box" size=".1 .1 .1"/></body>"""
    limits = []
    for world in (servo, servo + block):
        model = mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{world}</worldbody></mujoco>")
        theory = find_theory(model, Scenario(1.0, 0.05), None)
        limits.append(
            [theory.limit(name, (1e-3, 0.05)) for name in (Integrator.RK4, Integrator.EULER)]
        )
    (rk4, euler), (rk4_beside, euler_beside) = limits
    assert rk4_beside is not None and rk4_beside.timestep == pytest.approx(rk4.timestep, rel=1e-3)
    assert euler.timestep > 0.01 and euler_beside is None


@pytest.mark.parametrize(("height", "words"), [(0.05, "the world and ball by 0.05 m"), (0.099, "")])
def test_what_begins_inside_something_is_named_with_its_depth(height: float, words: str) -> None:
    ball = f"<body name='ball' pos='0 0 {height}'><freejoint/><geom size='.1'/></body>"
    floor = "<geom type='plane' size='1 1 1'/>"
    mjcf = f"<mujoco><worldbody>{floor}{ball}</worldbody></mujoco>"
    model = mujoco.MjModel.from_xml_string(mjcf)
    (scene,) = scenes(model, parse_declared('[[scenario]]\nname = "s"\nduration = 0.1\n'))
    assert run_pilot(model, scene).overlaps == words
