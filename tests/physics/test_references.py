"""Every hard case has two references that agree, and a model that MuJoCo takes."""

from __future__ import annotations

import decimal
import re
from decimal import Decimal
from pathlib import Path

import numpy as np
import pytest

from coursebuild.physics.engine import compiled, motion_of
from coursebuild.physics.extrapolation import State, integrate
from coursebuild.physics.problem import Integrator, Problem
from coursebuild.physics.problems import agreement, all_problems, problem_named, problem_names
from coursebuild.physics.problems import tumbling_box as box

PROBLEMS = all_problems()
WORSE = {
    "chain-heavy-tip": 1e-8,  # its mass matrix has a condition of 1e6 and swings at 1e4 rad/s
    "distant-body": 1.3e-6,  # ten times the distance of neighbouring numbers there
}


def test_all_thirteen_cases_are_there() -> None:
    assert {problem.case for problem in PROBLEMS} == set(range(1, 14))
    assert len(set(problem_names())) == len(PROBLEMS)
    assert problem_named("tumbling-box").case == 1


@pytest.mark.parametrize("problem", PROBLEMS, ids=problem_names())
def test_both_references_agree(problem: Problem) -> None:
    assert problem.agreement <= WORSE.get(problem.name, 1e-10)
    found = agreement(problem)
    assert found is not None
    assert found <= problem.agreement


@pytest.mark.parametrize("problem", PROBLEMS, ids=problem_names())
def test_the_reference_begins_where_the_scenario_does(problem: Problem) -> None:
    assert problem.reference is not None
    scenario = problem.scenario
    model = compiled(problem.mjcf, Integrator.EULER, 1e-3)
    qpos = np.array([scenario.qpos or model.qpos0], dtype=float)
    qvel = np.array([scenario.qvel or [0.0] * model.nv], dtype=float)
    begun = motion_of(model, np.zeros(1), qpos, qvel)
    soon = problem.reference.motion(np.array([1e-9, 2e-9]))
    assert soon.position.shape[1:] == begun.position.shape[1:]
    assert np.allclose(soon.position[0], begun.position[0], rtol=1e-12, atol=1e-5)
    assert np.allclose(np.abs(soon.attitude[0]), np.abs(begun.attitude[0]), rtol=0, atol=1e-5)
    assert np.allclose(soon.velocity[0], begun.velocity[0], rtol=1e-6, atol=1e-4)


@pytest.mark.parametrize("problem", PROBLEMS, ids=problem_names())
def test_timesteps_divide_the_looks_and_models_say_neither_timestep_nor_integrator(
    problem: Problem,
) -> None:
    looks = len(problem.scenario.times)
    assert looks * problem.scenario.sample == pytest.approx(problem.scenario.duration)
    for timestep in problem.timesteps:
        count = problem.scenario.sample / timestep
        assert count == pytest.approx(round(count), rel=1e-9)
    assert not re.search("timestep|integrator", problem.mjcf)


@pytest.mark.parametrize("nudge", box.NUDGES)
def test_the_boxs_closed_form_conserves_energy_and_momentum(nudge: float) -> None:
    form, inertia = box.Tumbling(nudge, box.SPIN), box.moments()
    omega = form.omega(np.linspace(0.1, 6 * form.flip_interval, 400))
    energy, momentum = omega**2 @ inertia, np.linalg.norm(omega * inertia, axis=1)
    start = np.array([nudge, box.SPIN, 0.0])
    assert np.max(np.abs(energy / (start**2 @ inertia) - 1)) < 1e-13
    assert np.max(np.abs(momentum / np.linalg.norm(start * inertia) - 1)) < 1e-13


@pytest.mark.parametrize("nudge", box.NUDGES)
def test_the_boxs_closed_form_agrees_with_thirty_digits(nudge: float) -> None:
    form = box.Tumbling(nudge, box.SPIN)
    times = np.array([0.5, 1.0, 1.5, 2.0, 2.2]) * form.first_crossing
    with decimal.localcontext(decimal.Context(prec=30)):
        i1, i2, i3 = (Decimal(moment) for moment in box.moments().tolist())
        ratios = ((i2 - i3) / i1, (i3 - i1) / i2, (i1 - i2) / i3)

        def rate(w: State) -> State:
            products = (w[1] * w[2], w[2] * w[0], w[0] * w[1])
            return np.array([r * p for r, p in zip(ratios, products, strict=True)], dtype=object)

        start = np.array([Decimal(nudge), Decimal(box.SPIN), Decimal(0)], dtype=object)
        exact = integrate(rate, start, times, 1e-24, columns=12).astype(float)
    assert np.max(np.abs(form.omega(times) - exact)) < 1e-10
    assert abs(exact[1, 1]) < 1e-10  # the first crossing


def test_problems_are_small_models(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)  # where MuJoCo would write what it warns of
    for problem in PROBLEMS:
        assert compiled(problem.mjcf, Integrator.RK4, 1e-3).nbody <= 12
        assert "file=" not in problem.mjcf
    assert list(tmp_path.iterdir()) == []
