"""A first run of a scene in small steps: what acts in it, and its bounds.

1. Every step is observed: a contact, a limit that is reached or dry friction makes accelerations
   jump, so that errors need not follow a power of the timestep and no smooth integration applies.
2. Eight twins begin 1e-10 away, in four directions, to both sides. Where the first of them is off
   by what the scenario states, or a tenth, errors of trajectories mean nothing any more: that is
   the horizon. The growth until there gives about the largest Lyapunov exponent.
3. The largest positions, and the largest energy where nothing drives the motion, else velocity,
   give the bounds, with room for coarse timesteps.
"""

from __future__ import annotations

import math
from typing import Any

import mujoco
import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from mjbench import simulation
from mjbench.detector import (
    Passages,
    Peaks,
    driving_force,
    has_bad_state,
    pair_names,
    pair_of,
    thickness,
    update_peaks,
)
from mjbench.problem import ROOM, Array, Integrator, Setup
from mjbench.reports.shown_errors import seconds_text
from mjbench.scene import Scene, SceneError

NUDGE = 1e-10
"""How far a twin's beginning is off: rad, or relative to the model's extent; velocities per s."""
_DIRECTIONS = 4
"""How many directions beginnings are nudged in, each to both sides."""
_PARTING_DISTANCE = 0.1
"""The error at which predictions end where the scenario states none: rad, or relative to the
model's extent."""
_REST_SPEED = 0.01
"""A body is at rest below this part of the speed of a fall through the model's extent."""
_SETTLED = 1e-6
"""A motion has come to rest below this part of its largest kinetic energy."""
_EXCESS = 0.1
"""The share of the largest kinetic energy above what there can be, from which it is nonsense."""
DEEPER = 1.25
"""How many times deeper than in small steps bodies may lie in each other."""
_FINER = 8
"""How many times shorter steps are in which not even RK4 damps what an integrator is lost with."""
MOST_STEPS = 200_000
"""The most steps of a motion whose timestep is searched for."""
_PEAK_INTERVAL = 8
"""Steps from one look at how large the state is to the next."""


class Pilot(Struct, frozen=True):
    """The results of a scene's first run."""

    scene: Scene
    peaks: Peaks
    setup: Setup
    """The scenario, with bounds of its states."""
    contact: bool
    """Whether anything touched."""
    constrained: bool
    """Whether a solver had anything to do."""
    jumps: tuple[str, ...]
    """The causes for jumps of accelerations, in words; empty where the scene is smooth."""
    horizons: tuple[float, float]
    """s, multiples of the sample: how long the first and the last twin stay near; the duration for
    one that stays near to the end."""
    lyapunov: float | None
    """1/s, of the middle one of the twins that part; `None` where all stay near."""
    settles: bool = False
    """Whether it comes to rest."""
    overlaps: str = ""
    """What begins inside something else, with its depth, in words."""

    @property
    def horizon(self) -> float:
        """s: how long all twins stay near."""
        return self.horizons[0]

    @property
    def smooth(self) -> bool:
        """Whether accelerations are a smooth function of the state."""
        return not self.jumps


def run_pilot(model: Any, scene: Scene) -> Pilot:
    """Run a scene at its shortest timestep.

    Where it diverges there, the first of a half, a quarter, … at which it does not, and half of
    that, join the scene's: just below its limit an integrator swings far too wide. A `SceneError`
    where there is none, or the scenario does not fit.
    """
    ladder = scene.timesteps
    while True:
        step = min(scene.timesteps) / 2
        try:
            pilot = _pilot_of(model, scene)
        except _DivergenceError:
            if scene.scenario.duration > MOST_STEPS * step:
                raise
            scene = replace(scene, timesteps=(step, *ladder))
            continue
        if len(scene.timesteps) != len(ladder) + 1:
            return pilot
        scene = replace(scene, timesteps=(step, *scene.timesteps))


class _DivergenceError(SceneError):
    """A scene has no motion at its shortest timestep."""


