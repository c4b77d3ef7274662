"""Cases 2, 5, 6 and 12: pendulums with a closed form, and linear oscillators with a known limit.

1. *Pendulum*, let go at 90° and at 179°, as a hinge, as a ball joint and held by `connect`. The
   last one's error is that of the soft constraint: it does not go away with the timestep.
2. *Damped spring.* Joint damping is implicit, unless `eulerdamp` is off.
3. *Stiff servo*: a spring and damper that a `position` actuator makes. Its `kv` is not joint
   damping: Euler takes it at the beginning of the step, and so is stable to a smaller timestep.
4. *Soft equality.* With constant impedance d a constraint's acceleration is a = −d (b v + k d r),
   where b = 2/(d · timeconst), k = 1/(d² timeconst² dampratio²) and r is the violation: an
   oscillator with ω = 1/(timeconst · dampratio) and ζ = dampratio. All integrators but `discrete`
   compute it from the state at the beginning of the step, the implicit ones too. `refsafe` would
   raise the time constant to two timesteps and so hide the limit behind another model; it is off.

Sources: Abramowitz & Stegun, 17.1 and 16.1; L. D. Landau, E. M. Lifshitz, Mechanics, § 11:
sin(θ/2) = k cd(ω₀t | k²) for a pendulum let go at rest, k = sin(θ₀/2); for the semi-implicit method
E. Hairer, C. Lubich, G. Wanner, Geometric Numerical Integration, I.3; for the polynomial of the
classical Runge–Kutta method E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, IV.2;
MuJoCo documentation, Constraint model.
"""

from __future__ import annotations

import cmath
import math
from typing import Literal

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from mjbench.integrate import forward_motion
from mjbench.problem import (
    NO_CONTACT,
    NO_GRAVITY,
    Array,
    Integrator,
    Limit,
    Motion,
    Problem,
    Reference,
    Scenario,
    SecondReference,
    divisions,
    model_text,
    motion_without_attitude,
    turning_at_rest,
)
from mjbench.rotations import axis_angle_to_quat

START = (1.0,), (5.0,)
"""m and m/s: from rest the semi-implicit method would seem to be of second order in velocity."""
POSITION_BOUND = 1e4
"""m: with a double root a stable state may grow a few hundred times before it decays."""
_SPAN = 5000.0
"""Radians over which stability is judged: just beyond its boundary an oscillator grows slowly."""
SPRING_RATE, SERVO_RATE, EQUALITY_RATE = 10.0, 100.0, 50.0
"""√(k/m), √(kp/m) and 1/(timeconst · dampratio), rad/s."""
_DAMPING = {0.0: "0", 0.1: "2", 1.0: "20", 10.0: "200"}
_KV = {0.1: "20", 1.0: "200", 10.0: "2000"}
_SOLREF = {0.1: "0.2 0.1", 1.0: "0.02 1"}
"""What makes the damping ratio in the models, by that ratio."""


class Oscillation(Struct, frozen=True):
    """x″ + 2ζωx′ + ω²x = 0."""

    ratio: float
    """ζ."""
    rate: float
    """ω, rad/s."""
    x0: float = 1.0
    v0: float = 5.0

    def motion(self, times: Array) -> Motion:
        """The motion at the times (n,) s."""
        ratio, rate, x0, v0 = self.ratio, self.rate, self.x0, self.v0
        decay = ratio * rate
        if ratio == 1.0:
            fall, b = np.exp(-decay * times), v0 + decay * x0
            place = fall * (x0 + b * times)
            speed = fall * (b - decay * (x0 + b * times))
        elif ratio < 1.0:
            turn = rate * math.sqrt(1 - ratio**2)
            fall, sine, cosine = np.exp(-decay * times), np.sin(turn * times), np.cos(turn * times)
            place = fall * (x0 * cosine + (v0 + decay * x0) / turn * sine)
            speed = fall * (v0 * cosine - (decay * v0 + rate**2 * x0) / turn * sine)
        else:  # the slow root without the difference of large numbers
            fast = -rate * (ratio + math.sqrt(ratio**2 - 1))
            slow = rate**2 / fast
            a, b = (fast * x0 - v0) / (fast - slow), (v0 - slow * x0) / (fast - slow)
            place = a * np.exp(slow * times) + b * np.exp(fast * times)
            speed = slow * a * np.exp(slow * times) + fast * b * np.exp(fast * times)
        return motion_without_attitude(times, place[:, None], speed[:, None])


