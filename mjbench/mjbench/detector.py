"""Whether a simulation went well: divergence never passes as success.

1. MuJoCo may reset a state that has become huge or no number, and carry on: a run that blew up can
   end in its initial state, with no error at all. Only the warning counters tell.
2. A slow growth raises no warning for a long time: the state is compared with what can be.
3. A state may shoot up and come back: the peaks on the way count, not only the end.
4. Bodies that go through each other raise no warning either. Depth alone is no loss: what is soft
   gives way, rests and rolls on. Lost is what comes out on the other side, or stays inside.
5. Where nothing drives the motion, potential and kinetic energy together are conserved or fall: a
   run that has many times as much is lost, however finite it stays.
"""

from __future__ import annotations

import enum
import math
from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np
from msgspec import Struct

from mjbench.problem import Array, Scenario, Setup

BAD_STATES = {
    int(mujoco.mjtWarning.mjWARN_BADQPOS): "positions",
    int(mujoco.mjtWarning.mjWARN_BADQVEL): "velocities",
    int(mujoco.mjtWarning.mjWARN_BADQACC): "accelerations",
    int(mujoco.mjtWarning.mjWARN_BADCTRL): "commands",
}
"""The warnings of a simulation that is lost. Where one command is no number, MuJoCo takes all as 0.
"""


def has_bad_state(data: Any) -> bool:
    """Whether MuJoCo has warned of a state that is lost."""
    numbers = data.warning.number.tolist()  # seven times as fast as to look up single warnings
    return any(numbers[kind] for kind in BAD_STATES)


class RunStatus(enum.Enum):
    """How a run went, the worst last."""

    OK = "ok"
    THROUGH = "through"
    """Something went through something else, which does not happen in small steps."""
    SLOW_GROWTH = "slow-growth"
    """No warning, but the state left the range of what can be."""
    DIVERGED = "diverged"
    """MuJoCo warned of a huge acceleration, velocity or position, or the state is no number."""
    REFUSED = "refused"
    """MuJoCo does not run the model under this setting."""


class RunJudgement(Struct, frozen=True):
    """How a run went, and the reasons in words."""

    status: RunStatus
    reasons: tuple[str, ...] = ()

    @property
    def ok(self) -> bool:
        """Whether the run may be used."""
        return self.status is RunStatus.OK


class Peaks(Struct, frozen=True):
    """The largest values of a run so far."""

    position: float = 0.0
    """Largest |qpos|, m or rad; NaN once one was NaN."""
    velocity: float = 0.0
    """Largest |qvel|, m/s or rad/s; NaN once one was NaN."""
    penetration: float = 0.0
    """Deepest contact, m."""
    sunk: float = 0.0
    """The same relative to the half thickness of the thinner body, where thicknesses are known: at
    1 its middle is at the other's surface."""
    energy: float = -math.inf
    """Potential and kinetic, J: under RK4 of the state, else of that before the last step, where
    MuJoCo computes it."""
    kinetic: float = 0.0
    """J."""

    @property
    def finite(self) -> bool:
        """Whether all positions and velocities were numbers."""
        return math.isfinite(self.position) and math.isfinite(self.velocity)

    def is_within(self, setup: Setup) -> bool:
        """Whether all peaks are within the bounds of a setup."""
        return (
            self.finite
            and self.position <= setup.position_bound
            and self.velocity <= setup.velocity_bound
            and self.energy <= setup.energy_bound
        )


_UNBOUNDED = Setup(scenario=Scenario(0.0, 0.0))


def update_peaks(data: Any, before: Peaks, thickness: Array | None = None) -> Peaks:
    """The peaks before, raised by the state in `data`.

    `thickness`: half the thickness of every geom (ngeom + 1,), m; the last is for index -1, which
    stands for no geom.
    """
    if data.model.opt.integrator == mujoco.mjtIntegrator.mjINT_RK4:
        # Contacts and energy are those of the last stage of a step, which is no state.
        for compute in (
            mujoco.mj_fwdPosition,
            mujoco.mj_fwdVelocity,
            mujoco.mj_energyPos,
            mujoco.mj_energyVel,
        ):
            compute(data.model, data)
    penetration, sunk = before.penetration, before.sunk
    if data.ncon:
        depths = -data.contact.dist
        penetration = max(penetration, float(depths.max()))
        if thickness is not None:
            shares = depths / thickness[data.contact.geom].min(axis=1)
            sunk = max(sunk, float(shares.max()))
    return Peaks(
        _larger(before.position, data.qpos),
        _larger(before.velocity, data.qvel),
        penetration,
        sunk,
        max(before.energy, float(data.energy[0] + data.energy[1])),
        max(before.kinetic, float(data.energy[1])),
    )


