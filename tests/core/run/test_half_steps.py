"""Each step of a script is made as two or four shorter ones, and the script does not notice."""

from __future__ import annotations

import json
from typing import Any

import pytest

from support.runners import Run

pytestmark = pytest.mark.site

HEAD = """\
import json
import mujoco
import numpy as np

SPRING = '''
<mujoco>
  <option timestep="0.1" gravity="0 0 0"/>
  <worldbody><body><joint name="j" type="slide" stiffness="10"/><geom size="0.1" mass="1"/></body>
  </worldbody>
  <actuator><motor joint="j"/></actuator>
</mujoco>
'''
model = mujoco.MjModel.from_xml_string(SPRING)
data = mujoco.MjData(model)
data.qpos[0] = 1
"""
TEN = {
    "one by one": "for _ in range(10):\n    mujoco.mj_step(model, data)\n",
    "many at once": "mujoco.mj_step(model, data, nstep=10)\n",
    "by keyword": "for _ in range(5):\n    mujoco.mj_step(m=model, d=data, nstep=2)\n",
    "by the clock": "while data.time < 0.95:\n    mujoco.mj_step(model, data)\n",
    "in parts": """\
for _ in range(10):
    mujoco.mj_step1(model, data)
    mujoco.mj_step2(model, data)
""",
    "with its own forward": """\
for _ in range(10):
    mujoco.mj_forward(model, data)
    mujoco.mj_Euler(model, data)
""",
    "of its own timestep": """\
model.opt.timestep = 0.05
while data.time < 0.975:
    mujoco.mj_step(model, data)
""",
    "as a rollout": """\
from mujoco import rollout
begin = np.array([[0, 1, 0.0]])
state, _ = rollout.rollout(model, data, begin, np.full((1, 10, 1), 2.0))
assert state.shape == (1, 10, 3) and np.allclose(state[0, :, 0], np.arange(1, 11) / 10)
data.qpos[0], data.qvel[0] = state[0, -1, 1:]
data.time = state[0, -1, 0]
""",
}


def spring(timestep: float, force: float = 2.0) -> tuple[float, float]:
    """Where 1 s of semi-implicit Euler leads to."""
    x, v = 1.0, 0.0
    for _ in range(round(1 / timestep)):
        v += timestep * (force - 10 * x)
        x += timestep * v
    return x, v


def test_steps_are_divided_however_they_are_made(run: Run) -> None:
    def run_to_end(text: str, number: int) -> tuple[bool, Any]:
        end = "print(json.dumps([*data.qpos, *data.qvel, data.time, model.opt.timestep]))\n"
        script_run = run(f"{HEAD}data.ctrl[0] = 2\n{text}{end}", perturbation=number)
        assert script_run.trace is not None and script_run.stdout, script_run.stderr
        return script_run.trace.is_perturbed, json.loads(script_run.stdout)

    for name, text in TEN.items():
        timestep = 0.05 if "its own timestep" in name else 0.1
        for number, part in ((0, 1.0), (-1, 0.5), (-2, 0.25)):
            is_perturbed, (x, v, time, timestep_read) = run_to_end(text, number)
            assert (x, v) == pytest.approx(spring(timestep * part), rel=1e-9), (name, number)
            assert time == pytest.approx(1.0, rel=1e-12), name
            assert (timestep_read, is_perturbed) == (timestep, number < 0), name
    assert not run_to_end("mujoco.mj_forward(model, data)\n", -1)[0], "there is no step"
    many = "mujoco.mj_step(model, data, nstep=1000)\n"
    assert run_to_end(many, 0)[1][2] == run_to_end(many, -1)[1][2], "the time to the last bit"
