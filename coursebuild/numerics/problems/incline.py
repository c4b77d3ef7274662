"""Case 7: a block and a ball on a slope: the cone of friction, rolling, creep of what should stick.

Entry point: `problems()`.

Gravity is tilted instead of the floor, along an axis of the contact's frame or half-way between its
two: a pyramidal cone gives only 1/√2 of the friction there.

Sources: C.-A. de Coulomb's law, a = g (sin α − μ cos α) when sliding; a solid ball that rolls
without slipping has a = 5/7 g sin α (L. D. Landau, E. M. Lifshitz, Mechanics, § 38).
"""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from msgspec.structs import replace

from coursebuild.numerics.integrate import bulirsch_stoer
from coursebuild.numerics.problem import (
    Array,
    Integrator,
    Motion,
    Problem,
    Reference,
    ScalarCheck,
    Scenario,
)
from coursebuild.numerics.problems.common import model_text, simulated

GRAVITY = 9.81
SLIDING, STICKING, ROLLING = math.radians(45), math.radians(15), math.radians(20)
FRICTION = 0.5
Cone = Literal["pyramidal", "elliptic"]
_CONES: tuple[Cone, ...] = ("elliptic", "pyramidal")
_HALF, _WIDE = 0.05, 0.2
"""m; a block as high as it is wide would rock."""
_STEP = 1e-3
_SCENARIO = Scenario(1.0, 0.1)


def mjcf(shape: str, slope: float, across: bool, cone: Cone, friction: float) -> str:
    """A block or a ball on a floor, with gravity tilted by `slope` (rad) towards x, or x and y."""
    pull = GRAVITY * math.sin(slope)
    x, y = (pull / math.sqrt(2), pull / math.sqrt(2)) if across else (pull, 0.0)
    z = -GRAVITY * math.cos(slope)
    size = f"{_WIDE} {_WIDE} {_HALF}" if shape == "box" else f"{_HALF}"
    contact = f'condim="3" friction="{friction} 0.005 0.0001"'
    option = f'gravity="{x!r} {y!r} {z!r}" cone="{cone}" tolerance="0" iterations="100"'
    plane = f'    <geom type="plane" size="10 10 1" {contact}/>'
    geom = f'<geom type="{shape}" size="{size}" mass="1" {contact}/>'
    body = f'    <body pos="0 0 {_HALF}"><freejoint/>{geom}</body>'
    return model_text(f"{plane}\n{body}", option)


def acceleration(text: str, integrator: Integrator) -> float:
    """Along the slope, m/s²: from 0.5 s, when the contact has settled, to 1 s, at 1 ms."""
    half, whole = (_speed(text, integrator, seconds) for seconds in (0.5, 1.0))
    return (whole - half) / 0.5


def creep(text: str, integrator: Integrator) -> float:
    """The velocity at which a block slips that should stick, m/s: after two seconds at 1 ms."""
    return _speed(text, integrator, 2.0)


def _speed(text: str, integrator: Integrator, seconds: float) -> float:
    """Along the slope after so many seconds from rest, m/s."""
    data = simulated(text, _SCENARIO, integrator, _STEP, round(seconds / _STEP))
    return math.hypot(data.qvel[0], data.qvel[1])


def _as_motion(times: Array, way: Array, speed: Array, turn: float, across: bool) -> Motion:
    along = np.array([1.0, 1.0, 0.0]) / math.sqrt(2) if across else np.array([1.0, 0.0, 0.0])
    axis = np.array([-along[1], along[0], 0.0])
    place = way[:, None] * along + np.array([0.0, 0.0, _HALF])
    half = way * turn / 2
    attitude = np.concatenate([np.cos(half)[:, None], np.sin(half)[:, None] * axis], axis=1)
    # Turning about an axis that does not move: the same in the body's frame and in the world's.
    velocity = np.concatenate([speed[:, None] * along, speed[:, None] * turn * axis], axis=1)
    return Motion(times, place, attitude[:, None], velocity)


def problems() -> tuple[Problem, ...]:
    """Sliding along an axis and between two, rolling, sticking; with both cones."""
    return (
        *(_sliding(cone, across) for cone in _CONES for across in (False, True)),
        *(_rolling(cone) for cone in _CONES),
        *(_sticking(cone) for cone in _CONES),
    )


