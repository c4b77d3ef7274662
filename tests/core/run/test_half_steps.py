"""Each step of a script is made as two of half the timestep, and the script does not notice."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from coursebuild.core.model.results import Outcome, ScriptJob, ScriptRun
from coursebuild.core.run.runner import ScriptServer

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


def test_steps_are_halved_however_they_are_made(server: ScriptServer, tmp_path: Path) -> None:
    (tmp_path / "examples").mkdir()

    def run(text: str, number: int) -> tuple[ScriptRun, Any]:
        end = "print(json.dumps([*data.qpos, *data.qvel, data.time, model.opt.timestep]))\n"
        (tmp_path / "examples/a.py").write_text(f"{HEAD}data.ctrl[0] = 2\n{text}{end}")
        job = ScriptJob("examples/a.py", (), 120.0, (), False, number)
        [done] = server.run(tmp_path, [job], parallel=1)
        assert done.outcome is Outcome.OK, done.stderr
        return done, json.loads(done.stdout)

    for name, text in TEN.items():
        timestep = 0.05 if "its own timestep" in name else 0.1
        for number, part in ((0, 1.0), (-1, 0.5)):
            done, (x, v, time, told) = run(text, number)
            assert (x, v) == pytest.approx(spring(timestep * part), rel=1e-9), (name, number)
            assert time == pytest.approx(1.0, rel=1e-12), name
            assert told == timestep, name
            assert done.trace is not None and done.trace.moved == (number < 0), name
    done, _ = run("mujoco.mj_forward(model, data)\n", -1)
    assert done.trace is not None and not done.trace.moved, "there is no step"
    done, (_, _, time, _) = run("mujoco.mj_step(model, data, nstep=1000)\nx = data.time\n", 0)
    assert run("mujoco.mj_step(model, data, nstep=1000)\n", -1)[1][2] == time, "to the last bit"
