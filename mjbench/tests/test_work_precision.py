"""Speed against error of models: errors, orders, drifts, statuses; commands, chaos, contact."""

from __future__ import annotations

import functools
import itertools
import math
from typing import Any

import mujoco
import pytest
from msgspec.structs import replace

from mjbench.reports.scene_report import ScenarioReport
from mjbench.scene import SceneError, scenes
from mjbench.work_precision import measure_scenario
from samples.runs import BOX, FLIP, measure, orders, row, with_search
from samples.surveys import parse_declared

pytestmark = pytest.mark.long


@functools.cache
def of_box() -> ScenarioReport:
    """The first flip of the tumbling box."""
    (scene,) = scenes(model := mujoco.MjModel.from_xml_string(BOX), parse_declared(FLIP))
    return measure_scenario(model, with_search(scene), clock=None)


def test_a_report_on_the_tumbling_box() -> None:
    """Its references agree, no error lies below ten floors, what it conserves is found out."""
    report = of_box()
    assert report.reference == "ode"
    assert report.agreement is not None and report.agreement < 1e-10
    for line in report.rows:
        assert line.attitude is not None and line.velocity is not None
        assert min(line.attitude) >= 9.999 * max(report.floor, 1e-14)
        assert min(line.velocity) >= 9.999 * report.velocity_floor
        assert line.energy_drift is not None and line.momentum_drift is not None
        assert (line.status, line.penetration, line.slip, line.refsafe) == ("ok", 0.0, None, False)
    (own_row,) = (line for line in report.rows if line.own)
    assert (own_row.setting.integrator, own_row.setting.timestep) == ("RK4", 0.002)
    assert (own_row.setting.solver, own_row.setting.cone) == ("", ""), "nothing is solved"
    assert len({line.setting for line in report.rows}) == len(report.rows) == 35


def test_an_error_that_can_be_seen() -> None:
    coarse, fine = (row(of_box(), "Euler", h) for h in (0.004, 0.0005))
    assert coarse.attitude is not None and coarse.seen is not None and fine.seen is not None
    assert coarse.seen == pytest.approx(coarse.attitude[0] * 180 / 3.141592653589793)
    assert coarse.seen > 1 > fine.seen


STIFF = """\
<mujoco>
  <option timestep="{step}"/>
  <worldbody>
    <body>
      <joint type="slide" stiffness="{stiffness}"/>
      <geom size="0.1" mass="1" contype="0" conaffinity="0"/>
    </body>
  </worldbody>
  <keyframe><key qpos="{start}"/></keyframe>
</mujoco>
"""

FROM_KEYFRAME = '[[scenario]]\nname = "a"\nkeyframe = 0\nreference = "self"\n'
"""The engine is its own reference: integrating the stiff spring takes ten times as long."""


def stiff(step: float, start: float, stiffness: float = 1e5) -> Any:
    text = STIFF.format(step=step, start=start, stiffness=stiffness)
    return mujoco.MjModel.from_xml_string(text)


def test_a_scene_that_blows_up_at_its_timesteps_is_measured_at_shorter_ones() -> None:
    """Without `autoreset="disable"` such a run ends where it began, with error 0."""
    declarations = parse_declared(f"{FROM_KEYFRAME}duration = 2\ntimesteps = [0.05]\n")
    (scene,) = scenes(stiff(0.1, 0.01), declarations, quick=True)
    report = measure_scenario(stiff(0.1, 0.01), scene, quick=True, clock=None)
    steps = {row.setting.timestep for row in report.rows}
    assert steps == {0.1, 0.05, 0.00625, 0.003125}, "0.05 s over 8 is the first below 2/ω = 6.3 ms"
    (own_row,) = (line for line in report.rows if line.own)
    assert own_row.status == "diverged"
    assert any("MuJoCo warned of bad " in reason for reason in own_row.reasons)
    assert (own_row.position, own_row.velocity, own_row.seen) == (None, None, None)
    text = "the scene does not run under its own setting, Euler at 100 ms: "
    assert report.verdict.text.startswith(text)
    assert report.verdict.lines[3].startswith("Euler stays bounded at the steps tried to 5.7")
    limits = {line.integrator: line.largest for line in report.stable}
    for name in ("Euler", "implicit", "implicitfast"):
        # Below 2/ω it swings within bounds, with up to 1/(1 − hω/2) times its energy.
        assert limits[name] == pytest.approx(2 * (10 / 11) / 1e5**0.5, rel=0.02)
    assert limits["discrete"] == "all"


