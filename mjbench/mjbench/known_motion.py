"""The references that a scene's motion is measured against, and how well they are known.

1. A smooth scene is integrated over `mj_forward` by Bulirsch–Stoer; DOP853 does it again. Their
   difference bounds the error of the reference. Both take the same accelerations, so the engine in
   ever smaller steps must tend to the same motion.
2. The exact motion that a course has comes first, and that integration second. It is believed after
   it was checked only: in a smooth scene two integrations that agree, and the engine that tends to
   them, outvote it; elsewhere the model must come nearer to it the stiffer its contacts and the
   shorter its timesteps are.
3. Where accelerations jump, the engine tends elsewhere, or the scene is too stiff for an
   integration in reasonable time, only the engine itself is left: in small steps, and again in
   steps twice as long under another integrator. This reference is called `self`.
4. A motion counts only as long as it is known: where two integrations part, the horizon ends.
"""

from __future__ import annotations

import contextlib
from functools import partial
from typing import Any

import mujoco
import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from mjbench import integrate
from mjbench.declarations import DeclaredScenario, Place
from mjbench.measure import (
    errors,
    largest_errors,
)
from mjbench.pilot import NUDGE, Pilot, horizon_errors, position_distances
from mjbench.problem import ROUNDING, Integrator, Setup, Sizes
from mjbench.scene import ExactMotion, SceneError
from mjbench.settings import CONES
from mjbench.simulation import (
    EngineStates,
    initial_data,
    motion_of,
    simulate,
    stiffened,
    with_integrator,
    without_sleep,
)

EVALUATIONS, QUICK_EVALUATIONS = 2_000_000, 400_000
"""Accelerations that a reference may take."""
TOLERANCE, QUICK_TOLERANCE = 1e-13, 1e-12
"""Of an integration, per step and relative to 1 + |y|. With fewer digits, drifts are hidden."""
FINER, QUICK_FINER = 16, 8
"""How many times shorter the steps of a `self` reference are than the shortest measured."""
PARTING_DISTANCE, _PARTING_SHARE = 0.01, 0.1
"""The difference from which on motions have nothing in common, rad or relative to the extent; the
same of two that are to be a reference, relative to the error to be told."""
PRECISION, _VOTES = 1e-8, 100.0
"""How far a course's exact motion may be off, relative to the largest number in it where this is
over 1, unless its scenario says; and floors of the integration within which it always may."""
_STIFFER, _NEEDED = (1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0), 3
"""How many times shorter time constants of contacts are when an exact motion is checked; how many
of them must each come nearer to it than the one before."""
_APPROACH, _NEAR, _ELSEWHERE = 0.8, 3.0, 5.0
"""The part of a difference that twice the stiffness may leave; within how many floors of the engine
an exact motion is the engine's; how many times farther it is from stiff contacts than these moved
at last, and can be known, where it is another one."""
_STEP = 1e-6
"""s, of the model whose accelerations are integrated: `refsafe` softens nothing then."""
_TENDS_ELSEWHERE = "the engine with small steps converges to something else"


class KnownMotion(Struct, frozen=True):
    """The reference of a scene, from the first sample to the horizon."""

    kind: str
    """`closed`, `ode` or `self`."""
    source: str
    states: EngineStates
    second_states: EngineStates
    """The same motion by the second reference."""
    floor: Sizes
    """How far it may be off."""
    second: str
    agreement: float
    """The largest difference of the two, in m, rad, m/s and rad/s."""
    horizon: float
    note: str = ""
    """Why there is no better reference; empty where this is the best kind."""


def find_reference(model: Any, pilot: Pilot, *, quick: bool = False) -> KnownMotion:
    """The reference of a scene; a `SceneError` where its exact motion is not this scene's."""
    reference = _find_computed(model, pilot, quick=quick)
    declaration = pilot.scene.declaration
    exact = None if declaration.reference else pilot.scene.exact
    if exact is None:
        return reference
    states = exact.engine_states(model, pilot.scene.scenario, reference.states)
    least = _check_exact(model, pilot, exact, states, reference, quick=quick)
    gap = motion_gap(model, states, reference.states)
    return replace(
        reference,
        kind="closed",
        source=exact.path,
        states=states,
        second_states=reference.states,
        floor=least.at_least(gap) if reference.kind == "ode" else least,
        second=reference.source,
        agreement=gap.largest,
        note="",
    )


def find_nearby(model: Any, pilot: Pilot, *, quick: bool) -> EngineStates | None:
    """The states of a scene's reference from another start; `None` where nobody knows them.

    A course's own exact motion may hold from the declared start only.
    """
    try:
        return _find_computed(without_sleep(model), pilot, quick=quick).states
    except SceneError:
        return None


