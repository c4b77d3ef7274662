"""Errors, orders, drifts and creep: what NUMERICS demands of the hard cases."""

from __future__ import annotations

import functools
import itertools
import math

import mujoco
import numpy as np
import pytest
from msgspec.structs import astuple, replace

from mjbench.cases import measure, orders
from mjbench.measure import errors, find_sticks, fit_order, friction_holds, measure_slip
from mjbench.problem import STANDARD, Integrator, Motion, Setup, Sizes
from mjbench.problems import all_problems, extremes
from mjbench.reports.model_report import ErrorLine
from mjbench.scene import scenes
from mjbench.simulation import simulate
from samples.surveys import parse_declared

FIRST = tuple(integrator for integrator in STANDARD if integrator is not Integrator.RK4)


@functools.cache
def error_lines(name: str, integrator: Integrator) -> tuple[ErrorLine, ...]:
    problem = all_problems()[name]
    return tuple(measure(problem, integrator, h) for h in problem.timesteps)


def slopes(name: str, integrator: Integrator) -> dict[str, float]:
    """The orders that could be fitted, by what they are of."""
    row = orders(all_problems()[name], error_lines(name, integrator))
    parts = {"position": row.position, "attitude": row.attitude, "velocity": row.velocity}
    return {part: fit.value for part, fit in parts.items() if fit is not None}


@pytest.mark.long
def test_the_euler_family_is_of_first_order() -> None:
    names = ("tumbling-box", "damped-spring-0", "free-top", "projectile")
    for name, integrator in itertools.product(names, FIRST):
        fits = slopes(name, integrator)
        if name != "tumbling-box":
            fits.pop("velocity", None)
        assert fits
        assert fits == pytest.approx(dict.fromkeys(fits, 1.0), abs=0.05), (name, integrator)
    assert set(slopes("tumbling-box", Integrator.EULER)) == {"attitude", "velocity"}


@pytest.mark.long
def test_orders_of_rk4() -> None:
    """Second in attitude; fourth in velocity, unless the torque depends on the attitude."""
    turning = {"velocity": 4.0, "attitude": 2.0}
    for name, expected in {
        **dict.fromkeys(("tumbling-box", "free-top", "coin", "flat-plate"), turning),
        "thin-rod": {"attitude": 2.0},  # of its velocities three errors are above the floor
        "heavy-top": {"velocity": 2.0, "attitude": 2.0},
        "damped-spring-0.1": {"position": 4.0, "velocity": 4.0},
        "pendulum-hinge-90": {"position": 3.9},
    }.items():
        fits = slopes(name, Integrator.RK4)
        selection = {part: fits[part] for part in expected}
        assert selection == pytest.approx(expected, abs=0.1), name


def test_an_order_is_fitted_only_where_errors_lie_on_a_line() -> None:
    steps = [2.0**-n for n in range(12)]
    clean = [h**3 for h in steps]
    spoilt = [max(e, 1e-7) if e < 0.1 else 5.0 for e in clean]
    fit = fit_order(steps, spoilt, 1e-9)
    assert fit == fit_order(steps[2:8], clean[2:8], 0.0)
    assert fit is not None and fit.value == pytest.approx(3.0, abs=1e-12)
    assert max(fit.uncertainty, fit.bend) < 1e-9
    assert fit_order(steps[2:5], clean[2:5], 0.0) is None  # three are often on one
    assert fit_order(steps, [1e-12] * 12, 1e-12) is None
    assert fit_order(steps, clean, 0.0, extent=1e-7) is None  # as large as the motion
    tending = [h * (1 + h + h**2) for h in steps[4:]]  # an order of 1, not where it is measured yet
    tending_fit = fit_order(steps[4:8], tending[:4], 0.0)
    assert tending_fit is not None
    assert 0.01 < tending_fit.value - 1 < tending_fit.uncertainty < 0.1
    assert {type(part) for part in astuple(tending_fit)} == {float}, "reports hold no others"
    for sizes in (
        [h**2 + 50 * h**4 for h in steps],
        [h**2 * (1.3 if n % 2 else 1) for n, h in enumerate(steps)],
        [h**1.5 for h in steps],  # no method has such an order, on however straight a line
        [0.01 * h**0.07 for h in steps],  # as large as the part of the motion that is lost
    ):
        assert fit_order(steps, sizes, 0.0) is None, sizes
    shaken = [h**2 * (1.05 if n % 2 else 1) for n, h in enumerate(steps)]
    shaken_fit = fit_order(steps, shaken, 0.0)
    assert shaken_fit is not None and abs(shaken_fit.value - 2) < shaken_fit.uncertainty < 0.05


def test_errors_are_apart_and_none_for_what_is_not_there() -> None:
    times = np.array([1.0, 2.0])
    level = np.broadcast_to(np.array([1.0, 0, 0, 0]), (2, 1, 4))
    rotated = np.array([[[np.cos(0.05), np.sin(0.05), 0, 0]], [[-1.0, 0, 0, 0]]])
    a = Motion(times, np.empty((2, 0)), level, np.zeros((2, 3)))
    b = Motion(times, np.empty((2, 0)), rotated, np.array([[3.0, 4, 0], [0, 0, 1]]))
    result = errors(b, a)
    assert result.position is None
    assert result.attitude is not None
    assert result.attitude[0] == pytest.approx(0.1, abs=1e-15)
    assert result.attitude[1] == 0.0
    assert result.velocity == (5.0, 1.0)
    assert errors(b, a, Sizes(0, 0, 0.2)).velocity == (5.0, 2.0)


