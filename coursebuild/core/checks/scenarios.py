"""Scenarios against the compiled model that they are declared for.

Entry point: `check_scenarios(declared, facts)`.

1. What they name is there: keyframes, bodies, sites, sensors.
2. States and commands have as many numbers as the model takes.
3. The model's own timestep ends where the state is looked at and commands change: its errors could
   not be compared otherwise.
"""

from __future__ import annotations

from collections.abc import Iterator

from coursebuild.core.model import Declarations, DeclaredScenario
from coursebuild.core.model.results import ModelFacts
from coursebuild.core.text.diagnostics import Diagnostic, diagnose, did_you_mean

_RULE = "scenario-model"


def check_scenarios(declared: Declarations, facts: ModelFacts) -> Iterator[Diagnostic]:
    """Everything in which the scenarios do not fit the model."""
    for scenario in declared.scenarios:
        yield from _check_keyframe(scenario, facts)
        yield from _check_lengths(scenario, facts)
        yield from _check_measured(scenario, facts)
        yield from _check_timestep(scenario, facts)


def _check_keyframe(scenario: DeclaredScenario, facts: ModelFacts) -> Iterator[Diagnostic]:
    wanted, place = scenario.keyframe, scenario.place("keyframe")
    count = len(facts.keyframes)
    if isinstance(wanted, int) and wanted >= count:
        have = f"it has {count}" if count else "it has none"
        message = f"the model has no keyframe {wanted}: {have}, counted from 0"
        yield diagnose(_RULE, place, message)
    if isinstance(wanted, str) and wanted not in facts.keyframes:
        names = [name for name in facts.keyframes if name]
        message = f"the model has no keyframe `{wanted}`"
        yield diagnose(_RULE, place, message, help=did_you_mean(wanted, names))


def _check_lengths(scenario: DeclaredScenario, facts: ModelFacts) -> Iterator[Diagnostic]:
    for name, given, count, what in (
        ("qpos", scenario.qpos, facts.nq, "positions (`nq`)"),
        ("qvel", scenario.qvel, facts.nv, "velocities (`nv`)"),
        ("controls", scenario.controls[0] if scenario.controls else (), facts.nu, "actuators"),
    ):
        if name == "controls" and scenario.controls:
            wrong = len(given) != count
            message = f"a command has {len(given)} numbers, and the model has {count} {what}"
        else:
            wrong = bool(given) and len(given) != count
            message = f"`{name}` has {len(given)} numbers, and the model has {count} {what}"
        if wrong:
            yield diagnose(_RULE, scenario.place(name), message)


def _check_measured(scenario: DeclaredScenario, facts: ModelFacts) -> Iterator[Diagnostic]:
    measure = scenario.measure
    if measure is None:
        return
    known = {"body": facts.body_names, "site": facts.sites, "sensor": facts.sensors}[measure.kind]
    if measure.name not in known:
        message = f"the model has no {measure.kind} `{measure.name}`"
        help = did_you_mean(measure.name, [name for name in known if name])
        yield diagnose(_RULE, scenario.place("measure"), message, help=help)


def _check_timestep(scenario: DeclaredScenario, facts: ModelFacts) -> Iterator[Diagnostic]:
    step = facts.timestep
    given = (
        ("sample", scenario.sample),
        ("hold", scenario.hold),
        ("duration", scenario.duration),
    )
    for name, length in given:
        if length is not None:
            count = round(length / step)
            if abs(count * step - length) > 1e-9 * length:
                message = f"the model's timestep, {step:g} s, does not divide `{name}`"
                message += f" ({length:g} s)"
                help = f"a multiple near it is {max(count, 1) * step:.12g}"
                yield diagnose(_RULE, scenario.place(name), message, help=help)
            return
