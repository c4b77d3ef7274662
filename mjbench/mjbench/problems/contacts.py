"""Cases 7 and 9: a block and a ball on a slope, and a heavy body that rests on a light one.

1. *Slope*: the cone of friction, rolling, creep of what should stick. Gravity is tilted instead of
   the floor, along an axis of the contact's frame or half-way between its two: a pyramidal cone
   gives only 1/√2 of the friction there.
2. *Stack*: at rest a contact's force f gives way by r = f (1 − d) Â/(k d²), with the impedance d,
   the stiffness k = 1/(d² timeconst² dampratio²) and Â, the sum of the inverse masses that it
   connects: whatever the bodies weigh, the depth grows with their ratio.

Sources: C.-A. de Coulomb's law, a = g (sin α − μ cos α) when sliding; a solid ball that rolls
without slipping has a = 5/7 g sin α (L. D. Landau, E. M. Lifshitz, Mechanics, § 38); MuJoCo
documentation, Computation, Constraint model.
"""

from __future__ import annotations

import math
from functools import partial
from typing import Any, Literal

import mujoco
import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from mjbench.problem import (
    Array,
    Integrator,
    Motion,
    Problem,
    Reference,
    ScalarCheck,
    Scenario,
    SecondReference,
    Sizes,
    model_text,
    motion_without_attitude,
)
from mjbench.rotations import axis_angle_to_quat
from mjbench.simulation import compile_model, run_steps

Cone = Literal["pyramidal", "elliptic"]
_CONES: tuple[Cone, ...] = ("elliptic", "pyramidal")
SLIDING, DIAGONAL_SLIDING = (
    "6.936717523440031 0 -6.936717523440032",
    "4.905 4.905 -6.936717523440032",
)
ROLLING = "3.3552176060248105 0 -9.218384609909762"
"""Gravity on slopes of 45° and 20°, m/s²; in the second half-way between the axes."""
_STEP = 1e-3
_SCENARIO = Scenario(1.0, 0.1)


def mjcf(shape: str, gravity: str, cone: Cone, friction: str) -> str:
    """A block or a ball on a floor, under a tilted gravity."""
    # A block as high as it is wide would rock.
    size = "0.2 0.2 0.05" if shape == "box" else "0.05"
    contact = f'condim="3" friction="{friction} 0.005 0.0001"'
    option = f'gravity="{gravity}" cone="{cone}" tolerance="0" iterations="100"'
    plane = f'    <geom type="plane" size="10 10 1" {contact}/>'
    geom = f'<geom type="{shape}" size="{size}" mass="1" {contact}/>'
    body = f'    <body pos="0 0 0.05"><freejoint/>{geom}</body>'
    return model_text(f"{plane}\n{body}", option)


class Incline(Struct, frozen=True):
    """A steady acceleration from rest, down a slope."""

    slope: float
    friction: float | None
    """Of a block; `None`: it is a ball, and rolls."""
    is_diagonal: bool = False
    """Whether it goes half-way between the axes."""
    gravity: float = 9.81
    height: float = 0.05
    """Of the centre, m."""

    @property
    def acceleration(self) -> float:
        """The acceleration along the slope, m/s²."""
        fall, press = self.gravity * math.sin(self.slope), self.gravity * math.cos(self.slope)
        return 5 / 7 * fall if self.friction is None else max(0.0, fall - self.friction * press)

    def motion(self, times: Array) -> Motion:
        """The motion at the times (n,) s."""
        speed = self.acceleration * times
        way, turn = speed * times / 2, 0.0 if self.friction else 1 / self.height
        direction = (
            np.array([1.0, 1.0, 0.0]) / math.sqrt(2) if self.is_diagonal else np.array([1.0, 0, 0])
        )
        axis = np.array([-direction[1], direction[0], 0.0])
        place = way[:, None] * direction + np.array([0.0, 0.0, self.height])
        half = way * turn / 2
        attitude = np.concatenate([np.cos(half)[:, None], np.sin(half)[:, None] * axis], axis=1)
        # Turning about an axis that does not move: the same in the body's frame and in the world's.
        velocity = np.concatenate(
            [speed[:, None] * direction, speed[:, None] * turn * axis], axis=1
        )
        return Motion(times, place, attitude[:, None], velocity)


