"""Scratch courses with labs."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from support.fixture_cases import fixture_text
from support.scratch_course import GOOD, Folder

BALL = """<mujoco><worldbody><body name="ball" pos="0 0 1"><freejoint/><geom size="0.1" mass="1"/>
<site name="tip" pos="0.1 0 0"/></body></worldbody>
<keyframe><key name="start" qpos="0 0 2 1 0 0 0"/></keyframe></mujoco>
"""


def fence(body: str) -> str:
    return f"```lab simlab\n{body}\n```\n\n"


def course(root: Path, stores: Path, *lessons: str) -> Folder:
    """A course of one valid lesson and these lessons, with the ball as a model."""
    folder = Folder(root)
    folder.fill([GOOD, *lessons], stores)
    folder.write("models/ball.xml", BALL)
    return folder


def run_check(folder: Folder, *names: str, status: int | None = None) -> dict[str, Any]:
    result = folder.main("check", *names, "--format", "json")
    assert status is None or result.status == status, result.out + result.err
    return {"status": result.status, **json.loads(result.out)}


RIGHT = fixture_text("documents/right_lab.json")  # fmt: skip
