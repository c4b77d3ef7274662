"""A model in one of its scenarios, with everything that its author left out filled in.

1. Without declarations each keyframe is a scenario; without a keyframe, the model's own state.
2. Times are whole numbers of the model's own timestep: a sample is some of them, a hold and the
   duration are some samples.
3. The ladder of timesteps is geometric about the model's own; each divides the sample.
4. Forces on bodies, and poses of mocap bodies, are rows that hold as long as commands do.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import mujoco
import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from mjbench.declarations import (
    DURATION,
    MOST_STEPS,
    BenchTable,
    Declarations,
    DeclaredScenario,
    Place,
    PushTable,
    is_multiple,
    keyframe_scenarios,
)
from mjbench.problem import Array, Scenario
from mjbench.simulation import EngineStates, initial_data

LOOKS = 100
"""About how many samples a scenario has by default."""
MIN_SAMPLES = 25
"""The fewest samples by default."""
LADDER, QUICK_LADDER = (-3, -2, -1, 0, 1, 2, 3), (-2, -1, 0, 1)
"""Powers of 2 by which timesteps differ from the model's own."""


LONGEST = 10_000_000
"""The most steps of a scenario at its shortest timestep: more would take hours."""
_STILL, _OFF_RATE = 1e-6, 0.02
"""m/s or rad/s: what is slower counts as this fast where velocities are compared; by how much they
may be off the rates of positions, relative to the fastest."""


class SceneError(Exception):
    """A scenario does not fit its model; `place` is where the mistake is."""

    def __init__(self, message: str, place: Place | None = None, help: str = "") -> None:
        super().__init__(message)
        self.message = message
        self.place = place
        self.help = help


class ExactMotion(Struct, frozen=True, eq=False):
    """A motion that the course knows."""

    path: str
    """Its file."""
    states: Callable[[Array, Array, Array], tuple[Array, Array | None]]
    """Times (n,) in s, and `qpos` and `qvel` of the beginning → the same at these times, (n, nq)
    and (n, nv); `None` where the course gives no velocities."""

    def check_velocities(self, model: Any, times: Array, begin: tuple[Array, Array]) -> None:
        """Check that velocities are the rates of positions; a `SceneError` where they are not.

        They are compared on the nearer side of a time: there may be a hit on the other.
        """
        step = 1e-4 * float(times[0])
        looks = np.ravel([times - step, times, times + step], order="F")
        qpos, qvel = self.states(looks, *begin)
        if qvel is None:
            return
        rates = np.empty((len(looks) - 1, int(model.nv)))
        for rate, now, later in zip(rates, qpos[:-1], qpos[1:], strict=True):
            mujoco.mj_differentiatePos(model, rate, step, now, later)
        sides, velocities = np.array([rates[::3], rates[1::3]]), qvel[1::3]
        fastest = np.maximum(np.abs(sides).max(axis=(0, 1)), np.abs(velocities).max(axis=0))
        gaps = np.abs(sides - velocities).min(axis=0) / np.maximum(fastest, _STILL)
        if not gaps.max(initial=0.0) <= _OFF_RATE:
            time, dof = np.unravel_index(int(gaps.argmax()), gaps.shape)
            message = f"`{self.path}` gives velocities that are not the rates of positions"
            help = f"number {dof} is {velocities[time, dof]:.3g} at {times[time]:.6g} s"
            help += f", where the positions give {sides[0, time, dof]:.3g}"
            raise SceneError(message, Place(self.path), help)

    def engine_states(self, model: Any, scenario: Scenario, states: EngineStates) -> EngineStates:
        """The motion at the times of computed states, whose velocities hold if it gives none."""
        data = initial_data(scenario, model)
        qpos, qvel = self.states(states.times, data.qpos.copy(), data.qvel.copy())
        motion = replace(states, qpos=qpos, qvel=states.qvel if qvel is None else qvel)
        if (motion.qpos.shape, motion.qvel.shape) != (states.qpos.shape, states.qvel.shape):
            message = f"`{self.path}` gives numbers of coordinates that differ from the model's"
            help = "they are those of `qpos`, and perhaps of `qvel`"
            raise SceneError(message, Place(self.path), help)
        return motion


