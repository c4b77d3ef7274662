"""Runs of a model over a span, and what ends in them: bounds, nearness, passing through."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from mjbench.declarations import is_multiple
from mjbench.detector import Passages, Peaks, RunStatus, has_bad_state, judge, update_peaks
from mjbench.pilot import Pilot, horizon_error, nudges, position_distance, scales
from mjbench.problem import Array, Setup
from mjbench.reports.shown_errors import horizon_error_text
from mjbench.simulation import EngineStates, initial_data, watch_steps

STARTS, QUICK_STARTS, NEARBY = 5, 3, 1e-4
"""The starts of runs, the own one among them, and how far the others are from it: rad, or relative
to the model's extent."""
_LOOKS = 500
"""How often a run is looked at."""
_TRANSIENT, _DECAY = 8, 0.75
"""What shoots up in so many first steps is a transient, if it has decayed after that part of
a run."""
_PART = 0.25
"""The part of the way that a motion goes by which what is off is not near to it."""
_LATE = ", with commands up to a step late"
_AT_REST = 1e-100
"""The part of its largest speed below which nothing begins to move: subnormal numbers are slow."""


class StabilityTrial(Struct, frozen=True):
    """A run at one timestep."""

    timestep: float
    """s."""
    status: RunStatus
    reason: str = ""
    """Why it was lost."""
    astray: str = ""
    """How it left the motion of small steps; empty where it did not, or nobody asked."""
    through: str = ""
    """What went through what."""

    @property
    def stable(self) -> bool:
        """Whether the run stayed within what can be."""
        return self.status is RunStatus.OK


class KeptMotion(Struct, frozen=True, eq=False):
    """The motion that small steps keep, as long as it can be predicted."""

    states: EngineStates
    units: Array
    """What counts as far in each degree of freedom (nv,)."""
    far: str
    """The same in words."""

    def distance(self, model: Any, data: Any, number: int) -> float:
        """How far a state near the time of such a sample is from it, where 1 is far."""
        qpos, qvel = self.states.qpos[number].copy(), self.states.qvel[number]
        mujoco.mj_integratePos(model, qpos, qvel, data.time - float(self.states.times[number]))
        return position_distance(model, qpos, data.qpos, self.units)


def kept_motion(model: Any, pilot: Pilot, reference: EngineStates) -> KeptMotion:
    """The reference of a scene as the motion that runs are compared with.

    Unless the scenario states an error, far is a part of the way that the motion goes, if it can be
    seen, and no more than where predictions end: small motions would always be near else.
    """
    scene, far = pilot.scene, horizon_error(model, pilot.scene)
    states = reference.head(int(np.sum(reference.times <= pilot.horizon * (1 + 1e-9))))
    if not scene.declaration.horizon_error:
        changes = np.zeros((len(states.times), int(model.nv)))
        for change, qpos in zip(changes, states.qpos, strict=True):
            mujoco.mj_differentiatePos(model, change, 1.0, states.qpos[0], qpos)
        ways = np.ptp(changes, axis=0)
        is_length = scales(model, 0.0, 1.0) > 0
        for unit, dofs, visible in (
            ("rad", ~is_length, math.radians(scene.bench.visible_angle)),
            ("m", is_length, scene.bench.visible * float(model.stat.extent)),
        ):
            if unit in far:
                far[unit] = min(far[unit], max(_PART * float(ways[dofs].max()), visible))
    units = scales(model, far.get("rad", math.inf), far.get("m", math.inf))
    return KeptMotion(states, units, horizon_error_text(far))


def step_count(span: float, timestep: float) -> int:
    """Steps that make up a span, both in s."""
    return math.ceil(span / timestep * (1 - 1e-12))


def run_trial(
    setup: Setup, model: Any, span: float, motion: KeptMotion | None = None, *, start: int = 0
) -> StabilityTrial:
    """Run a model over a span (s) with its own timestep, or until it is lost.

    `motion`: to compare it with; `start`: 0 for the scenario's own, else one near it. A command
    changes with the first step that begins after its time: the timestep need not divide the hold.
    """
    data = initial_data(setup.scenario, model)
    if start:
        direction = nudges(model, STARTS - 1, NEARBY)[start - 1]
        mujoco.mj_integratePos(model, data.qpos, direction[0], 1.0)
        data.qvel[:] += direction[1]
        data.act[:] += NEARBY * (-1) ** start
    model.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_ENERGY)
    timestep = float(model.opt.timestep)
    steps = step_count(span, timestep)
    interval = max(2, steps // _LOOKS)
    holds = setup.scenario.holds(span)
    commands = {min(math.ceil(begin / timestep - 1e-9), steps): new for begin, _, new in holds}
    late = [begin for begin, _, _ in holds if begin and not is_multiple(begin, timestep)]
    if (loop := setup.scenario.loop) and not is_multiple(loop.period, timestep):
        late = [0.0]
    times = () if motion is None or start else motion.states.times.tolist()
    samples = _nearest_samples(times, timestep)
    stops = sorted(
        {*range(1, _TRANSIENT + 1), *range(0, steps, interval), steps, *commands, *samples}
    )
    passages, astray = Passages(model, setup), ""
    limits, count, excess_end, is_lost = setup, 0, 0.0, False
    peak_speed = 0.0
    for stop in (stop for stop in stops if stop <= steps):
        try:
            if stop > count:
                watch_steps(model, data, stop - count, passages)
        except mujoco.FatalError:  # MuJoCo does not run it
            reason = "MuJoCo does not run it"
            return StabilityTrial(timestep, RunStatus.DIVERGED, reason, reason)
        count, now = stop, update_peaks(data, Peaks())
        if not count:  # before the first step MuJoCo has computed no energy: it says 0
            now = replace(now, energy=-math.inf)
        if count <= _TRANSIENT:
            fastest = max(limits.velocity_bound, now.velocity)
            most = max(limits.energy_bound, now.energy)
            limits = replace(limits, velocity_bound=fastest, energy_bound=most)
        excess_end = excess_end if now.is_within(setup) else count * timestep
        is_lost = not now.is_within(limits) or has_bad_state(data)
        if is_lost or (count > max(commands) and now.velocity < _AT_REST * peak_speed):
            break
        peak_speed = max(peak_speed, now.velocity)
        if motion is not None and count in samples and not astray:
            distance = motion.distance(model, data, samples[count])
            if not distance < 1:
                astray = f"off by {motion.far} at {data.time:.3g} s"
                astray += _LATE if late and late[0] < data.time else ""
        if stop in commands:
            commands[stop].give(data)
    is_lost = is_lost or excess_end > _DECAY * span  # it shot up, and has not come down
    judgement = judge(data, now, setup if is_lost else limits)
    status, reason = judgement.status, "; ".join(judgement.reasons)
    if is_lost and status is RunStatus.OK:
        status, reason = RunStatus.SLOW_GROWTH, "what shot up in the first steps did not come down"
    through = "; ".join(passages.texts())
    astray = astray or ("it is lost" if is_lost else "")
    return StabilityTrial(timestep, status, reason, astray, through)


def _nearest_samples(times: Sequence[float], timestep: float) -> dict[int, int]:
    """By the number of steps after the start the sample that is nearest to their time.

    A state is moved to that time as if it had no acceleration: a longer way would count as an error
    of the run.
    """
    counts = [round(time / timestep) for time in times]
    ways = [abs(time - count * timestep) for time, count in zip(times, counts, strict=True)]
    nearest_last = sorted(range(len(times)), key=lambda n: -ways[n])
    return {counts[n]: n for n in nearest_last if counts[n]}
