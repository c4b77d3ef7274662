"""Whether a simulation went well: divergence never passes as success.

Entry points: `judge(model, data, elapsed, seen, setup)`, `peaks`; `driving_force`, why energy may
rise.

1. MuJoCo resets a state that has become huge or no number, and carries on: a run that blew up can
   end in its initial state, with no error at all. Only the warning counters and the clock tell.
2. A slow growth raises no warning for a long time: the state is compared with what can be.
3. A state may shoot up and come back: the most that was seen on the way counts, not only the end.
4. Bodies that were pushed deep into each other raise none either.
5. Where nothing drives the motion, potential and kinetic energy together are conserved or fall: a
   run that has many times as much is lost, however finite it stays.
"""

from __future__ import annotations

import enum
import math
from typing import Any

import mujoco
import numpy as np
from msgspec import Struct

from coursebuild.numerics.problem import Array, Scenario, Setup

_BAD = {
    mujoco.mjtWarning.mjWARN_BADQPOS: "positions",
    mujoco.mjtWarning.mjWARN_BADQVEL: "velocities",
    mujoco.mjtWarning.mjWARN_BADQACC: "accelerations",
}
"""The warnings of a simulation that is lost."""


class RunStatus(enum.Enum):
    """How a run went, the worst last."""

    OK = "ok"
    SLOW_GROWTH = "slow-growth"
    """No warning, but the state left the range of what can be."""
    DIVERGED = "diverged"
    """MuJoCo warned of a huge acceleration, velocity or position, or the state is no number."""
    RESET = "reset"
    """MuJoCo put the state back to its beginning on the way: the end says nothing."""


class RunJudgement(Struct, frozen=True):
    """How a run went, and what shows it, in words."""

    status: RunStatus
    reasons: tuple[str, ...] = ()

    @property
    def ok(self) -> bool:
        """Whether the run may be used."""
        return self.status is RunStatus.OK


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
    energy: float = -math.inf
    """Potential and kinetic, J, where MuJoCo computes it: of the state before the last step."""
    kinetic: float = 0.0
    """J."""

    @property
    def finite(self) -> bool:
        """Whether all positions and velocities were numbers."""
        return math.isfinite(self.position) and math.isfinite(self.velocity)

    def within(self, setup: Setup) -> bool:
        """Whether it can be."""
        return (
            self.finite
            and self.position <= setup.position_bound
            and self.velocity <= setup.velocity_bound
            and self.energy <= setup.energy_bound
            and self.penetration <= setup.penetration_bound
            and self.sunk <= 1.0
        )


_UNBOUNDED = Setup(scenario=Scenario(0.0, 0.0))


def peaks(data: Any, before: Peaks, thickness: Array | None = None) -> Peaks:
    """The most that was seen, with what is there now.

    `thickness`: half the thickness of every geom, and a last one for what is none (ngeom + 1,), m.
    """
    return Peaks(
        _more(before.position, data.qpos),
        _more(before.velocity, data.qvel),
        max(before.penetration, deepest_contact(data)),
        before.sunk if thickness is None else max(before.sunk, _sunk(data, thickness)),
        max(before.energy, float(data.energy.sum())),
        max(before.kinetic, float(data.energy[1])),
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


def judge(
    model: Any, data: Any, elapsed: float, seen: Peaks | None = None, setup: Setup = _UNBOUNDED
) -> RunJudgement:
    """The worst that a run shows when it has ended after `elapsed` s, with every reason for it.

    `seen` is the most that was seen on the way, `setup` says what can be.
    """
    most = peaks(data, Peaks() if seen is None else seen)
    shown: list[tuple[RunStatus, str]] = []
    if not most.finite:
        shown.append((RunStatus.DIVERGED, "the state is not finite"))
    for kind, what in _BAD.items():
        if data.warning[int(kind)].number:
            shown.append((RunStatus.DIVERGED, f"MuJoCo warned of bad {what}"))
    if not abs(data.time - elapsed) <= model.opt.timestep / 2:
        said = f"the clock says {data.time:.6g} s after {elapsed:.6g} s: the state was reset"
        shown.append((RunStatus.RESET, said))
    for size, bound, what in (
        (most.position, setup.position_bound, "positions"),
        (most.velocity, setup.velocity_bound, "velocities"),
    ):
        if most.finite and not size <= bound:
            said = f"{what} reached {size / bound:.3g} times what can be"
            shown.append((RunStatus.SLOW_GROWTH, said))
    if most.finite and not most.energy <= setup.energy_bound:
        said = f"energy reached {most.energy:.3g} J, where {setup.energy_bound:.3g} J can be"
        shown.append((RunStatus.SLOW_GROWTH, said))
    deep = max(most.penetration / setup.penetration_bound, most.sunk)
    if not deep <= 1.0:
        said = f"bodies lie {deep:.3g} times as deep in each other as they may"
        shown.append((RunStatus.DIVERGED, said))
    worst = max((status for status, _ in shown), key=list(RunStatus).index, default=RunStatus.OK)
    return RunJudgement(worst, tuple(said for _, said in shown))


def deepest_contact(data: Any) -> float:
    """How deep bodies lie in each other now, m; 0 where nothing touches."""
    if data.ncon == 0:
        return 0.0
    return max(0.0, -float(np.min(data.contact.dist[: data.ncon])))


def driving_force(model: Any, scenario: Scenario) -> str:
    """What may raise the energy of a motion, or stores some that is not counted; empty: nothing."""
    commanded = np.any(scenario.controls) or (
        scenario.keyframe >= 0 and np.any(model.key_ctrl[scenario.keyframe])
    )
    acting = model.nu and not model.opt.disableflags & int(mujoco.mjtDisableBit.mjDSBL_ACTUATION)
    damping = model.dof_damping, model.tendon_damping
    fluid = model.opt.density > 0 or model.opt.viscosity > 0
    found = (
        (acting and (commanded or model.na or np.any(model.actuator_biastype)), "actuators act"),
        (fluid and np.any(model.opt.wind), "wind blows"),
        (np.any(model.body_gravcomp), "gravity is compensated"),
        (min(np.min(one, initial=0) for one in damping) < 0, "damping is negative"),
        (model.nflex, "a flex stores energy"),
        (model.nplugin, "a plugin acts"),
    )
    return ", ".join(words for there, words in found if there)
