"""The largest stable timesteps, beside theory."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable

import pytest
from msgspec.structs import replace

from coursebuild.numerics.detector import RunStatus
from coursebuild.numerics.problem import Integrator, Scenario, Setup
from coursebuild.numerics.problems import all_problems
from coursebuild.numerics.problems.oscillators import rk4_factor, rk4_limit
from coursebuild.numerics.reports.scene_report import StableRow
from coursebuild.numerics.stability import (
    StabilityTrial,
    attempt,
    boundaries,
    boundary,
    scan,
    stable_row,
    with_energy_bound,
)

pytestmark = pytest.mark.site


def test_limits_are_those_of_theory() -> None:
    """What is beyond by δ grows by 2δ in a step or more: it shows after a growth of exp 9."""
    mismatches = []
    limited = [p for p in all_problems().values() if p.limit is not None]
    problems = [with_energy_bound(replace(p, span=1.0)) for p in limited]
    for problem, integrator in itertools.product(problems, Integrator):
        theory = problem.limit(integrator) if problem.limit else None
        trials = {0.1: True, 1.0: True, 10.0: True}
        if theory is None or theory.timestep == 0:
            continue
        if math.isfinite(theory.timestep):
            problem = replace(problem, span=4000 * theory.timestep)
            trials = {0.996 * theory.timestep: True, 1.004 * theory.timestep: False}
        for timestep, stable in trials.items():
            trial = attempt(problem, integrator, timestep)
            if trial.stable != stable:
                mismatches.append((problem.name, integrator, timestep, trial.status))
    assert mismatches == []


def test_a_boundary_is_found_beside_theory() -> None:
    problem = replace(all_problems()["damped-spring-0.1"], search=(0.1, 1.0), span=200.0)
    lines = {line.integrator: line for line in boundaries(problem)}
    assert {integrator.value for integrator in Integrator} == set(lines), (
        "joints with damping know eulerdamp"
    )
    for integrator in (Integrator.EULER, Integrator.EULER_EXPLICIT, Integrator.RK4):
        line = lines[integrator.value]
        assert line.largest is not None and line.difference is not None
        assert abs(line.difference) < 0.01
        assert line.monotone and line.beyond == "slow-growth"
        assert line.duration == problem.span == 200
        assert line.steps == math.ceil(200 / line.largest)
        assert line.tried >= 40


def test_where_all_or_none_is_stable() -> None:
    problem = replace(all_problems()["damped-spring-1"], search=(0.05, 0.5))
    line = boundary(problem, Integrator.DISCRETE)
    assert (line.largest, line.searched, line.steps) == (None, (0.05, 0.5), 1000)
    line = boundary(replace(problem, search=(0.6, 2.0)), Integrator.EULER)
    assert (line.largest, line.difference, line.tried) == (0.0, None, 0)
    assert boundaries(replace(problem, search=None)) == ()
    undamped = replace(all_problems()["damped-spring-0"], search=(0.1, 0.3), span=10.0)
    assert Integrator.EULER_EXPLICIT.value not in {
        boundary_line.integrator for boundary_line in boundaries(undamped)
    }


def search_row(lost: Callable[[float], bool], search: tuple[float, float]) -> StableRow:
    def attempt_at(step: float) -> StabilityTrial:
        return StabilityTrial(step, RunStatus.DIVERGED if lost(step) else RunStatus.OK, 1.0)

    setup = Setup(scenario=Scenario(5.0, 5.0))
    return stable_row(Integrator.RK4, scan(attempt_at, search), setup, 5.0)


@pytest.mark.parametrize(
    ("island", "largest"),
    [
        ((61.9, 61.95), 61.9),  # just below the first boundary
        ((55.0, 57.0), 55.0),
        ((11.0, 12.5), 11.0),  # a fifth of it
        ((8.0, 9.0), 8.0),
        ((70.0, 90.0), 62.0),
    ],
)
def test_the_largest_is_below_everything_that_is_lost(
    island: tuple[float, float], largest: float
) -> None:
    low, high = island
    row = search_row(lambda step: low < step < high or 62 < step < 100, (1.0, 1000.0))
    assert row.largest == pytest.approx(largest, rel=2e-4)
    assert row.largest <= largest
    assert row.islands is not None and row.islands[1] == pytest.approx(1000.0)
    assert row.searched[0] <= max(1.001, largest / 8)
    assert row.steps == math.ceil(5.0 / row.largest)


def test_energy_that_cannot_be_is_instability() -> None:
    """Of all that a swinging chain has, 0.25 J, it had 300 J after 2,000 steps of 7.5 ms."""
    chain = with_energy_bound(all_problems()["chain-balls"])
    rest = 6 * 7 / 2 * 0.1 * 9.81 * 0.1  # J below the pivot when it hangs
    assert chain.energy_bound + rest == pytest.approx(11 * 0.26, rel=0.1)
    trial = attempt(chain, Integrator.EULER, 7.5e-3)
    assert trial.status is RunStatus.SLOW_GROWTH
    assert trial.growth > 1
    assert attempt(chain, Integrator.EULER, 2e-3).stable
    servo = with_energy_bound(all_problems()["stiff-servo-1"])
    assert servo.energy_bound == math.inf, "a motor drives it"


def test_all_timesteps_run_for_the_same_time() -> None:
    """A body that leaves its bounds at the end of that time, whatever divides it."""
    drifting = replace(
        all_problems()["damped-spring-0"],
        mjcf="<mujoco><option gravity='0 0 0'/><worldbody><body><joint type='slide'/>"
        "<geom size='.1'/></body></worldbody></mujoco>",
        scenario=Scenario(0.4, 0.1, (0.0,), (1.0,)),
        span=0.39,
        position_bound=0.385,
    )
    steps = [part * 0.39 / n for n in range(2, 60) for part in (1.0, 1.01)]
    assert [step for step in steps if attempt(drifting, Integrator.EULER, step).stable] == []
    assert attempt(replace(drifting, span=0.38), Integrator.EULER, 0.01).stable


def test_growth_beyond_the_boundary_is_that_of_theory() -> None:
    problem = all_problems()["damped-spring-10"]
    # −z² − 2ζz + … : the larger root of λ² − (2 − 2ζz − z²) λ + (1 − 2ζz) at z = hω
    z = 1.01 * 2 * (math.sqrt(101) - 10)
    half = 1 - 10 * z - z * z / 2
    root = abs(half) + math.sqrt(half * half - (1 - 20 * z))
    endless = replace(problem, position_bound=math.inf, velocity_bound=math.inf)
    endless = replace(endless, span=100 * z)
    trial = attempt(endless, Integrator.EULER_EXPLICIT, z / 10)
    assert trial.growth == pytest.approx(root, rel=1e-8)


def test_the_polynomial_of_runge_and_kutta() -> None:
    assert rk4_limit(0.0) == pytest.approx(2 * math.sqrt(2), rel=1e-12)
    assert rk4_limit(1.0) == pytest.approx(2.785293563405282, rel=1e-9)
    assert abs(rk4_factor(2j * math.sqrt(2))) == pytest.approx(1.0, rel=1e-15)
