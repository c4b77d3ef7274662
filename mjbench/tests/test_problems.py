"""Every hard case has two references that agree, and a model that MuJoCo takes."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from msgspec.structs import replace

from mjbench.cases import (
    DisagreementError,
    check_limits,
    floor,
    measure_figures,
)
from mjbench.problem import STANDARD, Array, Integrator, Limit, Motion, Problem
from mjbench.problems import all_problems
from mjbench.problems.impact import Bounce
from mjbench.simulation import compile_model

pytestmark = pytest.mark.long

OFF = 1 + 1e-6
DIRECTIONS = ("axis", "zaxis", "condim", "iterations")
"""Attributes of MJCF whose size says nothing."""
_PLANE = {f"geom size {n}" for n in range(3)}  # it is infinite
_SOFT = {f"geom solimp {n}" for n in (2, 3, 4)}  # dmin is dmax: how one becomes the other
_OTHER_AXES = {"inertial diaginertia 0", "inertial diaginertia 2"}  # it turns about the other axis
_FRICTIONS = {"geom friction 1", "geom friction 2"}  # against twisting and rolling
_BODY = {"geom size 0", "geom mass 0"}  # it does not turn, and falls or swings by what is given
IMMATERIAL = {
    "tumbling-box": {"geom mass 0"},  # without forces all moments may be multiplied alike
    "pendulum": _OTHER_AXES,
    "double-pendulum": _OTHER_AXES,
    "chain-hinges": _OTHER_AXES,
    "chain-balls": {f"qpos {4 * n}" for n in range(1, 6)},  # the length of a quaternion
    # What is light beside a body a million times as heavy.
    "chain-heavy-tip": _OTHER_AXES
    | {"inertial diaginertia 1", "inertial mass 0", "solution inertia", "solution masses 2"},
    "free-top": {"inertial mass 0"},  # its centre rests, here and in the next ones
    "thin-rod": {"inertial mass 0"},
    "coin": {"inertial mass 0"},
    "flat-plate": {"inertial mass 0"},
    "millimetre-cube": {"geom density 0"},  # as the box: no forces
    "distant-body": _BODY,
    "projectile": _BODY,
    "damped-spring": {"geom size 0"},  # its mass is given
    "stiff-servo": {"geom size 0"},
    "soft-equality": _BODY | {f"joint solimp {n}" for n in (2, 3, 4)},
    "sliding": _PLANE | _FRICTIONS | {"geom mass 0"},  # friction goes with weight
    # It does not slip: neither how much friction there could be nor what presses it counts.
    "rolling": _PLANE | _FRICTIONS | {"geom mass 0", "geom friction 0", "option gravity 2"},
    "sticking": _PLANE  # it rests under all of these
    | _FRICTIONS
    | {"geom mass 0", "geom friction 0", "option gravity 0", "option gravity 2"}
    | {"solution slope", "solution friction", "solution gravity"},
    "elastic-impact": _PLANE | _SOFT | {"geom mass 0"},  # its stiffness is of accelerations
    "newtons-cradle": _SOFT,
    "stack-1000": _PLANE | _SOFT | {"geom solimp 0"},  # deeper than the width: dmax alone counts
    "stack-10000": _PLANE | _SOFT | {"geom solimp 0"},
    "stack": _PLANE | _SOFT,
}
"""What a motion does not depend on, by the beginning of a case's name: no formula can notice it."""


def test_all_thirteen_cases_are_there() -> None:
    assert {problem.case for problem in all_problems().values()} == set(range(1, 14))
    assert len(all_problems()) == 44, "each has a name of its own"


def test_both_references_agree() -> None:
    assert [name for name, problem in all_problems().items() if not said_to_be_known(problem)] == []


def said_to_be_known(problem: Problem) -> bool:
    try:
        sizes = floor(problem)
    except (DisagreementError, ValueError):  # as where a hold ends between two samples
        return False
    return 0 < sizes.largest < 2e-6


@pytest.mark.slow
def test_each_number_of_each_problem_that_is_off_by_a_millionth_is_noticed() -> None:
    """Of the model, the scenario and the solution, one after the other."""
    mismatches = {}
    for problem in all_problems().values():
        if problem.name == "chain-heavy-tip":  # an integration of seconds, forty times
            problem = replace(problem, scenario=replace(problem.scenario, duration=0.003))
        unnoticed = {name for name, variant in variants(problem) if said_to_be_known(variant)}
        expected = next((v for k, v in IMMATERIAL.items() if problem.name.startswith(k)), set())
        if unnoticed != expected:
            mismatches[problem.name] = unnoticed ^ expected
    assert mismatches == {}


