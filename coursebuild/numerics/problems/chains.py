"""Case 11: chains of ten hinges and of six ball joints, and one whose tip is 1e6 times as heavy.

Entry point: `problems()`.

The first reference integrates MuJoCo's own accelerations; the second has equations of its own: a
mass matrix in angles from the vertical for hinges, and for ball joints free bodies that constraint
forces hold together.

Source: R. Featherstone, Rigid Body Dynamics Algorithms, 3.2 and 8; for n pendulums J.-L. Lagrange,
Mécanique analytique.
"""

from __future__ import annotations

import math

import numpy as np
from msgspec import Struct

from coursebuild.numerics.forward import forward_motion
from coursebuild.numerics.integrate import State, bulirsch_stoer
from coursebuild.numerics.problem import Array, Motion, Problem, Reference, Scenario
from coursebuild.numerics.problems.common import NO_CONTACT, model_text, motion_without_attitude
from mjcourse.spatial import quat_conj, quat_mul, quat_rotate, skew

GRAVITY = 9.81


class Chain(Struct, frozen=True):
    """Bodies on joints, each joint at the end of the body before."""

    kind: str
    """`hinge` or `ball`."""
    masses: tuple[float, ...]
    """kg, from the fixed end."""
    length: float
    """m, from a joint to the centre of mass and the next joint."""
    inertia: float
    """Of each body about its centre of mass, about any axis, kg m²."""
    bend: float
    """Angle of the first joint at the beginning, rad."""
    spin: float
    """Velocity of the first ball joint about the chain at the beginning, rad/s."""

    def mjcf(self) -> str:
        """The chain, hanging from the origin."""
        joint = '<joint type="hinge" axis="0 1 0"/>'
        if self.kind == "ball":
            joint = '<joint type="ball"/>'
        body = ""
        i = f"{self.inertia!r} {self.inertia!r} {self.inertia!r}"
        for index, mass in reversed(list(enumerate(self.masses))):
            at = f' pos="0 0 -{self.length!r}"' if index else ""
            body = (
                f"<body{at}>{joint}"
                f'<inertial pos="0 0 -{self.length!r}" mass="{mass!r}" diaginertia="{i}"/>'
                f"{body}</body>\n"
            )
        return model_text(body, f'gravity="0 0 -{GRAVITY}"', NO_CONTACT)

    def scenario(self, duration: float, sample: float) -> Scenario:
        """Bent at the first joint, and for ball joints spinning there."""
        count = len(self.masses)
        if self.kind == "hinge":
            return Scenario(duration, sample, (self.bend, *[0.0] * (count - 1)))
        turned = (math.cos(self.bend / 2), 0.0, math.sin(self.bend / 2), 0.0)
        upright = (1.0, 0.0, 0.0, 0.0) * (count - 1)
        spin = (0.5, 0.0, self.spin) + (0.0,) * (3 * (count - 1))
        return Scenario(duration, sample, turned + upright, spin)


def planar(chain: Chain, times: Array, tolerance: float) -> Motion:
    """A chain of hinges: M θ̈ = f in the angles θ from the vertical, (n, bodies)."""
    masses, length = np.array(chain.masses), chain.length
    count = len(masses)
    below = np.cumsum(masses[::-1])[::-1]
    carried = below[np.maximum.outer(np.arange(count), np.arange(count))] * length**2

    def rate(state: State) -> State:
        angle, speed = state[:count], state[count:]
        between = angle[:, None] - angle
        matrix = carried * np.cos(between) + chain.inertia * np.eye(count)
        force = -(carried * np.sin(between)) @ speed**2
        force -= GRAVITY * length * below * np.sin(angle)
        return np.concatenate([speed, np.linalg.solve(matrix, force)])

    start = np.concatenate([np.full(count, chain.bend), np.zeros(count)])
    states = bulirsch_stoer(rate, start, times, tolerance)
    place = np.diff(states[:, :count], axis=1, prepend=0.0)
    speed = np.diff(states[:, count:], axis=1, prepend=0.0)
    return motion_without_attitude(times, place, speed)


