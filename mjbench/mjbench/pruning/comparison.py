"""Two models in the same scenario: whether they do the same, bit for bit or nearly.

1. Both begin in the same state and are stepped side by side to the end: neither is ever set to the
   state of the other, which would hide what a part does that is gone. Positions, velocities,
   activations and the sensors that are left must be the same bits after every step; so must
   contacts with their forces, at every tenth step.
2. Where a bit differs, what counts is what the scene shows of it: how far the bodies that are left
   are displaced and turned at any step, and what its sensors read.
3. In chaos this is compared as long as a twin of the base, off by 1e-10, stays near it.
4. A run that the detector calls lost proves nothing.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Any, TypeAlias

import mujoco
import numpy as np
from msgspec import Struct
from msgspec.structs import replace
from numpy.typing import NDArray

from mjbench.declarations import Declarations, DeclaredScenario, Place
from mjbench.detector import Passages, Peaks, RunJudgement, judge, update_peaks
from mjbench.pilot import NUDGE, nudges
from mjbench.problem import Array, Scenario, Setup
from mjbench.rotations import angular_distance
from mjbench.scene import Scene, SceneError, scenes
from mjbench.simulation import (
    STATE,
    advance,
    expect_passages,
    full_state,
    initial_data,
    nudged,
)

Places: TypeAlias = NDArray[np.int64]
IndexMap: TypeAlias = Mapping[str, Places]
"""For each entry of the variant its place in the whole model, by the field with their number, such
as `nq`."""

_WIDTHS = {int(mujoco.mjtJoint.mjJNT_FREE): 7, int(mujoco.mjtJoint.mjJNT_BALL): 4}
"""The number of positions of joints that have several."""
_STATE = {
    "qpos": "nq",
    "qvel": "nv",
    "act": "na",
    "ctrl": "nu",
    "qacc_warmstart": "nv",
    "qfrc_applied": "nv",
    "xfrc_applied": "nbody",
    "mocap_pos": "nmocap",
    "mocap_quat": "nmocap",
    "eq_active": "neq",
}
"""Parts of a state, with the field of their length."""
KEY_SIZES = {"qpos": "nq", "qvel": "nv", "act": "na", "ctrl": "nu"}
"""Attributes of a keyframe, with the field of their length; mocap bodies are never removed."""


def index_map(model: Any, losses: Mapping[str, Collection[int]]) -> IndexMap:
    """The places in a model that are left without things of some kinds, given by number.

    Those are `body`, whose descendants go too, `joint`, `geom`, `sensor`, `actuator` and
    `equality`.
    """
    bodies = set(losses.get("body", ()))
    for number in range(1, model.nbody):  # parents come first
        if int(model.body_parentid[number]) in bodies:
            bodies.add(number)
    body = np.setdiff1d(np.arange(model.nbody), [*bodies])
    mocap = model.body_mocapid[body]
    joints = np.flatnonzero(np.isin(model.jnt_bodyid, body))

    def keep(kind: str, things: Places) -> Places:
        return np.setdiff1d(things, [*losses.get(kind, ())])

    joints = keep("joint", joints)
    actuators = keep("actuator", np.arange(model.nactuator))
    sensors = keep("sensor", np.arange(model.nsensor))
    geoms = keep("geom", np.arange(model.ngeom))
    widths = [_WIDTHS.get(int(kind), 1) for kind in model.jnt_type[joints]]
    return {
        "nq": _ranges(model.jnt_qposadr[joints], widths),
        "nv": np.flatnonzero(np.isin(model.dof_jntid, joints)),
        "na": _ranges(model.actuator_actadr[actuators], model.actuator_actnum[actuators]),
        "nu": _ranges(model.actuator_ctrladr[actuators], model.actuator_ctrlnum[actuators]),
        "nbody": body,
        "nmocap": mocap[mocap >= 0].astype(np.int64),
        "neq": keep("equality", np.arange(model.neq)),
        "ngeom": geoms[np.isin(model.geom_bodyid[geoms], body)],
        "nsensordata": _ranges(model.sensor_adr[sensors], model.sensor_dim[sensors]),
    }


def _ranges(starts: Any, counts: Any) -> Places:
    """Ranges of places one after the other; one that begins before 0 is empty."""
    places = [
        place
        for start, count in zip(starts, counts, strict=True)
        for place in (range(start, start + count) if start >= 0 else ())
    ]
    return np.array(places, dtype=np.int64)


def fits(index: IndexMap, whole: Any, model: Any) -> bool:
    """Whether a variant has exactly what should be left of the whole model, in keyframes too."""
    if any(getattr(model, size) != len(places) for size, places in index.items()):
        return False
    return model.nkey != whole.nkey or all(
        np.array_equal(getattr(model, f"key_{name}"), getattr(whole, f"key_{name}")[:, index[size]])
        for name, size in KEY_SIZES.items()
    )


def transfer(model: Any, data: Any, index: IndexMap, variant: Any, variant_data: Any) -> None:
    """Bring a state of the whole model into the data of a variant.

    Raises:
        ValueError: a part of the state (of a plugin, of a delay) cannot be assigned.
    """
    is_same_size = all(getattr(model, size) == getattr(variant, size) for size in index)
    if is_same_size and mujoco.mj_stateSize(model, STATE) == mujoco.mj_stateSize(variant, STATE):
        mujoco.mj_setState(variant, variant_data, full_state(model, data), STATE)
        return
    delays = mujoco.mj_stateSize(variant, int(mujoco.mjtState.mjSTATE_HISTORY))
    if variant.npluginstate or delays:
        raise ValueError("its plugins or delays have states that cannot be told apart")
    variant_data.time = data.time
    for name, size in _STATE.items():
        getattr(variant_data, name)[:] = getattr(data, name)[index[size]]
    variant_data.userdata[:] = data.userdata


QUICK = 0.5
"""About how many seconds a scenario takes with `--quick`."""
ALIKE = 0.01
"""The difference that counts as none: this part of what is just visible in a picture."""
NEARBY = 0.01
"""How far starts nearby are off in each degree of freedom: this part of how far, and how fast, it
moves from the declared start. What rests stays where it is."""
_ROUNDING = 1e-8
"""A reading that differs by less, relative to 1 or to the largest of its sensor, is the same."""
_CONTACTS = 10
"""Steps from one look at the contacts to the next."""


def pruning_scenes(
    model: Any, declarations: Declarations, *, quick: bool = False
) -> tuple[Scene, ...]:
    """The scenarios of a model, declared or by default; at least one.

    Raises:
        SceneError: a scenario does not fit the model.
    """
    declared_scenes = scenes(model, declarations, quick=quick)
    for scene in declared_scenes:
        if scene.scenario.forces or scene.scenario.poses:
            raise SceneError(
                "the diet does not know what pushes and poses need", scene.declaration.table
            )
    if not declared_scenes:  # nothing moves, but there are things to be without
        step, place = float(model.opt.timestep), Place(declarations.path)
        scenario, start = Scenario(10 * step, step), DeclaredScenario("start", table=place)
        return (Scene("start", "", scenario, (step,), step, declarations.bench, start),)
    if not quick:
        return declared_scenes
    short_scenes = []
    for scene in declared_scenes:
        sample, duration = scene.scenario.sample, scene.scenario.duration
        short = sample * max(1, round(min(duration, QUICK) / sample))
        short_scenes.append(replace(scene, scenario=replace(scene.scenario, duration=short)))
    return tuple(short_scenes)


def without_reset(model: Any) -> None:
    """Switch off MuJoCo's automatic reset, so that a state that blew up stays visible."""
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)


