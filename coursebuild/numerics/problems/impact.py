"""Case 8: an elastic impact, and Newton's cradle, with gaps and with two balls that touch.

Entry point: `problems()`.

With direct `solref` (stiffness, damping) and constant impedance a contact of two bodies without
friction is an oscillator of frequency √stiffness in their distance: without damping the bodies
part as fast as they met, after half a period. Between equal masses the velocities are exchanged.

Where two contacts act at once their forces are found together: f minimizes the solver's cost, which
for the active contacts means (A + R) f = a_ref with A = J M⁻¹ Jᵀ, R = diag(A) (1 − d)/d and
a_ref = −k d r for violations r. The first ball does not come to rest, and the middle one moves. A
contact that opens while the other one is loaded still pushes: 0.13 % of the energy is lost with it.

Sources: MuJoCo documentation, Modeling, Solver parameters, and Computation, Constraint model; for
balls that touch F. Herrmann, M. Seitz, How does the ball-chain work?, American Journal of Physics
50 (1982) 977.
"""

from __future__ import annotations

import math
from functools import partial

import numpy as np
from msgspec.structs import replace

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
from coursebuild.numerics.problems.common import (
    NO_GRAVITY,
    divisions,
    engine_reference,
    model_text,
    motion_without_attitude,
    simulated,
)

RATE = 1000.0
"""√stiffness, rad/s."""
CONTACT = math.pi / RATE
"""How long a contact lasts, s."""
RADIUS, SPEED, GAP = 0.1, 1.0, 0.05
"""m, m/s, m."""
IMPEDANCE = 0.9
_PHASES = 16
"""Of a step, in which a contact can begin."""
_LENGTHS = 4
"""Of a contact, from a whole number of steps on: at whole numbers errors cancel that elsewhere do
not."""

_GEOM = f'condim="1" solref="{-(RATE**2)!r} 0" solimp="{IMPEDANCE} {IMPEDANCE} 0.001 0.5 2"'
_OPTION = f'{NO_GRAVITY} tolerance="0"'


def _ball(at: float) -> str:
    joint, geom = '<joint type="slide" axis="1 0 0"/>', f'<geom size="{RADIUS}" mass="1" {_GEOM}/>'
    return f'    <body pos="{at!r} 0 0">{joint}{geom}</body>'


BOUNCE = model_text(
    f'    <geom type="plane" size="1 1 1" pos="{RADIUS + GAP!r} 0 0" zaxis="-1 0 0" {_GEOM}/>\n'
    + _ball(0.0),
    _OPTION,
)


def cradle_mjcf(gaps: tuple[float, ...]) -> str:
    """Balls on one line, with these gaps (m) between them."""
    starts = [sum(gaps[:index]) + 2 * RADIUS * index for index in range(len(gaps) + 1)]
    return model_text("\n".join(_ball(at) for at in starts), _OPTION)


CRADLE, TOUCHING = cradle_mjcf((GAP, GAP)), cradle_mjcf((GAP, 0.0))
_MEETING = Scenario(0.1, 0.01, (0.0,), (SPEED,))
_PASSING = Scenario(0.13, 0.01, (0.0, 0.0, 0.0), (SPEED, 0.0, 0.0))
_SHARED = Scenario(0.06, 0.002, (0.0, 0.0, 0.0), (SPEED, 0.0, 0.0))


def bounce(times: Array) -> Motion:
    """A ball that meets a wall `GAP` away at `SPEED` and comes back, at the times (n,) s."""
    begin = GAP / SPEED
    in_touch = times - begin
    depth = SPEED / RATE * np.sin(RATE * in_touch)
    place = np.where(
        in_touch < 0,
        SPEED * times,
        np.where(in_touch < CONTACT, GAP + depth, GAP - SPEED * (in_touch - CONTACT)),
    )
    speed = np.where(
        in_touch < 0,
        SPEED,
        np.where(in_touch < CONTACT, SPEED * np.cos(RATE * in_touch), -SPEED),
    )
    return motion_without_attitude(times, place[:, None], speed[:, None])


def cradle(times: Array) -> Motion:
    """Three balls with gaps, (n, 3): each takes over the velocity of the one before.

    In a contact the centre of two balls goes on at half the velocity, and their distance is half an
    oscillation; each ball is pushed, flies, and pushes the next one.
    """
    place, speed = np.zeros((len(times), 3)), np.zeros((len(times), 3))
    free, flown_from = 0.0, 0.0  # when the ball begins to fly, and from where
    for ball in range(3):
        last = ball == 2
        meets = math.inf if last else free + (GAP - flown_from) / SPEED
        flies = (times >= free) & (times < meets)
        place[flies, ball] = flown_from + SPEED * (times[flies] - free)
        speed[flies, ball] = SPEED
        if last:
            break
        t = times - meets
        pushes, done = (t >= 0) & (t < CONTACT), t >= CONTACT
        sine, cosine = np.sin(RATE * t[pushes]), np.cos(RATE * t[pushes])
        place[pushes, ball] = GAP + SPEED * (t[pushes] + sine / RATE) / 2
        place[pushes, ball + 1] = SPEED * (t[pushes] - sine / RATE) / 2
        speed[pushes, ball] = SPEED * (1 + cosine) / 2
        speed[pushes, ball + 1] = SPEED * (1 - cosine) / 2
        place[done, ball] = GAP + SPEED * CONTACT / 2
        free, flown_from = meets + CONTACT, SPEED * CONTACT / 2
    return motion_without_attitude(times, place, speed)


_J = np.array([[1.0, -1.0, 0.0], [0.0, 1.0, -1.0]])
"""Velocities → how fast each pair comes nearer."""


