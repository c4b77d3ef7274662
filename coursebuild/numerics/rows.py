"""One setting in one scene: run, judge, compare.

Entry point: `measured(model, scene, pilot, known, setting)`.

1. A run is judged first: the error of one that was lost is not given.
2. Errors count to the horizon; what should be conserved is watched to the end.
3. Errors are also said as a learner sees them: by how far bodies are displaced or turned in a
   picture, where 1 is just visible.
4. No error is given below ten floors of its reference.
"""

from __future__ import annotations

import math
from typing import Any

import mujoco
import numpy as np
from msgspec import Struct

from coursebuild.numerics.detector import Judgement, Status
from coursebuild.numerics.engine import (
    Run,
    begun,
    motion_of,
    refsafe_active,
    simulate_model,
    varied,
)
from coursebuild.numerics.forward import States
from coursebuild.numerics.grid import apply
from coursebuild.numerics.knowing import Known
from coursebuild.numerics.measure import FLOORS, Error, Errors, energy_drift, errors, momentum_drift
from coursebuild.numerics.pilot import Bounded, Pilot
from coursebuild.numerics.problem import Array, Integrator
from coursebuild.numerics.reports.bench import Setting
from coursebuild.numerics.rotation import angle_between
from coursebuild.numerics.scene import Scene, thickness
from coursebuild.numerics.slip import Sticks, slip


class Conserved(Struct, frozen=True):
    """What does not change in a scene."""

    energy: float | None
    """What changes of energy are large against, J; `None` where energy is not conserved."""
    momentum: bool
    """Whether the angular momentum about the centre of mass is."""


class Measured(Struct, frozen=True):
    """What one setting gave, without its cost."""

    setting: Setting
    judgement: Judgement
    errors: Errors | None
    figure: Error | None
    seen: float | None
    """The largest error in a picture: 1 is just visible."""
    noticeable: bool | None
    """Whether that is 1 or more; `None` where the reference is not known well enough."""
    energy_drift: float | None
    momentum_drift: float | None
    mean_energy: float | None
    """Mean kinetic energy from the horizon to the end, J; `None` where nothing is beyond."""
    penetration: float
    slip: float | None
    refsafe: bool
    steps: int


REFUSED = "MuJoCo does not run it"


def measured(
    model: Any,
    scene: Scene,
    first: Pilot,
    known: Known,
    conserved: Conserved,
    setting: Setting,
    sticks: Sticks | None = None,
) -> Measured:
    """Run a scene under a setting, and compare it with its reference.

    `sticks`: what sticks in the reference; `None` where nothing touches.
    """
    one = varied(model, Integrator(setting.integrator), setting.timestep)
    apply(one, setting)
    steps = round(scene.scenario.duration / setting.timestep)
    refsafe = first.constrained and refsafe_active(one)
    try:
        run = simulate_model(first.setup, one, thickness(model))
    except mujoco.FatalError as error:
        lost = Judgement(Status.DIVERGED, (f"{REFUSED}: {error}",))
        return Measured(
            setting, lost, None, None, None, None, None, None, None, 0.0, None, refsafe, steps
        )
    found = figure = seen = noticeable = creep = None
    if run.judgement.ok:
        count = len(known.states.times)
        states = States(run.times[:count], run.qpos[:count], run.qvel[:count], run.act[:count])
        motion = motion_of(model, states.times, states.qpos, states.qvel)
        found = _raised(errors(motion, known.motion), known)
        floor = FLOORS * visible_error(model, scene, known.states, known.other)
        shown = visible_error(model, scene, states, known.states)
        seen, noticeable = max(shown, floor), None if max(1, shown) <= floor else shown >= 1
        figure = _figure(model, scene, states, known)
        creep = None if sticks is None else slip(model, scene, states, sticks)
    return Measured(
        setting,
        run.judgement,
        found,
        figure,
        seen,
        noticeable,
        None if conserved.energy is None else energy_drift(run, conserved.energy),
        momentum_drift(run) if conserved.momentum else None,
        _mean_energy(run, known.horizon),
        run.penetration,
        creep,
        refsafe,
        steps,
    )


def _raised(found: Errors, known: Known) -> Errors:
    def up(one: Error | None, floor: float) -> Error | None:
        return one and Error(max(one.largest, FLOORS * floor), max(one.end, FLOORS * floor))

    floor = known.floor
    return Errors(
        up(found.position, floor.position),
        up(found.attitude, floor.attitude),
        up(found.velocity, floor.velocity),
    )


def _mean_energy(run: Run, horizon: float) -> float | None:
    beyond = run.energy[1:][run.times > horizon * (1 + 1e-9), 1]
    if len(beyond) < 2 or not np.isfinite(beyond).all():
        return None
    return float(beyond.mean())