class Pursuit(Struct, frozen=True):
    """The servo from rest at 0: in each hold it is an oscillator about its target."""

    ratio: float
    rate: float
    targets: tuple[float, ...] = (0.1, -0.05)
    hold: float = 0.05

    def motion(self, times: Array) -> Motion:
        """The motion at the times (n,) s."""
        x, v, begin = 0.0, 0.0, 0.0
        place, speed = np.empty((len(times), 1)), np.empty((len(times), 1))
        for target in self.targets:
            in_hold = (
                times > begin + 1e-12
            )  # what is after the hold is written again in the next one
            at = np.append(times[in_hold] - begin, self.hold)
            part = Oscillation(self.ratio, self.rate, x - target, v).motion(at)
            place[in_hold], speed[in_hold] = part.position[:-1] + target, part.velocity[:-1]
            x, v = float(part.position[-1, 0]) + target, float(part.velocity[-1, 0])
            begin += self.hold
        return motion_without_attitude(times, place, speed)


def limit_of(ratio: float, rate: float, integrator: Integrator, *explicit: Integrator) -> Limit:
    """The largest stable timestep of a damped oscillator.

    `explicit` are the integrators that take its damping at the beginning of the step.
    """
    root = math.sqrt(ratio**2 + 1)
    if integrator is Integrator.RK4:
        return Limit(rk4_limit(ratio) / rate, "|1 + z + z²/2 + z³/6 + z⁴/24| = 1")
    if integrator is Integrator.DISCRETE:
        return Limit(math.inf, "implicit in positions and velocities")
    if integrator in explicit:
        return Limit(2 * (root - ratio) / rate, "hω = 2(√(ζ²+1) − ζ)")
    return Limit(2 * (root + ratio) / rate, "hω = 2(√(ζ²+1) + ζ)")


def rk4_limit(ratio: float) -> float:
    """The first hω at which the Runge–Kutta method does not damp an oscillator."""
    discriminant_root = cmath.sqrt(ratio**2 - 1)
    roots = (-ratio + discriminant_root, -ratio - discriminant_root)

    def growth(z: float) -> float:
        return max(abs(rk4_factor(root * z)) for root in roots)

    low = high = 0.5 / (1 + ratio)
    while growth(high) <= 1:
        low, high = high, high * 1.01
    for _ in range(80):
        middle = (low + high) / 2
        low, high = (middle, high) if growth(middle) <= 1 else (low, middle)
    return low


def rk4_factor(z: complex) -> complex:
    """R(z): what a step of the classical Runge–Kutta method multiplies by, z = hλ."""
    return 1 + z * (1 + z / 2 * (1 + z / 3 * (1 + z / 4)))


def _spring_problem(ratio: float) -> Problem:
    rate, explicit = SPRING_RATE, Integrator.EULER_EXPLICIT
    damper = f'stiffness="100" damping="{_DAMPING[ratio]}"'
    joint = f'<joint type="slide" axis="1 0 0" {damper}/>'
    return Problem(
        name=f"damped-spring-{ratio:g}",
        title=f"Damped spring, ζ = {ratio:g}",
        case=5,
        mjcf=model_text(_ball(joint), NO_GRAVITY, NO_CONTACT),
        scenario=Scenario(1.0, 0.1, *START),
        position_bound=POSITION_BOUND,
        velocity_bound=POSITION_BOUND * rate * (1 + 4 * ratio),
        reference=Reference("closed", "the linear oscillator", Oscillation(ratio, rate)),
        timesteps=divisions(0.1, 5, 10, 20, 40, 80, 160, 320, 640),
        limit=lambda integrator: limit_of(ratio, rate, integrator, explicit),
        energy_conserved=ratio == 0,
        search=(1e-2 / rate, 1e2 / rate),
        span=_SPAN * max(1.0, 0.2 * ratio) / rate,
        room=POSITION_BOUND**2,
    )


