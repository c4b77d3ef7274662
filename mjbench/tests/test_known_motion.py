"""References of scenes, and how well they are known."""

from __future__ import annotations

import decimal
from decimal import Decimal
from typing import Any

import mujoco
import numpy as np
import pytest
from msgspec.structs import replace

from mjbench.integrate import NoConvergenceError, State, bulirsch_stoer, cumulative_integral, dop853
from mjbench.known_motion import KnownMotion, find_reference, self_reference
from mjbench.measured_setting import find_references
from mjbench.pilot import run_pilot
from mjbench.problem import Integrator
from mjbench.scene import SceneError, scenes
from samples.surveys import NO_DECLARATIONS, parse_declared

pytestmark = pytest.mark.long

PENDULUM = """\
<mujoco>
  <option timestep="0.002">{option}</option>
  <worldbody>
    <geom type="plane" size="3 3 1" pos="0 0 {floor}"/>
    <body>
      <joint axis="0 1 0" {joint}/>
      <geom type="sphere" size="0.02" mass="1" pos="0 0 -1"/>
    </body>
  </worldbody>
  <actuator><general joint="{acts}" {actuator}/></actuator>
  <keyframe><key name="level" qpos="1.5707963267948966"/></keyframe>
</mujoco>
"""


def pendulum(joint: str = "", floor: float = -9, actuator: str = "", option: str = "") -> Any:
    text = PENDULUM.format(
        joint=f'name="pin" {joint}', floor=floor, acts="pin", actuator=actuator, option=option
    )
    return mujoco.MjModel.from_xml_string(text)


def reference_of(
    model: Any, text: str = 'name = "a"\nkeyframe = 0\nduration = 0.5\n'
) -> KnownMotion:
    (scene,) = scenes(model, parse_declared("[[scenario]]\n" + text), quick=True)
    return find_reference(model, run_pilot(model, scene), quick=True)


def test_a_smooth_scene_is_integrated_twice() -> None:
    reference = reference_of(pendulum("damping='0.3'"))
    assert (reference.kind, reference.note) == ("ode", "")
    assert reference.source == "Bulirsch–Stoer over mj_forward"
    assert reference.second == "DOP853 over mj_forward"
    assert reference.agreement < 1e-12
    assert reference.horizon == 0.5


@pytest.mark.parametrize(
    ("model", "reason"),
    [
        (pendulum(floor=-0.5), "contact"),
        (
            pendulum("range='60 120' limited='true'"),
            "limits that are reached (1 of 1, 84 % of the time)",
        ),
        (pendulum("frictionloss='0.2'"), "dry friction"),
    ],
    ids=["contact", "limit", "friction"],
)
def test_where_something_jumps_the_engine_is_its_own_reference(model: Any, reason: str) -> None:
    (scene,) = scenes(model, NO_DECLARATIONS, quick=True)
    pilot = run_pilot(model, scene)
    assert pilot.jumps == (reason,)
    reference = find_reference(model, pilot, quick=True)
    assert reference.kind == "self"
    step = 1e6 * min(scene.timesteps) / 8
    assert reference.source == f"the engine itself: implicitfast at {step:.6g} µs, Newton's solver"
    assert reference.second == f"the same under Euler at {2 * step:.6g} µs"
    assert reference.floor.place > 1e-7, "it is not called better known than it is"


FULL = 'dyntype="integrator" gainprm="2" actlimited="true" actrange="-{most} {most}"'
"""An activation that a constant command fills until it is full."""


def test_an_activation_at_its_limit_is_a_jump() -> None:
    # `mj_forward` knows nothing of the clamp: both integrations agree, on another motion.
    model = pendulum("damping='1'", actuator=FULL.format(most=0.3))
    model.key_ctrl[0, 0] = 1.0
    (scene,) = scenes(model, NO_DECLARATIONS, quick=True)
    pilot = run_pilot(model, scene)
    assert pilot.jumps == ("an activation at its limit",)
    reference = find_reference(model, pilot, quick=True)
    assert (reference.kind, reference.states.act[-1, 0]) == ("self", 0.3)
    unseen = replace(pilot, jumps=())  # as of something that is not looked for
    reference = find_reference(model, unseen, quick=True)
    note = "no integration: the engine with small steps converges to something else"
    assert (reference.kind, reference.note) == ("self", note)


def test_an_activation_that_looks_ahead_by_a_timestep() -> None:
    text = 'dyntype="filterexact" dynprm="0.1" gainprm="2"'
    early = pendulum(actuator=f'{text} actearly="true"')
    late = pendulum(actuator=text)
    for model in (early, late):
        model.key_ctrl[0, 0] = 1.0
    first, second = reference_of(early), reference_of(late)
    assert (first.kind, second.kind) == ("ode", "ode")
    assert np.array_equal(first.states.qpos, second.states.qpos)


def test_commands_and_activations_are_integrated() -> None:
    """A filter of first order on a motor: what a formula says, with commands held."""
    act = 'dyntype="filter" dynprm="0.2" gainprm="3"'
    model = pendulum("", actuator=act, option='<flag gravity="disable"/>')
    text = 'name = "a"\ncontrols = [[1], [-1]]\nhold = 0.2\nsample = 0.1\nduration = 0.4\n'
    reference = reference_of(model, text)
    times = reference.states.times
    rising = 1 - np.exp(-times / 0.2)
    then = -1 + (1 + 1 - np.exp(-1.0)) * np.exp(-(times - 0.2) / 0.2)
    exact = np.where(times <= 0.2 + 1e-9, rising, then)
    assert reference.kind == "ode"
    assert np.max(np.abs(reference.states.act[:, 0] - exact)) < 1e-12


