"""Case 13: things that are very small, very far, or given with few digits."""

from __future__ import annotations

import math

import mujoco
import numpy as np
from msgspec import Struct

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
from mjbench.problems.tops import FreeTop, free_body, spinning, top_reference
from mjbench.simulation import run_steps

FAR, CRAWL = 1e9, 1e-3
"""m and m/s."""
_FAR_AWAY = Scenario(1.0, 0.1, (1e9,), (1e-3,))

_HALF_EDGE = 0.0005
"""m, of the cube."""
_CUBE = f'<geom type="box" size="{_HALF_EDGE} {_HALF_EDGE} {_HALF_EDGE}" density="1000"/>'
CUBE = model_text(f"    <body><freejoint/>{_CUBE}</body>", NO_GRAVITY, NO_CONTACT)
RESTING_CUBE = model_text(
    '    <geom type="plane" size="1 1 1"/>\n'
    f'    <body pos="0 0 {_HALF_EDGE}"><freejoint/>{_CUBE}</body>',
    'gravity="0 0 -9.81"',
)
DISTANT = model_text(
    '    <body><joint type="slide" axis="1 0 0"/><geom size="0.1" mass="1"/></body>',
    NO_GRAVITY,
    NO_CONTACT,
)
PLATE_MOMENTS = (0.0833, 0.0833, 0.1667)
"""A square plate of 1 kg and 1 m: 1/12, 1/12, 1/6, with four digits; A + B is less than C."""


ROUNDED_PLATE = free_body(" ".join(map(str, PLATE_MOMENTS)))


def _axial_moment(_: Integrator) -> float:
    balanced = ROUNDED_PLATE.replace("<option", '<compiler balanceinertia="true"/>\n  <option')
    return float(mujoco.MjModel.from_xml_string(balanced).body_inertia[1, 2])


def relative_depth(integrator: Integrator) -> float:
    """The depth of the resting cube in the floor, relative to its edge, after 1 s at 1 ms."""
    data = run_steps(RESTING_CUBE, Scenario(1.0, 0.1), integrator, 1e-3, 1000)
    return float((_HALF_EDGE - data.qpos[2]) / (2 * _HALF_EDGE))


def distance_crawled(integrator: Integrator, timestep: float) -> float:
    """The distance that the distant body covers in a second, m."""
    data = run_steps(DISTANT, _FAR_AWAY, integrator, timestep, round(1.0 / timestep))
    return float(data.qpos[0] - FAR)


class UniformMotion(Struct, frozen=True):
    """The uniform motion of a slide."""

    begin: float
    speed: float

    def motion(self, times: Array) -> Motion:
        """The motion at the times (n,) s."""
        place = self.begin + self.speed * times[:, None]
        return motion_without_attitude(times, place, np.full((len(times), 1), self.speed))


def problems() -> tuple[Problem, ...]:
    """The cube, the distant body and the plate."""
    return (_cube_problem(), _distant_problem(), _plate_problem())


def _cube_problem() -> Problem:
    return Problem(
        name="millimetre-cube",
        title="Cube of 1 mm",
        case=13,
        mjcf=CUBE,
        scenario=spinning(3.0, 4.0, 12.0),
        position_bound=1.5,
        velocity_bound=100.0,
        reference=Reference("closed", "a steady turn", FreeTop(1.0, 1.0, (3.0, 4.0, 12.0))),
        timesteps=divisions(0.05, 10, 20, 40, 80),
        checks=(
            ScalarCheck(
                "how deep it rests in the floor, in edges",
                "",
                0.0,
                relative_depth,
                "rigid bodies do not sink",
            ),
        ),
        energy_conserved=True,
        momentum_conserved=True,
        note="default contacts give way by a length that does not depend on the size of a body",
    )


def _distant_problem() -> Problem:
    spacing = math.ulp(FAR)
    return Problem(
        name="distant-body",
        title="Body 1e9 m away",
        case=13,
        mjcf=DISTANT,
        scenario=_FAR_AWAY,
        position_bound=2 * FAR,
        velocity_bound=1.0,
        reference=Reference("closed", "a uniform motion", UniformMotion(FAR, CRAWL)),
        precision=Sizes(10 * spacing, 0.0, 1e-12),
        timesteps=divisions(0.1, 10, 100, 1000),
        checks=tuple(
            ScalarCheck(
                f"distance gone in 1 s at 1 mm/s, {timestep:g} s a step",
                "m",
                CRAWL,
                lambda integrator, timestep=timestep: distance_crawled(integrator, timestep),  # type: ignore[misc]
                "a uniform motion",
                (Integrator.EULER, Integrator.RK4),
            )
            for timestep in (1e-2, 1e-3, 1e-4, 1e-5)
        ),
        smooth=False,
        note=f"numbers there lie {spacing:.2g} m apart",
    )


def _plate_problem() -> Problem:
    return Problem(
        name="flat-plate",
        title="Flat plate, A + B = C",
        case=13,
        mjcf=free_body("0.08333333333333333 0.08333333333333333 0.16666666666666666"),
        scenario=spinning(1.0, 2.0, 3.0),
        position_bound=1.5,
        velocity_bound=100.0,
        reference=top_reference(FreeTop(1 / 12, 1 / 6, (1.0, 2.0, 3.0))),
        timesteps=divisions(0.05, 5, 10, 20, 40, 80),
        checks=(
            ScalarCheck(
                "axial moment of the plate with four digits, after balanceinertia",
                "kg m²",
                PLATE_MOMENTS[2],
                _axial_moment,
                "what was written",
                (Integrator.EULER,),
            ),
        ),
        energy_conserved=True,
        momentum_conserved=True,
        note="with four digits A + B < C, and MuJoCo refuses it; balanceinertia makes it a sphere",
    )