class Scene(Struct, frozen=True):
    """A scenario of a model, ready to run."""

    name: str
    title: str
    scenario: Scenario
    timesteps: tuple[float, ...]
    """Rising, the model's own among them, s."""
    timestep: float
    """The model's own timestep, s."""
    bench: BenchTable
    declaration: DeclaredScenario
    exact: ExactMotion | None = None
    """The course's exact motion, if it gives one."""


def scenes(model: Any, declarations: Declarations, *, quick: bool = False) -> tuple[Scene, ...]:
    """The scenarios of a model (`mjModel`); none of one in which nothing can move.

    A `SceneError` where one does not fit.
    """
    if not model.nv:
        if declarations.scenarios:
            raise SceneError("nothing can move in the model", declarations.scenarios[0].table)
        return ()
    _check_fit(declarations, model)
    step = float(model.opt.timestep)
    steps = [step * 2.0**power for power in (QUICK_LADDER if quick else LADDER)]
    scenarios = declarations.scenarios
    if not scenarios:
        place = Place(declarations.path)
        names = keyframe_scenarios(element_names(model, "key"))
        titles = [f"from the keyframe {name}" for name in names]
        scenarios = tuple(
            DeclaredScenario(name, title, key, table=place)
            for key, (name, title) in enumerate(zip(names, titles, strict=True))
        )
        if not model.nkey:
            scenarios = (DeclaredScenario(names[0], "from the model's own state", table=place),)
    return tuple(_scene(model, scenario, declarations.bench, steps) for scenario in scenarios)


def _check_fit(declarations: Declarations, model: Any) -> None:
    """Check that a model has what scenarios name; a `SceneError` where it does not."""
    step = float(model.opt.timestep)
    for scenario in declarations.scenarios:
        names = element_names(model, "key")
        keyframes = names if isinstance(scenario.keyframe, str) else range(len(names))
        if scenario.keyframe is not None and scenario.keyframe not in keyframes:
            message = f"the model has no keyframe `{scenario.keyframe}`"
            raise SceneError(message, scenario.place("keyframe"))
        commands = [("controls", row, model.nu) for row in scenario.controls]
        state = [("qpos", scenario.qpos, model.nq), ("qvel", scenario.qvel, model.nv)]
        state.append(("act", scenario.act, model.na))
        for field, values, count in (*state, *commands):
            if values and len(values) != count:
                message = f"`{field}` has {len(values)} numbers, and the model takes {count}"
                raise SceneError(message, scenario.place(field))
        sample = scenario.sample
        for field, length in (("duration", scenario.duration), ("hold", scenario.hold)):
            if sample is not None and length is not None and not is_multiple(length, sample):
                message = f"`{field}` ({length:g} s) is not a multiple of `sample` ({sample:g} s)"
                raise SceneError(message, scenario.place(field))
        for length in (t for push in scenario.push for t in (push.at, push.duration)):
            for name, part in (("timestep", step), ("`sample`", sample)):
                if length and part is not None and not is_multiple(length, part):
                    message = f"a time of `push`, {length:g} s, is no multiple of the {name}"
                    raise SceneError(f"{message}, {part:g} s", scenario.place("push"))
        follow = max(map(len, (scenario.controls, *scenario.poses.values())))
        if follow > 1 and scenario.hold is None:
            raise SceneError("`hold` is missing: commands follow each other", scenario.table)
        bodies = element_names(model, "body")
        for field, names in (
            ("push", [p.body for p in scenario.push]),
            ("poses", [*scenario.poses]),
        ):
            for name in names:
                if name not in bodies[1:]:
                    raise SceneError(f"the model has no body `{name}`", scenario.place(field))
                if field == "poses" and model.body(name).mocapid[0] < 0:
                    raise SceneError(f"`{name}` is no mocap body", scenario.place(field))
        quantity = scenario.observable
        if quantity is not None and quantity.name not in element_names(model, quantity.kind):
            message = f"the model has no {quantity.kind} `{quantity.name}`"
            raise SceneError(message, scenario.place("measure"))


