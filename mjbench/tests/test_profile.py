"""Where the time of a step goes, by a clock that ticks once each time it is read."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from typing import Any

import mujoco
import pytest
from msgspec.structs import replace

from mjbench.cli import main
from mjbench.derive import derive_profile, derive_scenario
from mjbench.judge import compared_rows
from mjbench.profile import profile_lines, profile_rows, profile_text
from mjbench.reports.scene_report import PhaseProfile
from mjbench.reports.terminal import Style
from mjbench.scene import Scene, scenes
from samples.reports import interval, row, scenario
from samples.surveys import NO_DECLARATIONS

ROLLING = """\
<mujoco>
  <option timestep="0.01" integrator="{integrator}"><flag {flags}/></option>
  <worldbody>
    <geom type="plane" size="3 3 .1"/>
    <body pos="0 0 .1"><freejoint/><geom size=".1" mass="1"/><site name="imu"/></body>
    <body pos="1 0 .1"><freejoint/><geom size=".1" mass="1"/></body>
  </worldbody>
  <sensor>{sensors}</sensor>
</mujoco>
"""
IMU = '<accelerometer site="imu"/><gyro site="imu"/>'


def profile(
    integrator: str = "Euler", sensors: str = "", flags: str = 'island="enable"', **fields: Any
) -> PhaseProfile:
    text = ROLLING.format(integrator=integrator, sensors=sensors, flags=flags)
    model = mujoco.MjModel.from_xml_string(text)
    (scene,) = scenes(model, NO_DECLARATIONS, quick=True)
    setting = {"solver": "Newton", "iterations": 100, "cone": "pyramidal"}
    profiled_row = row(integrator, 0.01, name="its own", **{**setting, **fields})
    mujoco.set_mjcb_time(itertools.count(1.0).__next__)
    try:
        (result,) = profile_rows(model, brief(scene), {3: profiled_row}, quick=True)
    finally:
        mujoco.set_mjcb_time(None)
    return result


def brief(scene: Scene) -> Scene:
    return replace(scene, scenario=replace(scene.scenario, duration=0.4, sample=0.02))


def test_phases_are_each_their_own_and_together_the_step() -> None:
    result = profile()
    assert (result.row, result.name, result.steps) == (3, "its own", 40)
    assert sum(result.phases.values()) == pytest.approx(result.step)
    # A phase in which no other is timed takes the one tick between the two looks at the clock.
    for name in ("broad collision", "narrow collision", "velocity", "actuation", "solver"):
        assert result.phases[name] == pytest.approx(1), name
    assert result.phases["making constraints"] == pytest.approx(2), "made, and projected"
    assert result.phases["other"] > 0 and result.phases["integration"] > 1
    assert "sensors" not in result.phases, "there are none"


def test_a_step_of_rk4_is_four_evaluations_and_what_lies_between_them() -> None:
    euler, rk4 = profile(), profile("RK4")
    for name in ("kinematics", "inertia", "narrow collision", "solver"):
        assert rk4.phases[name] == pytest.approx(4 * euler.phases[name]), name
    assert rk4.phases["integration"] > euler.phases["integration"]
    assert sum(rk4.phases.values()) == pytest.approx(rk4.step)


def test_sensors_are_what_a_step_takes_more_with_them() -> None:
    """Sensors read no clock, so they take none of this one's ticks; what they take is measured."""
    result = profile(sensors=IMU)
    assert result.phases["sensors"] == pytest.approx(0)
    off = 'island="enable" sensor="disable"'
    assert "sensors" not in profile(sensors=IMU, flags=off).phases, "they are off anyway"


def test_contacts_rows_and_islands_are_counted_after_each_step() -> None:
    pyramids, cones = profile(), profile(cone="elliptic")
    assert pyramids.contacts == cones.contacts == (2.0, 2)
    assert pyramids.constraints[1] == 8, "a pyramid has four edges"
    assert cones.constraints[1] == 6, "a cone has a normal and two tangents"
    assert 7 < pyramids.constraints[0] < 8, "there are none before the first touch"
    assert 1.9 < pyramids.islands < 2
    assert profile(flags='island="disable"').islands == 0