def _find_computed(model: Any, pilot: Pilot, *, quick: bool) -> KnownMotion:
    """The reference without closed forms: an integration, or the engine in small steps."""
    declaration = pilot.scene.declaration
    reference, note = None, ""
    if pilot.smooth and declaration.reference != "self":
        try:
            reference = _integrate(model, pilot, quick)
        except integrate.NoConvergenceError as error:
            note = f"no integration: {error}"
        if reference is not None:
            setup = _with_duration(pilot.setup, float(reference.states.times[-1]))
            states, step = reference.states, min(pilot.scene.timesteps)
            near = NUDGE * np.exp((pilot.lyapunov or 0.0) * states.times)
            if not integrate.tends_to(model, setup, states, step, PARTING_DISTANCE, near):
                reference, note = None, f"no integration: {_TENDS_ELSEWHERE}"
        if reference is None and note.endswith(_TENDS_ELSEWHERE) and declaration.reference == "ode":
            raise _no_integration(_TENDS_ELSEWHERE, declaration)
    elif declaration.reference == "ode":
        raise _no_integration(f"there is {' and '.join(pilot.jumps)}", declaration)
    if reference is None:
        reference = replace(self_reference(model, pilot, quick=quick), note=note)
    return reference


def _check_exact(
    model: Any,
    pilot: Pilot,
    exact: ExactMotion,
    states: EngineStates,
    second: KnownMotion,
    *,
    quick: bool,
) -> Sizes:
    """How well a course's exact motion is known where no integration says it."""
    subject = f"`{exact.path}` is not this scene's motion"
    gap = motion_gap(model, states, second.states)
    clause = f"in the scenario `{pilot.scene.name}` it"
    precision = pilot.scene.declaration.precision or PRECISION
    if second.kind == "ode":
        for part in ("position", "attitude", "velocity"):
            column = {"position": second.states.qpos, "velocity": second.states.qvel}.get(part)
            size = 1.0 if column is None else max(1.0, float(np.abs(column).max(initial=0.0)))
            error, floor = getattr(gap, part), getattr(second.floor, part)
            if error <= max(precision * size, _VOTES * floor):
                continue
            if np.any(model.eq_active0):  # soft as contacts are, so theory may be of stiff ones
                _, rest = _stiff_gaps(model, pilot, states, precision, quick=quick)
                if rest is not None:
                    return Sizes(rest, rest, second.floor.velocity).at_least(ROUNDING)
            help = f"{clause} errs by {error:.2g} in {part}: two integrations of the model agree "
            help += f"with each other to {floor:.1g}, and the engine tends to them; `precision` "
            help += "says how far a formula that is meant to be no more than near may be off"
            raise SceneError(subject, Place(exact.path), help)
        return ROUNDING
    data = initial_data(pilot.scene.scenario, model)
    exact.check_velocities(model, states.times, (data.qpos.copy(), data.qvel.copy()))
    gaps, rest = _stiff_gaps(model, pilot, states, precision, quick=quick)
    if rest is None:
        far = ", ".join(f"{number:.2g}" for number in gaps)
        help = (
            f"{clause} is {far} (m or rad) from the engine in small steps with contacts as they "
            f"are, and {', '.join(f'{times:g}' for times in _STIFFER[1 : len(gaps)])} times as "
            "stiff: an exact motion is what that tends to; `precision` says how far it may be off"
        )
        raise SceneError(subject, Place(exact.path), help)
    return Sizes(rest, rest, second.floor.velocity).at_least(ROUNDING)


def _stiff_gaps(
    model: Any, pilot: Pilot, states: EngineStates, precision: float, *, quick: bool
) -> tuple[list[float], float | None]:
    """How far a motion is from the engine with what is soft stiffer and stiffer, m or rad.

    And how far it may be off, which is as much as it is from the engine; `None` where the engine
    tends to something else.
    """
    gaps: list[float] = []
    shifts: list[float] = []
    rest, stiff_states = np.inf, states
    for times in _STIFFER:
        try:
            stiff = _stiff_limit(model, pilot, times, quick=quick)
        except SceneError:
            if len(gaps) < _NEEDED:  # nothing would be checked
                raise
            break  # too stiff for steps of this length
        count = min(len(stiff_states.times), len(stiff.states.times))
        shifts.append(motion_gap(model, stiff_states.head(count), stiff.states.head(count)).place)
        stiff_states, least = stiff.states, stiff.floor.place
        gaps.append(motion_gap(model, states.head(count), stiff_states.head(count)).place)
        rest = min(rest, max(gaps[-1], least))
        if gaps[-1] <= max(precision, _NEAR * least):
            break
        if len(gaps) > _NEEDED:
            if gaps[-1] > _ELSEWHERE * max(shifts[-1], least):
                return gaps, None
            if shifts[-1] > _APPROACH * shifts[-2]:
                break  # luck, as of the phase of hits: there is no more to learn
        elif len(gaps) > 1 and gaps[-1] > _APPROACH * gaps[-2]:
            return gaps, None
    return gaps, rest


