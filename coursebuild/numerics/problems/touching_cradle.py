"""Case 8, another problem: Newton's cradle whose balls touch, so that all contacts act at once.

Entry point: `problem()`.

Each contact is a spring, but their forces are found together: f minimizes the solver's cost, which
for the active contacts means (A + R) f = a_ref with A = J M⁻¹ Jᵀ, R = diag(A) (1 − d)/d and
a_ref = −k d r for violations r. The first ball does not come to rest, and the middle one moves. A
contact that opens while the other one is loaded still pushes: 0.13 % of the energy is lost with it.

1. The first reference integrates these equations, kinks and all, in small steps.
2. The second goes from event to event: between them the motion is linear, and a matrix exponential
   by eigenvectors solves it.

Source: MuJoCo documentation, Computation, Constraint model; for the outcome F. Herrmann,
M. Seitz, How does the ball-chain work?, American Journal of Physics 50 (1982) 977.
"""

from __future__ import annotations

import math

import numpy as np

from coursebuild.numerics.integrate import State, bulirsch_stoer
from coursebuild.numerics.problem import (
    Array,
    Integrator,
    Motion,
    Problem,
    Reference,
    ScalarCheck,
    Scenario,
)
from coursebuild.numerics.problems.common import divisions, motion_without_attitude, simulated
from coursebuild.numerics.problems.impact import (
    CONTACT,
    GAP,
    IMPEDANCE,
    RATE,
    SPEED,
    cradle_mjcf,
)

_J = np.array([[1.0, -1.0, 0.0], [0.0, 1.0, -1.0]])
"""Velocities → how fast each pair comes nearer."""
_SOFTNESS = (1 - IMPEDANCE) / IMPEDANCE
_STIFFNESS = RATE**2 / IMPEDANCE
"""k d for k d² = RATE², 1/s²."""


def forces(depth: Array) -> Array:
    """What the contacts push with, (2,) N per kg: depths (2,) m, those below 0 do not touch.

    A + R has no positive number beside its diagonal, so that no force comes out negative.
    """
    found = np.zeros(2)
    touching = depth > 0
    if touching.any():
        a = _J[touching] @ _J[touching].T
        r = np.diag(np.diag(a)) * _SOFTNESS
        found[touching] = np.linalg.solve(a + r, _STIFFNESS * depth[touching])
    return found


def _rate(state: State) -> State:
    x, v = state[:3], state[3:]
    depth = _J @ x - np.array([GAP, 0.0])
    return np.concatenate([v, -_J.T @ forces(depth)])


def integrated(times: Array) -> Motion:
    """The equations integrated by Bulirsch–Stoer, from the first touch on."""
    begin = GAP / SPEED
    start = np.array([GAP, 0.0, 0.0, SPEED, 0.0, 0.0])
    place, speed = np.zeros((len(times), 3)), np.zeros((len(times), 3))
    flying = times <= begin
    place[flying, 0], speed[flying, 0] = SPEED * times[flying], SPEED
    if flying.all():
        return motion_without_attitude(times, place, speed)
    states = bulirsch_stoer(_rate, start, times[~flying] - begin, 1e-14, columns=4, first=1e-6)
    place[~flying], speed[~flying] = states[:, :3], states[:, 3:]
    return motion_without_attitude(times, place, speed)


def from_event_to_event(times: Array) -> Motion:
    """The same in the depths of both contacts, solved in closed form while the same ones touch."""
    begin = GAP / SPEED
    place, speed = np.zeros((len(times), 3)), np.zeros((len(times), 3))
    flying = times <= begin
    place[flying, 0], speed[flying, 0] = SPEED * times[flying], SPEED
    depth, rate, now = np.zeros(2), np.array([SPEED, 0.0]), begin
    touching = _touching(depth, rate)
    for index in np.flatnonzero(~flying).tolist():
        while now < times[index]:
            step = min(CONTACT / 100, times[index] - now)
            ahead, _ = _linear(depth, rate, touching, step)
            if np.any((ahead > 0) != touching):
                step = _event(depth, rate, touching, step)
                depth, rate = _linear(depth, rate, touching, step)
                touching = _touching(depth, rate)
            else:
                depth, rate = _linear(depth, rate, touching, step)
            now = now + step
        # Depths and the centre of mass → places: x₁ − x₂ − gap, x₂ − x₃, and their sum.
        centre = SPEED * times[index] / 3
        place[index] = _apart(depth + np.array([GAP, 0.0]), centre)
        speed[index] = _apart(rate, SPEED / 3)
    return motion_without_attitude(times, place, speed)


