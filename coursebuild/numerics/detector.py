"""Whether a simulation went well: divergence never passes as success.

Entry points: `Peaks`, `Observation`, `observe`, `judge`.

1. MuJoCo resets a state that has become huge or no number, and carries on: a run that blew up can
   end in its initial state, with no error at all. Only the warning counters and the clock tell.
2. A slow growth raises no warning for a long time: the state is compared with what can be.
3. A state may shoot up and come back: the most that was seen on the way counts, not only the end.
4. Bodies that were pushed deep into each other raise none either.
"""

from __future__ import annotations

import enum
import math
from typing import Any

import mujoco
import numpy as np
from msgspec import Struct

from coursebuild.numerics.problem import Array

BAD = (
    mujoco.mjtWarning.mjWARN_BADQPOS,
    mujoco.mjtWarning.mjWARN_BADQVEL,
    mujoco.mjtWarning.mjWARN_BADQACC,
)
"""The warnings of a simulation that is lost."""


class Status(enum.Enum):
    """How a run went."""

    OK = "ok"
    SLOW_GROWTH = "slow-growth"
    """No warning, but the state left the range of what can be."""
    DIVERGED = "diverged"
    """MuJoCo warned of a huge acceleration, velocity or position, or the state is no number."""
    RESET = "reset"
    """MuJoCo put the state back to its beginning on the way: the end says nothing."""


class Observation(Struct, frozen=True):
    """What was seen of a run."""

    warnings: tuple[int, int, int]
    """How often MuJoCo warned of bad positions, velocities and accelerations."""
    clock: float
    """`mjData.time` at the end, s."""
    elapsed: float
    """Steps done times the timestep, and the time at the beginning, s."""
    timestep: float
    finite: bool
    """Whether all positions and velocities are numbers."""
    position: float
    """Largest |qpos| seen, relative to the largest that can be."""
    velocity: float
    """The same of |qvel|."""
    penetration: float = 0.0
    """Deepest contact seen, relative to the deepest that is no fault."""


class Judgement(Struct, frozen=True):
    """How a run went, and what shows it, in words."""

    status: Status
    reasons: tuple[str, ...] = ()

    @property
    def ok(self) -> bool:
        """Whether the run may be used."""
        return self.status is Status.OK


_SAID = ("positions", "velocities", "accelerations")


def judge(seen: Observation) -> Judgement:
    """The worst that an observation shows, with every reason for it."""
    reasons: list[str] = []
    found = [Status.OK]
    if not seen.finite:
        found.append(Status.DIVERGED)
        reasons.append("the state is not finite")
    for count, what in zip(seen.warnings, _SAID, strict=True):
        if count:
            found.append(Status.DIVERGED)
            reasons.append(f"MuJoCo warned of bad {what}")
    if not abs(seen.clock - seen.elapsed) <= seen.timestep / 2:
        found.append(Status.RESET)
        reasons.append(
            f"the clock says {seen.clock:.6g} s after {seen.elapsed:.6g} s: the state was reset"
        )
    for size, what in ((seen.position, "positions"), (seen.velocity, "velocities")):
        if seen.finite and not size <= 1.0:
            found.append(Status.SLOW_GROWTH)
            reasons.append(f"{what} reached {size:.3g} times what can be")
    if not seen.penetration <= 1.0:
        found.append(Status.DIVERGED)
        reasons.append(f"bodies lie {seen.penetration:.3g} times as deep in each other as they may")
    return Judgement(max(found, key=_WORSE.index), tuple(reasons))


_WORSE = (Status.OK, Status.SLOW_GROWTH, Status.DIVERGED, Status.RESET)


class Peaks(Struct, frozen=True):
    """The most that was seen on the way."""

    position: float = 0.0
    """Largest |qpos|, m or rad; no number once one of them is none."""
    velocity: float = 0.0
    """Largest |qvel|, m/s or rad/s; no number once one of them is none."""
    penetration: float = 0.0
    """Deepest contact, m."""
    sunk: float = 0.0
    """The same relative to the half thickness of the thinner body, where thicknesses are known: at
    1 its middle is at the other's surface."""

    @property
    def finite(self) -> bool:
        """Whether all positions and velocities were numbers."""
        return math.isfinite(self.position) and math.isfinite(self.velocity)


NO_BOUNDS = Peaks(float("inf"), float("inf"), float("inf"))


def peaks(data: Any, before: Peaks, thickness: Array | None = None) -> Peaks:
    """The most that was seen, with what is there now.

    `thickness`: half the thickness of every geom, and a last one for what is none (ngeom + 1,), m.
    """
    return Peaks(
        _more(before.position, data.qpos),
        _more(before.velocity, data.qvel),
        max(before.penetration, deepest_contact(data)),
        before.sunk if thickness is None else max(before.sunk, _sunk(data, thickness)),
    )


def _sunk(data: Any, thickness: Array) -> float:
    if data.ncon == 0:
        return 0.0
    contact = data.contact
    thinner = thickness[contact.geom].min(axis=1)  # the number of what is no geom is -1
    return max(0.0, float(np.max(-contact.dist / thinner)))


def _more(before: float, values: Array) -> float:
    now = float(np.abs(values).max(initial=0.0))
    return before if before >= now or math.isnan(before) else now


def observe(
    model: Any,
    data: Any,
    elapsed: float,
    *,
    seen: Peaks | None = None,
    bounds: Peaks = NO_BOUNDS,
) -> Observation:
    """What is to be seen of a run when it has ended, after `elapsed` s.

    `seen` is the most that was seen on the way, `bounds` the most that can be.
    """
    most = peaks(data, Peaks() if seen is None else seen)
    counts = [int(data.warning[int(kind)].number) for kind in BAD]
    return Observation(
        warnings=(counts[0], counts[1], counts[2]),
        clock=float(data.time),
        elapsed=elapsed,
        timestep=float(model.opt.timestep),
        finite=most.finite,
        position=most.position / bounds.position,
        velocity=most.velocity / bounds.velocity,
        penetration=max(most.penetration / bounds.penetration, most.sunk),
    )


def deepest_contact(data: Any) -> float:
    """How deep bodies lie in each other now, m; 0 where nothing touches."""
    if data.ncon == 0:
        return 0.0
    return max(0.0, -float(np.min(data.contact.dist[: data.ncon])))