def variants(problem: Problem) -> Iterator[tuple[str, Problem]]:
    """The problem with each of its numbers changed, and what was changed."""
    element = ""
    for match in re.finditer(r'<(\w+)|(\w+)="([-+.\de ]+)"', problem.mjcf):
        element = match[1] or element
        numbers = [] if match[1] else list(re.finditer(r"\S+", match[3]))
        for n, number in enumerate(numbers):
            if float(number[0]) and match[2] not in DIRECTIONS:
                start, end = (match.start(3) + at for at in number.span())
                text = f"{problem.mjcf[:start]}{float(number[0]) * OFF!r}{problem.mjcf[end:]}"
                yield f"{element} {match[2]} {n}", replace(problem, mjcf=text)
    for name, scenario in change_each_number(
        problem.scenario, ("qpos", "qvel", "hold", "controls")
    ):
        yield name, replace(problem, scenario=scenario)
    for name, solution in change_each_number(problem.reference.solution):
        reference = replace(problem.reference, solution=solution)
        yield f"solution {name}", replace(problem, reference=reference)


def change_each_number(value: Any, names: tuple[str, ...] = ()) -> Iterator[tuple[str, Any]]:
    """A struct with each of its numbers changed, also those in tuples."""
    for name in names or value.__struct_fields__:
        field = getattr(value, name)
        if isinstance(field, float) and field:
            yield name, replace(value, **{name: field * OFF})
        for n, entry in enumerate(field if isinstance(field, tuple) else ()):
            new = tuple(OFF * x for x in entry) if isinstance(entry, tuple) else OFF * entry
            if new != entry:
                yield f"{name} {n}", replace(value, **{name: (*field[:n], new, *field[n + 1 :])})


class BentBounce(Bounce, frozen=True):
    """An impact whose formula is off in the contact, where no sample falls."""

    def motion(self, times: Array) -> Motion:
        motion = super().motion(times)
        bend = np.where((times > 0.05) & (times < 0.053), OFF, 1.0)
        return replace(motion, position=motion.position * bend[:, None])


def test_references_are_compared_between_samples_too() -> None:
    problem = all_problems()["elastic-impact"]
    bent = replace(problem.reference, solution=BentBounce())
    with pytest.raises(DisagreementError):
        floor(replace(problem, reference=bent))


def test_theory_of_a_step_that_the_engine_does_not_follow_is_refused() -> None:
    projectile = all_problems()["projectile"]
    figures = list(measure_figures(projectile, projectile.checks))
    assert [figure.integrator for figure in figures] == [i.value for i in STANDARD]
    off = replace(projectile.checks[0], exact=-0.04905 * OFF)
    expected = (
        "theory of `projectile` (error of the height after 1 s at 10 ms, Euler) differs "
        "from the engine by 4.9e-08, where 1e-12 is said"
    )
    with pytest.raises(DisagreementError, match=f"^{re.escape(expected)}$"):
        list(measure_figures(projectile, (off,)))
    assert list(measure_figures(projectile, (replace(off, precise=(Integrator.RK4,), exact=0.0),)))


def test_a_limit_that_is_off_by_a_millionth_is_refused() -> None:
    refusals = []
    for name, part in itertools.product(("damped-spring-0", "coin"), (1.0, OFF, 1 / OFF)):
        try:
            check_limits(with_limits_scaled(all_problems()[name], part))
        except DisagreementError as error:
            refusals.append(str(error))
    assert len(refusals) == 4
    assert refusals[0] == (
        "`damped-spring-0`: 0.2000002 s under Euler is not where its steps begin to grow "
        "(hω = 2(√(ζ²+1) + ζ))"
    )


def with_limits_scaled(problem: Problem, part: float) -> Problem:
    def limit(integrator: Integrator) -> Limit | None:
        limit = problem.limit(integrator) if problem.limit else None
        return limit and replace(limit, timestep=limit.timestep * part)

    return replace(problem, limit=limit)


def test_problems_are_small_models_that_timesteps_divide(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)  # where MuJoCo would write what it warns of
    for problem in all_problems().values():
        assert all(problem.scenario.steps(step) for step in problem.timesteps)
        assert not re.search("timestep|integrator|file=", problem.mjcf), problem.name
        assert compile_model(problem.mjcf, Integrator.RK4, 1e-3).nbody <= 12
    assert list(tmp_path.iterdir()) == []
