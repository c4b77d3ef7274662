"""Case 8: an elastic impact, and Newton's cradle with gaps.

Entry point: `problems()`.

With direct `solref` (stiffness, damping) and constant impedance a contact of two bodies without
friction is an oscillator of frequency √stiffness in their distance: without damping the bodies
part as fast as they met, after half a period. Between equal masses the velocities are exchanged.

Source: MuJoCo documentation, Modeling, Solver parameters.
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
from coursebuild.numerics.problems.common import (
    NO_GRAVITY,
    divisions,
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


CRADLE = cradle_mjcf((GAP, GAP))


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


def bounce_integrated(times: Array) -> Motion:
    """The same: free, then the oscillator by Bulirsch–Stoer until the force ends, then free."""

    def rate(state: State) -> State:
        return np.array([state[1], -(RATE**2) * state[0]])

    begin = GAP / SPEED
    start = np.array([0.0, SPEED])
    low, high = 0.5 / RATE, 6.0 / RATE  # the depth is positive, then negative
    for _ in range(60):
        middle = (low + high) / 2
        deep = bulirsch_stoer(rate, start, np.array([middle]), first=1e-4)[0, 0] > 0
        low, high = (middle, high) if deep else (low, middle)
    away = float(bulirsch_stoer(rate, start, np.array([low]), first=1e-4)[0, 1])
    place, speed = SPEED * times, np.full_like(times, SPEED)
    touching = (times > begin) & (times <= begin + low)
    if touching.any():
        states = bulirsch_stoer(rate, start, times[touching] - begin, first=1e-4)
        place[touching], speed[touching] = GAP + states[:, 0], states[:, 1]
    after = times > begin + low
    place[after] = GAP + away * (times[after] - begin - low)
    speed[after] = away
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


def cradle_integrated(times: Array) -> Motion:
    """The same from event to event: flight, then two bodies with a spring by Bulirsch–Stoer."""

    def pair(state: State) -> State:
        x, y, v, w = state.tolist()
        push = RATE**2 / 2 * (x - y - GAP)
        return np.array([v, w, -push, push])

    def parted(state: State) -> float:
        low, high = 0.5 / RATE, 6.0 / RATE
        for _ in range(60):
            middle = (low + high) / 2
            x, y = bulirsch_stoer(pair, state, np.array([middle]), first=1e-4)[0, :2]
            low, high = (middle, high) if x - y > GAP else (low, middle)
        return low

    place, speed = np.zeros((len(times), 3)), np.zeros((len(times), 3))
    now, x, v = 0.0, np.zeros(3), np.array([SPEED, 0.0, 0.0])
    for ball in range(2):
        meets = now + float((x[ball + 1] + GAP - x[ball]) / (v[ball] - v[ball + 1]))
        _fly(times, now, meets, x, v, place, speed)
        x = x + v * (meets - now)
        start = np.array([x[ball], x[ball + 1], v[ball], v[ball + 1]])
        ends = meets + parted(start)
        here = (times > meets) & (times <= ends)
        at = np.append(times[here] - meets, ends - meets)
        states = bulirsch_stoer(pair, start, at, first=1e-4)
        place[here], speed[here] = x, v
        place[here, ball : ball + 2] = states[:-1, :2]
        speed[here, ball : ball + 2] = states[:-1, 2:]
        x, v, now = x.copy(), v.copy(), ends
        x[ball : ball + 2], v[ball : ball + 2] = states[-1, :2], states[-1, 2:]
    _fly(times, now, math.inf, x, v, place, speed)
    return motion_without_attitude(times, place, speed)


def _fly(
    times: Array, begin: float, end: float, x: Array, v: Array, place: Array, speed: Array
) -> None:
    here = (times > begin) & (times <= end)
    place[here], speed[here] = x + v * (times[here] - begin)[:, None], v


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


def passed_on(integrator: Integrator, steps: int) -> float:
    """The velocity of the cradle's last ball after everything, m/s."""
    timestep = CONTACT / steps
    scenario = problems()[1].scenario
    return float(simulated(CRADLE, scenario, integrator, timestep, round(0.13 / timestep)).qvel[2])


def _restitutions() -> tuple[ScalarCheck, ...]:
    return tuple(
        ScalarCheck(
            f"restitution, {steps} to {steps + 1} steps in a contact, at worst",
            "",
            1.0,
            lambda integrator, steps=steps: restitution(integrator, steps),  # type: ignore[misc]
            "no damping",
        )
        for steps in (5, 10, 20, 40, 80)
    )


def problems() -> tuple[Problem, ...]:
    """The impact and the cradle."""
    return (
        Problem(
            name="elastic-impact",
            title="Elastic impact on a wall",
            case=8,
            mjcf=BOUNCE,
            scenario=Scenario(0.1, 0.01, (0.0,), (SPEED,)),
            position_bound=1.0,
            velocity_bound=2 * SPEED,
            reference=Reference(
                "closed", "half an oscillation without damping", bounce, floor=1e-13
            ),
            second=Reference(
                "ode", "Bulirsch–Stoer until the force ends", bounce_integrated, floor=1e-12
            ),
            timesteps=divisions(0.01, 16, 32, 64, 128, 256, 512),
            checks=_restitutions(),
            smooth=False,
            note="an impact begins within a step: no order is to be expected",
        ),
        Problem(
            name="newtons-cradle",
            title="Newton's cradle with gaps",
            case=8,
            mjcf=CRADLE,
            scenario=Scenario(0.13, 0.01, (0.0, 0.0, 0.0), (SPEED, 0.0, 0.0)),
            position_bound=1.0,
            velocity_bound=2 * SPEED,
            reference=Reference(
                "closed", "equal masses exchange their velocities", cradle, floor=1e-13
            ),
            second=Reference(
                "ode", "from contact to contact, Bulirsch–Stoer", cradle_integrated, floor=1e-12
            ),
            timesteps=divisions(0.01, 16, 32, 64, 128, 256, 512),
            checks=(
                ScalarCheck(
                    "velocity of the last ball, 20 steps in a contact",
                    "m/s",
                    SPEED,
                    lambda integrator: passed_on(integrator, 20),
                    "equal masses exchange their velocities",
                ),
            ),
            smooth=False,
            note="a cradle whose balls touch is another problem: all contacts act at once",
        ),
    )
