"""Whether the engine tends to an integration."""

from __future__ import annotations

from typing import Any

import mujoco
import pytest

from coursebuild.numerics.extrapolation import integrate
from coursebuild.numerics.forward import States, forward_states
from coursebuild.numerics.pilot import Bounded
from coursebuild.numerics.problem import Scenario
from coursebuild.numerics.tending import tends_to

pytestmark = pytest.mark.site


def arm(damping: float, more: str = "") -> Any:
    return mujoco.MjModel.from_xml_string(
        f"<mujoco><worldbody><body><joint axis='0 1 0' damping='{damping}' {more}/>"
        "<geom size='0.05' mass='1' pos='1 0 0'/></body></worldbody></mujoco>"
    )


def tends(model: Any, other: Any, step: float = 0.004) -> bool:
    """Whether one model in small steps does what another's accelerations say."""
    setup = Bounded(Scenario(2.0, 0.1), 1e9, 1e9)
    states: States = forward_states(
        other, setup, setup.scenario.times, lambda r, y, t: integrate(r, y, t, 1e-12)
    )
    return tends_to(model, setup, states, step, 0.01)


@pytest.mark.parametrize("step", [0.1, 0.02, 0.001])
def test_an_engine_tends_to_its_own_accelerations(step: float) -> None:
    assert tends(arm(0.1), arm(0.1), step)


@pytest.mark.parametrize("damping", [0.1001, 0.11, 0.5])
def test_it_does_not_tend_to_others(damping: float) -> None:
    assert not tends(arm(damping), arm(0.1))


def test_where_no_long_step_is_stable() -> None:
    stiff = "stiffness='40000' springref='3'"
    assert tends(arm(1, stiff), arm(1, stiff), 0.02)


def test_beyond_lyapunovs_horizon_nothing_is_compared() -> None:
    link = "<body pos='0 0 -1'>{}<joint axis='0 1 0'/><geom type='capsule' size='0.03' {}/></body>"
    shape = "fromto='0 0 0 0 0 -1'"
    chain = link.format("{}", shape).replace("{}", "", 1)
    mjcf = (
        "<mujoco><option><flag contact='disable'/></option><worldbody><body>"
        f"<joint axis='0 1 0' ref='0'/><geom type='capsule' size='0.03' {shape}/>{chain}</body>"
        "</worldbody></mujoco>"
    )
    model = mujoco.MjModel.from_xml_string(mjcf)
    setup = Bounded(Scenario(12.0, 0.05, qpos=(2.6, 1.2)), 1e9, 1e9)
    states = forward_states(
        model, setup, setup.scenario.times, lambda r, y, t: integrate(r, y, t, 1e-12)
    )
    assert tends_to(model, setup, states, 0.005, 0.01)
