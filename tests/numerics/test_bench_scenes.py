"""Commands, chaos, contact: what a report says of scenes that are not smooth and free."""

from __future__ import annotations

import math

import mujoco
import pytest

from support.bench_runs import measure, orders, row

pytestmark = pytest.mark.site

SERVO = """\
<mujoco>
  <option timestep="0.002"/>
  <worldbody>
    <body>
      <joint name="a" axis="0 1 0" damping="0.2"/>
      <geom type="capsule" size="0.02" fromto="0 0 0 0.4 0 0"/>
      <site name="tip" pos="0.4 0 0"/>
    </body>
  </worldbody>
  <actuator><position joint="a" kp="20"/></actuator>
</mujoco>
"""
SERVO_TOML = """\
[[scenario]]
name = "reach"
controls = [[0.5], [-1]]
hold = 0.3
sample = 0.05
measure = "site:tip"
"""


def test_commands_are_held_so_that_runge_kutta_keeps_its_order() -> None:
    (report,) = measure(mujoco.MjModel.from_xml_string(SERVO), SERVO_TOML)
    assert (report.reference, report.hold) == ("ode", 0.3)
    assert orders(report, "position")["RK4"] == pytest.approx(4.0, abs=0.15)
    assert report.figure == "place of the site tip [m]"
    fine = row(report, "RK4", 0.001)
    assert fine.figure is not None and fine.position is not None
    assert 0.1 * fine.position[0] < fine.figure[0] < fine.position[0]


DOUBLE_PENDULUM = """\
<mujoco>
  <option timestep="0.005" integrator="RK4"><flag contact="disable"/></option>
  <worldbody>
    <body>
      <joint axis="0 1 0"/>
      <geom type="capsule" size="0.02" fromto="0 0 0 0 0 -0.3"/>
      <body pos="0 0 -0.3">
        <joint axis="0 1 0"/>
        <geom type="capsule" size="0.02" fromto="0 0 0 0 0 -0.3"/>
      </body>
    </body>
  </worldbody>
  <keyframe><key qpos="2.5 0.5"/></keyframe>
</mujoco>
"""


def test_chaos_has_a_horizon_and_then_statistics() -> None:
    (report,) = measure(
        mujoco.MjModel.from_xml_string(DOUBLE_PENDULUM),
        '[[scenario]]\nname = "a"\nkeyframe = 0\nduration = 9\nsample = 0.04\n',
        quick=True,
    )
    assert report.lyapunov is not None and report.horizons is not None
    assert report.reference == "ode", "beyond the horizon nothing is compared with the engine"
    first, last = report.horizons
    assert report.horizon == first < last <= 9, "eight nudges part at different times"
    growth = math.log(0.1 / 1e-10)  # from the nudge to where nothing is in common
    assert first / 1.5 < growth / report.lyapunov < 1.5 * last
    assert any("errors count until" in note for note in report.notes)
    own_row = next(line for line in report.rows if line.own)
    assert own_row.mean_energy is not None
    assert own_row.energy_drift is not None


BLOCK = """\
<mujoco>
  <option timestep="0.002" gravity="2 0 -9.6"/>
  <worldbody>
    <geom type="plane" size="5 5 1"/>
    <body pos="0 0 0.1"><freejoint/><geom type="box" size="0.1 0.1 0.1"/></body>
  </worldbody>
</mujoco>
"""


def test_a_block_that_sticks_creeps_alike_in_each_measurement() -> None:
    model = mujoco.MjModel.from_xml_string(BLOCK)
    before = (model.opt.timestep, model.opt.integrator, model.opt.cone, model.opt.disableflags)
    short = '[[scenario]]\nname = "a"\nduration = 0.48\nsample = 0.016\n'
    (report,), repeated = (measure(model, short, quick=True) for _ in range(2))
    opt = model.opt
    assert (opt.timestep, opt.integrator, opt.cone, opt.disableflags) == before
    assert repeated == (report,)
    assert (report.reference, report.smooth, report.orders) == ("self", False, ())
    assert report.notes == (
        "errors follow no power of the timestep, because of contact",
        "beyond 0.01 s refsafe softens constraints: stable, but another model",
    )
    settings = [line.setting for line in report.rows]
    assert {line.cone for line in settings} == {"pyramidal", "elliptic"}
    assert {line.solver for line in settings} == {"PGS", "CG", "Newton"}
    assert len({line.iterations for line in settings}) == 3
    creep = {line.setting.cone: line.slip for line in report.rows}
    assert creep["pyramidal"] and creep["elliptic"]
    assert 1e-4 < creep["elliptic"] < creep["pyramidal"] < 1e-3
    errors = {line.setting.cone: line.model_error for line in report.rows}
    assert errors["elliptic"] is None
    assert all(e is None or e >= 10 * report.floor > 0 for e in errors.values())
    assert errors["pyramidal"] == pytest.approx(creep["pyramidal"] - creep["elliptic"], rel=0.2)
    assert {line.energy_drift for line in report.rows} == {None}


def test_the_error_of_a_pyramid_is_among_what_is_seen() -> None:
    mjcf = """\
    <mujoco>
      <option timestep="0.004" gravity="3 3 -9"/>
      <worldbody>
        <geom type="plane" size="50 50 1" friction="0.3"/>
        <body pos="0 0 0.1">
          <freejoint/><geom type="box" size="0.2 0.2 0.1" mass="1" friction="0.3"/>
        </body>
      </worldbody>
    </mujoco>
    """
    (report,) = measure(mujoco.MjModel.from_xml_string(mjcf), quick=True)
    own_row = next(line for line in report.rows if line.own)
    slope, time = 3 * 2**0.5, 2.0
    exact = (slope - 0.3 * 9 / 2**0.5 - (slope - 0.3 * 9)) * time**2 / 2  # half is enough
    assert own_row.model_error == pytest.approx(exact, rel=0.02)
    assert own_row.seen is not None and own_row.seen > 10
    (round_one,) = (
        line
        for line in report.rows
        if (line.setting.integrator, line.setting.timestep, line.setting.cone)
        == ("Euler", 0.004, "elliptic")
    )
    assert round_one.seen is not None and round_one.seen < own_row.seen / 5
    assert report.verdict.noticeable is True
