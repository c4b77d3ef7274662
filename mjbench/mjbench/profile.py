"""Where the time of a step goes, by MuJoCo's own timers.

1. `mjData.timer` adds up the time of each part of a step. Parts lie in each other: forward dynamics
   in the step, what depends on positions in them, collision in that. Here each phase is what is its
   own, so that phases add up to the step.
2. Sensors and the accelerations without constraints have no timer. Sensors are what forward
   dynamics take less of where they are off; nothing of the motion depends on them.
3. The timers read the wall clock, which runs on while others have the processor. A scenario is run
   several times in short stretches, all of which are the same work; of each the quickest counts.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import mujoco
import numpy as np

from mjbench.costs import inputs_of
from mjbench.problem import Array, Inputs
from mjbench.reports import Interval
from mjbench.reports.scene_report import PhaseProfile, WorkPrecisionRow
from mjbench.reports.shown_errors import seconds_text
from mjbench.reports.terminal import Style, fitted_table
from mjbench.scene import Scene
from mjbench.settings import with_setting
from mjbench.simulation import STATE, full_state, initial_data, silent

_ROUNDS, _QUICK_ROUNDS = 12, 5
"""How often a scenario is run."""
_STRETCH = 16
"""Steps of a stretch, at most."""
_BUDGET, _QUICK_BUDGET = 20.0, 5.0
"""Seconds that rounds may take in all, by MuJoCo's timers; there are two of them at least."""
_NO_SENSORS = int(mujoco.mjtDisableBit.mjDSBL_SENSOR)
_TIMERS = mujoco.mjtTimer
_PARTS = {
    "kinematics": ("POS_KINEMATICS",),
    "inertia": ("POS_INERTIA",),
    "broad collision": ("COL_BROAD",),
    "narrow collision": ("COL_NARROW",),
    "making constraints": ("POS_MAKE", "POS_PROJECT"),
    "velocity": ("VELOCITY",),
    "actuation": ("ACTUATION",),
    "solver": ("CONSTRAINT",),
}
"""The phases that are timers, which lie in forward dynamics and not in each other."""


def profile_rows(
    model: Any,
    scene: Scene,
    rows: Mapping[int, WorkPrecisionRow],
    *,
    quick: bool = False,
) -> tuple[PhaseProfile, ...]:
    """Profile a scenario under settings, given by the numbers of their rows.

    A `FatalError` of MuJoCo where one is lost.
    """
    jobs = [_Job(model, scene, number, row) for number, row in rows.items()]
    with silent():
        for count in range(_QUICK_ROUNDS if quick else _ROUNDS):
            spent = sum(job.run() for job in jobs)
            if count and (count + 2) * spent > (_QUICK_BUDGET if quick else _BUDGET):
                break
        return tuple(job.profile() for job in jobs)


class _Job:
    """A scenario under a setting, in rounds."""

    def __init__(self, model: Any, scene: Scene, number: int, row: WorkPrecisionRow) -> None:
        self._number, self._row = number, row
        self._model = with_setting(model, row.setting)
        holds = inputs_of(self._model, scene.scenario, row.setting.timestep)
        self._holds = list(_stretches(holds))
        self._data = initial_data(scene.scenario, self._model)
        self._state = full_state(self._model, self._data)
        variants = [self._model]
        if model.nsensor and not self._model.opt.disableflags & _NO_SENSORS:
            variants.append(with_setting(model, row.setting))
            variants[1].opt.disableflags |= _NO_SENSORS
        self._variants: list[tuple[Any, list[Array]]] = [(variant, []) for variant in variants]

    def run(self) -> float:
        """Make a round; the time that it took, s."""
        for variant, tables in self._variants:
            tables.append(self._timed_run(variant))
        return sum(float(t[-1][:, _TIMERS.mjTIMER_STEP].sum()) for _, t in self._variants)

    def profile(self) -> PhaseProfile:
        """What all rounds say."""
        steps = sum(count for _, count in self._holds)
        times, *variant_times = (
            _quickest(np.array(tables)) / steps for _, tables in self._variants
        )
        phases = _phases(times)
        for without_sensors in variant_times:
            phases["sensors"] = max(0.0, phases["other"] - _phases(without_sensors)["other"])
            phases["other"] -= phases["sensors"]
        counts = self._count()
        return PhaseProfile(
            row=self._number,
            name=self._row.name,
            steps=steps,
            step=float(times[_TIMERS.mjTIMER_STEP]),
            phases=phases,
            contacts=(float(counts[:, 0].mean()), int(counts[:, 0].max())),
            constraints=(float(counts[:, 1].mean()), int(counts[:, 1].max())),
            iterations=float(counts[:, 2].mean()),
            islands=float(counts[:, 3].mean()),
            rounds=len(self._variants[0][1]),
        )

    def _timed_run(self, variant: Any) -> Array:
        """What each timer says of each stretch, (stretches, timers) in s."""
        table = np.zeros((len(self._holds), int(_TIMERS.mjNTIMER)))
        data = self._begin()
        for times, (inputs, steps) in zip(table, self._holds, strict=True):
            inputs.give(data)
            data.timer.duration[:] = 0
            mujoco.mj_step(variant, data, steps)
            times[:] = data.timer.duration
        return table

    def _count(self) -> Array:
        """Contacts, rows of constraints, iterations and islands after each step: (steps, 4)."""
        data, counts = self._begin(), []
        for inputs, steps in self._holds:
            inputs.give(data)
            for _ in range(steps):
                mujoco.mj_step(self._model, data)
                counts.append((data.ncon, data.nefc, data.solver_niter.sum(), data.nisland))
        return np.array(counts, dtype=np.float64)

    def _begin(self) -> Any:
        mujoco.mj_resetData(self._model, self._data)  # a state does not say who sleeps
        mujoco.mj_setState(self._model, self._data, self._state, STATE)
        return self._data


