"""What a model is made of, and how fast the browser's engine runs it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import msgspec
import pytest

from coursebuild.features.bench.commands.measuring import Mjbench
from coursebuild.pipeline.scenes import find_scenes
from samples.reports import swing

pytestmark = pytest.mark.site

BALL = """\
<mujoco>
  <include file="parts/floor.xml"/>
  <worldbody>
    <body name="ball" pos="0 0 1"><freejoint/><geom size="0.1"/></body>
  </worldbody>
  <keyframe><key name="low" qpos="0 0 0.11 1 0 0 0"/></keyframe>
</mujoco>
"""
FLOOR = '<mujoco><worldbody><geom type="plane" size="1 1 1"/></worldbody></mujoco>\n'


@pytest.fixture
def root(tmp_path: Path) -> Path:
    for path, text in (
        ("content/course.toml", ""),
        ("models/ball.xml", BALL),
        ("models/parts/floor.xml", FLOOR),
    ):
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / path).write_text(text)
    return tmp_path


def card_of(root: Path) -> Any:
    (scene,) = find_scenes(root, ("ball",)).value
    with Mjbench(root, "a test") as mjbench:
        return msgspec.json.decode(mjbench.do("join", scene, scenarios=[swing()], card=True))[
            "card"
        ]


def test_a_card(root: Path) -> None:
    card = card_of(root)
    assert (card["possible"], card["touched"]) == (1, 1)
    assert card["mjcf"] == len(BALL) + len(FLOOR)
    assert card["mjb"] > 2000
    assert card["browser"] > 0


def test_what_does_not_touch_in_the_scenarios(root: Path) -> None:
    (root / "models/ball.toml").write_text('[[scenario]]\nname = "high"\nduration = 0.2\n')
    card = card_of(root)
    assert (card["possible"], card["touched"]) == (1, 0)
