"""Pairs of geoms that may touch, and those that do."""

from __future__ import annotations

import mujoco
import pytest

from coursebuild.numerics.problem import Scenario
from coursebuild.numerics.scene import Scene, scenes
from coursebuild.numerics.touching import possible_pairs, touched_pairs

BALLS = """
<mujoco>
  <worldbody>
    <geom name="floor" type="plane" size="1 1 1"/>
    <body pos="0 0 0.2"><freejoint/><geom name="falls" size="0.1"/></body>
    <body pos="5 0 9"><freejoint/><geom name="far" size="0.1"/></body>
    <body pos="0 0 30"><freejoint/>
      <geom name="ghost" size="0.1" contype="0" conaffinity="0"/></body>
  </worldbody>
  <keyframe><key name="low" qpos="0 0 0.2 1 0 0 0  5 0 0.15 1 0 0 0  0 0 30 1 0 0 0"/></keyframe>
</mujoco>
"""


def model(xml: str) -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(xml)


def scene(scenario: Scenario, own: float = 0.002) -> Scene:
    (first, *_) = scenes(model(BALLS), None)
    return Scene("one", "one", scenario, (own,), own, first.visible, None)


def test_only_what_masks_allow_may_touch() -> None:
    assert possible_pairs(model(BALLS)) == {(0, 1), (0, 2), (1, 2)}


def test_what_touches_within_the_scenario_counts() -> None:
    balls = model(BALLS)
    assert touched_pairs(balls, [scene(Scenario(0.1, 0.02))]) == frozenset()
    assert touched_pairs(balls, [scene(Scenario(0.4, 0.02))]) == {(0, 1)}
    low = scene(Scenario(0.4, 0.02, keyframe=0))
    assert touched_pairs(balls, [scene(Scenario(0.1, 0.02)), low]) == {(0, 1), (0, 2)}


def test_a_pair_within_its_gap_but_without_force_does_not_count() -> None:
    near = BALLS.replace('name="falls" size="0.1"', 'name="falls" size="0.1" gap="1"')
    assert touched_pairs(model(near), [scene(Scenario(0.02, 0.02))]) == frozenset()


def test_commands_move_things_into_each_other() -> None:
    pushed = model(
        """<mujoco><option gravity="0 0 0"/><worldbody>
        <geom name="wall" type="box" size=".1 1 1" pos="1 0 0"/>
        <body><joint name="x" type="slide" axis="1 0 0"/><geom name="cart" size=".1"/></body>
        </worldbody><actuator><motor joint="x" gear="10"/></actuator></mujoco>"""
    )
    idle = Scenario(1.0, 0.1, controls=((0.0,),), hold=0.1)
    push = Scenario(1.0, 0.1, controls=((0.0,), (30.0,)), hold=0.1)
    (first, *_) = scenes(pushed, None)
    one, two = (
        Scene("one", "one", each, (0.002,), 0.002, first.visible, None) for each in (idle, push)
    )
    assert touched_pairs(pushed, [one]) == frozenset()
    assert touched_pairs(pushed, [two]) == {(0, 1)}


@pytest.mark.filterwarnings("ignore")
def test_a_run_that_is_lost_ends() -> None:
    wild = model(
        """<mujoco><option timestep="0.1"/><worldbody>
        <body><joint type="hinge" stiffness="1e6"/><geom name="a" size=".1"/></body>
        <body pos="0 0 9"><geom name="b" size=".1"/></body></worldbody></mujoco>"""
    )
    start = Scenario(10.0, 0.1, qvel=(1e9,))
    (first, *_) = scenes(wild, None)
    lost = Scene("one", "one", start, (0.1,), 0.1, first.visible, None)
    assert touched_pairs(wild, [lost]) == frozenset()