def _forces(depth: Array) -> Array:
    """What the contacts push with, (2,) N per kg: depths (2,) m, those below 0 do not touch.

    A + R has no positive number beside its diagonal, so that no force comes out negative.
    """
    found = np.zeros(2)
    touching = depth > 0
    if touching.any():
        a = _J[touching] @ _J[touching].T
        r = np.diag(np.diag(a)) * (1 - IMPEDANCE) / IMPEDANCE
        found[touching] = np.linalg.solve(a + r, RATE**2 / IMPEDANCE * depth[touching])
    return found


def touching_cradle(times: Array) -> Motion:
    """Three balls, two of which touch, (n, 3): integrated in small steps from the first touch."""

    def rate(state: State) -> State:
        depth = _J @ state[:3] - np.array([GAP, 0.0])
        return np.concatenate([state[3:], -_J.T @ _forces(depth)])

    begin = GAP / SPEED
    place, speed = np.zeros((len(times), 3)), np.zeros((len(times), 3))
    flying = times <= begin
    place[flying, 0], speed[flying, 0] = SPEED * times[flying], SPEED
    if not flying.all():
        start = np.array([GAP, 0.0, 0.0, SPEED, 0.0, 0.0])
        later = times[~flying] - begin
        states = bulirsch_stoer(rate, start, later, 1e-14, columns=4, first=1e-6)
        place[~flying], speed[~flying] = states[:, :3], states[:, 3:]
    return motion_without_attitude(times, place, speed)


def restitution(integrator: Integrator, steps: int) -> float:
    """How fast the ball comes back, relative to how fast it came, at worst.

    A contact begins at any moment of a step, and lasts `steps` steps or a part of a step more.
    """
    cases = ((steps + k / _LENGTHS, j / _PHASES) for k in range(_LENGTHS) for j in range(_PHASES))
    found = [_back(integrator, length, phase) for length, phase in cases]
    return max(found, key=lambda back: math.inf if math.isnan(back) else abs(back - 1))


def _back(integrator: Integrator, length: float, phase: float) -> float:
    """The restitution where a contact lasts `length` steps and begins at `phase` of one."""
    timestep = CONTACT / length
    start = GAP - SPEED * timestep * (2 + phase)
    scenario = Scenario(0.1, 0.01, (start,), (SPEED,))
    data = simulated(BOUNCE, scenario, integrator, timestep, 3 * math.ceil(length) + 8)
    return -float(data.qvel[0]) / SPEED


def last_velocity(
    mjcf: str, scenario: Scenario, integrator: Integrator, ball: int, steps: int
) -> float:
    """The velocity of a ball after everything, m/s, with so many steps in a contact."""
    timestep = CONTACT / steps
    count = round(scenario.duration / timestep)
    return float(simulated(mjcf, scenario, integrator, timestep, count).qvel[ball])


def problems() -> tuple[Problem, ...]:
    """The impact and the cradles."""
    parted = Problem(
        name="elastic-impact",
        title="Elastic impact on a wall",
        case=8,
        mjcf=BOUNCE,
        scenario=_MEETING,
        position_bound=1.0,
        velocity_bound=2 * SPEED,
        reference=Reference("closed", "half an oscillation without damping", bounce, floor=1e-13),
        second=engine_reference(BOUNCE, _MEETING),
        timesteps=divisions(0.01, 16, 32, 64, 128, 256, 512),
        checks=tuple(_restitution(steps) for steps in (5, 10, 20, 40, 80)),
        smooth=False,
        note="an impact begins within a step: no order is to be expected",
    )
    exchanged = "equal masses exchange their velocities"
    passed = replace(
        parted,
        name="newtons-cradle",
        title="Newton's cradle with gaps",
        mjcf=CRADLE,
        scenario=_PASSING,
        reference=Reference("closed", exchanged, cradle, floor=1e-13),
        second=engine_reference(CRADLE, _PASSING),
        checks=(
            ScalarCheck(
                "velocity of the last ball, 20 steps in a contact",
                "m/s",
                SPEED,
                lambda integrator: last_velocity(CRADLE, _PASSING, integrator, 2, 20),
                exchanged,
            ),
        ),
        note="a cradle whose balls touch is another problem: all contacts act at once",
    )
    source = "MuJoCo's soft contacts, Bulirsch–Stoer in small steps"
    shared = replace(
        parted,
        name="newtons-cradle-touching",
        title="Newton's cradle, two balls of which touch",
        mjcf=TOUCHING,
        scenario=_SHARED,
        reference=Reference("ode", source, touching_cradle, floor=1e-11),
        second=engine_reference(TOUCHING, _SHARED),
        agreement=1e-9,
        timesteps=divisions(0.002, 16, 32, 64, 128),
        checks=tuple(_shared(ball, name) for ball, name in enumerate(("first", "middle", "last"))),
        note="all contacts act at once: the last ball does not take over the whole velocity",
    )
    return parted, passed, shared


def _restitution(steps: int) -> ScalarCheck:
    name = f"restitution, {steps} to {steps + 1} steps in a contact, at worst"
    measure = partial(restitution, steps=steps)
    return ScalarCheck(name, "", 1.0, measure, "no damping")


def _shared(ball: int, name: str) -> ScalarCheck:
    return ScalarCheck(
        f"velocity of the {name} ball, 80 steps in a contact",
        "m/s",
        lambda _: float(touching_cradle(np.array([_SHARED.duration])).velocity[0, ball]),
        lambda integrator: last_velocity(TOUCHING, _SHARED, integrator, ball, 80),
        "the soft contacts of MuJoCo, integrated",
    )
