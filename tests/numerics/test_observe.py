"""Contacts that should stick, and creep."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
import pytest

from coursebuild.numerics.measure import find_sticks, measure_slip
from coursebuild.numerics.scene import Scene, scenes
from coursebuild.numerics.simulation import EngineStates
from support.surveys import NO_DECLARATIONS

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
    (scene,) = scenes(model, NO_DECLARATIONS)
    return model, scene


def moving(speed: list[float], spin: list[float]) -> EngineStates:
    """A ball on a plane, at three times, with speeds along x and spins about y."""
    times = np.array([0.1, 0.2, 0.3])
    qpos = np.tile([0, 0, 0.0999, 1, 0, 0, 0], (3, 1)).astype(float)
    qvel = np.zeros((3, 6))
    qvel[:, 0], qvel[:, 4] = speed, spin
    return EngineStates(times, qpos, qvel, np.empty((3, 0)))


def test_only_what_sticks_in_the_reference_creeps() -> None:
    model, scene = ball()
    rolls = find_sticks(model, scene, moving([1, 1, 1], [10, 10, 10]))
    assert rolls == (frozenset({(0, 1)}),) * 3
    slides = find_sticks(model, scene, moving([1, 0, 0], [0, 0, 0]))
    assert slides == (frozenset(), frozenset(), frozenset({(0, 1)}))
    creeping = moving([0.02, 0.03, 0.04], [0, 0, 0])
    assert measure_slip(model, scene, creeping, rolls) == pytest.approx(0.009)
    assert measure_slip(model, scene, creeping, slides) == pytest.approx(0.004)
    assert measure_slip(model, scene, creeping, (frozenset(),) * 3) == 0.0
