"""Whether a simulation went well: divergence never passes as success.

Entry points: `Observation`, `observe`, `judge`.

1. MuJoCo resets a state that has become huge or no number, and carries on: a run that blew up can
   end in its initial state, with no error at all. Only the warning counters and the clock tell.
2. A slow growth raises no warning for a long time: the state is compared with what can be.
3. Bodies that were pushed deep into each other raise none either.
"""

from __future__ import annotations

import enum
from typing import Any

import mujoco
import numpy as np

from coursebuild.physics.problem import Array
from coursebuild.values import dataclass

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


@dataclass(frozen=True, slots=True)
class Observation:
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


@dataclass(frozen=True, slots=True)
class Judgement:
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


def observe(
    model: Any,
    data: Any,
    elapsed: float,
    *,
    qpos: Array | None = None,
    qvel: Array | None = None,
    bounds: tuple[float, float] = (float("inf"), float("inf")),
    penetration: float | None = None,
    deepest: float = float("inf"),
) -> Observation:
    """What is to be seen of a run when it has ended.

    `qpos` and `qvel` are all states seen on the way, (n, nq) and (n, nv), where there are any;
    `bounds` the largest |qpos| (m, rad) and |qvel| (m/s, rad/s) that can be; `penetration` the
    deepest contact seen on the way, m, and `deepest` the deepest that is no fault.
    """
    seen_qpos = data.qpos if qpos is None else qpos
    seen_qvel = data.qvel if qvel is None else qvel
    depth = deepest_contact(data) if penetration is None else penetration
    finite = bool(np.isfinite(seen_qpos).all() and np.isfinite(seen_qvel).all())
    counts = [int(data.warning[int(kind)].number) for kind in BAD]
    return Observation(
        warnings=(counts[0], counts[1], counts[2]),
        clock=float(data.time),
        elapsed=elapsed,
        timestep=float(model.opt.timestep),
        finite=finite,
        position=_largest(seen_qpos) / bounds[0],
        velocity=_largest(seen_qvel) / bounds[1],
        penetration=depth / deepest,
    )


def _largest(values: Array) -> float:
    return float(np.max(np.abs(values), initial=0.0))


def deepest_contact(data: Any) -> float:
    """How deep bodies lie in each other now, m; 0 where nothing touches."""
    if data.ncon == 0:
        return 0.0
    return max(0.0, -float(np.min(data.contact.dist[: data.ncon])))