def _apart(differences: Array, mean: float) -> Array:
    first, second = differences.tolist()
    middle = mean + (second - first) / 3
    return np.array([middle + first, middle, middle - second])


def _linear(depth: Array, rate: Array, touching: Array, time: float) -> tuple[Array, Array]:
    """Depths and their rates after a time in which the same contacts touch."""
    if touching.all():
        a = _J @ _J.T
        matrix = a @ np.linalg.inv(a + 2 * _SOFTNESS * np.eye(2)) * _STIFFNESS
        squares, modes = np.linalg.eigh((matrix + matrix.T) / 2)
        turn = np.sqrt(squares)
        p, q = modes.T @ depth, modes.T @ rate
        sine, cosine = np.sin(turn * time), np.cos(turn * time)
        return modes @ (p * cosine + q / turn * sine), modes @ (q * cosine - p * turn * sine)
    free, moving = depth + rate * time, rate.copy()
    for one, other in ((0, 1), (1, 0)):
        if touching[one]:  # this one is an oscillator, and moves the other one by half as much
            sine, cosine = math.sin(RATE * time), math.cos(RATE * time)
            new = depth[one] * cosine + rate[one] / RATE * sine
            fast = rate[one] * cosine - depth[one] * RATE * sine
            free[other] -= (new - depth[one] - rate[one] * time) / 2
            moving[other] -= (fast - rate[one]) / 2
            free[one], moving[one] = new, fast
    return free, moving


def _touching(depth: Array, rate: Array) -> Array:
    """Which contacts touch from now on: those that do soon if just these are taken to touch."""
    for guess in ((True, True), (True, False), (False, True)):
        touching = np.array(guess)
        soon, _ = _linear(depth, rate, touching, CONTACT * 1e-4)
        if np.array_equal(soon > 0, touching):
            return touching
    return np.array([False, False])


def _event(depth: Array, rate: Array, touching: Array, within: float) -> float:
    """When the first contact begins or ends, by bisection."""
    low, high = 0.0, within
    for _ in range(60):
        middle = (low + high) / 2
        same = np.array_equal(_linear(depth, rate, touching, middle)[0] > 0, touching)
        low, high = (middle, high) if same else (low, middle)
    return high


def last_velocity(integrator: Integrator, ball: int, steps: int = 80) -> float:
    """The velocity of a ball after everything, m/s."""
    one, timestep = problem(), CONTACT / steps
    count = round(one.scenario.duration / timestep)
    return float(simulated(one.mjcf, one.scenario, integrator, timestep, count).qvel[ball])


def _figure(ball: int, name: str) -> ScalarCheck:
    return ScalarCheck(
        f"velocity of the {name} ball, 80 steps in a contact",
        "m/s",
        lambda _: float(integrated(np.array([0.06])).velocity[0, ball]),
        lambda integrator: last_velocity(integrator, ball),
        "the soft contacts of MuJoCo, integrated",
    )


def problem() -> Problem:
    """A ball meets two that touch."""
    return Problem(
        name="newtons-cradle-touching",
        title="Newton's cradle, two balls of which touch",
        case=8,
        mjcf=cradle_mjcf((GAP, 0.0)),
        scenario=Scenario(0.06, 0.002, (0.0, 0.0, 0.0), (SPEED, 0.0, 0.0)),
        position_bound=1.0,
        velocity_bound=2 * SPEED,
        reference=Reference(
            "ode", "MuJoCo's soft contacts, Bulirsch–Stoer in small steps", integrated, floor=1e-11
        ),
        second=Reference(
            "closed", "from event to event, by eigenvectors", from_event_to_event, floor=1e-12
        ),
        timesteps=divisions(0.002, 16, 32, 64, 128),
        checks=(_figure(0, "first"), _figure(1, "middle"), _figure(2, "last")),
        smooth=False,
        note="all contacts act at once: the last ball does not take over the whole velocity",
    )
