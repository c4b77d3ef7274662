"""Cases 4 and 8: a stone that is thrown, an elastic impact, and Newton's cradle.

The stone flies without air; the semi-implicit method is wrong by exactly g T h/2. The cradle has
gaps, or two balls that touch.

With direct `solref` (stiffness, damping) and constant impedance a contact of two bodies without
friction is an oscillator of frequency √stiffness in their distance: without damping the bodies
part as fast as they met, after half a period. Between equal masses the velocities are exchanged.

Where two contacts act at once their forces are found together: f minimizes the solver's cost, which
for the active contacts means (A + R) f = a_ref with A = J M⁻¹ Jᵀ, R = diag(A) (1 − d)/d and
a_ref = −k d r for violations r. The first ball does not come to rest, and the middle one moves. A
contact that opens while the other one is loaded still pushes: 0.13 % of the energy is lost with it.

Sources: for the stone, with v ← v + gh before x ← x + vh, x after n steps is
x₀ + v₀nh + gh²n(n + 1)/2; MuJoCo documentation, Modeling, Solver parameters, and Computation,
Constraint model; for balls that touch F. Herrmann, M. Seitz, How does the ball-chain work?,
American Journal of Physics 50 (1982) 977.
"""

from __future__ import annotations

import math
from functools import partial

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from mjbench.integrate import State, bulirsch_stoer
from mjbench.measure import reference_motion
from mjbench.problem import (
    NO_CONTACT,
    NO_GRAVITY,
    Array,
    Integrator,
    Motion,
    Problem,
    Reference,
    ScalarCheck,
    Scenario,
    Sizes,
    divisions,
    model_text,
    motion_without_attitude,
)
from mjbench.simulation import run_steps

_STEP = 0.01
_THROW_SCENARIO = Scenario(1.0, 0.1, qvel=(3.0, 0.0, 4.0, 0.0, 0.0, 0.0))

_STONE = '    <body><freejoint/><geom size="0.05" mass="1"/></body>'
THROWN_STONE = model_text(_STONE, 'gravity="0 0 -9.81"', NO_CONTACT)


class Parabola(Struct, frozen=True):
    """x = v₀t + gt²/2, thrown from the origin."""

    launch: tuple[float, float, float]
    gravity: float

    def motion(self, times: Array) -> Motion:
        """The motion at the times (n,) s."""
        t = times[:, None]
        launch, fall = np.array(self.launch), np.array([0.0, 0.0, -self.gravity])
        upright = np.broadcast_to(np.array([1.0, 0.0, 0.0, 0.0]), (len(times), 1, 4))
        velocity = np.concatenate([launch + fall * t, np.zeros((len(times), 3))], axis=1)
        return Motion(times, launch * t + fall * t**2 / 2, upright, velocity)


PARABOLA = Parabola((3.0, 0.0, 4.0), 9.81)


def fall_error(integrator: Integrator) -> float:
    """Error of the height after a second at 10 ms, m: simulated less exact."""
    time = _THROW_SCENARIO.duration
    data = run_steps(THROWN_STONE, _THROW_SCENARIO, integrator, _STEP, round(time / _STEP))
    return float(data.qpos[2] - PARABOLA.motion(np.array([time])).position[0, 2])


def exact_error(integrator: Integrator) -> float:
    """The error in theory: −gTh/2 where velocities are stepped first, nothing with RK4."""
    error = -PARABOLA.gravity * _THROW_SCENARIO.duration * _STEP / 2
    return 0.0 if integrator is Integrator.RK4 else error


def _throw_problem() -> Problem:
    return Problem(
        name="projectile",
        title="Projectile",
        case=4,
        mjcf=THROWN_STONE,
        scenario=_THROW_SCENARIO,
        position_bound=100.0,
        velocity_bound=100.0,
        reference=Reference("closed", "x = v₀t + gt²/2", PARABOLA),
        timesteps=divisions(0.1, 5, 10, 20, 40, 80, 160),
        energy_conserved=True,
        checks=(
            ScalarCheck(
                "error of the height after 1 s at 10 ms",
                "m",
                exact_error,
                fall_error,
                "−gTh/2",
                precision=1e-12,
            ),
        ),
    )


GAP, SPEED, _RATE = 0.05, 1.0, 1000.0
"""m, m/s, and √stiffness, rad/s."""
CONTACT = math.pi / _RATE
"""How long a contact lasts, s."""
_PHASES = 16
"""Moments within a step at which a contact can begin."""
_LENGTHS = 4
"""Lengths of a contact, from a whole number of steps up: at whole numbers some errors cancel."""

