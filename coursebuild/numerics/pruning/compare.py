"""Two models in the same scenario: whether they do the same, bit for bit or nearly.

Entry points: `compare(base, changed, mapping, cases)`, `watch`; `cases(model, declared, quick=…)`,
the scenarios that a smaller model is judged by, at the model's own timestep.

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

from coursebuild.core.model.scenarios import Declarations
from coursebuild.numerics.detector import Peaks, RunJudgement, judge, peaks
from coursebuild.numerics.engine import advance, initial_data
from coursebuild.numerics.problem import Scenario, Setup, whole_number
from coursebuild.numerics.pruning.mapping import Mapping, transfer
from coursebuild.numerics.scene import scenes, thickness

QUICK = 0.5
"""Seconds at most of a scenario where it should be quick."""
TOLERANCE = 1e-8
"""What counts as equal: relative to a number's size, absolute where that is under 1."""
SHOTS, SHOT = 0.1, 0.05
"""Seconds from one start to the next, and that each lasts."""
_CONTACTS = 10
"""Steps from one look at the contacts to the next."""


class Case(Struct, frozen=True):
    """A scenario of a model."""

    name: str
    scenario: Scenario
    steps: int
    hold: int = 0
    """Steps for which a command holds; 0 where there is one command at most."""
    declared: bool = False

    @property
    def setup(self) -> Setup:
        """What a run must know of it."""
        return Setup(scenario=self.scenario)

    def command(self, step: int) -> tuple[float, ...]:
        """The command that begins with this step, from 0; empty where the last one holds."""
        number, rest = divmod(step, self.hold or self.steps + 1)
        rows = self.scenario.controls
        return () if rest or number >= len(rows) else rows[number]


def cases(model: Any, declared: Declarations | None, *, quick: bool) -> tuple[Case, ...]:
    """What happens to a model, declared or by default.

    Raises:
        SceneError: a scenario does not fit the model.
    """
    found = []
    for one in scenes(model, declared, quick=quick):
        what, step = one.scenario, one.own
        steps = whole_number(what.duration, step, "the duration", "the timestep")
        if quick:
            steps = min(steps, max(1, round(QUICK / step)))
        hold = whole_number(what.hold, step, "the hold", "the timestep") if what.hold else 0
        found.append(Case(one.name, what, steps, hold, one.declared is not None))
    if found:
        return tuple(found)
    # In a model in which nothing moves there is nothing to measure, but things to be without.
    step = float(model.opt.timestep)
    return (Case("start", Scenario(10 * step, step), 10),)


class MotionComparison(Struct, frozen=True):
    """How a changed model did in all scenarios."""

    identical: bool
    difference: float
    """The largest, within 50 ms; 0 where all bits are the same, infinite where it was lost."""

    @property
    def equal(self) -> bool:
        """Whether the difference is within the tolerance."""
        return self.difference <= TOLERANCE


def quiet(model: Any) -> Any:
    """The model with automatic reset off."""
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
    return model


def compare(base: Any, changed: Any, mapping: Mapping, cases: Sequence[Case]) -> MotionComparison:
    """Run both in all the scenarios.

    Raises:
        ValueError: a state cannot be brought from one to the other.
    """
    quiet(base), quiet(changed)
    identical, difference = True, 0.0
    for case in cases:
        if _same_bits(base, changed, mapping, case):
            continue
        identical = False
        difference = max(difference, _shots(base, changed, mapping, case))
        if math.isinf(difference):
            break
    return MotionComparison(identical, difference)


def _both(base: Any, changed: Any, mapping: Mapping, case: Case) -> tuple[Any, Any]:
    data = initial_data(case.setup, base)
    other = mujoco.MjData(changed)
    transfer(base, data, mapping, changed, other)
    return data, other


def _command(case: Case, step: int, data: Any, other: Any, mapping: Mapping | None) -> None:
    given = case.command(step)
    if given:
        data.ctrl[:] = given
        if mapping is not None:
            other.ctrl[:] = data.ctrl[mapping.ctrl]


def _same_bits(base: Any, changed: Any, mapping: Mapping, case: Case) -> bool:
    data, other = _both(base, changed, mapping, case)
    end = float(other.time) + case.steps * float(changed.opt.timestep)
    for step in range(case.steps):
        _command(case, step, data, other, mapping)
        advance(base, data)
        advance(changed, other)
        if not _equal_bits(data, other, mapping):
            return False
        if step % _CONTACTS == 0 and not _equal_contacts(base, data, changed, other, mapping):
            return False
    return judge(changed, other, end).ok


