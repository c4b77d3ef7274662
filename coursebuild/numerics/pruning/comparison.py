"""Two models in the same scenario: whether they do the same, bit for bit or nearly.

Entry points: `compare(base, variant, index, scenes)`, `watch(model, scene)`; `pruning_scenes(model,
declarations, quick=…)`, the scenarios by which a smaller model is judged.

1. Both begin in the same state and are stepped side by side. Positions, velocities, activations and
   the sensors that are left must be the same bits after every step; so must contacts with their
   forces, at every tenth step.
2. Where a bit differs, chaos may amplify it. So the base run is followed, and every 0.1 s the
   variant starts from its state: what counts is how far both are apart within 50 ms.
3. A run that the detector calls lost proves nothing.
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

from coursebuild.core.model.scenarios import Declarations, DeclaredScenario
from coursebuild.numerics.detector import Peaks, RunJudgement, judge, update_peaks
from coursebuild.numerics.problem import Scenario
from coursebuild.numerics.scene import Scene, scenes, thickness
from coursebuild.numerics.simulation import STATE, advance, full_state, initial_data

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
}
"""Parts of a state, with the field of their length."""
KEY_SIZES = {"qpos": "nq", "qvel": "nv", "act": "na", "ctrl": "nu"}
"""Attributes of a keyframe, with the field of their length; mocap bodies are never removed."""


def index_map(model: Any, losses: Mapping[str, Collection[int]]) -> IndexMap:
    """The places in a model that are left without things of some kinds, given by number.

    Those are `body`, whose descendants go too, `geom`, `sensor` and `actuator`.
    """
    bodies = set(losses.get("body", ()))
    for number in range(1, model.nbody):  # parents come first
        if int(model.body_parentid[number]) in bodies:
            bodies.add(number)
    body = np.setdiff1d(np.arange(model.nbody), [*bodies])
    mocap = model.body_mocapid[body]
    joints = np.flatnonzero(np.isin(model.jnt_bodyid, body))
    ctrl = np.setdiff1d(np.arange(model.nu), [*losses.get("actuator", ())])
    sensors = np.setdiff1d(np.arange(model.nsensor), [*losses.get("sensor", ())])
    geoms = np.setdiff1d(np.arange(model.ngeom), [*losses.get("geom", ())])
    widths = [_WIDTHS.get(int(kind), 1) for kind in model.jnt_type[joints]]
    return {
        "nq": _ranges(model.jnt_qposadr[joints], widths),
        "nv": np.flatnonzero(np.isin(model.dof_bodyid, body)),
        "na": _ranges(model.actuator_actadr[ctrl], model.actuator_actnum[ctrl]),
        "nu": ctrl,
        "nbody": body,
        "nmocap": mocap[mocap >= 0].astype(np.int64),
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
    is_same_size = all(getattr(model, size) == getattr(variant, size) for size in (*index, "neq"))
    if is_same_size and mujoco.mj_stateSize(model, STATE) == mujoco.mj_stateSize(variant, STATE):
        mujoco.mj_setState(variant, variant_data, full_state(model, data), STATE)
        return
    delays = mujoco.mj_stateSize(variant, int(mujoco.mjtState.mjSTATE_HISTORY))
    if variant.npluginstate or delays:
        raise ValueError("its plugins or delays have states that cannot be told apart")
    if variant.neq != model.neq:
        raise ValueError("it has other equalities")
    variant_data.time = data.time
    for name, size in _STATE.items():
        getattr(variant_data, name)[:] = getattr(data, name)[index[size]]
    variant_data.eq_active[:] = data.eq_active
    variant_data.userdata[:] = data.userdata


QUICK = 0.5
"""About how many seconds a scenario takes with `--quick`."""
TOLERANCE = 1e-8
"""The difference that counts as none: relative to a number's size, absolute if that is under 1."""
SHOTS, SHOT = 0.1, 0.05
"""Seconds from one start to the next, and that each lasts."""
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
    if not declared_scenes:  # nothing moves, but there are things to be without
        step, place = float(model.opt.timestep), declarations.source.span(0, 0)
        scenario, start = Scenario(10 * step, step), DeclaredScenario("start", span=place)
        return (Scene("start", "", scenario, (step,), step, declarations.bench, start),)
    return tuple(_shorten(scene) for scene in declared_scenes) if quick else declared_scenes


def _shorten(scene: Scene) -> Scene:
    sample, duration = scene.scenario.sample, scene.scenario.duration
    short = sample * max(1, round(min(duration, QUICK) / sample))
    return replace(scene, scenario=replace(scene.scenario, duration=short))


class MotionComparison(Struct, frozen=True):
    """How a variant compares with the base in all scenarios."""

    identical: bool
    difference: float
    """The largest; 0 where all bits are the same, infinite where it was lost."""


def compare(base: Any, variant: Any, index: IndexMap, scenes: Sequence[Scene]) -> MotionComparison:
    """Run base and variant in all scenarios.

    Raises:
        ValueError: a state of the base cannot be transferred.
    """
    for model in (base, variant):
        without_reset(model)
    sleeps = int(mujoco.mjtEnableBit.mjENBL_SLEEP) & ~base.opt.enableflags & variant.opt.enableflags
    difference, identical = 0.0, True
    for scene in scenes:
        if not _same_bits(base, variant, index, scene):
            identical = False
            # What sleeps would be awake after each shot.
            departure = _largest_departure(base, variant, index, scene, whole=bool(sleeps))
            difference = max(difference, departure)
        if difference > TOLERANCE and not sleeps:
            break
    return MotionComparison(identical, difference)


