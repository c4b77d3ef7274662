"""Two models side by side: the same bits, nearly the same, or not; and how their times compare."""

from __future__ import annotations

import math
from typing import Any

import mujoco
import numpy as np
import pytest

from mjbench.declarations import BenchTable, DeclaredScenario, Place
from mjbench.problem import Scenario
from mjbench.pruning.comparison import (
    ALIKE,
    IndexMap,
    compare,
    fits,
    index_map,
    nearby_scenes,
    pruning_scenes,
    transfer,
    watch,
)
from mjbench.scene import Scene
from mjbench.simulation import initial_data
from samples.surveys import NO_DECLARATIONS, parse_declared

DOUBLE_PENDULUM = """<mujoco><worldbody><body><joint axis="0 1 0"/><geom size=".1" pos=".5 0 0"/>
  <body pos="1 0 0"><joint axis="0 1 0"/><geom size=".1" pos=".5 0 0" mass="{mass!r}"/></body>
  </body></worldbody><keyframe><key qpos="-1.4 .5"/></keyframe></mujoco>"""


def scene_of(duration: float, keyframe: int = -1) -> Scene:
    scenario = Scenario(duration, 0.002, keyframe=keyframe)
    nobody = DeclaredScenario("go", table=Place(NO_DECLARATIONS.path))
    return Scene("go", "go", scenario, (0.002,), 0.002, BenchTable(), nobody)


CHAOS, SHORT = scene_of(15.0, 0), scene_of(1.0, 0)


def double(mass: float = 1.0) -> Any:
    return mujoco.MjModel.from_xml_string(DOUBLE_PENDULUM.format(mass=mass))


def identity_map(model: Any) -> IndexMap:
    return index_map(model, {})


def test_chaos_is_no_difference() -> None:
    """After 15 s the trajectories are far apart; as long as a twin stays near they are one."""
    base, variant = double(), double(1.0 + 1e-13)
    run = watch(base, CHAOS)
    assert 5 < run.horizon < 14
    comparison = compare(base, variant, identity_map(base), [run])
    assert not comparison.identical and 0 < comparison.difference < ALIKE
    assert f"until {run.horizon:.3g} s, beyond which the motion" in comparison.shown
    ends = []
    for model in (base, variant):
        data = initial_data(CHAOS.scenario, model)
        mujoco.mj_step(model, data, 7500)
        ends.append(data.qpos.copy())
    assert np.max(np.abs(ends[0] - ends[1])) > 10 * math.radians(1) * comparison.difference


def test_difference_is_that_of_the_whole_run_in_the_scenes_own_quantities() -> None:
    """A slide that leans by a millionth of the gravity is off by g t²/2 at the end."""
    text = """<mujoco><option gravity="{!r} 0 0"/><worldbody><body name="sled"><joint type="slide"
      axis="1 0 0"/><geom size=".1"/></body></worldbody></mujoco>"""
    base, variant = (mujoco.MjModel.from_xml_string(text.format(g)) for g in (0.0, 1e-5))
    run = watch(base, scene_of(4.0))
    comparison = compare(base, variant, identity_map(base), [run])
    assert comparison.shown == "the body sled is off by 8e-05 m at 4 s"
    length = 0.01 * float(base.stat.extent)
    assert comparison.difference == pytest.approx(8e-5 / length, rel=1e-3)


def test_starts_nearby_move_only_what_moves() -> None:
    text = """<mujoco><option gravity="0 0 0"/><worldbody>
      <body><joint axis="0 1 0"/><geom size=".1" pos=".5 0 0"/></body>
      <body pos="3 0 0"><joint axis="0 1 0"/><geom size=".1" pos=".5 0 0"/></body>
      </worldbody><keyframe><key qvel="2 0"/></keyframe></mujoco>"""
    model = mujoco.MjModel.from_xml_string(text)
    run = watch(model, scene_of(1.0, 0))
    nearby = [scene.scenario for scene in nearby_scenes(model, run, 3)]
    assert len({scenario.qpos[0] for scenario in nearby}) == 3
    assert all(0 < abs(scenario.qvel[0] - 2) < 0.1 for scenario in nearby)
    assert all(scenario.qpos[1] == scenario.qvel[1] == 0 for scenario in nearby)