ATWOOD = """\
<mujoco>
  <option timestep="0.001"/>
  <default><geom contype="0" conaffinity="0"/><joint type="slide" axis="0 0 1"/></default>
  <worldbody>
    <geom name="wheel" type="cylinder" size="0.1 0.02" pos="0 0 2" euler="90 0 0"/>
    <site name="aside" pos="0 0 2.3"/>
    <body pos="-0.1 0 1"><joint/><geom size="0.05" mass="2"/><site name="left"/></body>
    <body pos="0.1 0 1"><joint/><geom size="0.05" mass="1"/><site name="right"/></body>
  </worldbody>
  <tendon>
    <spatial limited="true" range="0 2.3141592653589793" solimplimit="0.95 0.95 0.001">
      <site site="left"/><geom geom="wheel" sidesite="aside"/><site site="right"/>
    </spatial>
  </tendon>
</mujoco>
"""


def test_two_runs_that_agree_by_luck_do_not_bound_a_reference() -> None:
    """When the rope, just taut, begins to pull is a matter of rounding."""
    model = mujoco.MjModel.from_xml_string(ATWOOD)
    text = '[[scenario]]\nname = "a"\nduration = 0.1\nsample = 0.01\n'
    (scene,) = scenes(model, parse_declared(text))
    reference = self_reference(model, run_pilot(model, scene), (Integrator.RK4,) * 3)
    # An impedance of 0.95 leaves a twentieth of the acceleration; the rope is critically damped.
    phase, rest = reference.states.times / 0.02, -2 * 9.81 * 0.05 * 0.02**2
    exact = rest * (1 - (1 + phase) * np.exp(-phase))
    assert np.abs(reference.states.qpos.sum(axis=1) - exact).max() < 3 * reference.floor.place


def test_an_author_may_choose() -> None:
    text = 'name = "a"\nkeyframe = 0\nduration = 0.1\nreference = '
    assert reference_of(pendulum(), text + '"self"').kind == "self"
    with pytest.raises(SceneError) as caught:
        reference_of(pendulum(floor=-0.5), 'name = "a"\nkeyframe = 0\nreference = "ode"')
    assert caught.value.message == "no integration can be the reference: there is contact"


SLIDING = """\
<mujoco>
  <option timestep="0.002"/>
  <worldbody>
    <geom type="plane" size="9 9 1"/>
    <body pos="0 0 0.05"><freejoint/><geom type="box" size="0.1 0.07 0.05"/></body>
  </worldbody>
</mujoco>
"""


def test_errors_under_each_cone_count_over_the_same_time() -> None:
    """Under the pyramid this motion is known for a third of the time for which it is else."""
    model = mujoco.MjModel.from_xml_string(SLIDING)
    table = '[[scenario]]\nname = "a"\nduration = 0.3\nsample = 0.01\nqvel = [1, 1, 0, 0, 0, 0]\n'
    (scene,) = scenes(model, parse_declared(table), quick=True)
    pilot = run_pilot(model, scene)
    pyramidal, elliptic = find_references(model, pilot, quick=True).values()
    times = elliptic.reference.states.times
    assert np.array_equal(pyramidal.reference.states.times, times)
    assert len(elliptic.reference.second_states.times) == len(times)
    assert pyramidal.reference.horizon == elliptic.reference.horizon == times[-1] < 0.3
    model.opt.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    assert find_reference(model, pilot, quick=True).horizon > times[-1], "known for longer alone"


TIMES = np.linspace(0.25, 20.0, 80)


def test_two_methods_agree_on_an_orbit_of_high_eccentricity() -> None:
    def rate(y: State) -> State:
        cube = (y[0] ** 2 + y[1] ** 2) ** 1.5
        return np.array([y[2], y[3], -y[0] / cube, -y[1] / cube])

    start = np.array([0.2, 0.0, 0.0, 3.0])  # e = 0.8
    states = bulirsch_stoer(rate, start, TIMES)
    # A relative error of 1e-13 in a step moves the phase by this after three turns.
    assert np.max(np.abs(states - dop853(rate, start, TIMES))) < 1e-8
    energy = (states[:, 2] ** 2 + states[:, 3] ** 2) / 2 - 1 / np.hypot(states[:, 0], states[:, 1])
    assert np.max(np.abs(energy + 0.5)) < 1e-12


def test_decimal_numbers_have_the_digits_that_were_asked_for() -> None:
    with decimal.localcontext(decimal.Context(prec=40)):
        start = np.array([Decimal(1)], dtype=object)
        states = bulirsch_stoer(lambda y: -y, start, np.array([1.0, 2.0]), 1e-30, columns=12)
        for row, time in zip(states, (1, 2), strict=True):
            assert abs(row[0] - Decimal(-time).exp()) < Decimal("1e-29")


def test_a_solution_that_ends_is_not_passed() -> None:
    for method in (bulirsch_stoer, dop853):
        states = method(lambda y: y * y, np.array([1.0]), np.array([0.0, 0.5, 0.9]))
        assert np.max(np.abs(states[:, 0] / [1.0, 2.0, 10.0] - 1)) < 1e-11
        with pytest.raises(NoConvergenceError, match="no step is small enough at 1 s"):
            method(lambda y: y * y, np.array([1.0]), np.array([2.0]))


def test_quadrature_to_each_time() -> None:
    times = np.array([0.1, 0.5, 3.0, 3.5])
    integral = cumulative_integral(lambda t: np.exp(-t) * np.sin(9 * t), times, 0.2)
    exact = (9 - np.exp(-times) * (np.sin(9 * times) + 9 * np.cos(9 * times))) / 82
    assert np.max(np.abs(integral - exact)) < 1e-15