def _rigid_motion(text: str, _: Scenario, times: Array) -> Motion:
    """The motion with rigid contacts, from the numbers of a model."""
    model = compile_model(text, Integrator.EULER, _STEP)
    pull, normal = model.opt.gravity[:2], -float(model.opt.gravity[2])
    size, spin = float(np.hypot(*pull)), np.zeros(3)
    rolls = model.geom_type[1] == mujoco.mjtGeom.mjGEOM_SPHERE
    if rolls:
        radius = float(model.geom_size[1, 0])
        lag = float(model.body_inertia[1, 1] / model.body_mass[1]) / radius**2
        push = pull / (1 + lag)
        spin = np.cross([0.0, 0.0, 1.0], [*push, 0.0]) / radius
    else:
        grip = float(model.geom_friction[:, 0].max()) * normal
        push = pull * max(0.0, 1 - grip / size)
    place = model.body_pos[1] + np.outer(times**2 / 2, [*push, 0.0])
    axis = np.cross([0.0, 0.0, 1.0], [*pull, 0.0])
    attitude = axis_angle_to_quat(axis, float(np.linalg.norm(spin)) * times**2 / 2)
    return Motion(times, place, attitude[:, None], np.outer(times, [*push, 0.0, *spin]))


RIGID = SecondReference("Newton’s and Coulomb’s laws for the numbers of the MJCF", _rigid_motion)


def acceleration(text: str, integrator: Integrator) -> float:
    """The acceleration along the slope, m/s²: from 0.5 s, when the contact has settled, to 1 s."""
    half, whole = 0.5, 1.0
    gain = _speed(text, integrator, whole) - _speed(text, integrator, half)
    return gain / (whole - half)


def _speed(text: str, integrator: Integrator, seconds: float) -> float:
    """The speed along the slope after so many seconds from rest, m/s."""
    data = run_steps(text, _SCENARIO, integrator, _STEP, round(seconds / _STEP))
    return math.hypot(data.qvel[0], data.qvel[1])


def _sliding_problem(cone: Cone, is_diagonal: bool) -> Problem:
    friction = 0.5
    slide = Incline(math.radians(45), friction, is_diagonal)
    text = mjcf("box", DIAGONAL_SLIDING if is_diagonal else SLIDING, cone, "0.5")
    name = "acceleration when sliding, from 0.5 s to 1 s at 1 ms"
    checks = [_acceleration(name, text, slide.acceleration, "Coulomb's law")]
    if (
        cone == "pyramidal" and is_diagonal
    ):  # |f₁| + |f₂| ≤ μ f leaves μ/√2 half-way between the axes
        blunted = replace(slide, friction=friction / math.sqrt(2)).acceleration
        name = "the same, against a pyramid's friction"
        checks.append(_acceleration(name, text, blunted, "|f₁| + |f₂| ≤ μ f"))
    course = "between the axes" if is_diagonal else "along an axis"
    article = "an" if cone == "elliptic" else "a"
    return _slope_problem(
        f"sliding-block-{cone}-{'across' if is_diagonal else 'along'}",
        f"Block sliding {course} of {article} {cone} cone",
        text,
        Reference("closed", "Coulomb's law, a = g (sin α − μ cos α)", slide),
        tuple(checks),
        "the error is the model's: soft contacts, and the cone; no order can be expected",
    )


def _rolling_problem(cone: Cone) -> Problem:
    roll = Incline(math.radians(20), None)
    text = mjcf("sphere", ROLLING, cone, "1")
    name, law = "acceleration when rolling, from 0.5 s to 1 s at 1 ms", "a = 5/7 g sin α"
    problem = _slope_problem(
        f"rolling-ball-{cone}",
        f"Ball rolling, {cone} cone",
        text,
        Reference("closed", f"rolling without slipping, {law}", roll),
        (_acceleration(name, text, roll.acceleration, law),),
        "the ball sinks in, and so rolls on a shorter arm: the error is the model's",
    )
    return replace(problem, velocity_bound=200.0)


def _sticking_problem(cone: Cone) -> Problem:
    rest, scenario = Incline(math.radians(15), 0.5), Scenario(2.0, 0.1)
    # These numbers are written once: it would rest with others too, and creep otherwise.
    fall, press = rest.gravity * math.sin(rest.slope), rest.gravity * math.cos(rest.slope)
    text = mjcf("box", f"{fall!r} 0 {-press!r}", cone, repr(rest.friction))
    creep = partial(_speed, text, seconds=scenario.duration)
    law = "Coulomb's law: tan α < μ, so that it rests"
    problem = _slope_problem(
        f"sticking-block-{cone}",
        f"Block that should stick, {cone} cone",
        text,
        Reference("closed", law, rest),
        (ScalarCheck("creep after 2 s at 1 ms", "m/s", 0.0, creep, "Coulomb's law"),),
        "soft friction gives way at a steady velocity",
    )
    return replace(problem, scenario=scenario, position_bound=1.0, velocity_bound=1.0)


def _acceleration(name: str, text: str, exact: float, law: str) -> ScalarCheck:
    return ScalarCheck(name, "m/s²", exact, partial(acceleration, text), law)