# ---------------------------------------------------------------------------------- what is seen


def visible_error(model: Any, scene: Scene, states: States, exact: States) -> float:
    """The largest displacement or turn of a body, in units of what a learner sees."""
    place, turn = _picture(model, states)
    exact_place, exact_turn = _picture(model, exact)
    moved = np.linalg.norm(place - exact_place, axis=2).max(initial=0.0)
    turned = angle_between(exact_turn, turn).max(initial=0.0)
    shown = float(moved) / _length(model, scene), float(turned) / math.radians(scene.visible.angle)
    return max(shown)


def _length(model: Any, scene: Scene) -> float:
    return scene.visible.share * max(float(model.stat.extent), 1e-15)


def _picture(model: Any, states: States) -> tuple[Array, Array]:
    """Places (n, b + g, 3) of bodies and geoms that can move, and attitudes (n, b, 4) of bodies."""
    data = mujoco.MjData(model)
    bodies = np.flatnonzero(model.body_weldid != 0)
    geoms = np.flatnonzero(model.body_weldid[model.geom_bodyid] != 0)
    places = np.empty((len(states.times), len(bodies) + len(geoms), 3))
    turns = np.empty((len(states.times), len(bodies), 4))
    for index, qpos in enumerate(states.qpos):
        data.qpos[:] = qpos
        mujoco.mj_kinematics(model, data)
        places[index, : len(bodies)] = data.xpos[bodies]
        places[index, len(bodies) :] = data.geom_xpos[geoms]
        turns[index] = data.xquat[bodies]
    return places, turns


# -------------------------------------------------------------------------------- what is declared


def figure_name(model: Any, scene: Scene) -> str:
    """What the scenario measures, with its unit in brackets; empty where nothing is declared."""
    wanted = scene.declared.measure if scene.declared is not None else None
    if wanted is None:
        return ""
    if wanted.kind != "sensor":
        return f"place of the {wanted.kind} {wanted.name} [m]"
    kind = mujoco.mjtSensor(int(model.sensor(wanted.name).type[0]))
    unit = _UNITS.get(kind.name.removeprefix("mjSENS_"), "")
    return f"sensor {wanted.name}" + (f" [{unit}]" if unit else "")


_UNITS = {
    "TOUCH": "N",
    "ACCELEROMETER": "m/s²",
    "VELOCIMETER": "m/s",
    "GYRO": "rad/s",
    "FORCE": "N",
    "TORQUE": "N m",
    "RANGEFINDER": "m",
    "TENDONPOS": "m",
    "TENDONVEL": "m/s",
    "BALLANGVEL": "rad/s",
    "FRAMEPOS": "m",
    "FRAMELINVEL": "m/s",
    "FRAMEANGVEL": "rad/s",
    "FRAMELINACC": "m/s²",
    "FRAMEANGACC": "rad/s²",
    "SUBTREECOM": "m",
    "SUBTREELINVEL": "m/s",
    "SUBTREEANGMOM": "kg m²/s",
    "E_POTENTIAL": "J",
    "E_KINETIC": "J",
}
"""Of sensors whose unit does not depend on the joint that they are at."""


def _figure(model: Any, scene: Scene, states: States, known: Known) -> Error | None:
    if not figure_name(model, scene):
        return None
    exact = figure_values(model, scene, known.states)
    spare = figure_values(model, scene, known.other)
    floor = FLOORS * float(np.linalg.norm(exact - spare, axis=1).max())
    apart = np.linalg.norm(figure_values(model, scene, states) - exact, axis=1)
    return Error(max(float(apart.max()), floor), max(float(apart[-1]), floor))


def figure_values(model: Any, scene: Scene, states: States) -> Array:
    """What the scenario measures, at every sample: (n, d)."""
    assert scene.declared is not None and scene.declared.measure is not None
    wanted = scene.declared.measure
    data = begun(Bounded(scene.scenario, math.inf, math.inf), model)
    found = []
    rows = scene.scenario.controls
    for time, qpos, qvel, act in zip(
        states.times, states.qpos, states.qvel, states.act, strict=True
    ):
        data.qpos[:], data.qvel[:], data.act[:] = qpos, qvel, act
        if rows:
            part = math.ceil(time / scene.scenario.hold - 1e-9) - 1 if scene.scenario.hold else 0
            data.ctrl[:] = rows[min(part, len(rows) - 1)]
        mujoco.mj_forward(model, data)
        if wanted.kind == "body":
            found.append(data.body(wanted.name).xpos.copy())
        elif wanted.kind == "site":
            found.append(data.site(wanted.name).xpos.copy())
        else:
            found.append(data.sensor(wanted.name).data.copy())
    return np.array(found)
