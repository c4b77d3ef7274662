"""Two models in the same scenario: whether they do the same, bit for bit or nearly.

Entry points: `compare(base, changed, index, scenes)`, `watch(model, scene)`; `pruning_scenes(model,
declared, quick=…)`, the scenarios that a smaller model is judged by.

1. Both begin in the same state and are stepped side by side. Positions, velocities, activations and
   the sensors that are left must be the same bits after every step; contacts, with their forces,
   too, wherever they are looked at.
2. Where a bit differs, chaos may make much of it. So the base run is followed, and every 0.1 s the
   changed model starts from its state: what counts is how far both are apart within 50 ms.
3. A run that the detector calls lost proves nothing.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core.model.scenarios import Declarations, DeclaredScenario
from coursebuild.numerics.detector import Peaks, RunJudgement, judge, update_peaks
from coursebuild.numerics.engine import advance, initial_data
from coursebuild.numerics.problem import Scenario
from coursebuild.numerics.pruning.index_map import IndexMap, transfer
from coursebuild.numerics.scene import Scene, scenes, thickness

QUICK = 0.5
"""Seconds of a scenario where it should be quick, about."""
TOLERANCE = 1e-8
"""What counts as equal: relative to a number's size, absolute where that is under 1."""
SHOTS, SHOT = 0.1, 0.05
"""Seconds from one start to the next, and that each lasts."""
_CONTACTS = 10
"""Steps from one look at the contacts to the next."""


def pruning_scenes(model: Any, declared: Declarations, *, quick: bool = False) -> tuple[Scene, ...]:
    """What happens to a model, declared or by default.

    Raises:
        SceneError: a scenario does not fit the model.
    """
    found = scenes(model, declared, quick=quick)
    if not found:  # nothing moves, but there are things to be without
        step, place = float(model.opt.timestep), declared.source.span(0, 0)
        scenario, start = Scenario(10 * step, step), DeclaredScenario("start", span=place)
        return (Scene("start", "", scenario, (step,), step, declared.bench, start),)
    return tuple(_shortened(scene) for scene in found) if quick else found


def _shortened(scene: Scene) -> Scene:
    sample, duration = scene.scenario.sample, scene.scenario.duration
    short = sample * max(1, round(min(duration, QUICK) / sample))
    return replace(scene, scenario=replace(scene.scenario, duration=short))


class MotionComparison(Struct, frozen=True):
    """How a changed model did in all scenarios."""

    identical: bool
    difference: float
    """The largest; 0 where all bits are the same, infinite where it was lost."""


def compare(base: Any, changed: Any, index: IndexMap, scenes: Sequence[Scene]) -> MotionComparison:
    """Run both in all the scenarios.

    Raises:
        ValueError: a state cannot be brought from one to the other.
    """
    for model in (base, changed):
        without_reset(model)
    sleeps = int(mujoco.mjtEnableBit.mjENBL_SLEEP) & ~base.opt.enableflags & changed.opt.enableflags
    difference, identical = 0.0, True
    for scene in scenes:
        if not _same_bits(base, changed, index, scene):
            identical = False
            # What sleeps would be awake after each shot.
            apart = _shots(base, changed, index, scene, whole=bool(sleeps))
            difference = max(difference, apart)
        if difference > TOLERANCE and not sleeps:
            break
    return MotionComparison(identical, difference)


def without_reset(model: Any) -> None:
    """Switch off MuJoCo's automatic reset, so that a state that blew up stays visible."""
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)


def _begin(base: Any, changed: Any, index: IndexMap, scene: Scene) -> tuple[Any, Any]:
    data, other = initial_data(scene.scenario, base), mujoco.MjData(changed)
    transfer(base, data, index, changed, other)
    return data, other


def _same_bits(base: Any, changed: Any, index: IndexMap, scene: Scene) -> bool:
    data, other = _begin(base, changed, index, scene)
    end = float(other.time) + scene.scenario.duration
    for step, command in enumerate(scene.scenario.commands(scene.timestep)):
        if command:
            data.ctrl[:] = command
            other.ctrl[:] = data.ctrl[index["nu"]]
        advance(base, data)
        advance(changed, other)
        if any(mine.tobytes() != his.tobytes() for mine, his in _states(data, other, index)):
            return False
        if step % _CONTACTS == 0 and not _equal_contacts(base, data, changed, other, index):
            return False
    return judge(changed, other, end).ok