def _sliding(cone: Cone, across: bool) -> Problem:
    fall, press = GRAVITY * math.sin(SLIDING), GRAVITY * math.cos(SLIDING)
    text = mjcf("box", SLIDING, across, cone, FRICTION)
    name, pull = "acceleration when sliding, from 0.5 s to 1 s at 1 ms", fall - FRICTION * press
    checks = [_acceleration(name, text, pull, "Coulomb's law")]
    if cone == "pyramidal" and across:  # |f₁| + |f₂| ≤ μ f leaves μ/√2 half-way between the axes
        name, blunted = "the same, against a pyramid's friction", FRICTION / math.sqrt(2)
        checks.append(_acceleration(name, text, fall - blunted * press, "|f₁| + |f₂| ≤ μ f"))
    where = "between the axes" if across else "along an axis"
    article = "an" if cone == "elliptic" else "a"
    return _problem(
        f"sliding-block-{cone}-{'across' if across else 'along'}",
        f"Block sliding {where} of {article} {cone} cone",
        text,
        _references("Coulomb's law, a = g (sin α − μ cos α)", pull, across=across, floor=1e-14),
        tuple(checks),
        "the error is the model's: soft contacts, and the cone; no order is to be expected",
    )


def _rolling(cone: Cone) -> Problem:
    pull = 5 / 7 * GRAVITY * math.sin(ROLLING)
    text = mjcf("sphere", ROLLING, False, cone, 1.0)
    name, law = "acceleration when rolling, from 0.5 s to 1 s at 1 ms", "a = 5/7 g sin α"
    found = _problem(
        f"rolling-ball-{cone}",
        f"Ball rolling, {cone} cone",
        text,
        _references(f"rolling without slipping, {law}", pull, turn=1 / _HALF, floor=1e-13),
        (_acceleration(name, text, pull, law),),
        "the ball sinks in, and so rolls on a shorter arm: the error is the model's",
    )
    return replace(found, velocity_bound=200.0)


def _sticking(cone: Cone) -> Problem:
    text = mjcf("box", STICKING, False, cone, FRICTION)

    def slipped(integrator: Integrator) -> float:
        return creep(text, integrator)

    found = _problem(
        f"sticking-block-{cone}",
        f"Block that should stick, {cone} cone",
        text,
        _references("Coulomb's law: tan α < μ, so that it rests", 0.0, floor=1e-15),
        (ScalarCheck("creep after 2 s at 1 ms", "m/s", 0.0, slipped, "Coulomb's law"),),
        "soft friction gives way at a steady velocity",
    )
    return replace(found, scenario=Scenario(2.0, 0.1), position_bound=1.0, velocity_bound=1.0)


def _acceleration(name: str, text: str, exact: float, law: str) -> ScalarCheck:
    return ScalarCheck(name, "m/s²", exact, lambda integrator: acceleration(text, integrator), law)


def _problem(
    name: str,
    title: str,
    text: str,
    references: tuple[Reference, Reference],
    checks: tuple[ScalarCheck, ...],
    note: str,
) -> Problem:
    return Problem(
        name=name,
        title=title,
        case=7,
        mjcf=text,
        scenario=_SCENARIO,
        position_bound=20.0,
        velocity_bound=20.0,
        penetration_bound=_HALF / 2,
        reference=references[0],
        second=references[1],
        timesteps=(2e-3, 1e-3, 5e-4),
        checks=checks,
        smooth=False,
        note=note,
    )


def _references(
    law: str, pull: float, *, turn: float = 0.0, across: bool = False, floor: float
) -> tuple[Reference, Reference]:
    """A steady acceleration `pull` (m/s²) from rest, by its formula and integrated.

    A ball turns with it, `turn` rad for each metre.
    """

    def closed(times: Array) -> Motion:
        return _as_motion(times, pull * times**2 / 2, pull * times, turn, across)

    def integrated(times: Array) -> Motion:
        states = bulirsch_stoer(lambda s: np.array([s[1], pull]), np.zeros(2), times)
        return _as_motion(times, states[:, 0], states[:, 1], turn, across)

    return (
        Reference("closed", law, closed, floor=floor),
        Reference("ode", "the law of motion, Bulirsch–Stoer", integrated, floor=10 * floor),
    )
