"""Errors as a learner sees them, and the quantity that a scenario declares to be measured.

Entry points: `visible_error(model, scene, states, exact)`; `quantity_name`, `quantity_values`.
"""

from __future__ import annotations

import math
from typing import Any

import mujoco
import numpy as np

from coursebuild.numerics.engine import States, initial_data
from coursebuild.numerics.problem import Array, Setup
from coursebuild.numerics.scene import Scene
from mjcourse.spatial import angular_distance


def visible_error(model: Any, scene: Scene, states: States, exact: States) -> float:
    """The largest displacement or turn of a body in a picture, where 1 is just visible."""
    place, turn = _picture(model, states)
    exact_place, exact_turn = _picture(model, exact)
    moved = float(np.linalg.norm(place - exact_place, axis=2).max(initial=0.0))
    turned = float(angular_distance(exact_turn, turn).max(initial=0.0))
    length = scene.visible.share * max(float(model.stat.extent), 1e-15)
    return max(moved / length, turned / math.radians(scene.visible.angle))


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


def quantity_name(model: Any, scene: Scene) -> str:
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


def quantity_values(model: Any, scene: Scene, states: States) -> Array:
    """What the scenario measures, at every sample: (n, d)."""
    assert scene.declared is not None and scene.declared.measure is not None
    wanted = scene.declared.measure
    data = initial_data(Setup(scenario=scene.scenario), model)
    found = []
    rows = zip(states.qpos, states.qvel, states.act, strict=True)
    for look, (qpos, qvel, act) in enumerate(rows):
        data.qpos[:], data.qvel[:], data.act[:] = qpos, qvel, act
        if scene.scenario.controls:
            data.ctrl[:] = scene.scenario.command(look)
        mujoco.mj_forward(model, data)
        match wanted.kind:
            case "body":
                found.append(data.body(wanted.name).xpos.copy())
            case "site":
                found.append(data.site(wanted.name).xpos.copy())
            case _:
                found.append(data.sensor(wanted.name).data.copy())
    return np.array(found)