def _servo_problem(ratio: float) -> Problem:
    rate, explicit = SERVO_RATE, (Integrator.EULER, Integrator.EULER_EXPLICIT)
    gains = f'kp="10000" kv="{_KV[ratio]}"'
    motor = f'  <actuator><position joint="slide" {gains}/></actuator>\n'
    source = "the linear oscillator about each target"
    bound = POSITION_BOUND / 10
    return Problem(
        name=f"stiff-servo-{ratio:g}",
        title=f"Stiff servo, ζ = {ratio:g}",
        case=6,
        mjcf=model_text(_ball(_SLIDE), NO_GRAVITY, NO_CONTACT, motor),
        scenario=Scenario(0.1, 0.01, controls=((0.1,), (-0.05,)), hold=0.05),
        position_bound=bound,
        velocity_bound=bound * rate * (1 + 4 * ratio),
        reference=Reference("closed", source, Pursuit(ratio, rate)),
        timesteps=divisions(0.01, 4, 8, 16, 32, 64, 128, 256),
        limit=lambda integrator: limit_of(ratio, rate, integrator, *explicit),
        search=(1e-2 / rate, 1e2 / rate),
        span=_SPAN * max(1.0, 0.2 * ratio) / rate,
        room=POSITION_BOUND**2,
    )


def _equality_problem(ratio: float) -> Problem:
    rate, implicit = EQUALITY_RATE, (Integrator.RK4, Integrator.DISCRETE)
    explicit = [integrator for integrator in Integrator if integrator not in implicit]
    soft = f'solref="{_SOLREF[ratio]}" solimp="0.9 0.9 0.001 0.5 2"'
    equality = f'  <equality><joint joint1="slide" {soft}/></equality>\n'
    flags = '<flag refsafe="disable" contact="disable"/>'
    source = "the linear oscillator of the constraint"
    return Problem(
        name=f"soft-equality-{ratio:g}",
        title=f"Soft equality as an oscillator, ζ = {ratio:g}, refsafe off",
        case=12,
        mjcf=model_text(_ball(_SLIDE), f'{NO_GRAVITY} tolerance="0"', flags, equality),
        scenario=Scenario(0.2, 0.02, *START),
        position_bound=POSITION_BOUND,
        velocity_bound=POSITION_BOUND * rate * (1 + 4 * ratio),
        reference=Reference("closed", source, Oscillation(ratio, rate)),
        timesteps=divisions(0.02, 4, 8, 16, 32, 64, 128, 256),
        limit=lambda integrator: limit_of(ratio, rate, integrator, *explicit),
        search=(1e-2 / rate, 1e1 / rate),
        span=_SPAN / rate,
        room=POSITION_BOUND**2,
    )


_SLIDE = '<joint name="slide" type="slide" axis="1 0 0"/>'


def _ball(joint: str) -> str:
    """1 kg on a joint."""
    return f'    <body>{joint}<geom size="0.1" mass="1"/></body>'


Kind = Literal["hinge", "ball", "connect"]
_AXIS = np.array([0.0, 1.0, 0.0])
_JOINTS = {
    "hinge": '<joint type="hinge" axis="0 1 0"/>',
    "ball": '<joint type="ball"/>',
    "connect": "<freejoint/>",
}
_PIVOT = '  <equality><connect body1="bob" anchor="0 0 0"/></equality>\n'
_STARTS = {
    90: ((1.5707963267948966,), (0.7071067811865476, 0.0, 0.7071067811865475, 0.0)),
    179: ((3.12413936106985,), (0.00872653549837393, 0.0, 0.9999619230641713, 0.0)),
}
"""By degrees, the angle of the hinge in rad, and the quaternion of the ball."""


def mjcf(kind: Kind) -> str:
    """A bob below a pivot at the origin; turns are about y."""
    inertial = '<inertial pos="0 0 -1" mass="1" diaginertia="0.01 0.01 0.01"/>'
    return model_text(
        f'    <body name="bob">{_JOINTS[kind]}{inertial}</body>',
        'gravity="0 0 -9.81"',
        NO_CONTACT,
        _PIVOT if kind == "connect" else "",
    )


