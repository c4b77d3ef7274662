"""The largest stable timesteps, beside theory."""

from __future__ import annotations

import itertools
import math

import pytest
from msgspec.structs import replace

from coursebuild.numerics.problem import INTEGRATORS, Integrator, Problem
from coursebuild.numerics.problems import all_problems, problem_named
from coursebuild.numerics.problems.oscillators import rk4_factor, rk4_limit
from coursebuild.numerics.stability import attempt, boundaries, boundary

pytestmark = pytest.mark.site


def limits(problem: Problem) -> dict[Integrator, float]:
    assert problem.limit is not None
    found = {one: problem.limit(one) for one in INTEGRATORS}
    return {one: limit.timestep for one, limit in found.items() if limit is not None}


def test_tops_are_stable_up_to_their_limit() -> None:
    for name in ("free-top", "thin-rod", "coin"):
        problem = problem_named(name)
        limit = limits(problem)[Integrator.RK4]
        assert attempt(problem, Integrator.RK4, 0.995 * limit).stable, name
        assert not attempt(problem, Integrator.RK4, 1.005 * limit).stable, name
        assert limits(problem)[Integrator.EULER] == 0.0, name
        for integrator in (Integrator.IMPLICIT, Integrator.IMPLICITFAST, Integrator.DISCRETE):
            assert attempt(problem, integrator, 100 * limit).stable, (name, integrator)


def test_limits_are_within_half_a_percent() -> None:
    wrong = []
    problems = [problem for problem in all_problems() if problem.case in (5, 6, 12)]
    for problem, integrator in itertools.product(problems, INTEGRATORS):
        limit = limits(problem)[integrator]
        trials = {0.995 * limit: True, 1.005 * limit: False}
        if math.isinf(limit):
            trials = dict.fromkeys((0.1, 1.0, 10.0), True)
        for timestep, stable in trials.items():
            found = attempt(problem, integrator, timestep)
            if found.stable != stable:
                wrong.append((problem.name, integrator, timestep, found.status))
    assert wrong == []


def test_a_boundary_is_found_by_scanning_and_bisecting() -> None:
    problem = replace(problem_named("damped-spring-0.1"), search=(0.05, 1.0))
    for integrator in (Integrator.EULER, Integrator.EULER_EXPLICIT, Integrator.RK4):
        found = boundary(problem, integrator)
        assert found.difference is not None
        assert abs(found.difference) < 0.005
        assert found.monotone
        assert found.beyond in ("slow-growth", "diverged")


def test_where_all_or_none_is_stable() -> None:
    problem = replace(problem_named("damped-spring-1"), search=(0.05, 0.5))
    assert boundary(problem, Integrator.DISCRETE).largest is None
    problem = replace(problem, search=(0.6, 2.0))
    found = boundary(problem, Integrator.EULER)
    assert found.largest == 0.0
    assert found.difference is None
    with pytest.raises(ValueError, match="no range of timesteps"):
        boundary(replace(problem, search=None), Integrator.EULER)
    assert boundaries(replace(problem, search=None)) == ()


def test_a_boundary_that_is_not_monotone_is_flagged() -> None:
    found = boundary(problem_named("chain-heavy-tip"), Integrator.IMPLICIT)
    assert not found.monotone
    assert found.islands
    assert found.largest is not None
    assert all(timestep > found.largest for timestep in found.islands)


def test_growth_beyond_the_boundary_is_that_of_theory() -> None:
    problem = problem_named("damped-spring-10")
    # −z² − 2ζz + … : the larger root of λ² − (2 − 2ζz − z²) λ + (1 − 2ζz) at z = hω
    z = 1.01 * 2 * (math.sqrt(101) - 10)
    half = 1 - 10 * z - z * z / 2
    root = abs(half) + math.sqrt(half * half - (1 - 20 * z))
    bounded = replace(problem, position_bound=math.inf, velocity_bound=math.inf, steps=1000)
    trial = attempt(bounded, Integrator.EULER_EXPLICIT, z / 10)
    assert trial.growth == pytest.approx(root, rel=1e-8)


def test_without_joint_damping_eulerdamp_makes_no_difference() -> None:
    free = replace(problem_named("damped-spring-0"), search=(0.1, 0.3), steps=100)
    assert Integrator.EULER_EXPLICIT.value not in {one.integrator for one in boundaries(free)}
    damped = replace(problem_named("damped-spring-1"), search=(0.05, 0.1), steps=100)
    assert Integrator.EULER_EXPLICIT.value in {one.integrator for one in boundaries(damped)}


def test_the_polynomial_of_runge_and_kutta() -> None:
    assert rk4_limit(0.0) == pytest.approx(2 * math.sqrt(2), rel=1e-12)
    assert rk4_limit(1.0) == pytest.approx(2.785293563405282, rel=1e-9)
    assert abs(rk4_factor(2j * math.sqrt(2))) == pytest.approx(1.0, rel=1e-15)