def _equal_bits(data: Any, other: Any, mapping: Mapping) -> bool:
    return bool(
        data.qpos[mapping.qpos].tobytes() == other.qpos.tobytes()
        and data.qvel[mapping.dof].tobytes() == other.qvel.tobytes()
        and data.act[mapping.act].tobytes() == other.act.tobytes()
        and data.sensordata[mapping.sensor].tobytes() == other.sensordata.tobytes()
    )


def _equal_contacts(base: Any, data: Any, changed: Any, other: Any, mapping: Mapping) -> bool:
    """Whether the geoms that are left touch alike, with the same forces."""
    left = {int(whole): i for i, whole in enumerate(mapping.geom)}
    mine = []
    for pair, index in _touching(data):
        if all(geom < 0 or geom in left for geom in pair):
            named = tuple(left.get(geom, -1) for geom in pair)
            mine.append((named, *_contact(base, data, index)))
    his = [(pair, *_contact(changed, other, index)) for pair, index in _touching(other)]
    return sorted(mine) == sorted(his)


def _touching(data: Any) -> list[tuple[tuple[int, ...], int]]:
    pairs = data.contact.geom[: data.ncon]
    return [(tuple(int(geom) for geom in pair), i) for i, pair in enumerate(pairs)]


def _contact(model: Any, data: Any, index: int) -> tuple[bytes, bytes]:
    force = np.zeros(6)
    mujoco.mj_contactForce(model, data, index, force)
    return data.contact.dist[index].tobytes(), force.tobytes()


def _shots(base: Any, changed: Any, mapping: Mapping, case: Case) -> float:
    """How far the changed model is from the base within 50 ms, from states of the base run."""
    data, other = _both(base, changed, mapping, case)
    timestep = float(base.opt.timestep)
    every, length = max(1, round(SHOTS / timestep)), max(1, round(SHOT / timestep))
    worst = 0.0
    for step in range(case.steps):
        _command(case, step, data, other, mapping)
        at = step % every
        if at == 0:
            transfer(base, data, mapping, changed, other)
        advance(base, data)
        if at < length:
            advance(changed, other)
            worst = max(worst, _apart(data, other, mapping))
            if not math.isfinite(worst):
                return math.inf
    if not judge(changed, other, float(other.time)).ok:
        return math.inf
    return worst


def _apart(data: Any, other: Any, mapping: Mapping) -> float:
    worst = 0.0
    for mine, his in (
        (data.qpos[mapping.qpos], other.qpos),
        (data.qvel[mapping.dof], other.qvel),
        (data.act[mapping.act], other.act),
        (data.sensordata[mapping.sensor], other.sensordata),
    ):
        if len(his):
            found = float(np.max(np.abs(mine - his) / np.maximum(1.0, np.abs(mine))))
            worst = found if not found <= worst else worst
    return math.inf if math.isnan(worst) else worst


class Seen(Struct, frozen=True, eq=False):
    """What a run of the whole model showed."""

    case: Case
    judgement: RunJudgement
    touching: frozenset[tuple[int, int]]
    """Pairs of geoms between which there was a contact."""
    constrained: bool
    """Whether a constraint was ever active."""
    low: np.ndarray[Any, Any]
    """(nbody, 3) m: least coordinates of the bodies' centres of mass in the world."""
    high: np.ndarray[Any, Any]
    """(nbody, 3) m: largest."""
    iterations: int
    """Most that the solver took."""


def watch(model: Any, case: Case) -> Seen:
    """Run the whole model once."""
    quiet(model)
    data = initial_data(case.setup, model)
    start, made = float(data.time), 0
    mujoco.mj_kinematics(model, data)
    low, high = data.xipos.copy(), data.xipos.copy()
    touching: set[tuple[int, int]] = set()
    seen, constrained, iterations = Peaks(), False, 0
    thick = thickness(model)
    for step in range(case.steps):
        _command(case, step, data, None, None)
        advance(model, data)
        made += 1
        np.minimum(low, data.xipos, out=low)
        np.maximum(high, data.xipos, out=high)
        if data.nefc:
            constrained = True
            iterations = max(iterations, int(data.solver_niter.max(initial=0)))
        if data.ncon:
            touching |= {(min(p), max(p)) for p in data.contact.geom[: data.ncon].tolist()}
        seen = peaks(data, seen, thick)
        if not seen.finite:
            break
    end = start + made * float(model.opt.timestep)
    judgement = judge(model, data, end, seen)
    return Seen(case, judgement, frozenset(touching), constrained, low, high, iterations)
