"""Case 11: chains of ten hinges and of six ball joints, and one whose tip is 1e6 times as heavy.

Entry point: `problems()`.

There is no closed form: both references integrate MuJoCo's accelerations, with different orders.
"""

from __future__ import annotations

import math

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.numerics.problem import Problem, Scenario
from coursebuild.numerics.problems.common import NO_CONTACT, engine_reference, model_text

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
    floor = 1e-8 if heavy else 1e-11
    return Problem(
        name=name,
        title=_TITLES[name],
        case=11,
        mjcf=mjcf,
        scenario=scenario,
        position_bound=100.0,
        velocity_bound=1e4,
        reference=replace(engine_reference(mjcf, scenario, tolerance), floor=floor),
        second=engine_reference(mjcf, scenario, tolerance, order=12),
        agreement=1e-10 if not heavy else 1e-8,
        timesteps=tuple(scenario.sample / n for n in (25, 50, 100, 200, 400)),
        search=(1e-6, 1e-2) if heavy else (1e-4, 1.0),
        span=0.2 if heavy else 20.0,
        energy_conserved=True,
    )