def without_reset(model: Any) -> None:
    """Switch off MuJoCo's automatic reset, so that a state that blew up stays visible."""
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)


def _begin_steps(
    base: Any, variant: Any, index: IndexMap, scene: Scene
) -> Iterator[tuple[int, Any, Any]]:
    """The number of each step with the data of both models, which wait for it with its command."""
    data, variant_data = initial_data(scene.scenario, base), mujoco.MjData(variant)
    transfer(base, data, index, variant, variant_data)
    for step, command in enumerate(scene.scenario.commands(scene.timestep)):
        if command:
            data.ctrl[:] = command
            variant_data.ctrl[:] = data.ctrl[index["nu"]]
        yield step, data, variant_data


def _same_bits(base: Any, variant: Any, index: IndexMap, scene: Scene) -> bool:
    left = {int(whole): i for i, whole in enumerate(index["ngeom"])}
    identity = {i: i for i in range(variant.ngeom)}
    for step, data, variant_data in _begin_steps(base, variant, index, scene):
        advance(base, data)
        advance(variant, variant_data)
        if any(a.tobytes() != b.tobytes() for a, b in _states(data, variant_data, index)):
            return False
        if step % _CONTACTS == 0:  # the geoms that are left touch alike, with the same forces
            contacts = _contacts(base, data, left)
            if contacts != _contacts(variant, variant_data, identity):
                return False
    return judge(variant, variant_data, scene.scenario.duration).ok


def _states(data: Any, variant_data: Any, index: IndexMap) -> tuple[tuple[Any, Any], ...]:
    """The state and sensors of the variant, each beside the same entries of the base."""
    return (
        (data.qpos[index["nq"]], variant_data.qpos),
        (data.qvel[index["nv"]], variant_data.qvel),
        (data.act[index["na"]], variant_data.act),
        (data.sensordata[index["nsensordata"]], variant_data.sensordata),
    )


def _contacts(model: Any, data: Any, left: dict[int, int]) -> list[tuple[object, ...]]:
    """The contacts between geoms that are left: their numbers, distance and force, as bytes."""
    contacts, force = [], np.zeros(6)
    for i, pair in enumerate(data.contact.geom[: data.ncon].tolist()):
        if all(geom < 0 or geom in left for geom in pair):
            mujoco.mj_contactForce(model, data, i, force)
            numbers = tuple(left.get(geom, -1) for geom in pair)
            contacts.append((numbers, data.contact.dist[i].tobytes(), force.tobytes()))
    return sorted(contacts)


def _largest_departure(
    base: Any, variant: Any, index: IndexMap, scene: Scene, *, whole: bool
) -> float:
    """How far the variant departs from the base within 50 ms, from states of the base run.

    `whole`: over the whole scenario instead, from its beginning.
    """
    interval, length = (max(1, round(span / scene.timestep)) for span in (SHOTS, SHOT))
    worst = 0.0
    for step, data, variant_data in _begin_steps(base, variant, index, scene):
        at = 0 if whole else step % interval
        if at == 0 and not whole:
            transfer(base, data, index, variant, variant_data)
        advance(base, data)
        if at < length:
            advance(variant, variant_data)
            for a, b in _states(data, variant_data, index):
                relative = np.abs(a - b) / np.maximum(1.0, np.abs(a))
                worst = max(worst, float(np.nan_to_num(relative, nan=np.inf).max(initial=0.0)))
            if math.isinf(worst):
                return math.inf
    return worst if judge(variant, variant_data, float(variant_data.time)).ok else math.inf


class WatchedRun(Struct, frozen=True, eq=False):
    """The observations of a run of the whole model."""

    scene: Scene
    judgement: RunJudgement
    touching_pairs: frozenset[tuple[int, int]]
    """Pairs of geoms between which there was a contact that counts."""
    constrained: bool
    """Whether a constraint was ever active."""


def watch(model: Any, scene: Scene) -> WatchedRun:
    """Run the whole model in a scenario."""
    without_reset(model)
    data = initial_data(scene.scenario, model)
    steps_made = 0
    touching: set[tuple[int, int]] = set()
    peaks, constrained, half_thickness = Peaks(), False, thickness(model)
    for command in scene.scenario.commands(scene.timestep):
        if command:
            data.ctrl[:] = command
        advance(model, data)
        steps_made += 1
        constrained = constrained or data.nefc > 0
        if data.ncon:
            pairs = data.contact.geom[data.contact.exclude == 0]  # none has a force within its gap
            touching |= {(min(p), max(p)) for p in pairs.tolist() if min(p) >= 0}
        peaks = update_peaks(data, peaks, half_thickness)
        if not peaks.finite:
            break
    judgement = judge(model, data, steps_made * scene.timestep, peaks)
    return WatchedRun(scene, judgement, frozenset(touching), constrained)
