"""Case 11: chains of ten hinges and of six ball joints, and one whose tip is 1e6 times as heavy.

Entry point: `problems()`; `Chain` has Newton's and Euler's equations.

The unit vector uᵢ goes from the joint of body i to its centre of mass, where the next body hangs.
The joint carries what all bodies from i on need beside gravity: Iᵢ ω̇ᵢ = −l uᵢ × Σ mₖ (aₖ − g), with
aₖ = l Σ (ω̇ⱼ × uⱼ + ωⱼ × (ωⱼ × uⱼ)) over the bodies up to k. Each body's moments are equal about all
axes, so that a chain of hinges is one of ball joints that swings in a plane.
"""

from __future__ import annotations

import numpy as np
from msgspec import Struct

from coursebuild.numerics.integrate import State, bulirsch_stoer
from coursebuild.numerics.problem import Array, Motion, Problem, Reference, Scenario, Sizes
from coursebuild.numerics.problems.common import NO_CONTACT, model_text
from mjcourse.spatial import quat_conj, quat_mul, quat_to_mat


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
        omega = quat_to_mat(tilted) @ np.array(self.spin or (0.0, 0.0, 0.0))
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
        velocity = np.einsum("nkji,nkj->nki", quat_to_mat(attitude), relative_omega)
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


def problems() -> tuple[Problem, ...]:
    """The three chains."""
    body, light = (
        'mass="0.1" diaginertia="1e-4 1e-4 1e-4"',
        'mass="0.001" diaginertia="1e-6 1e-6 1e-6"',
    )
    spinning = (0.5, 0.0, 2.0, *[0.0] * 15)
    upright = (1.0, 0.0, 0.0, 0.0)
    return (
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
            _mjcf(_HINGE, light, light, light, light.replace("0.001", "1000")),
            Scenario(0.01, 1e-3, (0.5, 0.0, 0.0, 0.0)),
            search=(1e-6, 1e-2),
            precision=Sizes(2e-12, 0.0, 2e-8),
        ),
    )


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