def _states(data: Any, other: Any, index: IndexMap) -> tuple[tuple[Any, Any], ...]:
    """What is left of the base's state and sensors, beside that of the changed model."""
    return (
        (data.qpos[index["nq"]], other.qpos),
        (data.qvel[index["nv"]], other.qvel),
        (data.act[index["na"]], other.act),
        (data.sensordata[index["nsensordata"]], other.sensordata),
    )


def _equal_contacts(base: Any, data: Any, changed: Any, other: Any, index: IndexMap) -> bool:
    """Whether the geoms that are left touch alike, with the same forces."""
    left = {int(whole): i for i, whole in enumerate(index["ngeom"])}
    everything = {i: i for i in range(changed.ngeom)}
    return _contacts(base, data, left) == _contacts(changed, other, everything)


def _contacts(model: Any, data: Any, left: dict[int, int]) -> list[tuple[object, ...]]:
    """Contacts between geoms that are left: their numbers, distance and force, as bytes."""
    found, force = [], np.zeros(6)
    for i, pair in enumerate(data.contact.geom[: data.ncon].tolist()):
        if all(geom < 0 or geom in left for geom in pair):
            mujoco.mj_contactForce(model, data, i, force)
            numbers = tuple(left.get(geom, -1) for geom in pair)
            found.append((numbers, data.contact.dist[i].tobytes(), force.tobytes()))
    return sorted(found)


def _shots(base: Any, changed: Any, index: IndexMap, scene: Scene, *, whole: bool) -> float:
    """How far the changed model is from the base within 50 ms, from states of the base run.

    `whole`: over the whole scenario instead, from its beginning.
    """
    data, other = _begin(base, changed, index, scene)
    every, length = (max(1, round(span / scene.timestep)) for span in (SHOTS, SHOT))
    worst = 0.0
    for step, command in enumerate(scene.scenario.commands(scene.timestep)):
        if command:
            data.ctrl[:] = command
            other.ctrl[:] = data.ctrl[index["nu"]]
        at = 0 if whole else step % every
        if at == 0 and not whole:
            transfer(base, data, index, changed, other)
        advance(base, data)
        if at < length:
            advance(changed, other)
            for mine, his in _states(data, other, index):
                relative = np.abs(mine - his) / np.maximum(1.0, np.abs(mine))
                worst = max(worst, float(np.nan_to_num(relative, nan=np.inf).max(initial=0.0)))
            if math.isinf(worst):
                return math.inf
    return worst if judge(changed, other, float(other.time)).ok else math.inf


class WatchedRun(Struct, frozen=True, eq=False):
    """What a run of the whole model showed."""

    scene: Scene
    judgement: RunJudgement
    touching: frozenset[tuple[int, int]]
    """Pairs of geoms between which there was a contact that counts."""
    constrained: bool
    """Whether a constraint was ever active."""


def watch(model: Any, scene: Scene) -> WatchedRun:
    """Run the whole model once."""
    without_reset(model)
    data = initial_data(scene.scenario, model)
    start, made = float(data.time), 0
    touching: set[tuple[int, int]] = set()
    most, constrained, thick = Peaks(), False, thickness(model)
    for command in scene.scenario.commands(scene.timestep):
        if command:
            data.ctrl[:] = command
        advance(model, data)
        made += 1
        constrained = constrained or data.nefc > 0
        if data.ncon:
            felt = data.contact.geom[data.contact.exclude == 0]  # none has a force within its gap
            touching |= {(min(p), max(p)) for p in felt.tolist() if min(p) >= 0}
        most = update_peaks(data, most, thick)
        if not most.finite:
            break
    judgement = judge(model, data, start + made * scene.timestep, most)
    return WatchedRun(scene, judgement, frozenset(touching), constrained)