def test_a_scene_that_diverges_at_every_timestep_is_refused() -> None:
    with pytest.raises(SceneError, match=r"it diverges within 1 ms even under Euler at 6.10352 µs"):
        measure(stiff(0.1, 0.01, -1e8), f"{FROM_KEYFRAME}duration = 0.8\n", quick=True)


def test_times_are_of_the_clock() -> None:
    """A clock that ticks evenly: whatever is timed takes the same, and nothing is uncertain."""
    ticks = iter(range(0, 10**15, 2_000_000))
    model = stiff(0.01, 0.1, 10)
    text = '[[scenario]]\nname = "a"\nduration = 0.8\n'
    (line,) = scenes(model, parse_declared(text), quick=True)
    report = measure_scenario(model, with_search(line), quick=True, clock=lambda: next(ticks))
    for line in report.rows:
        assert line.cost is not None and line.seconds is not None and line.realtime is not None
        assert line.cost.low == line.cost.value == line.cost.high > 0
        assert line.seconds.value * line.realtime == pytest.approx(1.0)
    assert [line.cost.value for line in report.rows if line.own and line.cost] == [1.0]
    assert any(line.front for line in report.rows)


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


@pytest.mark.parametrize(("line", "error"), [("", 0.1), ("horizon_error = { rad = 1e-3 }\n", 1e-3)])
def test_chaos_has_a_horizon(line: str, error: float) -> None:
    toml = '[[scenario]]\nname = "a"\nkeyframe = 0\nduration = 9\nsample = 0.04\n'
    (report,) = measure(mujoco.MjModel.from_xml_string(DOUBLE_PENDULUM), toml + line, quick=True)
    assert report.lyapunov is not None and report.horizons is not None
    assert report.reference == "ode", "beyond the horizon nothing is compared with the engine"
    first, last = report.horizons
    assert report.horizon == first < last <= 9, "eight nudges part at different times"
    assert report.horizon_error == {"rad": error}
    growth = math.log(error / 1e-10)  # from the nudge to where predictions end
    assert first / 1.5 < growth / report.lyapunov < 1.5 * last
    assert any("errors count until" in note for note in report.notes)
    assert report.own_row is not None and report.own_row.energy_drift is not None
    assert f"chaotic: off by {error:g} rad at" in report.verdict.text


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
    short += "timesteps = [0.0005]\nsearch = [0.01, 0.02]\n"
    (report,), repeated = (measure(model, short, quick=True) for _ in range(2))
    opt = model.opt
    assert (opt.timestep, opt.integrator, opt.cone, opt.disableflags) == before
    assert repeated == (report,)
    assert (report.reference, report.orders) == ("self", ())
    assert report.notes == (
        "the same motion to the bit, and no time saved, with 4 iterations",
        "no orders are given, as accelerations may jump: contact",
        "what sticks creeps by 0.000511 m under the scene's own setting, though friction stays "
        "below its limit: in the engine it is soft",
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
    text = '[[scenario]]\nname = "a"\ntimesteps = [0.001]\n'
    (report,) = measure(mujoco.MjModel.from_xml_string(mjcf), text, quick=True)
    own_row = next(line for line in report.rows if line.own)
    slope, time = 3 * 2**0.5, 2.0
    exact = (slope - 0.3 * 9 / 2**0.5 - (slope - 0.3 * 9)) * time**2 / 2  # half is enough
    assert own_row.model_error == pytest.approx(exact, rel=0.02)
    assert own_row.seen is not None and own_row.seen > 10
    round_setting = replace(own_row.setting, cone="elliptic")
    (round_one,) = (line for line in report.rows if line.setting == round_setting)
    assert round_one.seen is not None and round_one.seen < own_row.seen / 5


def test_a_cone_that_is_better_from_starts_nearby_too() -> None:
    """The pyramid's own error counts there as it does from the declared start."""
    mjcf = """<mujoco><option timestep="0.004"/><worldbody>
      <geom type="plane" size="9 9 1" friction="0.4"/>
      <body pos="0 0 0.1"><freejoint/><geom type="box" size="0.2 0.2 0.1" mass="1"/></body>
    </worldbody></mujoco>"""
    text = '[[scenario]]\nname = "a"\nduration = 0.48\nsample = 0.016\nqvel = [2, 2, 0, 0, 0, 0]\n'
    model = mujoco.MjModel.from_xml_string(mjcf)
    (scene,) = scenes(model, parse_declared(text), quick=True)
    ticks = itertools.count(step=2_000_000)
    report = measure_scenario(model, scene, quick=True, clock=ticks.__next__)
    assert report.verdict.better is not None, report.verdict.text
    assert report.rows[report.verdict.better].setting.cone == "elliptic"


STOP = """<mujoco><option timestep="0.004"/><worldbody>{}<body>
  <joint type="slide" axis="0 0 1" {}/><geom size=".1" mass="1" contype="{}"/>
</body></worldbody></mujoco>"""
FALL = '[[scenario]]\nname = "a"\nqpos = [{}]\nduration = 0.48\nsample = 0.016\n'
FALL += "timesteps = [0.004]\nsearch = [0.004, 0.008]\n"


def test_what_hangs_on_where_in_a_step_a_hit_falls_is_luck() -> None:
    """Here a smaller error of RK4, at the same cost; a part of a step later there is none."""
    model = mujoco.MjModel.from_xml_string(STOP.format("", 'limited="true" range="0 9"', 0))
    (scene,) = scenes(model, parse_declared(FALL.format(0.116)), quick=True)
    ticks = itertools.count(step=2_000_000)
    text = measure_scenario(model, scene, quick=True, clock=ticks.__next__).verdict.text
    assert text.startswith("no difference that holds: RK4 at 4 ms takes about as long and errs ")
    assert "here, but " in text and "from starts nearby" in text


def test_contacts_so_soft_that_a_ball_sinks_in_are_no_divergence() -> None:
    floor = '<geom type="plane" size="1 1 1" solref="0.2 1"/>'
    model = mujoco.MjModel.from_xml_string(STOP.format(floor, "", 1))
    (report,) = measure(model, FALL.format(0.5), quick=True)
    assert {line.status for line in report.rows} == {"ok"}


def test_refsafe_is_not_told_of_what_never_touches() -> None:
    """A weld with a stiffness of its own, and geoms that could touch."""
    model = mujoco.MjModel.from_xml_string("""<mujoco><option timestep="0.02" gravity="0 0 0"/>
      <worldbody><geom size=".1" pos="9 0 0"/><body name="a"><freejoint/><geom size=".1"/></body>
      </worldbody><equality><weld body1="a" solref="-400 -40"/></equality></mujoco>""")
    text = '[[scenario]]\nname = "a"\nqpos = [0.2, 0, 0, 1, 0, 0, 0]\nduration = 0.6\n'
    (report,) = measure(model, text + "search = [0.02, 0.03]\n", quick=True)
    assert not any(line.refsafe for line in report.rows)
    assert not any("refsafe" in note for note in report.notes)


def test_a_reference_does_not_sleep() -> None:
    """In steps so short that ten of them are slow, a disc that was let go would stay there."""
    mjcf = """<mujoco><option timestep="0.005" integrator="RK4" gravity="0 0 0"
        sleep_tolerance="0.01"><flag sleep="{}"/></option>
      <worldbody><body><joint axis="0 0 1" stiffness="4" damping="0.3"/>
        <geom type="cylinder" size="0.2 0.02" mass="5"/></body></worldbody></mujoco>"""
    text = '[[scenario]]\nname = "a"\nqpos = [0.3]\nduration = 0.8\nsample = 0.08\n'
    awake, sleeping = (
        measure(mujoco.MjModel.from_xml_string(mjcf.format(flag)), text, quick=True)[0]
        for flag in ("disable", "enable")
    )
    assert sleeping.reference == awake.reference == "ode" and sleeping.floor == awake.floor
    asleep, usual = (row(report, "RK4", 0.00125).position for report in (sleeping, awake))
    assert asleep and usual and usual[0] < 1e-9 and asleep[0] > 1e-3
    assert "nothing sleeps in the reference, so errors hold what sleep changes" in sleeping.notes


def test_where_a_declared_error_is_not_resolved_what_is_seen_is_compared() -> None:
    """A sensor of what stays at rest has no error; the ball that falls has one."""
    mjcf = """<mujoco><option timestep="0.004"/><worldbody>
      <body><joint name="x" type="slide" axis="0 0 1" damping="1"/><geom size=".1" mass="1"/></body>
      <body pos="1 0 0"><joint name="y" type="slide" axis="1 0 0"/><geom size=".1" mass="1"/></body>
    </worldbody><sensor><jointpos name="side" joint="y"/></sensor></mujoco>"""
    text = '[[scenario]]\nname = "a"\nduration = 0.8\nsample = 0.08\nmeasure = "sensor:side"\n'
    (report,) = measure(mujoco.MjModel.from_xml_string(mjcf), text, quick=True)
    assert {line.figure for line in report.rows} == {(0.0, 0.0)}
    (chart,) = report.charts
    assert [level.text for level in chart.levels] == ["just visible"]