class WatchedRun(Struct, frozen=True, eq=False):
    """The observations of a run of the whole model."""

    scene: Scene
    judgement: RunJudgement
    touching_pairs: frozenset[tuple[int, int]]
    """Pairs of geoms between which there was a contact that counts."""
    displacements: Array
    """(nv,): how far each degree of freedom was from its beginning, at most."""
    speeds: Array
    """(nv,): the largest."""
    horizon: float
    """s: how long a twin whose beginning is off by 1e-10 moves alike; infinite for to the end."""


def watch(model: Any, scene: Scene) -> WatchedRun:
    """Run the whole model in a scenario, and beside it a twin."""
    without_reset(model)
    data = initial_data(scene.scenario, model)
    twin = initial_data(nudged(scene.scenario, model, nudges(model, 2, NUDGE)[0]), model)
    start, change = data.qpos.copy(), np.zeros(model.nv)
    displacements, speeds = np.zeros(model.nv), np.zeros(model.nv)
    horizon = math.inf
    touching: set[tuple[int, int]] = set()
    peaks, passages = Peaks(), Passages(model)
    gauge = _Gauge(model, model, index_map(model, {}), scene)
    for inputs in scene.scenario.inputs(scene.timestep):
        inputs.give(data)
        inputs.give(twin)
        advance(model, data)
        if data.ncon:
            pairs = data.contact.geom[data.contact.exclude == 0]  # none has a force within its gap
            touching |= {(min(p), max(p)) for p in pairs.tolist() if min(p) >= 0}
        peaks = update_peaks(data, peaks, passages.thickness)
        passages.look(data)
        if not peaks.finite:
            break
        mujoco.mj_differentiatePos(model, change, 1.0, start, data.qpos)
        np.maximum(displacements, np.abs(change), out=displacements)
        np.maximum(speeds, np.abs(data.qvel), out=speeds)
        if math.isinf(horizon):
            advance(model, twin)
            gauge.look(data, twin)
            horizon = float(data.time) if gauge.seen > ALIKE else horizon
    setup = Setup(scenario=scene.scenario)
    if peaks.sunk > 1:
        passages.setup = setup = expect_passages(setup, model)
    judgement = judge(data, peaks, setup, passages.texts())
    return WatchedRun(scene, judgement, frozenset(touching), displacements, speeds, horizon)


