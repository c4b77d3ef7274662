"""A scenario for a model whose author declares none."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from mjbench.declarations import Declarations
from mjbench.fair import fair_scenarios
from mjbench.loop import Loop, time_limit
from mjbench.scene import scenes

ARM = """<mujoco><option timestep="0.002"/><worldbody>
  <body pos="0 0 1"><joint name="j" axis="0 1 0" damping="9"/><geom size=".05" pos=".3 0 0"/></body>
</worldbody>{}</mujoco>"""
MOTORS = """<actuator><motor joint="j" ctrllimited="true" ctrlrange="-2 6"/>
  <motor joint="j"/></actuator>"""
KEYS = '<keyframe><key name="other"/><key name="home" qpos="0.5" ctrl="3 0"/></keyframe>'


def test_commands_are_smooth_within_their_ranges_and_differ_by_seed() -> None:
    model = mujoco.MjModel.from_xml_string(ARM.format(MOTORS + KEYS))
    seeded_scenes = scenes(
        model, Declarations("arm.xml", fair_scenarios(model, "arm.xml", quick=False))
    )
    assert [scene.name for scene in seeded_scenes] == ["seed-1", "seed-2", "seed-3"]
    assert seeded_scenes[0].title.startswith("from the keyframe home, then smooth random commands")
    tables = [np.array(scene.scenario.controls) for scene in seeded_scenes]
    for table in tables:
        assert table[0] == pytest.approx([3.0, 0.0]), "as the keyframe has them"
        assert table[:, 0].min() >= -2 and table[:, 0].max() <= 6
        assert np.abs(np.diff(table, axis=0)).max() < 1.0 < np.ptp(table[:, 0])
    assert not np.array_equal(tables[0], tables[1])
    again = fair_scenarios(model, "arm.xml", quick=True)
    assert len(again) == 2 and again[0].controls == seeded_scenes[0].scenario.controls


def test_commands_are_waves_however_long_the_timestep_is() -> None:
    for timestep in (0.002, 0.02, 1.0):
        text = ARM.replace("0.002", str(timestep)).format(MOTORS)
        model = mujoco.MjModel.from_xml_string(text)
        (first, *_) = fair_scenarios(model, "arm.xml", quick=True)
        turns = np.diff(np.sign(np.diff(np.array(first.controls)[:, 1])))
        assert 4 <= np.count_nonzero(turns) <= 12, f"three waves and two periods at {timestep} s"


def test_a_scenario_is_as_long_as_there_is_time_for() -> None:
    text = ARM.replace("0.002", "0.0001").format(MOTORS + KEYS)
    model = mujoco.MjModel.from_xml_string(text)
    (usual, *_) = fair_scenarios(model, "arm.xml", quick=True)
    with time_limit(1):
        (first, *_) = fair_scenarios(model, "arm.xml", quick=True)
    assert usual.duration == pytest.approx(2) and first.duration is not None
    assert 0.0384 <= first.duration < 1.9
    commands = np.array(first.controls)[:, 1]
    assert np.count_nonzero(np.diff(np.sign(np.diff(commands)))) >= 4, "they are waves"


def test_without_a_keyframe_it_begins_where_the_model_comes_to_rest() -> None:
    quick_arm = ARM.replace('damping="9"', 'damping="0.6"')
    model = mujoco.MjModel.from_xml_string(quick_arm.format(MOTORS))
    (first, *_) = fair_scenarios(model, "arm.xml", quick=True)
    assert first.title is not None and first.title.startswith("from where it comes to rest")
    assert first.qpos[0] == pytest.approx(np.pi / 2, abs=1e-2), "it hangs"


def test_what_would_not_move_gets_velocities_and_what_cannot_has_no_scenario() -> None:
    weightless = ARM.replace("<option", '<option gravity="0 0 0"').format("")
    still = mujoco.MjModel.from_xml_string(weightless)
    still_motors = weightless.replace("/>", '><flag actuation="disable"/></option>', 1)
    disabled = mujoco.MjModel.from_xml_string(
        still_motors.replace("</mujoco>", f"{MOTORS}</mujoco>")
    )
    for model in (still, disabled):
        (scenario,) = fair_scenarios(model, "arm.xml", quick=True)
        assert scenario.title is not None and "random velocities" in scenario.title
        assert scenario.qvel and scenario.qvel[0] != 0
    still_arm = mujoco.MjModel.from_xml_string(
        weightless.replace("</mujoco>", f"{MOTORS}</mujoco>")
    )
    for command, delay, is_moving in ((0.0, 0.0, False), (1.0, 0.0, True), (1.0, 0.5, True)):
        code = compile(f"def control(m, d): return [{command}, 0]", "hold.py", "exec")
        loop = Loop("hold.py", code, 0.02, delay)
        (scenario,) = fair_scenarios(still_arm, "arm.xml", quick=True, loop=loop)
        assert scenario.name == "loop" and scenario.title is not None
        assert ", under the controller hold.py" in scenario.title
        assert bool(scenario.qvel) is not is_moving
    fixed = mujoco.MjModel.from_xml_string("<mujoco/>")
    assert fair_scenarios(fixed, "a.xml", quick=True) == ()