def _slope_problem(
    name: str,
    title: str,
    text: str,
    reference: Reference,
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
        reference=reference,
        second=RIGID,
        timesteps=(2e-3, 1e-3, 5e-4),
        checks=checks,
        smooth=False,
        note=note,
    )


RATIOS = (1.0, 1e1, 1e2, 1e3, 1e4)
"""Mass of the upper body in kg; the lower one has 1 kg."""
_RESTS = {
    1.0: (-3.1392e-06, -6.2784e-06),
    1e1: (-1.726560e-05, -3.453120e-05),
    1e2: (-1.585296e-04, -3.170592e-04),
    1e3: (-1.5711696e-03, -3.1423392e-03),
    1e4: (-1.56975696e-02, -3.13951392e-02),
}
"""By that mass, where the balls rest, m: the scenarios begin there."""
_SETTLING = 3.0


def _stack_mjcf(ratio: float) -> str:
    """Two balls that slide up and down over a floor."""
    contact = 'condim="1" solref="0.004 1" solimp="0.99 0.99 0.001 0.5 2"'
    plane = f'    <geom type="plane" size="1 1 1" {contact}/>'
    balls = [
        f'    <body pos="0 0 {height}"><joint type="slide" axis="0 0 1"/>'
        f'<geom size="0.1" mass="{mass}" {contact}/></body>'
        for height, mass in (("0.1", 1.0), ("0.3", ratio))
    ]
    option = 'gravity="0 0 -9.81" tolerance="0" iterations="200"'
    return model_text("\n".join((plane, *balls)), option)


class RestingStack(Struct, frozen=True):
    """A stack at rest, sunk as deep as its contacts give way."""

    upper: float
    lower: float = 1.0
    gravity: float = 9.81
    impedance: float = 0.99
    timeconst: float = 0.004

    @property
    def depths(self) -> Array:
        """The depths of the lower and the upper contact, (2,) m."""
        forces = self.gravity * np.array([self.lower + self.upper, self.upper])
        inverse = np.array([1 / self.lower, 1 / self.lower + 1 / self.upper])
        depths: Array = forces * inverse * (1 - self.impedance) * self.timeconst**2
        return depths

    def motion(self, times: Array) -> Motion:
        """The motion at the times (n,) s."""
        still = np.zeros((len(times), 2))
        return motion_without_attitude(times, still - np.cumsum(self.depths), still)


def _settle(integrator: Integrator, ratio: float) -> Any:
    """`mjData` of the stack, let go without overlap and left to itself for a while."""
    scenario = Scenario(1.0, 0.1, (0.0, 0.0))
    return run_steps(_stack_mjcf(ratio), scenario, integrator, 1e-3, round(_SETTLING / 1e-3))


def problems() -> tuple[Problem, ...]:
    """Sliding along an axis and between two, rolling, sticking, with both cones; stacks."""
    return (
        *(_sliding_problem(cone, is_diagonal) for cone in _CONES for is_diagonal in (False, True)),
        *(_rolling_problem(cone) for cone in _CONES),
        *(_sticking_problem(cone) for cone in _CONES),
        *map(_stack_problem, RATIOS),
    )


def _stack_problem(ratio: float) -> Problem:
    solution = RestingStack(ratio)
    depth = solution.depths.sum()
    precision = 1e-13 if ratio < 1e4 else math.inf  # the heaviest does not come to rest in time
    return Problem(
        name=f"stack-{ratio:g}",
        title=f"Stack of 1 kg under {ratio:g} kg",
        case=9,
        mjcf=_stack_mjcf(ratio),
        scenario=Scenario(0.2, 0.002, _RESTS[ratio]),
        position_bound=1.0,
        velocity_bound=10.0,
        reference=Reference("closed", "r = f (1 − d) Â/(k d²)", solution),
        precision=Sizes(1e-13, 0.0, 1e-11),
        timesteps=(2e-3, 1e-3, 5e-4),
        checks=(
            ScalarCheck(
                f"how far the upper body sinks, let go without overlap, {_SETTLING:g} s at 1 ms",
                "m",
                float(depth),
                # Contacts would not say it of balls that passed each other.
                lambda integrator: float(-_settle(integrator, ratio).qpos[1]),
                "r = f (1 − d) Â/(k d²), both contacts",
                precision=precision,
            ),
            ScalarCheck(
                "velocity that is left then",
                "m/s",
                0.0,
                lambda integrator: float(np.max(np.abs(_settle(integrator, ratio).qvel))),
                "at rest",
                precision=precision,
            ),
        ),
        smooth=False,
        note="rigid bodies would not sink at all: the depth is the error of the soft model",
    )