def _larger(before: float, values: Array) -> float:
    now = float(np.abs(values).max(initial=0.0))
    return before if before >= now or math.isnan(before) else now


def judge(
    data: Any,
    before: Peaks | None = None,
    setup: Setup = _UNBOUNDED,
    passages: Sequence[str] = (),
) -> RunJudgement:
    """The worst status of a run that has ended, with every reason for it.

    `before` holds the peaks on the way, `setup` the bounds, `passages` what went through what.
    """
    peaks = update_peaks(data, Peaks() if before is None else before)
    symptoms: list[tuple[RunStatus, str]] = []
    if not peaks.finite:
        symptoms.append((RunStatus.DIVERGED, "the state is not finite"))
    if bad := [subject for kind, subject in BAD_STATES.items() if data.warning[kind].number]:
        symptoms.append((RunStatus.DIVERGED, f"MuJoCo warned of bad {', '.join(bad)}"))
    for size, bound, subject in (
        (peaks.position, setup.position_bound, "positions"),
        (peaks.velocity, setup.velocity_bound, "velocities"),
    ):
        if peaks.finite and not size <= bound:
            times = "a little more than" if size < 1.005 * bound else f"{size / bound:.3g} times"
            symptoms.append((RunStatus.SLOW_GROWTH, f"{subject} reached {times} their bound"))
    if peaks.finite and not peaks.energy <= setup.energy_bound:
        text = f"energy reached {peaks.energy:.3g} J, and its bound is {setup.energy_bound:.3g} J"
        symptoms.append((RunStatus.SLOW_GROWTH, text))
    symptoms += [(RunStatus.THROUGH, text) for text in passages]
    worst = max((status for status, _ in symptoms), key=list(RunStatus).index, default=RunStatus.OK)
    return RunJudgement(worst, tuple(text for _, text in symptoms))


def pair_of(contact: Any) -> tuple[int, int]:
    """The numbers of the two geoms that touch in a contact; -1 for what is none."""
    return int(contact.geom[0]), int(contact.geom[1])


def pair_names(model: Any, pair: tuple[int, int]) -> str:
    """What the two bodies are called that two geoms belong to."""
    return " and ".join(_body_of(model, geom) for geom in pair)


class Passages:
    """Watches pairs of geoms that go deep into each other, and tells which went through.

    Deep is what lies in the other by more than half the thickness of the thinner one, and than in
    small steps. The side on which it entered is that of its contact's normal before.
    """

    def __init__(self, model: Any, setup: Setup = _UNBOUNDED) -> None:
        self.model, self.setup = model, setup
        self.thickness = thickness(model)
        self._shallow = _DIPPING * self.thickness.min()
        """What is no deeper than this is no dip into anything, m."""
        self.through: dict[tuple[int, int], float] = {}
        """Pairs that parted on the other side, and when, s."""
        self.inside: dict[tuple[int, int], Array] = {}
        """Pairs that are deep in each other now, with the normal of their contact before."""
        self._normals: dict[tuple[int, int], Array] = {}
        kinds, partners = model.geom_contype, model.geom_conaffinity
        may_touch = np.bitwise_or.reduce(kinds) & np.bitwise_or.reduce(partners) and model.ngeom > 1
        is_off = model.opt.disableflags & int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
        self.needed = bool((may_touch or model.npair) and not is_off)
        """Whether anything can touch: then every step is looked at, as what is thin is passed
        between two looks."""

    def look(self, data: Any) -> None:
        """Look at a state whose contacts are computed."""
        if not (data.ncon or self.inside):
            return
        if not self.inside and data.contact.dist.min() >= -self._shallow:
            return
        present: dict[tuple[int, int], tuple[float, Array]] = {}
        geoms = data.contact.geom
        shares = -data.contact.dist / self.thickness[geoms].min(axis=1) if data.ncon else ()
        for number in np.flatnonzero(np.asarray(shares) > _DIPPING).tolist():
            first, second = (int(geom) for geom in geoms[number])
            share = float(shares[number])
            if first >= 0 and share > present.get((first, second), (0.0,))[0]:
                turn = data.geom_xmat[first].reshape(3, 3)
                normal = turn.T @ data.contact.frame[number, :3]
                present[first, second] = share, normal
        for pair, (share, normal) in present.items():
            if share > self.setup.sunk_bound:
                self.inside.setdefault(pair, self._normals.get(pair, normal))
                continue
            side = self.inside.pop(pair, None)
            if side is not None and side @ normal < 0:
                self.through.setdefault(pair, float(data.time))
            self._normals[pair] = normal
        for pair in self.inside.keys() - present.keys():
            turn = data.geom_xmat[pair[0]].reshape(3, 3)
            way = turn.T @ (data.geom_xpos[pair[1]] - data.geom_xpos[pair[0]])
            if way @ self.inside.pop(pair) < 0:
                self.through.setdefault(pair, float(data.time))

    def pairs(self) -> frozenset[tuple[int, int]]:
        """All pairs that went through, or are inside each other now."""
        return frozenset((*self.through, *self.inside))

    def texts(self) -> tuple[str, ...]:
        """What went through what first, unless it does so in small steps too, and how many more."""
        sentences = {
            pair: f"{pair_names(self.model, pair)} went through each other, at {time:.3g} s"
            for pair, time in self.through.items()
        }
        for pair in self.inside:
            names = pair_names(self.model, pair)
            sentences.setdefault(pair, f"{names} stay inside each other at the end")
        texts = [text for pair, text in sentences.items() if pair not in self.setup.passing]
        rest = "another pair" if len(texts) == 2 else f"{len(texts) - 1} more pairs"
        return (texts[0], f"and {rest}") if texts[1:] else tuple(texts)


