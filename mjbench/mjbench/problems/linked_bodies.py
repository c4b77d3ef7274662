"""Cases 10 and 11: a double pendulum, whose errors double until they mean nothing, and chains.

1. *Double pendulum.* Sines and cosines are states of their own (c′ = −s ω, s′ = c ω), so that the
   equations are rational and `decimal` numbers can integrate them. Where the motion is chaotic, one
   run says little: what is known of it is said of an ensemble of beginnings that lie around the one
   of the case.
2. *Chains* of ten hinges and of six ball joints, and one whose tip is 1e6 times as heavy. The unit
   vector uᵢ goes from the joint of body i to its centre of mass, where the next body hangs. The
   joint carries what all bodies from i on need beside gravity: Iᵢ ω̇ᵢ = −l uᵢ × Σ mₖ (aₖ − g), with
   aₖ = l Σ (ω̇ⱼ × uⱼ + ωⱼ × (ωⱼ × uⱼ)) over the bodies up to k. Each body's moments are equal about
   all axes, so that a chain of hinges is one of ball joints that swings in a plane.

Source: H. Goldstein, C. Poole, J. Safko, Classical Mechanics, 3rd ed., 1.4 and 8.1; for the
exponent G. Benettin et al., Physical Review A 14 (1976) 2338.
"""

from __future__ import annotations

