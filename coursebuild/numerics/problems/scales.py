"""Case 13: things that are very small, very far, or given with few digits.

Entry point: `problems()`.
"""

from __future__ import annotations

import math

import mujoco
import numpy as np

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
    NO_CONTACT,
    NO_GRAVITY,
    divisions,
    engine_reference,
    model_text,
    motion_without_attitude,
    simulated,
    turning_at_rest,
)
from coursebuild.numerics.problems.tops import FreeTop
from mjcourse.spatial import axis_angle_to_quat

EDGE, DENSITY = 1e-3, 1000.0
"""m and kg/m³."""
FAR, CRAWL = 1e9, 1e-3
"""m and m/s."""
_TURN = (3.0, 4.0, 12.0)
"""rad/s."""
_GRAVITY = 9.81
_FAR_AWAY = Scenario(1.0, 0.1, (FAR,), (CRAWL,))

_CUBE = f'<geom type="box" size="{EDGE / 2!r} {EDGE / 2!r} {EDGE / 2!r}" density="{DENSITY!r}"/>'
CUBE = model_text(f"    <body><freejoint/>{_CUBE}</body>", NO_GRAVITY, NO_CONTACT)
RESTING = model_text(
    '    <geom type="plane" size="1 1 1"/>\n'
    f'    <body pos="0 0 {EDGE / 2!r}"><freejoint/>{_CUBE}</body>',
    f'gravity="0 0 -{_GRAVITY}"',
)
DISTANT = model_text(
    '    <body><joint type="slide" axis="1 0 0"/><geom size="0.1" mass="1"/></body>',
    NO_GRAVITY,
    NO_CONTACT,
)
PLATE_MOMENTS = (0.0833, 0.0833, 0.1667)
"""A square plate of 1 kg and 1 m: 1/12, 1/12, 1/6, with four digits; A + B is less than C."""


def plate(moments: tuple[float, float, float], *, balance: bool = False) -> str:
    """A plate of 1 kg with these moments, kg m²."""
    a, b, c = moments
    inertial = f'<inertial pos="0 0 0" mass="1" diaginertia="{a!r} {b!r} {c!r}"/>'
    compiler = '  <compiler balanceinertia="true"/>\n' if balance else ""
    world = f"    <body><freejoint/>{inertial}</body>"
    return model_text(world, NO_GRAVITY, NO_CONTACT, compiler)


def _axial_moment(_: Integrator) -> float:
    model = mujoco.MjModel.from_xml_string(plate(PLATE_MOMENTS, balance=True))
    return float(model.body_inertia[1, 2])


def steady(times: Array) -> Motion:
    """A cube turns about any axis at a constant rate."""
    omega = np.array(_TURN)
    attitude = axis_angle_to_quat(omega, float(np.linalg.norm(omega)) * times)
    return turning_at_rest(times, attitude, np.tile(omega, (len(times), 1)))


def sunk(integrator: Integrator) -> float:
    """How deep the resting cube lies in the floor, relative to its edge, after 1 s at 1 ms."""
    data = simulated(RESTING, Scenario(1.0, 0.1), integrator, 1e-3, 1000)
    return float((EDGE / 2 - data.qpos[2]) / EDGE)


def crawled(integrator: Integrator, timestep: float) -> float:
    """How far the distant body went in a second, m."""
    data = simulated(DISTANT, _FAR_AWAY, integrator, timestep, round(1.0 / timestep))
    return float(data.qpos[0] - FAR)


def _line(times: Array) -> Motion:
    return motion_without_attitude(
        times, (FAR + CRAWL * times)[:, None], np.full((len(times), 1), CRAWL)
    )


def problems() -> tuple[Problem, ...]:
    """The cube, the distant body and the plate."""
    return (_cube(), _distant(), _plate())


def _cube() -> Problem:
    scenario = Scenario(1.0, 0.05, (0, 0, 0, 1, 0, 0, 0), (0, 0, 0, *_TURN))
    return Problem(
        name="millimetre-cube",
        title="Cube of 1 mm",
        case=13,
        mjcf=CUBE,
        scenario=scenario,
        position_bound=1.5,
        velocity_bound=100.0,
        reference=Reference("closed", "a steady turn", steady, floor=1e-14),
        second=engine_reference(CUBE, scenario),
        timesteps=divisions(0.05, 10, 20, 40, 80),
        checks=(
            ScalarCheck(
                "how deep it rests in the floor, in edges",
                "",
                0.0,
                sunk,
                "rigid bodies do not sink",
            ),
        ),
        energy_conserved=True,
        momentum_conserved=True,
        note="default contacts give way by a length that does not depend on the size of a body",
    )


def _distant() -> Problem:
    spacing = math.ulp(FAR)
    return Problem(
        name="distant-body",
        title="Body 1e9 m away",
        case=13,
        mjcf=DISTANT,
        scenario=_FAR_AWAY,
        position_bound=2 * FAR,
        velocity_bound=1.0,
        reference=Reference("closed", "a uniform motion", _line, floor=spacing),
        second=engine_reference(DISTANT, _FAR_AWAY),
        agreement=10 * spacing,
        timesteps=divisions(0.1, 10, 100, 1000),
        checks=tuple(
            ScalarCheck(
                f"distance gone in 1 s at 1 mm/s, {timestep:g} s a step",
                "m",
                CRAWL,
                lambda integrator, timestep=timestep: crawled(integrator, timestep),  # type: ignore[misc]
                "a uniform motion",
                (Integrator.EULER, Integrator.RK4),
            )
            for timestep in (1e-2, 1e-3, 1e-4, 1e-5)
        ),
        smooth=False,
        note=f"numbers there lie {spacing:.2g} m apart",
    )


def _plate() -> Problem:
    exact = FreeTop(1 / 12, 1 / 6, (1.0, 2.0, 3.0))
    mjcf = plate((1 / 12, 1 / 12, 1 / 6))
    return Problem(
        name="flat-plate",
        title="Flat plate, A + B = C",
        case=13,
        mjcf=mjcf,
        scenario=exact.scenario(),
        position_bound=1.5,
        velocity_bound=100.0,
        reference=exact.reference,
        second=engine_reference(mjcf, exact.scenario()),
        timesteps=divisions(0.05, 10, 20, 40, 80),
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