_DIPPING = 0.25
"""The share of half a thickness from which a contact is watched."""


def _body_of(model: Any, geom: int) -> str:
    """What the body of a geom is called; of one without a name, its nearest ancestor's."""
    body = int(model.geom_bodyid[geom]) if geom >= 0 else 0
    inner = ""
    while body and not model.body(body).name:
        body, inner = int(model.body_parentid[body]), "a part of "
    if body:
        return f"{inner}{model.body(body).name}"
    return "a body without a name" if inner else "the world"


def thickness(model: Any) -> Array:
    """Half the thickness of every geom, and infinity for none (index -1): (ngeom + 1,) m.

    Planes and height fields are infinitely thick: nothing is on their other side.
    """
    half = model.geom_aabb[:, 3:].min(axis=1)
    planes = (int(mujoco.mjtGeom.mjGEOM_PLANE), int(mujoco.mjtGeom.mjGEOM_HFIELD))
    bottomless = np.isin(model.geom_type, planes)
    return np.append(np.where(bottomless | (half == 0), np.inf, half), np.inf)


def deepest_contact(data: Any) -> float:
    """How deep bodies lie in each other now, m; 0 where nothing touches."""
    if data.ncon == 0:
        return 0.0
    return max(0.0, -float(np.min(data.contact.dist[: data.ncon])))


def driving_force(model: Any, scenario: Scenario) -> str:
    """What may raise the energy of a motion, or store some that is not counted; "" for nothing."""
    has_commands = np.any(scenario.controls) or scenario.loop is not None
    has_commands |= bool(scenario.keyframe >= 0 and np.any(model.key_ctrl[scenario.keyframe]))
    has_actuators = model.nu and not model.opt.disableflags & int(
        mujoco.mjtDisableBit.mjDSBL_ACTUATION
    )
    is_pushing = any(  # without a command too, as the range leaves 0 out
        np.any((limited != 0) & ((ranges[:, 0] > 0) | (ranges[:, 1] < 0)))
        for limited, ranges in (
            (model.actuator_ctrllimited, model.actuator_ctrlrange),
            (model.actuator_forcelimited, model.actuator_forcerange),
        )
    )
    damping = [
        getattr(model, f"{owner}_{name}")
        for owner in ("dof", "tendon", "actuator")
        for name in ("damping", "dampingpoly")
    ]
    has_fluid = model.opt.density > 0 or model.opt.viscosity > 0
    causes = (
        (
            has_actuators
            and (has_commands or is_pushing or model.na or np.any(model.actuator_biastype)),
            "actuators act",
        ),
        (np.any(scenario.forces), "it is pushed"),
        (len(scenario.poses) > 1, "mocap bodies are moved"),
        (np.any(model.geom_surfacevel), "a surface moves"),
        (np.any(model.geom_adhesion) or np.any(model.pair_adhesion), "contacts adhere"),
        (has_fluid and np.any(model.geom_fluid[:, 0]), "a fluid stores energy"),
        (has_fluid and np.any(model.opt.wind), "wind blows"),
        (np.any(model.body_gravcomp), "gravity is compensated"),
        (min(np.min(values, initial=0) for values in damping) < 0, "damping is negative"),
        (model.nflex, "a flex stores energy"),
        (model.nplugin, "a plugin acts"),
    )
    return ", ".join(words for applies, words in causes if applies)