def element_names(model: Any, kind: str) -> list[str]:
    """The names of all elements of a kind, such as `body`, by their number; "" without one."""
    return [str(getattr(model, kind)(n).name) for n in range(int(getattr(model, f"n{kind}")))]


def _scene(
    model: Any, declaration: DeclaredScenario, bench: BenchTable, steps: Sequence[float]
) -> Scene:
    step, keyframe = float(model.opt.timestep), declaration.keyframe
    declaration = with_pushes_on_grid(declaration, step)
    if isinstance(keyframe, str):
        keyframe = int(model.key(keyframe).id)
    qpos = np.array(declaration.qpos)
    if qpos.size:  # an author need not compute quaternions of length 1
        mujoco.mj_normalizeQuat(model, qpos)
    scenario = replace(
        _scenario_times(step, declaration),
        qpos=tuple(qpos.tolist()),
        qvel=declaration.qvel,
        controls=declaration.controls,
        act=declaration.act,
        keyframe=-1 if keyframe is None else keyframe,
    )
    scenario = replace(
        scenario,
        forces=force_rows(model, declaration.push, scenario.hold),
        poses=pose_rows(model, declaration.poses, scenario),
    )
    for timestep in declaration.timesteps:
        if not is_multiple(scenario.sample, timestep):
            message = (
                f"the timestep {timestep:g} s does not divide the sample, {scenario.sample:g} s"
            )
            help = "give `sample` a value that all timesteps divide"
            raise SceneError(message, declaration.place("timesteps"), help)
    by_count = {round(scenario.sample / step): step}
    for timestep in declaration.timesteps or steps:
        count = max(1, round(scenario.sample / timestep))
        by_count.setdefault(count, _decimal(scenario.sample / count))
    ladder = tuple(by_count[count] for count in sorted(by_count, reverse=True))
    if scenario.duration > LONGEST * ladder[0]:
        message = f"{scenario.duration:g} s in steps of {ladder[0]:g} s are over {LONGEST:,} steps"
        place = declaration.place("duration" if declaration.duration is not None else "timesteps")
        raise SceneError(message, place, "measure a shorter time, or longer timesteps")
    title = declaration.title or declaration.name
    return Scene(declaration.name, title, scenario, ladder, step, bench, declaration)


def _scenario_times(step: float, declaration: DeclaredScenario) -> Scenario:
    duration, sample, hold = declaration.duration, declaration.sample, declaration.hold
    lengths = (("duration", duration), ("sample", sample), ("hold", hold))
    whole: dict[str, int] = {}
    for name, length in lengths:
        if length is not None and not is_multiple(length, step):
            message = f"the model's timestep, {step:g} s, does not divide `{name}` ({length:g} s)"
            raise SceneError(message)
        if length is not None:
            whole[name] = round(length / step)
    hold_steps, sample_steps = whole.get("hold"), whole.get("sample")
    count = max(map(len, (declaration.controls, *declaration.poses.values())))
    end = max((push.at + push.duration for push in declaration.push), default=0.0)
    count = max(count, round(end / hold) if hold else 0)
    last = hold_steps * count if hold_steps is not None and count > 1 else 0
    total = whole.get("duration") or max(last, min(round(DURATION / step), MOST_STEPS), 1)
    if sample_steps is None:
        basis = math.gcd(*(whole[name] for name in ("duration", "hold") if name in whole))
        sample_steps = (
            _sample_steps(basis, total) if basis else max(8, 8 * round(total / LOOKS / 8))
        )
    total = whole.get("duration") or sample_steps * max(
        MIN_SAMPLES, math.ceil(max(last, total) / sample_steps)
    )
    if hold_steps is not None and "duration" not in whole:
        total = hold_steps * math.ceil(total / hold_steps)
    return Scenario(
        duration or _decimal(total * step),
        sample or _decimal(sample_steps * step),
        hold=0.0 if hold_steps is None else hold or _decimal(hold_steps * step),
    )