def test_a_timestep_that_misses_the_end_is_refused() -> None:
    problem = all_problems()["projectile"]
    with pytest.raises(ValueError, match=r"the sampling interval \(0\.1 s\) is not a multiple"):
        measure(problem, Integrator.EULER, 0.03)
    longer = replace(problem, scenario=replace(problem.scenario, duration=1.05))
    with pytest.raises(ValueError, match=r"the duration \(1\.05 s\) is not a multiple"):
        measure(longer, Integrator.EULER, 0.01)


def test_energy_belongs_to_the_moment_it_is_given_for() -> None:
    # The energy that MuJoCo gives after a step is that of before: it would seem to oscillate.
    line = measure(all_problems()["pendulum-hinge-90"], Integrator.RK4, 0.1 / 160)
    assert line.energy_drift is not None
    assert abs(line.energy_drift) < 1e-11


EULER, RK4 = Integrator.EULER, Integrator.RK4
AS_THEORY_SAYS = (
    # The case, a part of its figure's name, the integrators, and how far off they may be.
    ("tumbling-box", "kinetic", (RK4,), 1e-8),
    ("tumbling-box", "flip", (RK4,), 2e-8),
    ("free-top", "growth", STANDARD, 1e-9),
    ("thin-rod", "growth", STANDARD, 1e-9),
    ("coin", "growth", STANDARD, 1e-9),
    ("projectile", "height", STANDARD, 1e-12),
    ("newtons-cradle", "last", (RK4,), 1e-4),
    ("newtons-cradle-touching", "velocity", (RK4,), 1e-3),
    # A block chatters: its contacts act only part of the time.
    ("sliding-block-elliptic-along", "acceleration", (EULER,), 0.12),
    ("sliding-block-elliptic-across", "acceleration", (EULER,), 0.12),
    ("sliding-block-pyramidal-along", "acceleration", (EULER,), 0.12),
    ("sliding-block-pyramidal-across", "pyramid", (EULER,), 0.12),
    ("stack-1", "sinks", (EULER,), 1e-11),
    ("stack-1000", "sinks", (EULER,), 1e-9),
)


@pytest.mark.long
def test_figures_are_those_of_theory() -> None:
    mismatches = []
    for name, part, integrators, room in AS_THEORY_SAYS:
        for check, integrator in itertools.product(all_problems()[name].checks, integrators):
            if part in check.name and integrator in check.integrators:
                value, exact = check.measure(integrator), check.expected(integrator)
                if not abs(value - exact) <= room:
                    mismatches.append((name, check.name, integrator, value, exact))
    assert mismatches == []
    with pytest.raises(ValueError, match=r"A \+ B >= C"):
        mujoco.MjModel.from_xml_string(extremes.ROUNDED_PLATE)


FRICTION = """\
<mujoco>
  <option gravity="{gravity}"/>
  <worldbody>
    <geom type="plane" size="5 5 1" surfacevel="{belt} 0 0"/>
    <body pos="0 0 0.1">
      <joint name="along" type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/>{turn}
      <geom type="{shape}" size="0.1 0.1 0.1" mass="1"/>
    </body>
  </worldbody>
  <actuator><motor joint="along"/></actuator>
</mujoco>
"""
FRICTION_CASES = {
    # title: (slope, force in N, belt in m/s, shape), below the limit, creep in m
    "a block under the angle of friction": ((0.2, 0, 0, "box"), True, (1e-4, 1e-3)),
    "a block over it": ((1.01, 0, 0, "box"), False, (1e-3, 1e-1)),
    "a ball that rolls down": ((0.2, 0, 0, "sphere"), True, (1e-5, 1e-3)),
    "a push below the limit": ((0, 3, 0, "box"), True, (1e-4, 1e-3)),
    "a push above it": ((0, 9.9, 0, "box"), False, (1e-3, 1e-1)),
    "a ride on a slow belt": ((0, 0, 0.02, "box"), True, (0, 2e-4)),
    "a block held against a belt": ((-0.2, 0, 0.02, "box"), True, (1e-4, 1e-3)),
    "a ride on a belt that it slides on at first": ((0, 0, 0.5, "box"), True, (0, 2e-4)),
}


def test_creep_is_told_from_what_slides_rolls_or_rides() -> None:
    mismatches = []
    for title, ((slope, force, belt, shape), is_held, (least, most)) in FRICTION_CASES.items():
        gravity = f"{9.81 * slope / math.hypot(1, slope)} 0 {-9.81 / math.hypot(1, slope)}"
        turn = '<joint axis="0 1 0"/>' if shape == "sphere" else ""
        mjcf = FRICTION.format(gravity=gravity, belt=belt, shape=shape, turn=turn)
        model = mujoco.MjModel.from_xml_string(mjcf)
        declarations = parse_declared(
            f'[[scenario]]\nname = "a"\nduration = 0.48\nsample = 0.016\ncontrols = [[{force}]]\n'
        )
        (scene,) = scenes(model, declarations)
        states = simulate(Setup(scenario=scene.scenario), model).states
        sticks = find_sticks(model, scene, states)
        outcome = friction_holds(model, scene, states, sticks)
        creep = measure_slip(model, scene, states, sticks)
        if outcome != is_held or not least <= creep <= most:
            mismatches.append((title, outcome, creep))
    assert mismatches == []