def nearby_scenes(model: Any, run: WatchedRun, count: int) -> Iterator[Scene]:
    """The scenario of a run from random starts nearby, always the same ones."""
    scenario, random = run.scene.scenario, np.random.default_rng(2)
    for number in range(count if np.any(run.displacements) or np.any(run.speeds) else 0):
        change = random.normal(size=(2, model.nv)) * NEARBY * (run.displacements, run.speeds)
        nearby = nudged(scenario, model, change)
        yield replace(run.scene, name=f"{run.scene.name}, nearby {number + 1}", scenario=nearby)


class MotionComparison(Struct, frozen=True):
    """How a variant compares with the base in all runs."""

    identical: bool
    difference: float
    """The largest of what can be seen, where 1 is just visible; infinite where it was lost."""
    shown: str = ""
    """The same in the scene's own quantities; empty where nothing differs."""


def compare(
    whole: Any,
    variant: Any,
    index: IndexMap,
    runs: Sequence[WatchedRun],
    remainder: tuple[Any, IndexMap] | None = None,
) -> MotionComparison:
    """Run whole model and variant side by side as the whole ran before, each from where it begins.

    A run ends where a difference can be seen, which is then the largest that is known.
    `remainder`: a smaller model that is known to move alike, to run in place of the whole one.

    Raises:
        ValueError: a state of the whole model cannot be transferred.
    """
    base, base_index = remainder or (whole, index_map(whole, {}))
    for model in (base, variant):
        without_reset(model)
    worst = MotionComparison(True, 0.0)
    for run in runs:
        start = initial_data(run.scene.scenario, whole)
        data, variant_data = mujoco.MjData(base), mujoco.MjData(variant)
        transfer(whole, start, base_index, base, data)
        transfer(whole, start, index, variant, variant_data)
        comparison = _follow((base, data, base_index), (variant, variant_data, index), run)
        identical = worst.identical and comparison.identical
        worst = max(worst, comparison, key=lambda c: (c.difference, bool(c.shown)))
        worst = replace(worst, identical=identical)
        if worst.difference >= 1.0:
            break
    return worst


