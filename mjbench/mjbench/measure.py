"""The errors of a motion against its reference, the orders that they show, drifts, and contacts.

1. Errors of position, attitude and velocity stand apart, each at its largest and at the end: RK4 is
   of fourth order in velocity and of second in attitude.
2. No error is given below ten times the floor, by which the reference itself may be off.
3. An order is the slope where the error is over a hundred floors and under 0.1: nearer to the floor
   rounding is measured, beyond 0.1 the asymptotic law does not hold yet. It is given only where
   those errors lie on a line, in a logarithmic plot, whose slope may be a whole number: else the
   law does not hold yet. Where slopes still tend somewhere, the interval holds that limit too.
4. In the reference, two geoms stick to each other between two samples where a point in which they
   touch hardly moves along the surface, at both of them. A body that rolls sticks too. In another
   run the speed of that point along the surface, added up over the same time, is creep: by the
   solver, by soft contact, or by the timestep.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from functools import lru_cache
from typing import Any, TypeAlias

import mujoco
import numpy as np

from mjbench.detector import pair_of
from mjbench.problem import STANDARD, Array, Integrator, Motion, Reference, Sizes
from mjbench.reports import scene_report
from mjbench.rotations import angular_distance
from mjbench.scene import Scene
from mjbench.simulation import (
    EngineStates,
    initial_data,
    motion_of,
    with_integrator,
)

_LOWEST, _HIGHEST = 100.0, 0.1
"""An order is fitted to errors over so many floors, and under so much."""
_FEWEST = 4
"""Errors that an order needs."""
_BEYOND = 2.0
"""How many times the last change of slopes their limit may be beyond the last slope."""
_UNCERTAIN, _BENT = 0.25, 0.25
"""The widest half interval of an order, and the largest bend, with which it is given."""
_LEAST_ORDER, _LAST_DIGIT = 0.5, 0.005
"""Errors that fall more slowly are those of a motion that is lost in a fast part of the whole; half
of the last digit of an order as it is told."""

_ZERO_SIZES, _UNIT_SIZES = Sizes(0.0, 0.0, 0.0), Sizes(1.0, 1.0, 1.0)


@lru_cache(maxsize=64)
def reference_motion(reference: Reference, times: tuple[float, ...]) -> Motion:
    """The motion of a reference at these times (s); computed once."""
    return reference.solution.motion(np.array(times))


def errors(motion: Motion, exact: Motion, floor: Sizes = _ZERO_SIZES) -> scene_report.Errors:
    """The errors of a motion against an exact one at the same times; none is below ten floors."""
    sizes = error_sizes(motion, exact)

    def pair(part: str) -> tuple[float, float] | None:
        if part not in sizes:
            return None
        least = scene_report.FLOORS * float(getattr(floor, part))
        return max(float(np.max(sizes[part])), least), max(float(sizes[part][-1]), least)

    return scene_report.Errors(pair("position"), pair("attitude"), pair("velocity"))


def error_sizes(motion: Motion, exact: Motion) -> dict[str, Array]:
    """The errors at every sample (n,) of position, attitude and velocity, those that there are."""
    displacements = motion.position - exact.position
    speed_differences = motion.velocity - exact.velocity
    angles = angular_distance(exact.attitude, motion.attitude)
    sizes = {}
    if displacements.size:
        sizes["position"] = np.linalg.norm(displacements, axis=1)
    if angles.size:
        sizes["attitude"] = np.max(angles, axis=1)
    if speed_differences.size:
        sizes["velocity"] = np.linalg.norm(speed_differences, axis=1)
    return sizes


def largest_errors(motion_errors: scene_report.Errors) -> Sizes:
    """The largest error of each part; 0 for a part that is missing."""
    parts = (motion_errors.position, motion_errors.attitude, motion_errors.velocity)
    return Sizes(*(0.0 if part is None else part[0] for part in parts))


def fit_order(
    timesteps: Sequence[float], errors: Sequence[float], floor: float, extent: float = 1.0
) -> scene_report.FittedOrder | None:
    """The order that errors at timesteps (s), in any order, show.

    `floor` is how far the reference may be off, and `extent` how much the motion changes, in the
    unit of the errors. `None` where fewer than four errors are between a hundred floors and a tenth
    of 1 and of the extent, or where they do not lie on a line: there is no order to be told then.
    """
    from scipy.special import stdtrit

    usable = [
        (math.log(h), math.log(error))
        for h, error in sorted(zip(timesteps, errors, strict=True))
        if max(_LOWEST * floor, 1e-300) < error < _HIGHEST * min(1.0, extent)
    ]
    if len(usable) < _FEWEST:
        return None
    x, y = np.array(usable).T
    slopes = np.diff(y) / np.diff(x)
    slope, shift = np.polyfit(x, y, 1).tolist()
    freedom = len(x) - 2
    deviation = math.sqrt(float(np.sum((y - slope * x - shift) ** 2)) / freedom)
    error = deviation / math.sqrt(float(np.sum((x - x.mean()) ** 2)))
    uncertainty = float(stdtrit(freedom, 0.975)) * error  # an interval of 95 %
    finest, finer, fine = slopes[:3].tolist()
    if (finer - finest) * (fine - finer) > 0:  # not noise: they tend to a slope beyond the finest
        uncertainty = max(uncertainty, abs(slope - finest) + _BEYOND * abs(finer - finest))
    fit = scene_report.FittedOrder(slope, uncertainty, float(np.ptp(slopes)))
    is_line = fit.uncertainty <= _UNCERTAIN and fit.bend <= _BENT
    is_whole = abs(slope - round(slope)) <= max(fit.uncertainty, fit.bend) + _LAST_DIGIT
    return fit if is_line and is_whole and fit.value > _LEAST_ORDER else None


def fit_orders(
    integrator: str,
    runs: Sequence[tuple[float, scene_report.Errors]],
    floor: Sizes,
    extent: Sizes = _UNIT_SIZES,
) -> scene_report.OrderRow:
    """Orders of an integrator, from its timesteps (s) and errors there; lost runs do not count."""

    def fit(part: str) -> scene_report.FittedOrder | None:
        pairs = [
            (h, pair[0])
            for h, run_errors in runs
            if (pair := getattr(run_errors, part)) is not None
        ]
        steps, errors = [h for h, _ in pairs], [error for _, error in pairs]
        return fit_order(steps, errors, getattr(floor, part), getattr(extent, part))

    return scene_report.OrderRow(integrator, fit("position"), fit("attitude"), fit("velocity"))


def fit_scene_orders(
    model: Any,
    rows: Iterable[scene_report.WorkPrecisionRow],
    baseline: scene_report.MeasuredSetting,
    states: EngineStates,
    floor: Sizes,
) -> tuple[scene_report.OrderRow, ...]:
    """The orders of all integrators in a scene, under the solver of its own setting."""
    motion = motion_of(model, states)
    angles = angular_distance(motion.attitude[:1], motion.attitude)
    extent = Sizes(
        float(np.linalg.norm(np.ptp(motion.position, axis=0))),
        float(angles.max(initial=0.0)),
        float(np.linalg.norm(np.ptp(motion.velocity, axis=0))),
    )
    runs: dict[str, list[tuple[float, scene_report.Errors]]] = {name.value: [] for name in STANDARD}
    for row in rows:
        if row.setting.solver_settings == baseline.solver_settings:
            runs[row.setting.integrator].append((row.setting.timestep, row))
    return tuple(fit_orders(name, errors, floor, extent) for name, errors in runs.items())


def energy_drift(energy: Array, scale: float | None = None) -> float | None:
    """The largest change of potential and kinetic energy (n, 2), J, together, with its sign.

    It is relative to `scale`, J, or else to `energy_scale`.
    """
    whole = energy.sum(axis=1)
    if scale is None:
        scale = energy_scale(energy)
    if not np.isfinite(whole).all() or scale == 0:
        return None
    changes = (whole - whole[0]) / scale
    return float(changes[np.argmax(np.abs(changes))])


def energy_scale(energy: Array) -> float:
    """The kinetic energy at the beginning, J; where that is 0, its largest."""
    return float(energy[0, 1]) or float(np.max(energy[:, 1]))


def momentum_drift(momentum: Array) -> float | None:
    """The largest change of angular momentum (n, 3), relative to its initial size."""
    scale = float(np.linalg.norm(momentum[0]))
    if not np.isfinite(momentum).all() or scale == 0:
        return None
    return float(np.max(np.linalg.norm(momentum - momentum[0], axis=1)) / scale)


def visible_error(model: Any, scene: Scene, states: EngineStates, exact: EngineStates) -> float:
    """The largest displacement or turn of a body in a picture, where 1 is just visible."""
    return float(visible_errors(model, scene, states, exact).max(initial=0.0))


def visible_errors(model: Any, scene: Scene, states: EngineStates, exact: EngineStates) -> Array:
    """The same at every sample: (n,)."""
    place, turn = _picture(model, states)
    exact_place, exact_turn = _picture(model, exact)
    displacements = np.linalg.norm(place - exact_place, axis=2).max(axis=1, initial=0.0)
    angles = angular_distance(exact_turn, turn).max(axis=1, initial=0.0)
    length = scene.bench.visible * max(float(model.stat.extent), 1e-15)
    sizes: Array = np.maximum(
        displacements / length, angles / math.radians(scene.bench.visible_angle)
    )
    return sizes


def _picture(model: Any, states: EngineStates) -> tuple[Array, Array]:
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
    """The declared quantity of a scenario, with its unit in brackets; empty without one."""
    quantity = scene.declaration.observable
    if quantity is None:
        return ""
    if quantity.kind != "sensor":
        return f"place of the {quantity.kind} {quantity.name} [m]"
    sensor = model.sensor(quantity.name)
    kind = mujoco.mjtSensor(int(sensor.type[0])).name.removeprefix("mjSENS_")
    unit = _UNITS.get(kind, "")
    if kind in _OF_JOINTS:
        is_slide = model.jnt_type[int(sensor.objid[0])] == mujoco.mjtJoint.mjJNT_SLIDE
        unit = ("m" if is_slide else "rad") + _OF_JOINTS[kind]
    return f"sensor {quantity.name}" + (f" [{unit}]" if unit else "")


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
_OF_JOINTS = {"JOINTPOS": "", "JOINTVEL": "/s"}
"""The units of sensors, and of those of a slide or a hinge what follows m or rad."""


def quantity_values(model: Any, scene: Scene, states: EngineStates) -> Array:
    """The declared quantity of a scenario at every sample: (n, d)."""
    quantity = scene.declaration.observable
    assert quantity is not None
    values = []
    for data in _samples(model, scene, states):
        match quantity.kind:
            case "body":
                values.append(data.body(quantity.name).xpos.copy())
            case "site":
                values.append(data.site(quantity.name).xpos.copy())
            case _:
                values.append(data.sensor(quantity.name).data.copy())
    return np.array(values)


def _samples(model: Any, scene: Scene, states: EngineStates) -> Iterator[Any]:
    """`mjData` at every sample of a motion, with its inputs, and all that follows from these."""
    data = initial_data(scene.scenario, model)
    samples = scene.scenario.inputs(scene.scenario.sample)
    rows = zip(states.qpos, states.qvel, states.act, samples, strict=False)
    for qpos, qvel, act, inputs in rows:
        data.qpos[:], data.qvel[:], data.act[:] = qpos, qvel, act
        inputs.give(data)
        mujoco.mj_forward(model, data)
        yield data


def quantity_errors(model: Any, scene: Scene, states: EngineStates, exact: EngineStates) -> Array:
    """How far the declared quantity is from that of the exact states at every sample: (n,)."""
    gaps = quantity_values(model, scene, states) - quantity_values(model, scene, exact)
    distances: Array = np.linalg.norm(gaps, axis=1)
    return distances


Pair: TypeAlias = tuple[int, int]
"""Two geoms, by number."""
Sticks: TypeAlias = tuple[frozenset[Pair], ...]
"""The pairs that stick in every interval between two samples, the first one before any sample."""

_SLOW = 0.01
"""A point that sticks moves slower than this part of the speed of a fall through the model's
extent."""
_MIN_SLOW_SPEED = 1e-3
"""m/s, where nothing falls."""


def find_sticks(model: Any, scene: Scene, states: EngineStates) -> Sticks:
    """The pairs of geoms that stick in a motion, from sample to sample."""
    fall = math.sqrt(float(np.linalg.norm(model.opt.gravity)) * float(model.stat.extent))
    slow_pairs = [
        frozenset(
            pair for pair, speed in speeds.items() if speed < max(_SLOW * fall, _MIN_SLOW_SPEED)
        )
        for speeds in surface_speeds(model, scene, states)
    ]
    return tuple(slow_pairs[max(0, i - 1)] & slow_pairs[i] for i in range(len(slow_pairs)))


def friction_holds(model: Any, scene: Scene, states: EngineStates, sticks: Sticks) -> bool:
    """Whether friction is below its limit at all that sticks, at every sample of these states."""
    model = with_integrator(model, Integrator.EULER, scene.timestep)
    model.opt.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    force = np.zeros(6)
    for data, pairs in zip(_samples(model, scene, states), sticks, strict=False):
        loads = {pair: np.zeros(2) for pair in pairs}  # friction over its coefficient, and pressure
        for number, contact in enumerate(data.contact[: data.ncon]):
            pair = pair_of(contact)
            if pair in loads:
                mujoco.mj_contactForce(model, data, number, force)
                friction = force[1 : contact.dim] / contact.friction[: contact.dim - 1]
                loads[pair] += np.linalg.norm(friction), force[0]
        if any(friction > _BELOW_LIMIT * normal for friction, normal in loads.values()):
            return False
    return True


_BELOW_LIMIT = 0.99
"""The part of its limit to which friction counts as below it."""


def measure_slip(model: Any, scene: Scene, states: EngineStates, sticks: Sticks) -> float:
    """The largest creep, m, of a pair that sticks in the reference."""
    total: dict[Pair, float] = {}
    before = 0.0
    for time, speeds, pairs in zip(
        states.times.tolist(), surface_speeds(model, scene, states), sticks, strict=False
    ):
        for pair in pairs:
            total[pair] = total.get(pair, 0.0) + speeds.get(pair, 0.0) * (time - before)
        before = time
    return max(total.values(), default=0.0)


def surface_speeds(model: Any, scene: Scene, states: EngineStates) -> list[dict[Pair, float]]:
    """At every sample the least speed along the surface, m/s, of pairs of geoms that touch."""
    data = initial_data(scene.scenario, model)
    least_speeds = []
    for qpos, qvel, act in zip(states.qpos, states.qvel, states.act, strict=True):
        data.qpos[:], data.qvel[:], data.act[:] = qpos, qvel, act
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_fwdVelocity(model, data)
        least: dict[Pair, float] = {}
        for contact in touching_contacts(data):
            if contact.dim >= 3:  # with friction
                pair = pair_of(contact)
                _, speed = contact_speeds(model, data, contact)
                least[pair] = min(speed, least.get(pair, math.inf))
        least_speeds.append(least)
    return least_speeds


def touching_contacts(data: Any) -> list[Any]:
    """Contacts of geoms that push each other; not those of a flex."""
    return [
        contact
        for contact in data.contact[: data.ncon]
        if min(contact.geom) >= 0 and contact.dist <= contact.includemargin
    ]


def contact_speeds(model: Any, data: Any, contact: Any) -> tuple[float, float]:
    """The speeds (m/s) with which two geoms part, and slide along each other, at a contact."""
    first, second = pair_of(contact)
    relative = _velocity(model, data, second, contact.pos)
    relative = relative - _velocity(model, data, first, contact.pos)
    normal = contact.frame[:3]
    slip = relative - _belt_velocity(model, data, first, contact.pos)
    slip = slip + _belt_velocity(model, data, second, contact.pos)
    return float(normal @ relative), float(np.linalg.norm(slip - normal * (normal @ slip)))


def _velocity(model: Any, data: Any, geom: int, point: Array) -> Array:
    """The velocity (3,) of a geom's material at a point of the world, m/s."""
    twist = np.zeros(6)
    mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_GEOM, geom, twist, 0)
    velocity: Array = twist[3:] + np.cross(twist[:3], point - data.geom_xpos[geom])
    return velocity


def _belt_velocity(model: Any, data: Any, geom: int, point: Array) -> Array:
    """The velocity (3,) that `surfacevel` adds to that; only its part along the surface counts."""
    turn = data.geom_xmat[geom].reshape(3, 3)
    linear, angular = model.geom_surfacevel[geom].reshape(2, 3) @ turn.T
    velocity: Array = linear + np.cross(angular, point - data.geom_xpos[geom])
    return velocity