def _failure(model: Any, data: Any) -> SceneError:
    time = seconds_text(data.time, 2)
    if data.warning[mujoco.mjtWarning.mjWARN_BADCTRL].number:
        message = f"a command is no number, or huge, before {time}"
        return SceneError(f"{message}: MuJoCo takes all of them as 0 then")
    setting = f"{simulation.integrator_of(model).value} at {seconds_text(model.opt.timestep)}"
    message = f"it diverges within {time} even under {setting}"
    return _DivergenceError(message, help="another integrator, or smaller commands, may hold")


def _pilot_of(model: Any, scene: Scene) -> Pilot:
    step, scenario = min(scene.timesteps), scene.scenario
    variant = simulation.without_sleep(
        simulation.with_integrator(model, simulation.integrator_of(model), step)
    )
    variant.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_ENERGY)
    data, errors = simulation.initial_data(scenario, variant), horizon_errors(variant, scene)
    twins, nudge_sizes = [], []
    for change in nudges(variant, 2 * _DIRECTIONS, NUDGE):
        aside = simulation.nudged(scenario, variant, change)
        twins.append(simulation.initial_data(aside, variant))
        nudge_sizes.append(float(np.max(np.abs(change[0] / errors), initial=0.0)))
    look = _Observer(variant)
    peaks, half_thickness, passages = Peaks(), thickness(variant), Passages(variant)
    times, steps_per_sample = scenario.times, scenario.steps(step)
    gaps = np.full((len(twins), len(times)), np.nan)
    for index, inputs in enumerate(scenario.inputs(scenario.sample)):
        for copy in (data, *twins):
            inputs.give(copy)
        for number in range(steps_per_sample):
            simulation.advance(variant, data)
            look(data)
            if number % _PEAK_INTERVAL == 0 or number == steps_per_sample - 1:
                peaks = update_peaks(data, peaks, half_thickness)
                passages.look(data)
                if not peaks.finite or has_bad_state(data):
                    raise _failure(variant, data)
        for twin, gap in zip(twins, gaps, strict=True):
            if index == 0 or gap[index - 1] < 1:
                simulation.advance(variant, twin, steps_per_sample)
                gap[index] = position_distance(variant, data.qpos, twin.qpos, errors)
    first = simulation.initial_data(scenario, variant)
    energy = float(simulation.invariants(variant, first, first.qpos, first.qvel)[:2].sum())
    if not (look.constrained or driving_force(model, scenario)):  # most is at the beginning
        kinetic = peaks.kinetic
        if peaks.energy > energy + _EXCESS * kinetic:  # the integrator itself is lost
            fine = simulation.with_integrator(variant, Integrator.RK4, step / _FINER)
            kinetic = simulation.simulate(Setup(scenario=scenario), fine).energy[:, 1].max()
        peaks = replace(peaks, energy=energy, kinetic=float(np.fmin(kinetic, peaks.kinetic)))
    setup = replace(_bounds(variant, scene, peaks), passing=passages.pairs())
    horizons, growth_rates = [], []
    for gap, size in zip(gaps, nudge_sizes, strict=True):
        parted = np.flatnonzero(gap >= 1)
        end = int(parted[0]) if parted.size else len(times)
        horizons.append(float(times[max(0, end - 1)]))
        if parted.size:
            growth_rates.append(math.log(float(gap[end]) / size) / float(times[end]))
    return Pilot(
        scene=scene,
        peaks=peaks,
        setup=setup,
        contact=look.contact,
        constrained=look.constrained,
        jumps=(
            *(() if scenario.loop is None else ("a controller in the loop",)),
            *look.jumps(variant),
        ),
        horizons=(min(horizons), max(horizons)),
        lyapunov=float(np.median(growth_rates)) if growth_rates else None,
        settles=float(data.energy[1]) < _SETTLED * peaks.kinetic,
        overlaps=_initial_overlaps(variant, first, half_thickness),
    )


_OVERLAP = 0.25
"""The share of half a thickness beyond which something is said to begin inside something else."""
_MOST_OVERLAPS = 3