def phases(number: int = 0, *, steps: int = 500, **times: float) -> PhaseProfile:
    """Return the profile of a row, with the times of phases in µs."""
    table: Mapping[str, float] = {name: 1e-6 * time for name, time in times.items()}
    names = {0: "Euler at 2 ms", 1: "Euler at 4 ms"}
    step, none = sum(table.values()), (0.0, 0)
    return PhaseProfile(number, names[number], steps, step, table, none, none, 0.0, 0.0, 5)


@pytest.mark.parametrize(
    ("rival", "text"),
    [
        (None, ""),
        (
            phases(1, steps=250, collision=3, solver=9),
            "the verdict rests on collision: over the scenario 1.5 ms → 750 µs under Euler at 4 ms",
        ),
        (
            phases(1, steps=2000, collision=3, solver=6),
            "the verdict rests on the number of steps: 500 → 2000 under Euler at 4 ms",
        ),
        (
            phases(1, steps=525, collision=3, solver=6.7),
            "the verdict rests on solver: over the scenario 3 ms → 3.5 ms under Euler at 4 ms",
        ),
        (phases(1, collision=3.1, solver=6.2), "the verdict rests on errors, not on time"),
    ],
)
def test_a_sentence_says_what_the_verdict_rests_on(rival: PhaseProfile | None, text: str) -> None:
    most = "of the phases solver takes the most, 67 % of a step"
    assert profile_text(phases(collision=3, solver=6), rival) == "; ".join(
        filter(None, (most, text))
    )


def test_what_has_no_timer_is_no_phase() -> None:
    text = profile_text(phases(solver=3, other=7), None)
    assert text == "of the phases solver takes the most, 30 % of a step"
    text = profile_text(phases(solver=3, other=7), phases(1, solver=3, other=17))
    assert "rests on what has no timer: over the scenario 3.5 ms → 8.5 ms under" in text


def test_the_rival_of_a_verdict_is_profiled_and_named() -> None:
    mine = row(own=True, seen=0.5, cost=1, dominated_by=1, name="Euler at 2 ms")
    better = row(timestep=0.004, seen=0.4, cost=0.67, front=True, name="Euler at 4 ms")
    dear_row = row("RK4", seen=0.1, cost=4, front=True)
    report = derive_scenario(scenario([mine, better, dear_row]), lambda _: ())
    assert list(compared_rows(report)) == [0, 1]
    pair = phases(collision=3, solver=6), phases(1, collision=0.5, solver=5.5)
    report = derive_profile(report, pair)
    assert "rests on collision" in report.profile_text
    cheaper = replace(report.rows[1], cost=interval(0.5))
    disturbed = replace(report, rows=(report.rows[0], cheaper, report.rows[2]))
    assert "disturbed the timers" in derive_profile(disturbed, pair).profile_text
    alike = replace(report.rows[1], cost=replace(interval(1.0), low=0.8, high=1.2))
    dominated = replace(report.rows[0], dominated_by=1)
    report = derive_profile(replace(report, rows=(dominated, alike, report.rows[2])), pair)
    assert report.profile_text.endswith("not on time")
    table = list(profile_lines(report.profile, report.profile_text, Style(100)))
    assert any(line.split() == "solver 6 µs 67 % 5.5 µs 92 %".split() for line in table)
    assert not list(profile_lines((), "", Style(100)))


def test_a_lost_scene_compares_nothing() -> None:
    lost = row(own=True, status="diverged", reasons=("the state is not finite",), cost=None)
    report = scenario([replace(lost, seconds=None, position=None, velocity=None)])
    assert compared_rows(derive_scenario(report, lambda _: ())) == {}


def test_times_are_not_compared_so_check_takes_no_profile(
    tmp_path: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    model = tmp_path / "ball.xml"
    model.write_text(ROLLING.format(integrator="Euler", sensors="", flags=""))
    assert main([str(model), "--profile", "--check", str(model)]) == 2
    assert "--check compares no times" in capsys.readouterr().err
