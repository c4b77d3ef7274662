"""Runs of a model over a span, and what ends in them: bounds, nearness, passing through.

And up to which delay a controller in the loop does what it does without it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
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
from mjbench.simulation import (
    EngineStates,
    initial_data,
    nudged,
    runnable,
    simulate,
    watch_steps,
)

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
    steps = math.ceil(span / timestep * (1 - 1e-12))
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
        except mujoco.FatalError:
            reason = "MuJoCo does not run it"
            return StabilityTrial(timestep, RunStatus.REFUSED, reason, reason)
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


def bisect(
    is_lost: Callable[[float], bool],
    grid: Sequence[float],
    resolution: float,
    reach: float = 10.0,
    enough: float = 0.0,
    snap: Callable[[float], float] = float,
) -> float:
    """The largest timestep below which none is lost: infinite for all of the grid, 0 for none.

    The grid is tried from above, down to `1 / reach` of the shortest that is lost, or to `enough`
    (s) where none is. `snap`: as of a `Laboratory`.
    """
    lost = math.inf
    stable = 0.0
    for step in reversed(grid):
        if step < (enough if math.isinf(lost) else lost / reach):
            break
        if is_lost(step):
            lost, stable = step, 0.0
        elif not stable:
            stable = step
    if math.isinf(lost) or not stable:
        return math.inf if math.isinf(lost) else 0.0
    while lost / stable > 1 + resolution:
        middle = snap(math.sqrt(lost * stable))
        if middle <= stable:  # none that is tried lies between
            break
        lost, stable = (middle, stable) if is_lost(middle) else (lost, middle)
    return stable


def _nearest_samples(times: Sequence[float], timestep: float) -> dict[int, int]:
    """By the number of steps after the start the sample that is nearest to their time.

    A state is moved to that time as if it had no acceleration: a longer way would count as an error
    of the run.
    """
    counts = [round(time / timestep) for time in times]
    ways = [abs(time - count * timestep) for time, count in zip(times, counts, strict=True)]
    nearest_last = sorted(range(len(times)), key=lambda n: -ways[n])
    return {counts[n]: n for n in nearest_last if counts[n]}


_COUNT, _RESOLUTION = 16, 1e-2
"""The delays that are tried in a decade, and the relative width at which a bisection ends; from one
half of a run to the other, what grows by less does not grow."""
_LONGEST_DELAY = 0.25
"""The longest delay that is tried, relative to the scenario."""


def loop_note(model: Any, pilot: Pilot, reference: EngineStates) -> str:
    """Up to which delay a controller does what it does at the scenario's own, in words.

    At the model's own timestep and integrator; `reference`: the motion of small steps. A loop that
    grows slowly is within its bounds for as long as a run lasts, so it is asked whether a run from
    nearby goes away from it, unless one does without more delay.
    """
    scene = pilot.scene
    loop = scene.scenario.loop
    assert loop is not None
    motion = kept_motion(model, pilot, reference)
    variant = runnable(model)

    def setup(delay: float) -> Setup:
        late = replace(loop, delay=loop.delay + delay)
        return replace(pilot.setup, scenario=replace(scene.scenario, loop=late))

    @cache
    def trial(delay: float) -> StabilityTrial:
        return run_trial(setup(delay), variant, scene.scenario.duration, motion)

    is_calm = not _grows(variant, setup(0.0))

    def is_lost(delay: float) -> bool:
        return not trial(delay).stable or (is_calm and _grows(variant, setup(delay)))

    most = max(_LONGEST_DELAY * scene.scenario.duration, 2 * scene.timestep)
    count = max(2, round(_COUNT * math.log10(most / scene.timestep)) + 1)
    grid: list[float] = np.geomspace(scene.timestep, most, count).tolist()
    bounds = []
    for is_off in (is_lost, lambda delay: bool(trial(delay).astray)):
        is_off_already = is_off(0.0)
        largest = 0.0 if is_off_already else bisect(is_off, grid, _RESOLUTION, math.inf)
        delay = f"{loop.delay + min(largest, most):.3g} s"
        bounds.append(
            f"at every delay tried, up to {delay}"
            if math.isinf(largest)
            else f"up to a delay of {delay}"
            if largest
            else "at no delay, not even its own"
            if is_off_already
            else f"at no delay longer than {loop.delay:.3g} s"
        )
    span = f"for the {scene.scenario.duration:.3g} s of the scenario"
    clause = "small differences stay small"
    if not is_calm:
        clause = f"small differences do not fade at its own delay, and it stays bounded {span}"
    return (
        f"with {Path(loop.path).name} every {loop.period:.3g} s {clause} {bounds[0]}, and it stays "
        f"near the motion of small steps {span if is_calm else 'for as long'} {bounds[1]}, at the "
        "scene's own setting"
    )


def _grows(model: Any, setup: Setup) -> bool:
    """Whether a run from nearby goes farther from the scenario's own in its second half."""
    aside = nudged(setup.scenario, model, nudges(model, 2, NEARBY)[0])
    states = simulate(replace(setup, scenario=aside), model).states
    differences = states.qvel - simulate(setup, model).states.qvel
    first, second = np.array_split(differences, 2)
    return not np.linalg.norm(second) <= (1 + _RESOLUTION) * np.linalg.norm(first)
