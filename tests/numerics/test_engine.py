"""The engine set up for measuring, and the reference that integrates its accelerations."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from msgspec.structs import replace

from coursebuild.numerics.engine import compiled, invariants, refsafe_active, simulate
from coursebuild.numerics.problem import INTEGRATORS, Integrator
from coursebuild.numerics.problems import problem_named


def test_integrators_are_set_and_reset_is_off() -> None:
    text = problem_named("damped-spring-1").mjcf
    for integrator in INTEGRATORS:
        model = compiled(text, integrator, 0.125)
        assert model.opt.timestep == 0.125
        named = mujoco.mjtIntegrator(model.opt.integrator).name.removeprefix("mjINT_")
        assert named == integrator.value.partition(",")[0].upper()
        assert model.opt.disableflags & int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
        explicit = bool(model.opt.disableflags & int(mujoco.mjtDisableBit.mjDSBL_EULERDAMP))
        assert explicit == (integrator is Integrator.EULER_EXPLICIT)


def test_measuring_does_not_disturb_the_run() -> None:
    problem = problem_named("stack-10")
    run = simulate(problem, compiled(problem.mjcf, Integrator.EULER, 1e-3))
    model = compiled(problem.mjcf, Integrator.EULER, 1e-3)
    data = mujoco.MjData(model)
    data.qpos[:] = problem.scenario.qpos
    mujoco.mj_step(model, data, round(problem.scenario.duration / 1e-3))
    assert np.array_equal(run.states.qpos[-1], data.qpos)
    assert np.array_equal(run.states.qvel[-1], data.qvel)


def test_commands_are_those_of_their_hold() -> None:
    problem = problem_named("stiff-servo-1")
    run = simulate(problem, compiled(problem.mjcf, Integrator.IMPLICIT, 1e-4))
    model = compiled(problem.mjcf, Integrator.IMPLICIT, 1e-4)
    data = mujoco.MjData(model)
    for (command,) in problem.scenario.controls:
        data.ctrl[0] = command
        mujoco.mj_step(model, data, 500)
    assert run.states.qpos[-1, 0] == data.qpos[0]


def test_invariants_of_a_state() -> None:
    problem = problem_named("pendulum-hinge-90")
    model = compiled(problem.mjcf, Integrator.EULER, 1e-3)
    found = invariants(model, mujoco.MjData(model), np.array([0.3]), np.array([2.0]))
    assert found[0] == pytest.approx(-9.81 * np.cos(0.3), rel=1e-14)
    assert found[1] == pytest.approx(1.01 * 2.0**2 / 2, rel=1e-14)
    assert found[2:] == pytest.approx([0.0, 0.01 * 2.0, 0.0], abs=1e-15)


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
        model = compiled(problem_named(name).mjcf, Integrator.EULER, timestep)
        assert refsafe_active(model) is active, (name, timestep)


def test_limits_and_dry_friction_have_time_constants_too() -> None:
    for attributes in ('limited="true" range="-1 1"', 'frictionloss="1"'):
        text = (
            f"<mujoco><worldbody><body><joint type='slide' {attributes}/>"
            "<geom size='.1'/></body></worldbody></mujoco>"
        )
        assert refsafe_active(compiled(text, Integrator.EULER, 0.011))
        assert not refsafe_active(compiled(text, Integrator.EULER, 0.009))


def test_a_wrong_hold_is_refused() -> None:
    problem = problem_named("stiff-servo-1")
    wrong = replace(problem, scenario=replace(problem.scenario, hold=0.015))
    with pytest.raises(ValueError, match=r"the hold \(0\.015 s\) is no multiple"):
        simulate(wrong, compiled(wrong.mjcf, Integrator.EULER, 1e-3))
