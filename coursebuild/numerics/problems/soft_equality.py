"""Case 12: a soft equality constraint is a damped oscillator, with a stability limit of its own.

Entry point: `problems()`.

With constant impedance d the constraint's acceleration is a = −d (b v + k d r), where
b = 2/(d · timeconst), k = 1/(d² timeconst² dampratio²) and r is the violation: an oscillator with
ω = 1/(timeconst · dampratio) and ζ = dampratio. All integrators but `discrete` compute it from the
state at the beginning of the step, the implicit ones too. `refsafe` would raise the time constant
to two timesteps and so hide the limit behind another model; it is off here.

Source: MuJoCo documentation, Computation, Constraint model.
"""

from __future__ import annotations

from coursebuild.numerics.problem import Integrator, Limit, Problem, Scenario
from coursebuild.numerics.problems.common import NO_GRAVITY
from coursebuild.numerics.problems.damped_spring import (
    BOUND,
    START,
    limit_of,
    references,
)

RATE = 50.0
"""1/(timeconst · dampratio), rad/s."""
RATIOS = (0.1, 1.0)
"""The damping ratio of `solref`."""


def mjcf(ratio: float) -> str:
    """1 kg on a slide that a joint equality holds at 0."""
    return f"""\
<mujoco>
  <option {NO_GRAVITY} tolerance="0"><flag refsafe="disable" contact="disable"/></option>
  <worldbody>
    <body>
      <joint name="slide" type="slide" axis="1 0 0"/>
      <geom size="0.1" mass="1"/>
    </body>
  </worldbody>
  <equality>
    <joint joint1="slide" solref="{1 / (RATE * ratio)!r} {ratio!r}" solimp="0.9 0.9 0.001 0.5 2"/>
  </equality>
</mujoco>
"""


def problems() -> tuple[Problem, ...]:
    """One for each damping ratio."""
    return tuple(_problem(ratio) for ratio in RATIOS)


def _limit(ratio: float, integrator: Integrator) -> Limit:
    explicit = (
        Integrator.EULER,
        Integrator.EULER_EXPLICIT,
        Integrator.IMPLICIT,
        Integrator.IMPLICITFAST,
    )
    return limit_of(ratio, RATE, integrator, explicit=explicit)


def _problem(ratio: float) -> Problem:
    source = "the linear oscillator of the constraint"
    reference, second = references(ratio, RATE, source, floor=1e-13)
    return Problem(
        name=f"soft-equality-{ratio:g}",
        title=f"Soft equality as an oscillator, ζ = {ratio:g}, refsafe off",
        case=12,
        mjcf=mjcf(ratio),
        scenario=Scenario(0.2, 0.02, START[:1], START[1:]),
        position_bound=BOUND,
        velocity_bound=BOUND * RATE * (1 + 4 * ratio),
        reference=reference,
        second=second,
        timesteps=tuple(0.02 / n for n in (4, 8, 16, 32, 64, 128, 256)),
        limit=lambda one: _limit(ratio, one),
        search=(1e-2 / RATE, 1e1 / RATE),
    )
