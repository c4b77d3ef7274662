"""A first run of a scene, in small steps: what acts in it, how far it can be told, what can be.

Entry point: `pilot(model, scene)`.

1. Every step is looked at: a contact, a limit that is reached or dry friction makes accelerations
   jump, so that errors follow no power of the timestep and no smooth integration applies.
2. Beside it run eight twins whose beginnings are off by 1e-10, in four directions, to both sides.
   Where the first of them is a tenth away, errors of trajectories mean nothing any more: that is
   the horizon. The growth until there is the largest Lyapunov exponent, about.
3. What was seen of positions, and of energy where nothing drives the motion, else of velocities,
   says what can be, with room for coarse timesteps.
"""

from __future__ import annotations

import math
from typing import Any

import mujoco
import numpy as np
from msgspec import Struct

from coursebuild.numerics.detector import Peaks, driving_force, peaks
from coursebuild.numerics.engine import advance, initial_data, integrator_of, with_integrator
from coursebuild.numerics.problem import ROOM, Array, Scenario, Setup
from coursebuild.numerics.scene import Scene, SceneError

NUDGE = 1e-10
"""Of a twin's beginning: rad, or relative to the model's extent; velocities likewise, per s."""
_DIRECTIONS = 4
"""In which beginnings are nudged, each to both sides."""
APART = 0.1
"""Where two motions have nothing in common any more: rad, or relative to the model's extent."""
_RESTING = 0.01
"""What moves slower than this part of the speed of a fall through the model's extent is at rest."""
_SELDOM = 8
"""Steps from one look at how large the state is to the next."""


class Pilot(Struct, frozen=True):
    """What the first run of a scene says."""

    scene: Scene
    setup: Setup
    """The scenario, and the most that can be in it."""
    contact: bool
    """Whether anything touched."""
    constrained: bool
    """Whether a solver had anything to do."""
    jumps: tuple[str, ...]
    """What makes accelerations jump, in words; none: the scene is smooth."""
    horizons: tuple[float, float]
    """s, multiples of the sample: until where the first and the last twin stay near; the duration
    for one that stays near to the end."""
    lyapunov: float | None
    """1/s, of the middle one of the twins that part; `None` where all stay near."""

    @property
    def horizon(self) -> float:
        """s: until where all twins stay near."""
        return self.horizons[0]

    @property
    def smooth(self) -> bool:
        """Whether accelerations are a smooth function of the state."""
        return not self.jumps


def pilot(model: Any, scene: Scene) -> Pilot:
    """Run a scene at its shortest timestep under its own integrator.

    Raises:
        SceneError: it diverges even there.
    """
    step, scenario = min(scene.timesteps), scene.scenario
    own = with_integrator(model, integrator_of(model), step)
    own.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_ENERGY)
    data, twins = initial_data(scenario, own), _twins(own, scenario)
    look = _Observer(own)
    seen = Peaks()
    times, every = scenario.times, scenario.steps(step)
    gaps = np.full((len(twins), len(times)), np.nan)
    for index in range(len(times)):
        command = scenario.command(index)
        for one in (data, *twins) if command else ():
            one.ctrl[:] = command
        for number in range(every):
            advance(own, data)
            look(data)
            if number % _SELDOM == 0 or number == every - 1:
                seen = peaks(data, seen)
        if not seen.finite:
            raise SceneError(f"it diverges within {times[index]:.6g} s even at {step:g} s a step")
        for twin, gap in zip(twins, gaps, strict=True):
            if index == 0 or gap[index - 1] < APART:
                advance(own, twin, every)
                gap[index] = position_distance(own, data.qpos, twin.qpos)
    horizons, rates = zip(*(_horizon(times, gap) for gap in gaps), strict=True)
    grown = [rate for rate in rates if rate is not None]
    return Pilot(
        scene=scene,
        setup=_bounds(own, scenario, seen),
        contact=look.contact,
        constrained=look.constrained,
        jumps=look.jumps(own),
        horizons=(min(horizons), max(horizons)),
        lyapunov=float(np.median(grown)) if grown else None,
    )


def position_distance(model: Any, first: Array, second: Array) -> float:
    """How far two positions (nq,) are from each other, at the joint where they differ most.

    In rad for hinges and attitudes, relative to the model's extent for slides and free places.
    """
    difference = np.zeros(int(model.nv))
    mujoco.mj_differentiatePos(model, difference, 1.0, first, second)
    return float(np.max(np.abs(difference / scales(model)), initial=0.0))