import decimal
import math
from decimal import Decimal

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from mjbench.integrate import State, bulirsch_stoer
from mjbench.measure import reference_motion
from mjbench.problem import (
    NO_CONTACT,
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
from mjbench.rotations import quat_conj, quat_mul, rotate
from mjbench.simulation import advance, compile_model, initial_data, simulate


class Chain(Struct, frozen=True):
    """Like rods in line, let go when the first one is turned about y."""

    masses: tuple[float, ...]
    """kg, from the fixed end."""
    inertia: float
    """Of each body about its centre of mass, about any axis, kg m²."""
    spin: tuple[float, float, float] | None = None
    """Of all at the beginning, in their frame, rad/s; `None`: they rest, and the joints are
    hinges."""
    bend: float = 0.5
    """Of the first joint at the beginning, rad."""
    length: float = 0.1
    gravity: float = 9.81

    def motion(self, times: Array) -> Motion:
        """The motion at the rising times (n,) s."""
        count = len(self.masses)
        tilted = np.array([np.cos(self.bend / 2), 0.0, np.sin(self.bend / 2), 0.0])
        omega = rotate(tilted, self.spin or (0.0, 0.0, 0.0))
        start = np.concatenate([np.tile(tilted, count), np.tile(omega, count)])
        masses = np.array(self.masses)
        tolerance = 1e-13 if np.ptp(masses) == 0 else 1e-10
        states = bulirsch_stoer(self._rate, start, times, tolerance)
        attitude = states[:, : 4 * count].reshape(-1, count, 4)
        parents = np.roll(attitude, 1, axis=1)
        parents[:, 0] = (1.0, 0.0, 0.0, 0.0)
        relative = quat_mul(quat_conj(parents), attitude)
        relative_omega = np.diff(states[:, 4 * count :].reshape(-1, count, 3), axis=1, prepend=0.0)
        if self.spin is None:
            angles = 2 * np.arctan2(relative[..., 2], relative[..., 0])
            return Motion(times, angles, np.empty((len(times), 0, 4)), relative_omega[..., 1])
        velocity = rotate(quat_conj(attitude), relative_omega)
        return Motion(times, np.empty((len(times), 0)), relative, velocity.reshape(len(times), -1))

    def _rate(self, state: State) -> State:
        """d/dt of all attitudes (4 each) and angular velocities (3 each, in the world's frame)."""
        count = len(self.masses)
        q, omega = state[: 4 * count].reshape(-1, 4), state[4 * count :].reshape(-1, 3)
        w, v = q[:, :1], q[:, 1:]
        slope = np.hstack([-np.sum(omega * v, axis=1, keepdims=True), w * omega + _cross(omega, v)])
        u = -np.stack(
            [
                2 * (v[:, 0] * v[:, 2] + q[:, 0] * v[:, 1]),
                2 * (v[:, 1] * v[:, 2] - q[:, 0] * v[:, 0]),
                q[:, 0] ** 2 + v[:, 2] ** 2 - v[:, 0] ** 2 - v[:, 1] ** 2,
            ],
            axis=1,
        )
        carried_mass = np.cumsum(self.masses[::-1])[::-1]  # the mass from each body on
        shared_mass = carried_mass[np.maximum.outer(np.arange(count), np.arange(count))]
        s = np.cross(u[:, None], -np.eye(3))  # u × as a matrix
        matrix = -(self.length**2) * np.einsum("ij,iab,jbc->iajc", shared_mass, s, s)
        matrix = matrix.reshape(3 * count, -1) + self.inertia * np.eye(3 * count)
        load = self.length * shared_mass @ _cross(omega, _cross(omega, u))
        load[:, 2] += carried_mass * self.gravity
        acceleration = np.linalg.solve(matrix, -self.length * _cross(u, load).ravel())
        return np.concatenate([slope.ravel() / 2, acceleration])


def _cross(a: Array, b: Array) -> Array:
    """The cross products of rows (n, 3)."""
    product: Array = np.cross(a, b)
    return product


CHAINS = {
    "chain-hinges": Chain((0.1,) * 10, 1e-4),
    "chain-balls": Chain((0.1,) * 6, 1e-4, (0.5, 0.0, 2.0)),
    "chain-heavy-tip": Chain((1e-3, 1e-3, 1e-3, 1e3), 1e-6),
}
_PRECISION = Sizes(1e-10, 1e-10, 1e-9)
_HINGE = '<joint type="hinge" axis="0 1 0"/>'
_TILTED = (0.9689124217106447, 0.0, 0.24740395925452294, 0.0)


def _mjcf(joint: str, *bodies: str) -> str:
    """A chain that hangs from the origin, of bodies by their masses and moments."""
    text = ""
    for index, inertial in reversed(list(enumerate(bodies))):
        place = ' pos="0 0 -0.1"' if index else ""
        text = f'<body{place}>{joint}<inertial pos="0 0 -0.1" {inertial}/>{text}</body>\n'
    return model_text(text, 'gravity="0 0 -9.81"', NO_CONTACT)


def _problem(
    name: str,
    title: str,
    mjcf: str,
    scenario: Scenario,
    search: tuple[float, float] = (1e-4, 1.0),
    precision: Sizes = _PRECISION,
) -> Problem:
    return Problem(
        name=name,
        title=title,
        case=11,
        mjcf=mjcf,
        scenario=scenario,
        position_bound=100.0,
        velocity_bound=1e4,
        reference=Reference("ode", "Newton's and Euler's equations, Bulirsch–Stoer", CHAINS[name]),
        precision=precision,
        timesteps=tuple(scenario.sample / n for n in (25, 50, 100, 200, 400)),
        search=search,
        span=0.2 if name == "chain-heavy-tip" else 40.0,
        energy_conserved=True,
    )


_PARTING_ERROR = 0.1
"""rad: the error at which a motion has nothing in common with the exact one."""
_MEMBERS, _RADIUS = 12, 1e-3
"""The size of the ensemble, and how far it begins from the case, rad."""
_STEP, _SPAN = 1e-3, 50.0
"""s: the timestep of the measurements, and the time over which an exponent is measured."""

_LINK = '<joint type="hinge" axis="0 1 0"/><inertial pos="0 0 -1" mass="1" diaginertia="1 0.01 1"/>'
_DOUBLE_PENDULUM = model_text(
    f'    <body>{_LINK}<body pos="0 0 -1">{_LINK}</body></body>', 'gravity="0 0 -9.81"', NO_CONTACT
)


class DoublePendulum(Struct, frozen=True):
    """Two like bobs; each one's rod ends at its centre of mass, where the next one hangs."""

    upper: float = 2.0
    """At the beginning, rad."""
    lower: float = 0.5
    """Relative to the upper one, rad."""
    gravity: float = 9.81
    mass: float = 1.0
    length: float = 1.0
    inertia: float = 0.01
    """Of each bob about its centre of mass, kg m²."""

    def motion(self, times: Array) -> Motion:
        """Lagrange's equations with 40 digits, at the rising times (n,) s."""
        with decimal.localcontext(decimal.Context(prec=40)):
            m, g, length = Decimal(self.mass), Decimal(self.gravity), Decimal(self.length)
            m11 = Decimal(self.inertia) + 2 * m * length * length
            m22, m12 = m11 - m * length * length, m * length * length

            def rate(state: State) -> State:
                _, _, c1, s1, c2, s2, w1, w2 = state
                c, s = m12 * (c1 * c2 + s1 * s2), m12 * (s1 * c2 - c1 * s2)
                f1, f2 = -s * w2 * w2 - 2 * m * g * length * s1, s * w1 * w1 - m * g * length * s2
                det = m11 * m22 - c * c
                a1, a2 = (m22 * f1 - c * f2) / det, (m11 * f2 - c * f1) / det
                slopes = [w1, w2, -s1 * w1, c1 * w1, -s2 * w2, c2 * w2, a1, a2]
                return np.array(slopes, dtype=object)

            first, zero = Decimal(self.upper), Decimal(0)
            second = first + Decimal(self.lower)
            start = [first, second, *_cosine_sine(first), *_cosine_sine(second), zero, zero]
            states = bulirsch_stoer(rate, np.array(start, dtype=object), times, 1e-28, columns=12)
        a1, a2, *_, w1, w2 = states.T
        place = np.stack([a1, a2 - a1], axis=1).astype(float)
        return motion_without_attitude(times, place, np.stack([w1, w2 - w1], axis=1).astype(float))


def _cosine_sine(angle: Decimal) -> tuple[Decimal, Decimal]:
    """The cosine and sine of an angle, by their series."""
    sums, term = [Decimal(0), Decimal(0)], Decimal(1)
    for n in range(80):
        sums[n % 2] += term if n % 4 < 2 else -term
        term = term * angle / (n + 1)
    return sums[0], sums[1]


REFERENCE = Reference("ode", "Lagrange's equations with 40 digits", DoublePendulum())


def _ensemble() -> list[DoublePendulum]:
    """Beginnings on a circle around that of the case."""
    base, turns = DoublePendulum(), [2 * math.pi * n / _MEMBERS for n in range(_MEMBERS)]
    return [
        DoublePendulum(base.upper + _RADIUS * math.cos(t), base.lower + _RADIUS * math.sin(t))
        for t in turns
    ]


def horizons(integrator: Integrator) -> list[float]:
    """When the error of the angles first passes 0.1 rad, s, for each member of the ensemble."""
    model, times = compile_model(_DOUBLE_PENDULUM, integrator, _STEP), []
    for member in _ensemble():
        scenario = Scenario(20.0, 0.05, (member.upper, member.lower))
        run = simulate(replace(_double_pendulum(), scenario=scenario), model).states
        truth = reference_motion(replace(REFERENCE, solution=member), tuple(run.times.tolist()))
        error = np.linalg.norm(run.qpos - truth.position, axis=1)
        parted = np.flatnonzero(~(error < _PARTING_ERROR))
        times.append(float(run.times[parted[0]]) if len(parted) else math.inf)
    return times


def exponents(integrator: Integrator) -> list[float]:
    """The largest Lyapunov exponent, 1/s, for each member of the ensemble.

    Two runs of each, brought near to each other again and again.
    """
    model, rates = compile_model(_DOUBLE_PENDULUM, integrator, _STEP), []
    for member in _ensemble():
        scenario = Scenario(_SPAN, 0.5, (member.upper, member.lower))
        data, neighbour = initial_data(scenario, model), initial_data(scenario, model)
        distance, total = 1e-8, 0.0
        neighbour.qpos[0] += distance
        for _ in scenario.times:
            for state in (data, neighbour):
                advance(model, state, scenario.steps(_STEP))
            separation = np.concatenate([neighbour.qpos - data.qpos, neighbour.qvel - data.qvel])
            size = float(np.linalg.norm(separation))
            total += math.log(size / distance)
            neighbour.qpos[:] = data.qpos + separation[:2] * distance / size
            neighbour.qvel[:] = data.qvel + separation[2:] * distance / size
        rates.append(total / _SPAN)
    return rates


def _double_pendulum() -> Problem:
    """Six seconds from (2.0, 0.5) rad at rest: as long as numbers of sixteen digits can tell."""
    return Problem(
        name="double-pendulum",
        title="Double pendulum from (2.0, 0.5) rad",
        case=10,
        mjcf=_DOUBLE_PENDULUM,
        scenario=Scenario(6.0, 0.05, (2.0, 0.5)),
        position_bound=1e3,
        velocity_bound=1e2,
        reference=REFERENCE,
        precision=Sizes(1e-7, 0.0, 1e-6),
        timesteps=divisions(0.05, 10, 20, 40, 80, 160, 320, 640),
        checks=(
            ScalarCheck(
                "horizon: when the error at 1 ms passes 0.1 rad",
                "s",
                None,
                horizons,
                f"{_MEMBERS} beginnings {_RADIUS:g} rad around, each against 40 digits",
            ),
            ScalarCheck(
                "Lyapunov exponent, over 50 s at 1 ms",
                "1/s",
                None,
                exponents,
                f"Benettin's method, {_MEMBERS} beginnings {_RADIUS:g} rad around",
                (Integrator.RK4,),
            ),
        ),
        energy_conserved=True,
        note="past the horizon the error of a trajectory means nothing",
    )


def problems() -> tuple[Problem, ...]:
    """The double pendulum and three chains."""
    body, light, heavy = (
        'mass="0.1" diaginertia="1e-4 1e-4 1e-4"',
        'mass="0.001" diaginertia="1e-6 1e-6 1e-6"',
        'mass="1000" diaginertia="1e-6 1e-6 1e-6"',
    )
    spinning = (0.5, 0.0, 2.0, *[0.0] * 15)
    upright = (1.0, 0.0, 0.0, 0.0)
    return (
        _double_pendulum(),
        _problem(
            "chain-hinges",
            "Chain of ten hinges",
            _mjcf(_HINGE, *[body] * 10),
            Scenario(0.5, 0.05, (0.5, *[0.0] * 9)),
        ),
        _problem(
            "chain-balls",
            "Chain of six ball joints",
            _mjcf('<joint type="ball"/>', *[body] * 6),
            Scenario(0.5, 0.05, _TILTED + upright * 5, spinning),
        ),
        _problem(  # the light bodies between the pivot and the heavy one swing at 1e4 rad/s
            "chain-heavy-tip",
            "Chain with a tip of 1e6 times the mass",
            _mjcf(_HINGE, light, light, light, heavy),
            Scenario(0.01, 1e-3, (0.5, 0.0, 0.0, 0.0)),
            search=(1e-6, 1e-2),
            precision=Sizes(2e-12, 0.0, 2e-8),
        ),
    )