def _initial_overlaps(model: Any, data: Any, half_thickness: Array) -> str:
    """What lies inside something else at the beginning, the deepest first, in words."""
    mujoco.mj_fwdPosition(model, data)
    depths: dict[str, float] = {}
    for contact in data.contact[: data.ncon]:
        pair, depth = pair_of(contact), -float(contact.dist)
        if min(pair) >= 0 and depth > _OVERLAP * half_thickness[list(pair)].min():
            names = pair_names(model, pair)
            depths[names] = max(depth, depths.get(names, 0.0))
    deepest = sorted(depths.items(), key=lambda item: -item[1])
    parts = [f"{names} by {depth:.3g} m" for names, depth in deepest]
    rest = len(parts) - _MOST_OVERLAPS
    return "; ".join(parts[:_MOST_OVERLAPS]) + (f"; and {rest} more" if rest > 0 else "")


def position_distance(model: Any, first: Array, second: Array, units: Array | None = None) -> float:
    """The distance of two positions (nq,), at the joint where they differ most.

    `units`: what counts as 1 in each degree of freedom (nv,), else `scales`.
    """
    difference = np.zeros(int(model.nv))
    mujoco.mj_differentiatePos(model, difference, 1.0, first, second)
    sizes = np.abs(difference / (scales(model) if units is None else units))
    return float(np.max(sizes, initial=0.0))


def position_distances(
    model: Any, first: Array, second: Array, units: Array | None = None
) -> Array:
    """The distances of two motions (n, nq) at each time: (n,)."""
    pairs = zip(first, second, strict=True)
    return np.array([position_distance(model, a, b, units) for a, b in pairs])


def scales(model: Any, angle: float = 1.0, length: float | None = None) -> Array:
    """The size of a difference in each degree of freedom: rad, or m.

    `angle`: of hinges and attitudes; `length`: of slides and places, else the model's extent.
    """
    sizes = np.full(int(model.nv), angle)
    if length is None:
        length = max(float(model.stat.extent), mujoco.mjMINVAL)
    for kind, dof in zip(model.jnt_type, model.jnt_dofadr, strict=True):
        if kind == mujoco.mjtJoint.mjJNT_FREE:
            sizes[dof : dof + 3] = length
        elif kind == mujoco.mjtJoint.mjJNT_SLIDE:
            sizes[dof] = length
    return sizes


def horizon_error(model: Any, scene: Scene) -> dict[str, float]:
    """The errors at which predictions of a scene end, by unit: those that it states, or a tenth."""
    if scene.declaration.horizon_error:
        return {str(unit): error for unit, error in scene.declaration.horizon_error.items()}
    tenth = _PARTING_DISTANCE * scales(model)
    is_length = scales(model, 0.0, 1.0) > 0
    parts = {"rad": tenth[~is_length], "m": tenth[is_length]}
    return {unit: float(errors[0]) for unit, errors in parts.items() if errors.size}


def horizon_errors(model: Any, scene: Scene) -> Array:
    """The same for each degree of freedom (nv,); infinite where none is stated of its unit."""
    errors = horizon_error(model, scene)
    return scales(model, errors.get("rad", math.inf), errors.get("m", math.inf))


_KINDS = mujoco.mjtConstraint
_LIMITS = [int(_KINDS.mjCNSTR_LIMIT_JOINT), int(_KINDS.mjCNSTR_LIMIT_TENDON)]