def position_distances(model: Any, first: Array, second: Array) -> Array:
    """The same of two motions (n, nq), at each time: (n,)."""
    pairs = zip(first, second, strict=True)
    return np.array([position_distance(model, one, other) for one, other in pairs])


def scales(model: Any) -> Array:
    """What a difference in each degree of freedom is large against: 1 rad, or the extent, m."""
    found = np.ones(int(model.nv))
    extent = max(float(model.stat.extent), mujoco.mjMINVAL)
    for kind, dof in zip(model.jnt_type, model.jnt_dofadr, strict=True):
        if kind == mujoco.mjtJoint.mjJNT_FREE:
            found[dof : dof + 3] = extent
        elif kind == mujoco.mjtJoint.mjJNT_SLIDE:
            found[dof] = extent
    return found


class _Observer:
    """Looks at every state, and keeps what acted."""

    def __init__(self, model: Any) -> None:
        self.contact = self.limit = self.constrained = False
        self.friction = self.full = False
        self._limited, self._range = _limited_activations(model)

    def __call__(self, data: Any) -> None:
        """See what acts."""
        if data.nefc:
            self.constrained = True
            self.limit = self.limit or data.nl > 0
            self.friction = self.friction or data.nf > 0
        self.contact = self.contact or data.ncon > 0
        if self._limited.size and not self.full:
            act = data.act[self._limited]
            self.full = bool(np.any((act <= self._range[:, 0]) | (act >= self._range[:, 1])))

    def jumps(self, model: Any) -> tuple[str, ...]:
        """What makes accelerations jump."""
        found = (
            (self.contact, "contact"),
            (self.limit, "a limit that is reached"),
            (self.friction, "dry friction"),
            (self.full, "an activation at its limit"),
            (bool(model.nplugin), "a plugin"),
            (bool(np.any(model.actuator_history[:, 0] > 0)), "a delayed actuator")
            if hasattr(model, "actuator_history")
            else (False, ""),
        )
        return tuple(words for there, words in found if there)


def _limited_activations(model: Any) -> tuple[Any, Array]:
    """Which activations are clamped, by number (n,), and between what (n, 2)."""
    found = [
        (int(model.actuator_actadr[i]) + k, model.actuator_actrange[i])
        for i in np.flatnonzero(model.actuator_actlimited)
        for k in range(int(model.actuator_actnum[i]))
    ]
    limits: Array = np.array([limits for _, limits in found]).reshape(-1, 2)
    return np.array([number for number, _ in found], dtype=np.intp), limits


def _twins(model: Any, scenario: Scenario) -> list[Any]:
    """The beginning with positions and velocities pushed a little, always in the same ways."""
    directions = np.random.default_rng(1).normal(size=(_DIRECTIONS, 2, int(model.nv)))
    push, found = NUDGE * scales(model), []
    for direction in (*directions, *-directions):
        size = max(float(np.abs(direction).max(initial=0.0)), mujoco.mjMINVAL)
        twin = initial_data(scenario, model)
        mujoco.mj_integratePos(model, twin.qpos, direction[0] / size * push, 1.0)
        twin.qvel[:] += direction[1] / size * push
        found.append(twin)
    return found


def _horizon(times: Array, gaps: Array) -> tuple[float, float | None]:
    beyond = np.flatnonzero(gaps >= APART)
    if not beyond.size:
        return float(times[-1]), None
    end = int(beyond[0])
    growth = math.log(float(gaps[end]) / NUDGE) / float(times[end])
    return float(times[max(0, end - 1)]), growth


def _bounds(model: Any, scenario: Scenario, seen: Peaks) -> Setup:
    extent = float(model.stat.extent)
    fall = math.sqrt(float(np.linalg.norm(model.opt.gravity)) * extent)
    # A hinge without limits may go round the other way.
    hinged = bool(np.any(model.jnt_type == mujoco.mjtJoint.mjJNT_HINGE))
    round_and_round = 2 * seen.velocity * scenario.duration if hinged else 0.0
    driven = bool(driving_force(model, scenario))
    resting = float(model.body_mass.sum()) * max(_RESTING * fall, 1e-3) ** 2
    return Setup(
        scenario=scenario,
        position_bound=2 * seen.position + ROOM * max(extent, 1.0) + round_and_round,
        velocity_bound=ROOM * max(seen.velocity, fall, 1e-3) if driven else math.inf,
        energy_bound=math.inf if driven else seen.energy + ROOM * max(seen.kinetic, resting),
    )