def spatial(chain: Chain, times: Array, tolerance: float) -> Motion:
    """A chain of ball joints: bodies with attitudes of their own, and forces in the joints.

    Angular velocities are in the world's frame, where inertias are spheres' and do not turn: then
    there is no gyroscopic torque. A body's centre is its upper joint and the arm R (0, 0, −l).
    """
    count = len(chain.masses)
    masses = np.array(chain.masses)
    down = np.array([0.0, 0.0, -chain.length])

    def rate(state: State) -> State:
        q = state[: 4 * count].reshape(count, 4)
        unit = q / np.linalg.norm(q, axis=1, keepdims=True)
        omega = state[4 * count :].reshape(count, 3)
        arm = quat_rotate(unit, np.broadcast_to(down, (count, 3)))
        local = quat_rotate(quat_conj(unit), omega)
        alpha = _spatial_accelerations(chain, masses, arm, omega)
        turning = quat_mul(q, np.insert(local, 0, 0.0, axis=1)) / 2
        return np.concatenate([turning.ravel(), alpha.ravel()])

    turned = np.array([math.cos(chain.bend / 2), 0.0, math.sin(chain.bend / 2), 0.0])
    first = quat_rotate(turned, np.array([0.5, 0.0, chain.spin]))
    start = np.concatenate([np.tile(turned, count), np.tile(first, count)])
    states = bulirsch_stoer(rate, start, times, tolerance)
    q = states[:, : 4 * count].reshape(len(times), count, 4)
    q = q / np.linalg.norm(q, axis=2, keepdims=True)
    omega = states[:, 4 * count :].reshape(len(times), count, 3)
    attitude, speed = q.copy(), omega.copy()
    attitude[:, 1:] = quat_mul(quat_conj(q[:, :-1]), q[:, 1:])
    speed[:, 1:] -= omega[:, :-1]
    velocity = quat_rotate(quat_conj(q), speed).reshape(len(times), 3 * count)
    return Motion(times, np.empty((len(times), 0)), attitude, velocity)


def _spatial_accelerations(chain: Chain, masses: Array, arm: Array, omega: Array) -> Array:
    """Angular accelerations (bodies, 3): the joints' forces solved together with the motion.

    Body i has its upper joint at its centre less its arm, and the next one at its centre. With
    forces F_i from above, m a_i = F_i − F_{i+1} + m g and I α_i = −arm_i × F_i; the joints hold if
    a_i − a_{i−1} = α_i × arm_i + ω_i × (ω_i × arm_i).
    """
    count = len(masses)
    gravity = np.array([0.0, 0.0, -GRAVITY])
    matrix = np.zeros((3 * count, 3 * count))
    known = np.zeros(3 * count)
    for i in range(count):
        at = slice(3 * i, 3 * i + 3)
        cross = skew(arm[i])
        matrix[at, at] += np.eye(3) / masses[i] - cross @ cross / chain.inertia
        if i + 1 < count:
            matrix[at, slice(3 * i + 3, 3 * i + 6)] -= np.eye(3) / masses[i]
        known[at] = np.cross(omega[i], np.cross(omega[i], arm[i]))
        if i:
            before = slice(3 * i - 3, 3 * i)
            matrix[at, before] -= np.eye(3) / masses[i - 1]
            matrix[at, at] += np.eye(3) / masses[i - 1]
        else:
            known[at] -= gravity
    force = np.linalg.solve(matrix, known).reshape(count, 3)
    alpha: Array = np.cross(-arm, force) / chain.inertia
    return alpha


CHAINS = {
    "chain-hinges": Chain("hinge", (0.1,) * 10, 0.1, 1e-4, 0.5, 0.0),
    "chain-balls": Chain("ball", (0.1,) * 6, 0.1, 1e-4, 0.5, 2.0),
    "chain-heavy-tip": Chain("hinge", (1e-3, 1e-3, 1e-3, 1e3), 0.1, 1e-6, 0.5, 0.0),
}
_TITLES = {
    "chain-hinges": "Chain of ten hinges",
    "chain-balls": "Chain of six ball joints",
    "chain-heavy-tip": "Chain with a tip of 1e6 times the mass",
}


def problems() -> tuple[Problem, ...]:
    """The three chains."""
    return tuple(_problem(name, chain) for name, chain in CHAINS.items())


def _problem(name: str, chain: Chain) -> Problem:
    heavy = name == "chain-heavy-tip"
    # The light bodies between the pivot and the heavy one swing at 1e4 rad/s.
    scenario = chain.scenario(0.01, 1e-3) if heavy else chain.scenario(0.5, 0.05)
    tolerance = 1e-10 if heavy else 1e-13
    mjcf = chain.mjcf()
    second = planar if chain.kind == "hinge" else spatial
    return Problem(
        name=name,
        title=_TITLES[name],
        case=11,
        mjcf=mjcf,
        scenario=scenario,
        position_bound=100.0,
        velocity_bound=1e4,
        reference=Reference(
            "ode",
            "MuJoCo's accelerations, Bulirsch–Stoer",
            lambda times: forward_motion(mjcf, scenario, times, tolerance=tolerance),
            floor=1e-11 if not heavy else 1e-8,
        ),
        second=Reference(
            "ode",
            "equations of its own, Bulirsch–Stoer",
            lambda times: second(chain, times, tolerance),
            floor=1e-11,
        ),
        agreement=1e-10 if not heavy else 1e-8,
        timesteps=tuple(scenario.sample / n for n in (25, 50, 100, 200, 400)),
        search=(1e-6, 1e-2) if heavy else (1e-4, 1.0),
        steps=2000,
        energy_conserved=True,
    )
