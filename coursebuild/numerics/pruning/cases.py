"""The scenarios that a diet is judged by, as states and commands of a compiled model.

Entry points: `cases(model, declared, quick=…)`, `begin`, `command`.

They are those of `physics.scene`, at the model's own timestep.
"""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
from msgspec import Struct

from coursebuild.model.scenarios import Declarations
from coursebuild.numerics.problem import whole_number
from coursebuild.numerics.scene import scenes

QUICK = 0.5
"""Seconds at most of a scenario where it should be quick."""


class Case(Struct, frozen=True):
    """A scenario of a model."""

    name: str
    keyframe: int | None
    qpos: tuple[float, ...]
    """Instead of the keyframe's, where there are any."""
    qvel: tuple[float, ...]
    steps: int
    controls: tuple[tuple[float, ...], ...]
    """Commands, each for `hold` steps, the last to the end; those it began with where empty."""
    hold: int
    """0 where there is one command at most."""
    declared: bool


def cases(model: Any, declared: Declarations | None, *, quick: bool) -> tuple[Case, ...]:
    """What happens to a model, declared or by default.

    Raises:
        SceneError: a scenario does not fit the model.
    """
    found = []
    for one in scenes(model, declared, quick=quick):
        what, step = one.scenario, one.own
        steps = whole_number(what.duration, step, "the duration", "the timestep")
        if quick:
            steps = min(steps, max(1, round(QUICK / step)))
        hold = whole_number(what.hold, step, "the hold", "the timestep") if what.hold else 0
        keyframe = None if what.keyframe < 0 else what.keyframe
        wrote = one.declared is not None
        case = Case(one.name, keyframe, what.qpos, what.qvel, steps, what.controls, hold, wrote)
        found.append(case)
    # In a model in which nothing moves there is nothing to measure, but things to be without.
    return tuple(found) or (Case("start", None, (), (), 10, (), 0, False),)


def begin(model: Any, case: Case) -> Any:
    """`mjData` where a scenario begins."""
    data = mujoco.MjData(model)
    if case.keyframe is not None:
        mujoco.mj_resetDataKeyframe(model, data, case.keyframe)
    if case.qpos:
        data.qpos[:] = case.qpos
    if case.qvel:
        data.qvel[:] = case.qvel
    return data


def command(case: Case, step: int) -> np.ndarray[Any, Any] | None:
    """The command that begins with this step, from 0; `None` where the last one holds."""
    if not case.controls:
        return None
    every = case.hold or case.steps + 1
    number, rest = divmod(step, every)
    if rest or number >= len(case.controls):
        return None
    return np.array(case.controls[number])
