"""Writes native.json: values by native MuJoCo that the tests of the labs compare theirs with.

    python site/tests/native.py

1. Each case is a model, a state, and the number of steps from it.
2. MuJoCo computes what `lib` gives, by ways that `lib` does not use where there is one: momenta
   from the Jacobians of the bodies, the energy from the inertia matrix.
3. Numbers of the lab's generator are computed anew, in Python's integers.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

SPRING = """<mujoco><option timestep="0.001"/><worldbody>
  <body name="cart" pos="0 0 1">
    <joint name="slide" type="slide" axis="1 0 0" stiffness="30" springref=".1"/>
    <geom type="box" size=".2 .1 .05" mass="3"/>
    <body name="bob" pos="0 0 -.05">
      <joint name="hinge" axis="0 1 0"/><geom size=".05" pos="0 0 -.5" mass="1"/>
    </body>
  </body>
  <body name="free" pos="1 2 3">
    <freejoint name="float"/><geom type="ellipsoid" size=".3 .2 .1" mass="2"/>
  </body>
  <body name="swing" pos="-1 0 2">
    <joint name="ball" type="ball"/><geom type="capsule" size=".05" fromto="0 0 0 .1 .2 -.7"/>
    <site name="end" pos=".1 .2 -.7"/>
  </body>
</worldbody></mujoco>"""

RESTING = """<mujoco><worldbody><geom name="floor" type="plane" size="2 2 .1"/>
  <body pos="0 0 .1"><freejoint/><geom name="box" type="box" size=".1 .1 .1" mass="2"/></body>
  <body pos="1 0 .2"><freejoint/><geom name="ball" size=".2" mass="5"/></body>
</worldbody></mujoco>"""

POSE = [0.3, 0.7, 1, 2, 3, 0.5, 0.5, -0.5, 0.5, 0.6, 0, 0.8, 0]


def case(
    name: str, xml: str, qpos: list[float] | None, qvel: list[float] | None, steps: int
) -> dict[str, Any]:
    """What `lib` should give after `steps` steps from a state; `None`: that of the model."""
    model = mujoco.MjModel.from_xml_string(xml)
    data = mujoco.MjData(model)
    if qpos is not None:
        data.qpos[:] = qpos
    if qvel is not None:
        data.qvel[:] = qvel
    start = {"qpos": data.qpos.tolist(), "qvel": data.qvel.tolist()}
    for _ in range(steps):
        mujoco.mj_step(model, data)
    mujoco.mj_forward(model, data)
    linear, angular = momenta(model, data)
    return {
        "name": name,
        "xml": xml,
        **start,
        "steps": steps,
        "end": {"qpos": data.qpos.tolist(), "qvel": data.qvel.tolist()},
        "energy": energy(model, data),
        "momentum": linear.tolist(),
        "angmom": angular.tolist(),
        "normal_force": normal_forces(model, data),
        "contacts": data.ncon,
    }


def energy(model: mujoco.MjModel, data: mujoco.MjData) -> dict[str, float]:
    """J, with gravity and the springs of joints."""
    inertia = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, inertia)
    kinetic = 0.5 * data.qvel @ inertia @ data.qvel
    potential = -(model.body_mass * (data.xipos @ model.opt.gravity)).sum()
    for joint in np.flatnonzero(model.jnt_stiffness):
        at = model.jnt_qposadr[joint]
        stretch = data.qpos[at] - model.qpos_spring[at]
        potential += 0.5 * model.jnt_stiffness[joint] * stretch**2
    values = {"kinetic": kinetic, "potential": potential, "total": kinetic + potential}
    return {part: float(value) for part, value in values.items()}


def momenta(model: mujoco.MjModel, data: mujoco.MjData) -> tuple[np.ndarray, np.ndarray]:
    """Linear (kg m/s) and angular (kg m^2/s), the latter about the common centre of mass."""
    centre = model.body_mass @ data.xipos / model.body_mass.sum()
    linear, angular = np.zeros(3), np.zeros(3)
    for body in range(1, model.nbody):
        jacp, jacr = np.zeros((3, model.nv)), np.zeros((3, model.nv))
        mujoco.mj_jacBodyCom(model, data, jacp, jacr, body)
        rotation = data.ximat[body].reshape(3, 3)
        p = model.body_mass[body] * (jacp @ data.qvel)
        linear += p
        angular += rotation @ (model.body_inertia[body] * (rotation.T @ (jacr @ data.qvel)))
        angular += np.cross(data.xipos[body] - centre, p)
    return linear, angular


def normal_forces(model: mujoco.MjModel, data: mujoco.MjData) -> dict[str, float]:
    """N, on each geom that has a name."""
    names = [model.geom(i).name for i in range(model.ngeom)]
    forces = {name: 0.0 for name in names if name}
    for i in range(data.ncon):
        force = np.zeros(6)
        mujoco.mj_contactForce(model, data, i, force)
        for geom in data.contact[i].geom:
            forces[names[geom]] += float(force[0])
    return forces


def random_numbers(seed: float, count: int) -> list[float]:
    """xoshiro128** seeded by splitmix32."""
    low, high = np.array([seed]).view(np.uint32).tolist()
    mask = 0xFFFFFFFF
    z = low ^ (high * 0x9E3779B1 & mask)
    state = []
    for _ in range(4):
        z = (z + 0x9E3779B9) & mask
        x = (z ^ z >> 16) * 0x85EBCA6B & mask
        x = (x ^ x >> 13) * 0xC2B2AE35 & mask
        state.append(x ^ x >> 16)

    def rotated(x: int, k: int) -> int:
        return (x << k | x >> 32 - k) & mask

    def word() -> int:
        a, b, c, d = state
        result = rotated(b * 5 & mask, 7) * 9 & mask
        t = b << 9 & mask
        c, d = c ^ a, d ^ b
        state[:] = [a ^ d, b ^ c, c ^ t, rotated(d, 11)]
        return result

    return [((word() >> 5) * 2**26 + (word() >> 6)) / 2**53 for _ in range(count)]


def text() -> str:
    """The contents of native.json."""
    cases = [
        case("moving", SPRING, POSE, list(np.linspace(-2, 3, 11)), 0),
        case("later", SPRING, None, list(np.linspace(1, -1, 11)), 500),
        case("resting", RESTING, None, None, 1000),
    ]
    draws = [{"seed": seed, "numbers": random_numbers(seed, 5)} for seed in (0.0, 1.0, 42.0, -1.5)]
    values = {"version": mujoco.__version__, "cases": cases, "random": draws}
    return json.dumps(values, indent=1) + "\n"


if __name__ == "__main__":
    Path(__file__).with_name("native.json").write_text(text(), encoding="utf-8")