_GEOM = 'condim="1" solref="-1000000 0" solimp="0.9 0.9 0.001 0.5 2"'
_OPTION = f'{NO_GRAVITY} tolerance="0"'


def _ball(at: str) -> str:
    joint, geom = '<joint type="slide" axis="1 0 0"/>', f'<geom size="0.1" mass="1" {_GEOM}/>'
    return f'    <body pos="{at} 0 0">{joint}{geom}</body>'


BOUNCE = model_text(
    f'    <geom type="plane" size="1 1 1" pos="0.15 0 0" zaxis="-1 0 0" {_GEOM}/>\n' + _ball("0"),
    _OPTION,
)
CRADLE = model_text("\n".join(map(_ball, ("0", "0.25", "0.5"))), _OPTION)
TOUCHING_BALLS = model_text("\n".join(map(_ball, ("0", "0.25", "0.45"))), _OPTION)
_BOUNCE_SCENARIO = Scenario(0.1, 0.01, (0.0,), (1.0,))
_CRADLE_SCENARIO = Scenario(0.13, 0.01, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
_TOUCHING_SCENARIO = Scenario(0.06, 0.002, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0))


class Bounce(Struct, frozen=True):
    """A ball that meets a wall and comes back."""

    gap: float = GAP
    speed: float = SPEED
    rate: float = _RATE

    def motion(self, times: Array) -> Motion:
        """The motion at the times (n,) s."""
        gap, speed, rate, contact = self.gap, self.speed, self.rate, math.pi / self.rate
        t = times - gap / speed
        touching = [t < 0, t < contact]
        return_place = gap - speed * (t - contact)
        place = np.select(
            touching, [speed * times, gap + speed / rate * np.sin(rate * t)], return_place
        )
        velocity = np.select(touching, [np.full_like(t, speed), speed * np.cos(rate * t)], -speed)
        return motion_without_attitude(times, place[:, None], velocity[:, None])


class Cradle(Bounce, frozen=True):
    """Three balls with gaps: each takes over the velocity of the one before.

    In a contact the centre of two balls goes on at half the velocity, and their distance is half an
    oscillation; each ball is pushed, flies, and pushes the next one.
    """

    def motion(self, times: Array) -> Motion:
        """The motion at the times (n,) s."""
        gap, full, rate, contact = self.gap, self.speed, self.rate, math.pi / self.rate
        place, speed = np.zeros((len(times), 3)), np.zeros((len(times), 3))
        start, flown_from = 0.0, 0.0  # when the ball begins to fly, and from where
        for ball in range(3):
            meets = math.inf if ball == 2 else start + (gap - flown_from) / full
            flies = (times >= start) & (times < meets)
            place[flies, ball] = flown_from + full * (times[flies] - start)
            speed[flies, ball] = full
            if ball == 2:
                break
            t = times - meets
            pushes, has_pushed = (t >= 0) & (t < contact), t >= contact
            sine, cosine = np.sin(rate * t[pushes]), np.cos(rate * t[pushes])
            place[pushes, ball] = gap + full * (t[pushes] + sine / rate) / 2
            place[pushes, ball + 1] = full * (t[pushes] - sine / rate) / 2
            speed[pushes, ball] = full * (1 + cosine) / 2
            speed[pushes, ball + 1] = full * (1 - cosine) / 2
            place[has_pushed, ball] = gap + full * contact / 2
            start, flown_from = meets + contact, full * contact / 2
        return motion_without_attitude(times, place, speed)


_J = np.array([[1.0, -1.0, 0.0], [0.0, 1.0, -1.0]])
"""Velocities → how fast each pair comes nearer."""


class TouchingCradle(Bounce, frozen=True):
    """Three balls of 1 kg, two of which touch: integrated in small steps from the first touch."""

    impedance: float = 0.9

    def _forces(self, depth: Array) -> Array:
        """The forces of the contacts, (2,) N, by their depths (2,) m; below 0 they do not touch.

        A + R has no positive number beside its diagonal, so that no force comes out negative.
        """
        forces = np.zeros(2)
        touching = depth > 0
        if touching.any():
            a = _J[touching] @ _J[touching].T
            r = np.diag(np.diag(a)) * (1 - self.impedance) / self.impedance
            push = self.rate**2 / self.impedance * depth[touching]
            forces[touching] = np.linalg.solve(a + r, push)
        return forces

    def motion(self, times: Array) -> Motion:
        """The motion at the times (n,) s."""

        def rate(state: State) -> State:
            depth = _J @ state[:3] - np.array([self.gap, 0.0])
            return np.concatenate([state[3:], -_J.T @ self._forces(depth)])

        begin = self.gap / self.speed
        place, speed = np.zeros((len(times), 3)), np.zeros((len(times), 3))
        is_flying = times <= begin
        place[is_flying, 0], speed[is_flying, 0] = self.speed * times[is_flying], self.speed
        if not is_flying.all():
            start = np.array([self.gap, 0.0, 0.0, self.speed, 0.0, 0.0])
            contact_times = times[~is_flying] - begin
            states = bulirsch_stoer(rate, start, contact_times, 1e-14, columns=4, first=1e-6)
            place[~is_flying], speed[~is_flying] = states[:, :3], states[:, 3:]
        return motion_without_attitude(times, place, speed)


