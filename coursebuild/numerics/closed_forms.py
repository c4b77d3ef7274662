"""A closed form of a hard case as the motion of a model that begins like it.

Entry point: `closed_motion(model, scene, declared, times)`.
"""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np

from coursebuild.model.scenarios import DeclaredScenario
from coursebuild.numerics.engine import States, compiled, initial_data, motion_of
from coursebuild.numerics.problem import Array, Integrator, Motion, Reference, Setup
from coursebuild.numerics.problems import problem_named
from coursebuild.numerics.scene import Scene, SceneError
from mjcourse.spatial import quat_conj, quat_mul


def closed_motion(
    model: Any, scene: Scene, declared: DeclaredScenario, times: Array
) -> tuple[Reference, Motion]:
    """The reference that a scenario names, and its motion begun where the scene begins.

    Raises:
        SceneError: the scene begins otherwise than the hard case, but for the place of free bodies.
    """
    problem, place = problem_named(declared.closed), declared.place("reference")
    assert problem.reference is not None
    there = compiled(problem.mjcf, Integrator.EULER, 1e-3)
    if (there.jnt_type.tolist(), there.nq) != (model.jnt_type.tolist(), model.nq):
        message = f"the model has other joints than the hard case `{declared.closed}`"
        raise SceneError(message, place)
    here, start = _start(model, Setup(scenario=scene.scenario)), _start(there, problem)
    shift = here.position - start.position
    free = np.concatenate(
        [
            np.full(3 if kind == mujoco.mjtJoint.mjJNT_FREE else 1, kind == 0)
            for kind in model.jnt_type
            if kind != mujoco.mjtJoint.mjJNT_BALL
        ]
        or [np.zeros(0, dtype=bool)]
    )
    speeds = np.abs(here.velocity - start.velocity).max(initial=0.0)
    if np.abs(shift[:, ~free]).max(initial=0.0) > 1e-9 or speeds > 1e-9:
        message = f"the scenario begins otherwise than the hard case `{declared.closed}`"
        raise SceneError(message, place, "its closed form holds for its own beginning only")
    turn = quat_mul(here.attitude, quat_conj(start.attitude))
    motion = problem.reference.motion(times)
    attitude = quat_mul(turn, motion.attitude)
    return problem.reference, Motion(times, motion.position + shift, attitude, motion.velocity)


def _start(model: Any, setup: Setup) -> Motion:
    data = initial_data(setup, model)
    return motion_of(model, States(np.zeros(1), data.qpos[None], data.qvel[None], data.act[None]))
