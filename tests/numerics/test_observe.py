"""Pairs of geoms that may touch, those that do, and contacts that should stick and creep."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
import pytest

from coursebuild.numerics.engine import EngineStates
from coursebuild.numerics.observe import slip, speeds_of, sticking, touched_pairs
from coursebuild.numerics.problem import Scenario
from coursebuild.numerics.pruning.reachability import possible_pairs
from coursebuild.numerics.scene import Scene, scenes

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


BALL = """\
<mujoco>
  <worldbody>
    <geom type="plane" size="9 9 1"/>
    <body pos="0 0 0.0999"><freejoint/><geom size="0.1" mass="1"/></body>
  </worldbody>
</mujoco>
"""


def ball() -> tuple[Any, Scene]:
    model = mujoco.MjModel.from_xml_string(BALL)
    (scene,) = scenes(model, None)
    return model, scene


def moving(speed: list[float], spin: list[float]) -> EngineStates:
    """A ball on a plane, at three times, with speeds along x and spins about y."""
    times = np.array([0.1, 0.2, 0.3])
    qpos = np.tile([0, 0, 0.0999, 1, 0, 0, 0], (3, 1)).astype(float)
    qvel = np.zeros((3, 6))
    qvel[:, 0], qvel[:, 4] = speed, spin
    return EngineStates(times, qpos, qvel, np.empty((3, 0)))


def test_speeds_are_those_of_the_point_that_touches() -> None:
    model, scene = ball()
    found = speeds_of(model, scene, moving([1, 1, 0], [0, 10, 10]))
    assert [one[0, 1] for one in found] == pytest.approx([1, 0, 1], abs=1e-3)
    lifted = moving([1, 1, 1], [0, 0, 0])
    lifted.qpos[:, 2] = 0.5
    assert speeds_of(model, scene, lifted) == [{}, {}, {}]


def test_only_what_sticks_in_the_reference_creeps() -> None:
    model, scene = ball()
    rolls = sticking(model, scene, moving([1, 1, 1], [10, 10, 10]))
    assert rolls == (frozenset({(0, 1)}),) * 3
    slides = sticking(model, scene, moving([1, 0, 0], [0, 0, 0]))
    assert slides == (frozenset(), frozenset(), frozenset({(0, 1)}))
    creeping = moving([0.02, 0.03, 0.04], [0, 0, 0])
    assert slip(model, scene, creeping, rolls) == pytest.approx(0.009)
    assert slip(model, scene, creeping, slides) == pytest.approx(0.004)
    assert slip(model, scene, creeping, (frozenset(),) * 3) == 0.0