def _stretches(holds: Sequence[tuple[Inputs, int]]) -> Iterator[tuple[Inputs, int]]:
    """The same inputs, none for more steps than a stretch has."""
    for inputs, steps in holds:
        for begin in range(0, steps, _STRETCH):
            yield inputs, min(_STRETCH, steps - begin)


def _quickest(tables: Array) -> Array:
    """The timers of all stretches together (timers,), each from its quickest round."""
    rounds = tables[:, :, _TIMERS.mjTIMER_STEP].argmin(axis=0)
    quickest: Array = tables[rounds, np.arange(tables.shape[1])].sum(axis=0)
    return quickest


def _phases(times: Array) -> dict[str, float]:
    """The times of phases, which add up to that of the step."""

    def timer(name: str) -> float:
        return float(times[getattr(_TIMERS, f"mjTIMER_{name}")])

    phases = {name: sum(map(timer, timers)) for name, timers in _PARTS.items()}
    forward = timer("FORWARD")
    # Under RK4 the timer of advancing stands still: what lies between its evaluations is no part of
    # any of them.
    integration = timer("STEP") - forward
    return {**phases, "integration": integration, "other": forward - sum(phases.values())}


_ALIKE = 1.1
"""Times that differ by a smaller factor are alike: the wall clock tells no more."""


def profile_text(
    own_profile: PhaseProfile, rival: PhaseProfile | None, cost: Interval | None = None
) -> str:
    """What of the time a verdict rests on that compares two settings.

    Without a `rival` only what takes the longest is known. `cost`: of the rival, relative to the
    own setting's, by processor time, which other work on the machine does not disturb.
    """
    phases = [name for name in own_profile.phases if name != "other"]
    phase = max(phases, key=lambda name: own_profile.phases[name])
    share = own_profile.phases[phase] / own_profile.step if own_profile.step else 0.0
    most = f"of the phases {phase} takes the most, {100 * share:.0f} % of a step"
    if rival is None:
        return most
    pairs = {
        name: (own_profile.steps * time, rival.steps * rival.phases.get(name, 0.0))
        for name, time in own_profile.phases.items()
    }
    before, after = (sum(times) for times in zip(*pairs.values(), strict=True))
    is_alike = cost is not None and cost.low <= 1 <= cost.high
    if is_alike or not (before and after) or 1 / _ALIKE < after / before < _ALIKE:
        return f"{most}; the verdict rests on errors, not on time"
    if cost is not None and not cost.low / _ALIKE <= after / before <= cost.high * _ALIKE:
        return f"{most}; which the verdict rests on is not known: other work disturbed the timers"
    step_ratio, count_ratio = rival.step / own_profile.step, rival.steps / own_profile.steps
    if abs(math.log(step_ratio)) < min(math.log(_ALIKE), abs(math.log(count_ratio))):
        steps = f"{own_profile.steps} → {rival.steps}"
        return f"{most}; the verdict rests on the number of steps: {steps} under {rival.name}"
    sign = math.copysign(1.0, after - before)
    phase = max(pairs, key=lambda name: sign * (pairs[name][1] - pairs[name][0]))
    change = " → ".join(seconds_text(time, 2) for time in pairs[phase])
    phase = "what has no timer" if phase == "other" else phase
    return f"{most}; the verdict rests on {phase}: over the scenario {change} under {rival.name}"


def profile_lines(profiles: Sequence[PhaseProfile], text: str, style: Style) -> Iterator[str]:
    """A table of phases by setting, and what the verdict rests on."""
    if not profiles:
        return
    yield ""
    yield from style.wrap(f"where the time goes: {text}")
    names = list(profiles[0].phases)
    labels = ("a step", *names, "steps", "contacts", "rows of constraints", "iterations", "islands")
    columns: list[tuple[str, list[str]]] = [("", list(labels))]
    for profile in profiles:
        times = [_share(profile, name) for name in names]
        counts = [f"{profile.steps}", _counts(profile.contacts), _counts(profile.constraints)]
        means = [f"{profile.iterations:.3g}", f"{profile.islands:.3g}"]
        columns.append((profile.name, [seconds_text(profile.step, 2), *times, *counts, *means]))
    yield from fitted_table(columns, style.width)
    rounds = min(profile.rounds for profile in profiles)
    yield from style.wrap(
        f"by MuJoCo's own timers, the quickest of {rounds} rounds; contacts, rows, iterations and "
        "islands are means of all steps, and the most in brackets"
    )


def _share(profile: PhaseProfile, name: str) -> str:
    time = profile.phases.get(name)
    if time is None:
        return ""
    share = f"{100 * time / profile.step:.0f} %" if profile.step else ""
    return f"{seconds_text(time, 2)}  {share}".rstrip()


def _counts(counts: tuple[float, int]) -> str:
    return f"{counts[0]:.3g} ({counts[1]})"
