"""The course of the browser's tests: two models, and a lesson with four labs."""

from __future__ import annotations

import json
from pathlib import Path

TWIN = Path(__file__).parents[2] / "content/labs/twin.js"
"""A kind of lab of the course in this repository."""

PENDULUM = """<mujoco>
  <option timestep="0.002" integrator="RK4"/>
  <worldbody>
    <light pos="0 -2 3" dir="0 0.5 -1"/>
    <body name="arm" pos="0 0 1">
      <joint name="hinge" axis="0 1 0"/>
      <geom name="rod" type="capsule" fromto="0 0 0 0 0 -0.5" size="0.03" mass="1"/>
      <site name="tip" pos="0 0 -0.5" size="0.02"/>
    </body>
  </worldbody>
  <keyframe><key name="up" qpos="2"/></keyframe>
</mujoco>
"""

ZOO = f"""<mujoco>
  <asset>
    <texture name="sky" type="skybox" builtin="gradient" rgb1="0.6 0.75 0.9" rgb2="1 1 1"
      width="32" height="192"/>
    <texture name="squares" type="2d" builtin="checker" rgb1="1 1 1" rgb2="0.6 0.6 0.6"
      width="64" height="64"/>
    <texture name="crossed" type="cube" builtin="flat" mark="cross" rgb1="0.8 0.5 0.2"
      rgb2="0.2 0.5 0.8" markrgb="1 1 1" width="32" height="32"/>
    <material name="floor" texture="squares" texuniform="true"/>
    <material name="crossed" texture="crossed"/>
    <mesh name="corner" vertex="0 0 0  0.4 0 0  0 0.4 0  0 0 0.4"/>
    <hfield name="hills" nrow="8" ncol="9" size="0.6 0.4 0.2 0.05"
      elevation="{" ".join(str(i % 5) for i in range(72))}"/>
  </asset>
  <worldbody>
    <light pos="0 0 4" dir="0 0 -1" type="directional"/>
    <light pos="2 2 4" dir="-1 -1 -2"/>
    <geom type="plane" size="0 0 0.1" material="floor"/>
    <geom type="hfield" hfield="hills" pos="-1.4 1.2 0.05"/>
    <body pos="0 0 1"><freejoint/><geom type="box" size="0.2 0.15 0.1" material="crossed"/></body>
    <body pos="0.8 0 1"><freejoint/><geom type="sphere" size="0.2"/></body>
    <body pos="-0.8 0 1"><freejoint/><geom type="capsule" size="0.1 0.2"/></body>
    <body pos="0 0.8 1"><freejoint/>
      <geom type="ellipsoid" size="0.1 0.2 0.3" rgba="0.3 0.3 0.8 0.5"/></body>
    <body pos="0 -0.8 1"><freejoint/><geom type="cylinder" size="0.15 0.1"/></body>
    <body pos="-0.8 -0.8 1"><freejoint/><geom type="mesh" mesh="corner"/></body>
    <body pos="1.2 -0.8 1.2"><joint axis="0 1 0"/>
      <geom type="capsule" fromto="0 0 0 0.4 0 0" size="0.04"/><site name="end" pos="0.4 0 0"/>
    </body>
    <site name="anchor" pos="1.6 -0.8 1.8"/>
    <flexcomp name="cloth" type="grid" count="5 5 1" spacing="0.1 0.1 0.1" pos="0.3 1.2 1"
      radius="0.01" dim="2" mass="0.3"><edge equality="true"/></flexcomp>
  </worldbody>
  <tendon><spatial width="0.01"><site site="anchor"/><site site="end"/></spatial></tendon>
</mujoco>
"""

CONTROLS = (
    {
        "label": "gravity",
        "unit": "m/s²",
        "min": 0,
        "max": 20,
        "step": 0.1,
        "value": 9.8,
        "apply": "model.opt.gravity[2] = -value",
    },
    {
        "type": "select",
        "label": "start",
        "param": "angle",
        "reset": True,
        "options": [["low", 0.5], ["high", 2.5]],
        "value": 2.5,
    },
    {"type": "button", "label": "Push", "run": "data.qvel[0] += 3"},
)

SWING = {
    "title": "A swing",
    "model": "pendulum",
    "setup": "data.qpos[0] = ctx.angle",
    "camera": {"azimuth": 90, "elevation": -10, "distance": 2.5, "target": [0, 0, 1]},
    "toggles": ["frames", "joints"],
    "trail": "tip",
    "controls": CONTROLS,
    "readouts": [
        {"label": "angle (rad)", "expr": "data.qpos[0]", "digits": 3},
        {"label": "side", "expr": "data.qpos[0] > 0 ? 'left' : 'right'"},
    ],
    "plots": [
        {
            "ylabel": "angle (rad)",
            "window": 5,
            "refLines": [{"y": 0, "label": "down"}],
            "traces": [{"label": "angle", "expr": "data.qpos[0]"}],
        }
    ],
}

AUTO = {"title": "By itself", "model": "pendulum", "key": "up", "autoplay": True, "height": 200}

ALL = {
    "title": "Everything",
    "model": "zoo",
    "toggles": ["frames", "contacts", "forces", "com", "inertia", "joints"],
}


TWINS = {
    "title": "Twins",
    "model": "pendulum",
    "key": "up",
    "nudge": {"entry": "qvel", "index": 0, "sizes": [1e-6, 1e-3]},
    "seconds": 5,
}


def _lab(lab: object, kind: str = "simlab") -> str:
    return f"```lab {kind}\n{json.dumps(lab, ensure_ascii=False)}\n```\n\n"


FAR = "Some text in a paragraph of its own, so that labs are not near at first.\n\n" * 60

_ALL_LABS = (_lab(SWING), _lab(AUTO), _lab(ALL), _lab(TWINS, "twin"))
LESSON = f"## First\n\n{FAR.join(('', *_ALL_LABS))}Text.\n"
PAGE = "lessons/1.1-one.html"