def test_a_changed_model_that_diverges_is_not_equal() -> None:
    base, variant = double(), double()
    variant.dof_damping[:] = -1e6
    comparison = compare(base, variant, identity_map(base), [watch(base, CHAOS)])
    assert not comparison.identical and comparison.difference > 1


def test_a_ball_so_soft_that_it_sinks_beyond_its_middle_is_not_lost() -> None:
    model = mujoco.MjModel.from_xml_string(
        """<mujoco><worldbody><geom type="plane" size="1 1 1"/><body name="ball" pos="0 0 .06">
        <freejoint/><geom size=".05" mass="1" solref=".2 1"/></body></worldbody></mujoco>"""
    )
    assert watch(model, scene_of(0.5)).judgement.ok


def test_contacts_count_though_nothing_moves() -> None:
    """The block stays where it is to the bit, but another geom bears it."""
    text = """<mujoco><option gravity="0 0 0"/><worldbody><geom name="{}" size=".1" pos="0 0 -.1"/>
      <geom name="{}" size=".1" pos="0 0 -.1"/><body><freejoint/><geom size=".1" pos="0 0 .1"/>
      </body></worldbody></mujoco>"""
    base = mujoco.MjModel.from_xml_string(text.format("a", "b"))
    variant = mujoco.MjModel.from_xml_string(text.format("a", "b"))
    variant.geom_contype[0] = variant.geom_conaffinity[0] = 0
    run = watch(base, scene_of(0.002))
    assert compare(base, base, identity_map(base), [run]).identical
    comparison = compare(base, variant, identity_map(base), [run])
    assert not comparison.identical


FULL = """<mujoco><worldbody><body name="m" mocap="true"/>
  <body name="a"><freejoint/><geom size=".1"/>
    <body><joint type="ball"/><geom size=".1"/></body></body>
  <body name="b"><joint name="j"/><geom size=".1"/></body></worldbody>
  <actuator><motor joint="j"/><general joint="j" dyntype="integrator"/></actuator></mujoco>"""


def test_a_state_is_brought_over() -> None:
    model, spec = mujoco.MjModel.from_xml_string(FULL), mujoco.MjSpec.from_string(FULL)
    spec.delete(spec.body("a"))
    variant = spec.compile()
    left = index_map(model, {"body": {model.body("a").id}})
    assert fits(left, model, variant)
    data, variant_data = mujoco.MjData(model), mujoco.MjData(variant)
    data.qpos[:], data.qvel[:] = range(12), range(10)
    data.time, data.act[:], data.ctrl[:], data.mocap_pos[0] = 3.0, [1], [4, 5], 7
    transfer(model, data, left, variant, variant_data)
    state = variant_data.time, variant_data.qpos.tolist(), variant_data.qvel.tolist()
    assert state == (3.0, [11.0], [9.0])
    assert (variant_data.act.tolist(), variant_data.ctrl.tolist()) == ([1], [4, 5])
    assert variant_data.mocap_pos[0].tolist() == [7] * 3


def test_scenarios_as_the_author_wrote_them() -> None:
    text = """[[scenario]]\nname = "push"\nduration = 1\nsample = 0.1\nhold = 0.2
controls = [[1], [2]]\nqvel = [0, 5]\n"""
    mjcf = DOUBLE_PENDULUM.format(mass=1.0).replace('<joint axis="0 1 0"/>', '<joint name="j"/>', 1)
    motor = "<actuator><motor joint='j'/></actuator></mujoco>"
    model = mujoco.MjModel.from_xml_string(mjcf.replace("</mujoco>", motor))
    (scene,) = pruning_scenes(model, parse_declared(text))
    assert (scene.name, scene.scenario.qvel[-1]) == ("push", 5)
    commands = [(n, i.controls[0]) for n, i in enumerate(scene.scenario.inputs(0.002))]
    assert commands == [(step, 1 if step < 100 else 2) for step in range(500)]
    (short,) = pruning_scenes(model, parse_declared(text), quick=True)
    assert short.scenario.duration == 0.5
