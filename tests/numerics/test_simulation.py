"""The engine set up for measuring, and the reference that integrates its accelerations."""

from __future__ import annotations

import mujoco
import numpy as np

from coursebuild.numerics.problem import Integrator
from coursebuild.numerics.problems import all_problems
from coursebuild.numerics.simulation import compile_model, refsafe_active, simulate


def test_measuring_does_not_disturb_the_run() -> None:
    problem = all_problems()["stack-10"]
    run = simulate(problem, compile_model(problem.mjcf, Integrator.EULER, 1e-3))
    model = compile_model(problem.mjcf, Integrator.EULER, 1e-3)
    data = mujoco.MjData(model)
    data.qpos[:] = problem.scenario.qpos
    mujoco.mj_step(model, data, round(problem.scenario.duration / 1e-3))
    assert np.array_equal(run.states.qpos[-1], data.qpos)
    assert np.array_equal(run.states.qvel[-1], data.qvel)


def test_commands_are_those_of_their_hold() -> None:
    problem = all_problems()["stiff-servo-1"]
    run = simulate(problem, compile_model(problem.mjcf, Integrator.IMPLICIT, 1e-4))
    model = compile_model(problem.mjcf, Integrator.IMPLICIT, 1e-4)
    data = mujoco.MjData(model)
    for (command,) in problem.scenario.controls:
        data.ctrl[0] = command
        mujoco.mj_step(model, data, 500)
    assert run.states.qpos[-1, 0] == data.qpos[0]


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
    for attributes in ('limited="true" range="-1 1"', 'frictionloss="1"'):
        joint = f"<joint type='slide' {attributes}/>"
        text = f"<mujoco><worldbody><body>{joint}<geom size='.1'/></body></worldbody></mujoco>"
        assert refsafe_active(compile_model(text, Integrator.EULER, 0.011)), attributes
        assert not refsafe_active(compile_model(text, Integrator.EULER, 0.009)), attributes