def _decimal(seconds: float) -> float:
    """A product of decimal fractions as the decimal fraction that it is meant to be."""
    rounded = float(f"{seconds:.12g}")
    return rounded if abs(rounded - seconds) <= 1e-15 * seconds else seconds


def _sample_steps(basis: int, total: int) -> int:
    """A divisor of `basis` near the usual number of looks, which longer timesteps divide too."""
    small = [n for n in range(1, math.isqrt(basis) + 1) if basis % n == 0]
    divisors = {*small, *(basis // n for n in small)}

    def badness(steps: int) -> float:
        odd_factors = 3 - min(3, (steps & -steps).bit_length() - 1)
        deviation = math.log(steps * LOOKS / total)
        return (deviation if deviation > 0 else -deviation / 2) + 0.7 * odd_factors

    return min(sorted(divisors), key=badness)


def with_pushes_on_grid(declaration: DeclaredScenario, step: float) -> DeclaredScenario:
    """A scenario whose `hold` divides the times at which its pushes begin and end.

    Its commands and poses stay as long as they were. `step`: the model's own timestep, s, which
    divides all these times.
    """
    if not declaration.push:
        return declaration
    times = [time for push in declaration.push for time in (push.at, push.duration)]
    counts = [round(time / step) for time in times]
    before = None if declaration.hold is None else round(declaration.hold / step)
    hold = math.gcd(*counts, *([] if before is None else [before]))
    repeats = 1 if before is None else before // hold

    def repeat(rows: Sequence[Any]) -> tuple[Any, ...]:
        return tuple(row for row in rows for _ in range(repeats if len(rows) > 1 else 1))

    return replace(
        declaration,
        hold=float(f"{hold * step:.12g}"),
        controls=repeat(declaration.controls),
        poses={name: repeat(rows) for name, rows in declaration.poses.items()},
    )


def force_rows(
    model: Any, pushes: Sequence[PushTable], hold: float
) -> tuple[tuple[float, ...], ...]:
    """`xfrc_applied` in a row (6 nbody,) for each `hold` (s), and 0 behind the last push."""
    if not pushes:
        return ()
    spans = [(round(p.at / hold), round((p.at + p.duration) / hold)) for p in pushes]
    table = np.zeros((max(end for _, end in spans) + 1, int(model.nbody), 6))
    for push, (begin, end) in zip(pushes, spans, strict=True):
        table[begin:end, int(model.body(push.body).id)] += (*push.force, *push.torque)
    return tuple(map(tuple, table.reshape(len(table), -1).tolist()))


def pose_rows(
    model: Any, poses: Mapping[str, Sequence[Sequence[float]]], scenario: Scenario
) -> tuple[tuple[float, ...], ...]:
    """All mocap bodies in a row (7 nmocap,) for each of their poses.

    A body without a next pose stays where it is. A `keyframe` says where those are that have none.
    """
    if not poses:
        return ()
    key = scenario.keyframe
    table = np.empty((max(map(len, poses.values())), int(model.nmocap), 7))
    for body in np.flatnonzero(model.body_mocapid >= 0).tolist():
        number = int(model.body_mocapid[body])
        rows: Any = poses.get(str(model.body(body).name))
        if rows is None and key >= 0:
            place = model.key_mpos[key].reshape(-1, 3)[number]
            rows = [(*place, *model.key_mquat[key].reshape(-1, 4)[number])]
        elif rows is None:
            rows = [(*model.body_pos[body], *model.body_quat[body])]
        table[: len(rows), number], table[len(rows) :, number] = rows, rows[-1]
    lengths = np.linalg.norm(table[:, :, 3:], axis=2, keepdims=True)
    table[:, :, 3:] /= np.where(lengths == 0, 1.0, lengths)
    return tuple(map(tuple, table.reshape(len(table), -1).tolist()))
