"""Every hard case has two references that agree, and a model that MuJoCo takes."""

from __future__ import annotations

import itertools
import re
from pathlib import Path

import numpy as np
import pytest
from msgspec.structs import replace

from mjbench.cases import DisagreementError, check_limits, floor, measure_figures
from mjbench.problem import STANDARD, Array, Integrator, Limit, Motion, Problem
from mjbench.problems import all_problems
from mjbench.problems.impact import Bounce
from mjbench.simulation import compile_model

pytestmark = pytest.mark.long

OFF = 1 + 1e-6


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
