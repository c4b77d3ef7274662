"""Case 6: a stiff servo, a spring and damper that a `position` actuator makes.

Entry point: `problems()`.

Its damping `kv` is not that of a joint: Euler takes it at the beginning of the step, and so is
stable to a smaller timestep than with the same damping in the joint.
"""

from __future__ import annotations

import math

import numpy as np

from coursebuild.numerics.problem import Array, Integrator, Motion, Problem, Reference, Scenario
from coursebuild.numerics.problems.common import NO_CONTACT, NO_GRAVITY, motion_without_attitude
from coursebuild.numerics.problems.damped_spring import BOUND, integrated, limit_of, oscillation

RATE = 100.0
"""√(kp/m), rad/s."""
RATIOS = (0.1, 1.0, 10.0)
"""ζ of the servo."""
TARGETS = (0.1, -0.05)
"""Commands, m, each held for `HOLD`."""
HOLD = 0.05


def mjcf(ratio: float) -> str:
    """1 kg on a slide, driven by a servo of rate² N/m and 2 ζ rate N s/m."""
    return f"""\
<mujoco>
  <option {NO_GRAVITY}>{NO_CONTACT}</option>
  <worldbody>
    <body>
      <joint name="slide" type="slide" axis="1 0 0"/>
      <geom size="0.1" mass="1"/>
    </body>
  </worldbody>
  <actuator>
    <position joint="slide" kp="{RATE**2!r}" kv="{2 * ratio * RATE!r}"/>
  </actuator>
</mujoco>
"""


def commanded(ratio: float, times: Array, *, closed: bool) -> Motion:
    """The servo following its commands from rest at 0, at the times (n,) s.

    In each hold it is an oscillator about its target, by the closed form or integrated.
    """
    form = oscillation if closed else integrated
    x, v, begin = 0.0, 0.0, 0.0
    place, speed = np.empty((len(times), 1)), np.empty((len(times), 1))
    for index, target in enumerate(TARGETS):
        last = index + 1 == len(TARGETS)
        end = math.inf if last else begin + HOLD
        here = (times > begin + 1e-12) & (times <= end + 1e-12)
        until = max(HOLD, float(times[-1]) - begin) if last else HOLD
        offsets = np.append(times[here] - begin, until)
        part = form(ratio, RATE, x - target, v, offsets)
        place[here], speed[here] = part.position[:-1] + target, part.velocity[:-1]
        if not last:
            x, v = float(part.position[-1, 0]) + target, float(part.velocity[-1, 0])
            begin = end
    return motion_without_attitude(times, place, speed)


def problems() -> tuple[Problem, ...]:
    """One for each damping ratio."""
    return tuple(_problem(ratio) for ratio in RATIOS)


def _problem(ratio: float) -> Problem:
    return Problem(
        name=f"stiff-servo-{ratio:g}",
        title=f"Stiff servo, ζ = {ratio:g}",
        case=6,
        mjcf=mjcf(ratio),
        scenario=Scenario(
            2 * HOLD, 0.01, controls=tuple((target,) for target in TARGETS), hold=HOLD
        ),
        position_bound=BOUND / 10,
        velocity_bound=BOUND / 10 * RATE * (1 + 4 * ratio),
        reference=Reference(
            "closed",
            "the linear oscillator about each target",
            lambda times: commanded(ratio, times, closed=True),
            floor=1e-14 * RATE,
        ),
        second=Reference(
            "ode",
            "Bulirsch–Stoer, begun anew at each command",
            lambda times: commanded(ratio, times, closed=False),
            floor=1e-13 * RATE,
        ),
        timesteps=tuple(0.01 / n for n in (4, 8, 16, 32, 64, 128, 256)),
        limit=lambda one: limit_of(
            ratio, RATE, one, explicit=(Integrator.EULER, Integrator.EULER_EXPLICIT)
        ),
        search=(1e-2 / RATE, 1e2 / RATE),
    )
