"""The references of a scene under each model of contacts, and what that model itself errs by.

Errors under a cone are those of the timestep and the solver: they are measured against what the
engine tends to under that cone in small steps. What remains then is the model's own error: against
the closed form where the scenario names one, else of a pyramid against the cone that it stands for.
Both count over the same time, which is as long as the motion is known under each cone.
"""

from __future__ import annotations

from typing import Any

from msgspec import Struct
from msgspec.structs import replace

from mjbench.known_motion import KnownMotion, find_reference, motion_gap, self_reference
from mjbench.measure import (
    Sticks,
    find_sticks,
    friction_holds,
    quantity_errors,
    quantity_name,
    visible_error,
)
from mjbench.pilot import Pilot
from mjbench.problem import ROUNDING, Integrator
from mjbench.reports.scene_report import FLOORS
from mjbench.scene import Scene
from mjbench.settings import CONES
from mjbench.simulation import with_integrator, without_sleep


class Cone(Struct, frozen=True):
    """The reference for errors under a cone."""

    reference: KnownMotion
    model_error: float | None
    """What remains of the error however small the timestep, m or rad."""
    visible_model_error: float
    """The same as a visible error; 0 where the errors contain it already."""
    sticks: Sticks | None = None
    """What sticks in the reference; `None` where nothing touches."""
    is_held: bool = False
    """Whether friction is below its limit there, so that what moves is creep."""


def find_references(model: Any, pilot: Pilot, *, quick: bool = False) -> dict[str, Cone]:
    """The references of a scene by cone, over the same time; under "" where nothing touches."""
    model, scene = without_sleep(model), pilot.scene
    reference = find_reference(model, pilot, quick=quick)
    if not pilot.contact:
        return {"": Cone(reference, None, 0.0)}
    motions = {}
    for cone, number in CONES.items():
        motions[cone] = reference
        if reference.kind != "self" or model.opt.cone != number:
            variant = with_integrator(model, Integrator.EULER, scene.timestep)
            variant.opt.cone = number
            motions[cone] = self_reference(variant, pilot, quick=quick)
    count = min(len(motion.states.times) for motion in (reference, *motions.values()))
    limits = {cone: _until(model, motion, count) for cone, motion in motions.items()}
    exact = _until(model, reference, count) if reference.kind == "closed" else None
    truth = exact or limits["elliptic"]
    cones = {}
    for cone, limit in limits.items():
        sticks = find_sticks(model, scene, limit.states)
        is_held = friction_holds(model, scene, limit.states, sticks)
        if limit is truth:
            cones[cone] = Cone(limit, None, 0.0, sticks, is_held)
            continue
        gap = motion_gap(model, limit.states, truth.states).place
        least = FLOORS * max(limit.floor.place, truth.floor.place)
        visible = 0.0
        if exact is None and gap > least:
            visible = visible_error(model, scene, limit.states, truth.states)
        cones[cone] = Cone(exact or limit, max(gap, least), visible, sticks, is_held)
    return cones


def _until(model: Any, motion: KnownMotion, count: int) -> KnownMotion:
    """So many samples of a motion: errors of settings are compared over the same time."""
    if count == len(motion.states.times):
        return motion
    states, second_states = motion.states.head(count), motion.second_states.head(count)
    gap = motion_gap(model, states, second_states)
    return replace(
        motion,
        states=states,
        second_states=second_states,
        floor=gap.at_least(ROUNDING) if motion.kind == "self" else motion.floor,
        agreement=gap.largest,
        horizon=float(states.times[-1]),
    )


def least_known(model: Any, scene: Scene, reference: KnownMotion) -> tuple[float, float]:
    """Below which a reference knows nothing of what is seen, and of the declared quantity.

    It is as much of what its two motions differ by there as it may be off in itself: a formula that
    was checked is far nearer to the truth than to the engine, whose friction and contacts are soft.
    """
    states, second_states, floor = reference.states, reference.second_states, reference.floor
    gap = motion_gap(model, states, second_states)
    share = min(1.0, floor.place / (gap.place or 1.0))
    least_seen = FLOORS * share * visible_error(model, scene, states, second_states)
    if not quantity_name(model, scene):
        return least_seen, 0.0
    share = max(share, min(1.0, floor.velocity / (gap.velocity or 1.0)))
    distances = quantity_errors(model, scene, states, second_states)
    return least_seen, FLOORS * share * float(distances.max())