def _stiff_limit(model: Any, pilot: Pilot, times: float, *, quick: bool) -> KnownMotion:
    """What the engine tends to in small steps with what is soft so many times as stiff."""
    stiffer = stiffened(model, times)
    stiffer.opt.cone = CONES["elliptic"]
    limits = [self_reference(stiffer, pilot, quick=quick)]
    with contextlib.suppress(SceneError):
        limits.append(self_reference(stiffer, pilot, (Integrator.RK4,) * 3, quick=quick))
    return min(limits, key=lambda limit: limit.floor.place)


def _no_integration(reason: str, declaration: DeclaredScenario) -> SceneError:
    help = "leave `reference` out: the engine itself in small steps is the reference then"
    place = declaration.place("reference")
    return SceneError(f"no integration can be the reference: {reason}", place, help)


def _integrate(model: Any, pilot: Pilot, quick: bool) -> KnownMotion:
    times = pilot.setup.scenario.times
    times = times[times <= pilot.horizon * (1 + 1e-9)]
    variant = with_integrator(model, Integrator.EULER, _STEP)
    variant.opt.solver = mujoco.mjtSolver.mjSOL_NEWTON
    variant.opt.iterations, variant.opt.tolerance = max(100, int(variant.opt.iterations)), 0.0
    variant.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_WARMSTART)
    variant.actuator_actearly[:] = 0  # it looks ahead by a timestep, which tends to nothing
    most = QUICK_EVALUATIONS if quick else EVALUATIONS
    tolerance = QUICK_TOLERANCE if quick else TOLERANCE
    run = partial(integrate.forward_states, variant, pilot.scene.scenario, times, evaluations=most)
    states = run(partial(integrate.bulirsch_stoer, tolerance=tolerance))
    source = "Bulirsch–Stoer over mj_forward"
    second_states = run(partial(integrate.dop853, tolerance=tolerance))
    return _combine(model, pilot, "ode", source, states, "DOP853 over mj_forward", second_states)


def self_reference(
    model: Any,
    pilot: Pilot,
    integrators: tuple[Integrator, ...] = (Integrator.IMPLICITFAST, Integrator.EULER),
    *,
    quick: bool = False,
) -> KnownMotion:
    """Run the engine in small steps, and in steps twice as long under another integrator.

    A third one runs in steps four times as long: two that agree by luck do not with it.
    """
    step = min(pilot.scene.timesteps) / (QUICK_FINER if quick else FINER)
    runs = []
    for doublings, integrator in enumerate(integrators):
        fine = with_integrator(model, integrator, step * 2**doublings)
        fine.opt.solver = mujoco.mjtSolver.mjSOL_NEWTON
        fine.opt.iterations = max(100, int(fine.opt.iterations))
        fine.opt.tolerance = min(1e-10, float(fine.opt.tolerance))
        run = simulate(_with_duration(pilot.setup, pilot.horizon), fine)
        if not np.isfinite(run.states.qpos).all():
            raise SceneError(f"it diverges even at {step:g} s a step")
        runs.append(run.states)
    names = [integrator.value for integrator in integrators]
    source = f"the engine itself: {names[0]} at {1e6 * step:.6g} µs, Newton's solver"
    second = f"the same under {names[1]} at {2e6 * step:.6g} µs"
    reference = _combine(model, pilot, "self", source, runs[0], second, runs[1])
    count, floor = len(reference.states.times), reference.floor
    for states in runs[2:]:
        floor = floor.at_least(motion_gap(model, reference.states, states.head(count)))
    return replace(reference, floor=floor)


def _with_duration(setup: Setup, duration: float) -> Setup:
    return replace(setup, scenario=replace(setup.scenario, duration=duration))


def _combine(
    model: Any,
    pilot: Pilot,
    kind: str,
    source: str,
    states: EngineStates,
    second: str,
    second_states: EngineStates,
) -> KnownMotion:
    unit = horizon_errors(model, pilot.scene)
    gaps = position_distances(model, states.qpos, second_states.qpos, unit)
    parted = np.flatnonzero(gaps > _PARTING_SHARE)
    good = max(1, int(parted[0])) if parted.size else len(gaps)
    states, second_states = states.head(good), second_states.head(good)
    gap, horizon = motion_gap(model, states, second_states), float(states.times[-1])
    floor = gap.at_least(ROUNDING)
    return KnownMotion(kind, source, states, second_states, floor, second, gap.largest, horizon)


def motion_gap(model: Any, states: EngineStates, second_states: EngineStates) -> Sizes:
    """How far two motions are apart at most."""
    return largest_errors(errors(motion_of(model, states), motion_of(model, second_states)))