def restitution(integrator: Integrator, steps: int) -> float:
    """The worst ratio of the speed with which the ball returns to that with which it came.

    A contact begins at any moment of a step, and lasts `steps` steps or a part of a step more.
    """
    cases = ((steps + k / _LENGTHS, j / _PHASES) for k in range(_LENGTHS) for j in range(_PHASES))
    restitutions = []
    for length, phase in cases:
        timestep = CONTACT / length
        start = GAP - SPEED * timestep * (2 + phase)
        scenario = Scenario(0.1, 0.01, (start,), (SPEED,))
        data = run_steps(BOUNCE, scenario, integrator, timestep, 3 * math.ceil(length) + 8)
        restitutions.append(-float(data.qvel[0]) / SPEED)
    return max(restitutions, key=lambda back: math.inf if math.isnan(back) else abs(back - 1))


def last_velocity(
    mjcf: str, scenario: Scenario, integrator: Integrator, ball: int, steps: int
) -> float:
    """The velocity of a ball at the end, m/s, with so many steps in a contact."""
    timestep = CONTACT / steps
    count = round(scenario.duration / timestep)
    return float(run_steps(mjcf, scenario, integrator, timestep, count).qvel[ball])


def problems() -> tuple[Problem, ...]:
    """The throw, the impact and the cradles."""
    impact = Problem(
        name="elastic-impact",
        title="Elastic impact on a wall",
        case=8,
        mjcf=BOUNCE,
        scenario=_BOUNCE_SCENARIO,
        position_bound=1.0,
        velocity_bound=2 * SPEED,
        reference=Reference("closed", "half an oscillation without damping", Bounce()),
        timesteps=divisions(0.01, 16, 32, 64, 128, 256, 512),
        checks=tuple(
            ScalarCheck(
                f"restitution, {steps} to {steps + 1} steps in a contact, at worst",
                "",
                1.0,
                partial(restitution, steps=steps),
                "no damping",
            )
            for steps in (5, 10, 20, 40, 80)
        ),
        smooth=False,
        note="an impact begins within a step: no order can be expected",
    )
    law = "equal masses exchange their velocities"
    last_ball = partial(last_velocity, CRADLE, _CRADLE_SCENARIO, ball=2, steps=20)
    name = "velocity of the last ball, 20 steps in a contact"
    cradle = replace(
        impact,
        name="newtons-cradle",
        title="Newton's cradle with gaps",
        mjcf=CRADLE,
        scenario=_CRADLE_SCENARIO,
        reference=Reference("closed", law, Cradle()),
        checks=(ScalarCheck(name, "m/s", SPEED, last_ball, law),),
        note="a cradle whose balls touch is another problem: all contacts act at once",
    )
    touching = replace(
        impact,
        name="newtons-cradle-touching",
        title="Newton's cradle, two balls of which touch",
        mjcf=TOUCHING_BALLS,
        scenario=_TOUCHING_SCENARIO,
        reference=_TOUCHING,
        precision=Sizes(1e-10, 0.0, 1e-8),
        timesteps=divisions(0.002, 16, 32, 64, 128),
        checks=tuple(
            _touching_check(ball, name) for ball, name in enumerate(("first", "middle", "last"))
        ),
        note="all contacts act at once: the last ball does not take over the whole velocity",
    )
    return _throw_problem(), impact, cradle, touching


_TOUCHING = Reference(
    "ode", "MuJoCo's soft contacts, Bulirsch–Stoer in small steps", TouchingCradle()
)


def _touching_check(ball: int, name: str) -> ScalarCheck:
    end = (_TOUCHING_SCENARIO.duration,)
    return ScalarCheck(
        f"velocity of the {name} ball, 80 steps in a contact",
        "m/s",
        lambda _: float(reference_motion(_TOUCHING, end).velocity[0, ball]),
        partial(last_velocity, TOUCHING_BALLS, _TOUCHING_SCENARIO, ball=ball, steps=80),
        "the soft contacts of MuJoCo, integrated",
    )