def _follow(
    first: tuple[Any, Any, IndexMap], second: tuple[Any, Any, IndexMap], run: WatchedRun
) -> MotionComparison:
    """Compare two models, each with its state and its places in the whole, in a run."""
    (base, data, base_index), (variant, variant_data, variant_index) = first, second
    scene, identical = run.scene, True
    index = {
        size: np.searchsorted(base_index[size], places) for size, places in variant_index.items()
    }
    gauge = _Gauge(base, variant, index, scene)
    geoms = {int(number): i for i, number in enumerate(index["ngeom"])}
    own_geoms = {i: i for i in range(variant.ngeom)}
    for step, inputs in enumerate(scene.scenario.inputs(scene.timestep)):
        if inputs.controls:
            data.ctrl[:] = np.take(inputs.controls, base_index["nu"])
            variant_data.ctrl[:] = np.take(inputs.controls, variant_index["nu"])
        advance(base, data)
        advance(variant, variant_data)
        if identical:
            identical = all(
                getattr(data, name)[index[size]].tobytes() == getattr(variant_data, name).tobytes()
                for name, size in _MOTION.items()
            )
        if identical and step % _CONTACTS == 0:  # the same geoms touch, with the same forces
            contacts = _contacts(base, data, geoms)
            identical = contacts == _contacts(variant, variant_data, own_geoms)
        if not identical and data.time <= run.horizon:
            gauge.look(data, variant_data)
            if gauge.seen >= 1.0:
                return MotionComparison(False, gauge.seen, gauge.shown)
    for model, state in ((base, data), (variant, variant_data)):
        mujoco.mj_kinematics(model, state)  # a step leaves places as they were at its beginning
    if not identical and data.time <= run.horizon:
        gauge.look(data, variant_data)
    judgement = judge(variant_data)
    if not judgement.ok:
        return MotionComparison(False, math.inf, f"the run is lost: {'; '.join(judgement.reasons)}")
    difference, words = gauge.with_sensors()
    if words and math.isfinite(run.horizon):
        words += f", until {run.horizon:.3g} s, beyond which the motion cannot be predicted"
    return MotionComparison(identical, difference, words)


_MOTION = {"qpos": "nq", "qvel": "nv", "act": "na", "sensordata": "nsensordata"}


class _Gauge:
    """How far a variant is from the base, in what the scene shows."""

    def __init__(self, base: Any, variant: Any, index: IndexMap, scene: Scene) -> None:
        self._base, self._bodies, self._readings = base, index["nbody"], index["nsensordata"]
        extent = max(min(float(base.stat.extent), float(variant.stat.extent)), 1e-15)
        self._length, self._share = scene.bench.visible * extent, scene.bench.visible
        self._angle = math.radians(scene.bench.visible_angle)
        self._gaps, self._largest = np.zeros((2, len(self._readings)))
        self.seen, self.shown = 0.0, ""
        """The largest so far of bodies, where 1 is just visible, and the same in words."""

    def look(self, data: Any, variant_data: Any) -> None:
        """Compare places, attitudes and sensors now."""
        places = np.linalg.norm(data.xpos[self._bodies] - variant_data.xpos, axis=1)
        turns = angular_distance(data.xquat[self._bodies], variant_data.xquat)
        for gaps, size, unit in ((places, self._length, "m"), (turns, self._angle, "rad")):
            worst = int(gaps.argmax())  # of NaN, if there is one, which is no place
            gap = math.inf if math.isnan(gaps[worst]) else float(gaps[worst])
            if (share := gap / size) > self.seen:
                number = int(self._bodies[worst])
                name = self._base.body(number).name or f"number {number}"
                off = f"off by {gap:.2g} {unit} at {float(data.time):.3g} s"
                self.seen, self.shown = share, f"the body {name} is {off}"
        if len(self._readings):
            readings = data.sensordata[self._readings]
            np.maximum(self._gaps, np.abs(readings - variant_data.sensordata), out=self._gaps)
            np.maximum(self._largest, np.abs(readings), out=self._largest)

    def with_sensors(self) -> tuple[float, str]:
        """The largest of bodies and sensors, whose readings count relative to their largest."""
        gaps = np.nan_to_num(self._gaps, nan=np.inf)
        gaps = np.where(gaps > _ROUNDING * np.maximum(self._largest, 1.0), gaps, 0.0)
        shares = gaps / (self._share * np.maximum(self._largest, _ROUNDING))
        if shares.max(initial=0.0) <= self.seen:
            return self.seen, self.shown
        worst = int(shares.argmax())
        sensor = int(np.searchsorted(self._base.sensor_adr, self._readings[worst], "right")) - 1
        name = self._base.sensor(sensor).name or str(sensor)
        return float(shares[worst]), f"the sensor {name} is off by {gaps[worst]:.2g}"


def _contacts(model: Any, data: Any, left: dict[int, int]) -> list[tuple[object, ...]]:
    """The contacts between geoms that are left: their numbers, distance and force, as bytes."""
    contacts, force = [], np.zeros(6)
    for i, pair in enumerate(data.contact.geom[: data.ncon].tolist()):
        if all(geom < 0 or geom in left for geom in pair):
            mujoco.mj_contactForce(model, data, i, force)
            numbers = tuple(left.get(geom, -1) for geom in pair)
            contacts.append((numbers, data.contact.dist[i].tobytes(), force.tobytes()))
    return sorted(contacts)
