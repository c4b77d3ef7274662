"""Scratch courses with labs."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

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
    """The JSON report of `check`, with its exit status."""
    result = folder.main("check", *names, "--format", "json")
    assert status is None or result.status == status, result.out + result.err
    return {"status": result.status, **json.loads(result.out)}


RIGHT = '''{
  "title": "All of it", "model": "ball", "key": "start", "camera": {"azimuth": 30},
  "toggles": ["frames"], "seed": 3, "stopAt": 1, "trail": "tip",
  "setup": "ctx.n = 0; ctx.r = lib.random()",
  "controller": "ctx.n += 1; data.qfrc_applied[2] = ctx.lift",
  "controls": [
    {"label": "lift", "unit": "N", "min": 0, "max": 9, "value": 1, "param": "lift"},
    {"label": "mass", "min": 0.5, "max": 2, "value": 1, "set": "model.body_mass[1]"},
    {"label": "g", "type": "select", "options": [["earth", -9.81], ["moon", -1.6]],
     "set": "model.opt.gravity[2]", "reset": true},
    {"label": "kick", "type": "button", "run": "data.qvel[0] = 1"}
  ],
  "readouts": [{"label": "height", "expr": "data.qpos[2]"},
               {"label": "state", "expr": "sim.time < 0.5 ? 'early' : 'late'"}],
  "plots": [{"ylabel": "z (m)", "traces": [{"label": "z", "expr": "data.qpos[2]"}]}],
  "expect": [
    {"t": 0, "expr": "data.qpos[2]", "min": 2, "max": 2},
    {"t": 1, "expr": "ctx.n", "min": 500, "max": 500},
    {"after": "kick", "t": 0.5, "expr": "data.qpos[0]", "min": 0.4999, "max": 0.5001},
    {"after": {"g": -1.6}, "t": 0.5, "expr": "data.qpos[2]", "min": 1.9, "max": 2},
    {"after": {"g": -1.6, "lift": 0}, "t": 0.5, "expr": "data.qpos[2]", "min": 1.79, "max": 1.81},
    {"after": [{"g": -1.6}, "kick"], "t": 0.5, "expr": "data.qpos[0]", "min": 0.499, "max": 0.501},
    {"after": ["kick", {"g": -1.6}], "t": 0.5, "expr": "data.qpos[0]", "min": 0, "max": 0}
  ]
}'''  # fmt: skip