class Swing(Struct, frozen=True):
    """The swing of a pendulum that is let go at rest."""

    kind: Kind
    begin: float
    """rad, between 0 and π."""
    gravity: float = 9.81
    length: float = 1.0
    """m, from the pivot to the centre of mass."""
    mass: float = 1.0
    inertia: float = 0.01
    """About the centre of mass, kg m²."""

    @property
    def rate(self) -> float:
        """Of small swings, rad/s."""
        moment = self.inertia + self.mass * self.length**2
        return math.sqrt(self.mass * self.gravity * self.length / moment)

    def motion(self, times: Array) -> Motion:
        """The motion at the times (n,) s."""
        from scipy.special import ellipj

        k, k1 = math.sin(self.begin / 2), math.cos(self.begin / 2)
        sn, cn, dn, _ = ellipj(self.rate * times, k * k)
        # The cosine beside the sine: near the top the sine alone would lose half of the digits.
        angle = 2 * np.arctan2(k * cn / dn, k1 / dn)
        rate = -2 * k * self.rate * k1 * sn / dn
        if self.kind == "hinge":
            return motion_without_attitude(times, angle[:, None], rate[:, None])
        attitude = axis_angle_to_quat(_AXIS, angle)[:, None]
        turning = rate[:, None] * _AXIS
        if self.kind == "ball":
            return Motion(times, np.empty((len(times), 0)), attitude, turning)
        return turning_at_rest(times, attitude[:, 0], turning)


def _held_motion(text: str, scenario: Scenario, times: Array) -> Motion:
    """The motion of the free body if its soft pivot were rigid."""
    ball = text.replace(_PIVOT, "").replace(_JOINTS["connect"], _JOINTS["ball"])
    motion = forward_motion(ball, replace(scenario, qpos=scenario.qpos[3:]), times)
    return turning_at_rest(times, motion.attitude[:, 0], motion.velocity)


RIGID_PIVOT = SecondReference("MuJoCo’s accelerations with a ball joint, DOP853", _held_motion)


def problems() -> tuple[Problem, ...]:
    """Each pendulum from each angle, each oscillator with some damping ratios."""
    kinds: tuple[Kind, ...] = ("hinge", "ball", "connect")
    return (
        *(_pendulum_problem(kind, degrees) for kind in kinds for degrees in (90, 179)),
        *map(_spring_problem, _DAMPING),
        *map(_servo_problem, _KV),
        *map(_equality_problem, _SOLREF),
    )


def _pendulum_problem(kind: Kind, degrees: int) -> Problem:
    angle, quaternion = _STARTS[degrees]
    start = {"hinge": angle, "ball": quaternion, "connect": (0.0, 0.0, 0.0, *quaternion)}[kind]
    source = "Jacobi's elliptic functions, Landau & Lifshitz, Mechanics, § 11"
    return Problem(
        name=f"pendulum-{kind}-{degrees}",
        title=f"Pendulum from {degrees}°, {_SUSPENSIONS[kind]}",
        case=2,
        mjcf=mjcf(kind),
        scenario=Scenario(4.0, 0.1, start),
        position_bound=math.pi,
        velocity_bound=8.0,
        reference=Reference("closed", source, Swing(kind, math.radians(degrees))),
        second=RIGID_PIVOT if kind == "connect" else None,
        timesteps=divisions(0.1, 5, 10, 20, 40, 80, 160),
        search=None if kind == "connect" else (1e-3, 3.0),
        span=500.0,
        smooth=kind != "connect",
        energy_conserved=True,
        note=_NOTES[kind],
    )


_SUSPENSIONS = {
    "hinge": "a hinge",
    "ball": "a ball joint",
    "connect": "a free body held by connect",
}
_NOTES = {
    "hinge": "let go at rest it never goes round: beyond the boundary it does",
    "ball": "let go at rest it never goes round: beyond the boundary it does",
    "connect": "the error is that of the soft constraint, and does not go away with the timestep",
}