class _Observer:
    """Looks at every state, and remembers what acted."""

    def __init__(self, model: Any) -> None:
        self.contact = self.constrained = self.friction = self.full = False
        self._steps = self._limited_steps = 0
        self._limits = set[tuple[int, int]]()
        clamped = [
            (int(model.actuator_actadr[i]) + k, model.actuator_actrange[i])
            for i in np.flatnonzero(model.actuator_actlimited)
            for k in range(int(model.actuator_actnum[i]))
        ]
        self._limited = np.array([number for number, _ in clamped], dtype=np.intp)
        self._range = np.array([limits for _, limits in clamped]).reshape(-1, 2)

    def __call__(self, data: Any) -> None:
        if data.nefc:
            self.constrained = True
            self.friction = self.friction or data.nf > 0
        self._steps += 1
        if data.nl:
            self._limited_steps += 1
            rows = np.isin(data.efc_type, _LIMITS)
            self._limits.update(zip(data.efc_type[rows], data.efc_id[rows], strict=True))
        self.contact = self.contact or data.ncon > 0
        if self._limited.size and not self.full:
            act = data.act[self._limited]
            self.full = bool(np.any((act <= self._range[:, 0]) | (act >= self._range[:, 1])))

    def jumps(self, model: Any) -> tuple[str, ...]:
        """The causes for jumps of accelerations, in words."""
        part = f"{len(self._limits)} of {model.jnt_limited.sum() + model.tendon_limited.sum()}"
        share = 100 * self._limited_steps / max(self._steps, 1)
        causes = (
            (self.contact, "contact"),
            (bool(self._limits), f"limits that are reached ({part}, {share:.0f} % of the time)"),
            (self.friction, "dry friction"),
            (self.full, "an activation at its limit"),
            (bool(model.nplugin), "a plugin"),
            (bool(np.any(model.actuator_history[:, 0] > 0)), "a delayed actuator"),
        )
        return tuple(words for is_present, words in causes if is_present)


def nudges(model: Any, count: int, size: float) -> Array:
    """Changes of positions and velocities, to both sides of random directions: (count, 2, nv)."""
    directions = np.random.default_rng(1).normal(size=(count // 2, 2, int(model.nv)))
    largest = np.abs(directions).max(axis=2, initial=mujoco.mjMINVAL)[:, :1, None]
    directions = directions / largest * size * scales(model)
    return np.concatenate([directions, -directions])


def _bounds(model: Any, scene: Scene, peaks: Peaks) -> Setup:
    scenario = scene.scenario
    extent = float(model.stat.extent)
    fall = math.sqrt(float(np.linalg.norm(model.opt.gravity)) * extent)
    # A hinge without limits may go round the other way.
    has_hinges = bool(np.any(model.jnt_type == mujoco.mjtJoint.mjJNT_HINGE))
    round_and_round = 2 * peaks.velocity * scenario.duration if has_hinges else 0.0
    setup = Setup(
        scenario=scenario,
        position_bound=2 * peaks.position + ROOM * max(extent, 1.0) + round_and_round,
        sunk_bound=max(1.0, DEEPER * peaks.sunk),
    )
    if driving_force(model, scenario):
        return replace(setup, velocity_bound=ROOM * max(peaks.velocity, fall, 1e-3))
    rest_energy = float(model.body_mass.sum()) * max(_REST_SPEED * fall, 1e-3) ** 2
    kinetic = max(peaks.kinetic, rest_energy)
    return replace(setup, energy_bound=peaks.energy + ROOM * kinetic)


def longer_setup(model: Any, pilot: Pilot, span: float) -> Setup:
    """The setup for a longer span (s), where a motion may fall farther, go on to grow, or hit."""
    scene = pilot.scene
    duration = math.ceil(span / scene.scenario.sample * (1 - 1e-12)) * scene.scenario.sample
    longer_scene = replace(scene, scenario=replace(scene.scenario, duration=duration))
    for integrator in (Integrator.RK4, simulation.integrator_of(model)):
        variant = simulation.with_integrator(model, integrator, min(scene.timesteps))
        run = simulation.simulate(Setup(scenario=longer_scene.scenario), variant)
        position, velocity, kinetic = (
            float(np.abs(values).max(initial=0.0))
            for values in (run.states.qpos, run.states.qvel, run.energy[:, 1])
        )
        if math.isfinite(position + velocity + kinetic):
            peaks = replace(
                pilot.peaks,
                position=max(position, pilot.peaks.position),
                velocity=max(velocity, pilot.peaks.velocity),
                kinetic=max(kinetic, pilot.peaks.kinetic),
                sunk=max(run.sunk, pilot.peaks.sunk),
            )
            passing = pilot.setup.passing | run.passing
            return replace(_bounds(model, longer_scene, peaks), passing=passing)
    return pilot.setup
