"""Every hard case has two references that agree, and a model that MuJoCo takes."""

from __future__ import annotations

import decimal
import re
from collections.abc import Iterable
from decimal import Decimal
from pathlib import Path

import numpy as np
import pytest

from coursebuild.numerics.cases import agreement
from coursebuild.numerics.engine import EngineStates, compiled, motion_of
from coursebuild.numerics.integrate import State, bulirsch_stoer
from coursebuild.numerics.problem import Integrator
from coursebuild.numerics.problems import all_problems, problem_named, problem_names
from coursebuild.numerics.problems import tumbling_box as box

WORSE = {
    "chain-heavy-tip": 1e-8,  # its mass matrix has a condition of 1e6 and swings at 1e4 rad/s
    "newtons-cradle-touching": 1e-9,  # its forces jump
    "distant-body": 1.3e-6,  # ten times the distance of neighbouring numbers there
}
LONG = ("double-pendulum", "chain-balls", "chain-hinges", "chain-heavy-tip")
"""Those whose references take seconds."""


def apart(names: Iterable[str]) -> list[str]:
    """What to say of each case whose references differ by more than is said of it."""
    found = []
    for problem in map(problem_named, names):
        allowed, measured = WORSE.get(problem.name, 1e-10), agreement(problem)
        if measured is None or not measured <= problem.agreement <= allowed:
            found.append(f"{problem.name}: {measured}, said {problem.agreement}, over {allowed}")
    return found


def test_all_thirteen_cases_are_there() -> None:
    assert {problem.case for problem in all_problems()} == set(range(1, 14))
    assert len(set(problem_names())) == len(all_problems())
    assert problem_named("tumbling-box").case == 1


def test_both_references_agree() -> None:
    assert apart(name for name in problem_names() if name not in LONG) == []


@pytest.mark.site
def test_both_references_of_long_integrations_agree() -> None:
    assert apart(LONG) == []


def test_the_reference_begins_where_the_scenario_does() -> None:
    for problem in all_problems():
        assert problem.reference is not None
        scenario = problem.scenario
        model = compiled(problem.mjcf, Integrator.EULER, 1e-3)
        qpos = np.array([scenario.qpos or model.qpos0], dtype=float)
        qvel = np.array([scenario.qvel or [0.0] * model.nv], dtype=float)
        begun = motion_of(model, EngineStates(np.zeros(1), qpos, qvel, np.empty((1, 0))))
        soon = problem.reference.motion(np.array([1e-9, 2e-9]))
        assert soon.position.shape[1:] == begun.position.shape[1:], problem.name
        for found, expected, rtol, atol in (
            (soon.position, begun.position, 1e-12, 1e-5),
            (np.abs(soon.attitude), np.abs(begun.attitude), 0, 1e-5),
            (soon.velocity, begun.velocity, 1e-6, 1e-4),
        ):
            name = problem.name
            np.testing.assert_allclose(found[0], expected[0], rtol=rtol, atol=atol, err_msg=name)


def test_timesteps_divide_the_looks_and_models_say_neither_timestep_nor_integrator() -> None:
    for problem in all_problems():
        looks = len(problem.scenario.times)
        assert looks * problem.scenario.sample == pytest.approx(problem.scenario.duration)
        for timestep in problem.timesteps:
            count = problem.scenario.sample / timestep
            assert count == pytest.approx(round(count), rel=1e-9), problem.name
        assert not re.search("timestep|integrator", problem.mjcf), problem.name


def test_the_boxs_closed_form_conserves_energy_and_momentum() -> None:
    inertia = box.moments()
    for nudge in box.NUDGES:
        form = box.Tumbling(nudge, box.SPIN)
        omega = form.omega(np.linspace(0.1, 6 * form.flip_interval, 400))
        energy, momentum = omega**2 @ inertia, np.linalg.norm(omega * inertia, axis=1)
        start = np.array([nudge, box.SPIN, 0.0])
        assert np.max(np.abs(energy / (start**2 @ inertia) - 1)) < 1e-13, nudge
        assert np.max(np.abs(momentum / np.linalg.norm(start * inertia) - 1)) < 1e-13, nudge


@pytest.mark.site
def test_the_boxs_closed_form_agrees_with_thirty_digits() -> None:
    for nudge in box.NUDGES:
        form = box.Tumbling(nudge, box.SPIN)
        times = np.array([0.5, 1.0, 1.5, 2.0, 2.2]) * form.first_crossing
        exact = turned_with_thirty_digits(nudge, times)
        assert np.max(np.abs(form.omega(times) - exact)) < 1e-10, nudge
        assert abs(exact[1, 1]) < 1e-10, nudge  # the first crossing


def turned_with_thirty_digits(nudge: float, times: np.ndarray) -> np.ndarray:
    """Euler's equations of the box, integrated in decimal numbers."""
    with decimal.localcontext(decimal.Context(prec=30)):
        i1, i2, i3 = (Decimal(moment) for moment in box.moments().tolist())
        ratios = ((i2 - i3) / i1, (i3 - i1) / i2, (i1 - i2) / i3)

        def rate(w: State) -> State:
            products = (w[1] * w[2], w[2] * w[0], w[0] * w[1])
            return np.array([r * p for r, p in zip(ratios, products, strict=True)], dtype=object)

        start = np.array([Decimal(nudge), Decimal(box.SPIN), Decimal(0)], dtype=object)
        return bulirsch_stoer(rate, start, times, 1e-24, columns=12).astype(float)


def test_problems_are_small_models(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)  # where MuJoCo would write what it warns of
    for problem in all_problems():
        assert compiled(problem.mjcf, Integrator.RK4, 1e-3).nbody <= 12
        assert "file=" not in problem.mjcf
    assert list(tmp_path.iterdir()) == []
