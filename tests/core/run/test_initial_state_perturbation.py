"""Initial states, and nothing else, are moved a little, and in the same way wherever they occur."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from coursebuild.core.model.results import Outcome, ScriptJob, ScriptRun
from coursebuild.core.run.runner import ScriptServer
from support.runners import both_ways

pytestmark = pytest.mark.site

HEAD = """\
import json
import mujoco
import numpy as np

SPRING = '''
<mujoco model="spring">
  <option gravity="0 0 0"/>
  <worldbody>
    <body><joint type="slide" stiffness="10"/><geom size="0.1" mass="1"/></body>
    <body pos="1 0 0"><joint type="slide" stiffness="10"/><geom size="0.1" mass="1"/></body>
  </worldbody>
  <keyframe><key name="pulled" qpos="0.5 0" qvel="0 2"/></keyframe>
</mujoco>
'''
BODY = '''
<mujoco model="body">
  <worldbody>
    <body pos="0 0 1"><freejoint/><geom type="box" size="0.1 0.2 0.3"/></body>
    <body pos="5 0 1"><joint type="ball"/><geom size="0.1" pos="0.2 0 0"/></body>
  </worldbody>
</mujoco>
'''
told = {}

def tell(name, values):
    told[name] = np.asarray(values, float).ravel().tolist()

model = mujoco.MjModel.from_xml_string(SPRING)
data = mujoco.MjData(model)
"""
SIZE = 1e-12
Told = Callable[..., dict[str, list[float]]]


@pytest.fixture
def run(server: ScriptServer, tmp_path: Path) -> Callable[..., ScriptRun]:
    (tmp_path / "examples").mkdir()

    def run_script(text: str, perturbation: int) -> ScriptRun:
        whole = f"{HEAD}{text}\nprint(json.dumps(told))\n"
        (tmp_path / "examples/a.py").write_text(whole)
        job = ScriptJob("examples/a.py", (), 120.0, (), False, perturbation)
        [run] = server.run(tmp_path, [job], parallel=1)
        assert run.outcome is Outcome.OK, run.stderr
        return run

    return run_script


@pytest.fixture
def told(run: Callable[..., ScriptRun]) -> Told:
    def told(text: str, perturbation: int = 1) -> dict[str, list[float]]:
        values: Any = json.loads(run(text, perturbation).stdout)
        return dict(values)

    return told


def moved(value: float, by: float) -> bool:
    """Whether a value is as far from 1 as initial states are moved."""
    return abs(abs(value / by - 1.0) - SIZE) < SIZE / 100


FORWARD = "mujoco.mj_forward(model, data)\n"
STEP = "mujoco.mj_step(model, data)\n"
PULL = "data.qpos[:] = 0.5, 0.25\n"


@both_ways
def test_an_ordinary_run_is_as_ever(told: Told) -> None:
    text = PULL + STEP * 20 + "tell('q', data.qpos)"
    assert told(text, 0) == told(text, 0)
    assert told(text, 0) != told(text, 1)


def test_a_state_is_moved_before_anything_is_computed_from_it(told: Told) -> None:
    for function in ("mj_forward", "mj_step1", "mj_kinematics", "mj_inverse", "mj_fwdPosition"):
        found = told(f"{PULL}mujoco.{function}(model, data)\ntell('q', data.qpos)")
        assert moved(found["q"][0], 0.5), function
        assert moved(found["q"][1], 0.25), function


def test_by_keyword_too_and_only_once(told: Told) -> None:
    text = PULL + "model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_SPRING\n"
    text += "for _ in range(100):\n    mujoco.mj_step(m=model, d=data, nstep=2)\n"
    text += "tell('q', data.qpos)"
    found = told(text)
    assert moved(found["q"][0], 0.5)
    assert moved(found["q"][1], 0.25)


def test_runs_of_a_pair_go_in_opposite_directions(told: Told) -> None:
    text = PULL + FORWARD + "tell('q', data.qpos - [0.5, 0.25])"
    one, two, three, four = (told(text, number)["q"] for number in (1, 2, 3, 4))
    assert one == pytest.approx([-x for x in two], rel=1e-3)
    assert three == pytest.approx([-x for x in four], rel=1e-3)
    assert abs(three[0]) == pytest.approx(abs(one[0]) / 2, rel=1e-3)
    assert one[0] * one[1] * three[0] * three[1] < 0, "the second pair goes another way"


def test_after_a_reset_the_state_is_moved_again_and_alike(told: Told) -> None:
    text = "for name in 'ab':\n"
    text += "    mujoco.mj_resetDataKeyframe(model, data, 0)\n    mujoco.mj_forward(model, data)\n"
    text += "    tell(name, [*data.qpos, *data.qvel])\n    mujoco.mj_step(model, data, 10)\n"
    found = told(text)
    assert moved(found["a"][0], 0.5)
    assert moved(found["a"][3], 2.0)
    assert found["a"] == found["b"]


def test_velocities_and_activations(told: Told) -> None:
    text = """
xml = SPRING.replace("<keyframe>", "<actuator><general joint='j' dyntype='filter' dynprm='1'/>"
                     "</actuator><keyframe>").replace('type="slide"', 'name="j" type="slide"', 1)
xml = xml[:xml.index("<keyframe>")] + "</mujoco>"
model = mujoco.MjModel.from_xml_string(xml)
data = mujoco.MjData(model)
data.act[0] = 3.0
data.qvel[1] = 7.0
mujoco.mj_forward(model, data)
tell("act", data.act)
tell("v", data.qvel)
"""
    found = told(text)
    assert moved(found["act"][0], 3.0)
    assert moved(found["v"][1], 7.0)
    assert found["v"][0] == 0.0


def test_a_state_that_is_set_after_some_steps(told: Told) -> None:
    text = STEP * 5 + PULL + "data.qvel[:] = 0\n" + FORWARD + "tell('q', data.qpos)"
    found = told(text)
    assert moved(found["q"][0], 0.5)
    assert moved(found["q"][1], 0.25)


def test_only_what_was_set_is_moved_again(told: Told) -> None:
    text = PULL + STEP * 5 + "kept = data.qpos[0]\ndata.qpos[1] = 3.0\n" + FORWARD
    found = told(text + "tell('q', data.qpos)\ntell('kept', kept)")
    assert found["q"][0] == found["kept"][0]
    assert moved(found["q"][1], 3.0)


def test_what_is_put_back_is_not_moved(told: Told) -> None:
    text = PULL + STEP * 5 + "q, v, t = data.qpos.copy(), data.qvel.copy(), data.time\n" + STEP * 5
    text += "after = data.qpos.copy()\ndata.qpos[:], data.qvel[:], data.time = q, v, t\n" + STEP * 5
    found = told(text + "tell('apart', data.qpos - after)")
    assert found["apart"] == [0.0, 0.0]


@pytest.mark.parametrize(
    "copied",
    [
        "import copy\nother = copy.copy(data)",
        "other = mujoco.MjData(model)\nmujoco.mj_copyData(other, model, data)",
        "spec = mujoco.mjtState.mjSTATE_INTEGRATION\n"
        "state = np.empty(mujoco.mj_stateSize(model, spec))\n"
        "mujoco.mj_getState(model, data, state, spec)\n"
        "other = mujoco.MjData(model)\nmujoco.mj_setState(model, other, state, spec)",
    ],
)
def test_a_copy_goes_on_as_the_original_does(told: Told, copied: str) -> None:
    text = PULL + STEP * 5 + copied + "\n" + STEP * 5
    text += "mujoco.mj_step(model, other, 5)\ntell('apart', other.qpos - data.qpos)"
    assert told(text)["apart"] == [0.0, 0.0]


def test_equal_states_are_moved_equally_so_that_differences_stay(told: Told) -> None:
    text = """
def end(offset, timestep):
    model.opt.timestep = timestep
    data = mujoco.MjData(model)
    data.qpos[:] = 0.5 + offset, 0.25
    while data.time < 0.999:
        mujoco.mj_step(model, data)
    return data.qpos[0]

tell("slope", (end(1e-6, 1e-3) - end(-1e-6, 1e-3)) / 2e-6)
tell("error", end(0, 1e-3) - end(0, 1e-4))
"""
    plain, other = told(text, 0), told(text, 1)
    assert other["slope"] == pytest.approx(plain["slope"], rel=1e-9)
    assert other["error"] == pytest.approx(plain["error"], rel=1e-10)


def test_quaternions_keep_their_length(told: Told) -> None:
    text = """
model = mujoco.MjModel.from_xml_string(BODY)
data = mujoco.MjData(model)
data.qpos[3:7] = 0.5, 0.5, -0.5, 0.5
data.qpos[7:11] = np.array([1, 2, 3, 4]) / np.sqrt(30)
before = data.qpos.copy()
mujoco.mj_forward(model, data)
tell("lengths", [np.linalg.norm(data.qpos[at:at + 4]) for at in (3, 7)])
tell("apart", [np.abs(data.qpos - before)[at:at + 4].max() for at in (3, 7)])
tell("z", data.qpos[2])
"""
    found = told(text)
    assert found["lengths"] == pytest.approx([1.0, 1.0], abs=3e-16)
    assert all(1e-13 < apart < 1e-12 for apart in found["apart"])
    assert moved(found["z"][0], 1.0)


def test_a_quaternion_that_is_not_turned_stays_so_where_something_else_moves(told: Told) -> None:
    text = "model = mujoco.MjModel.from_xml_string(BODY)\ndata = mujoco.MjData(model)\n"
    found = told(text + FORWARD + "tell('q', data.qpos)")["q"]
    assert found[3:7] == [1.0, 0.0, 0.0, 0.0]
    assert found[:2] == [0.0, 0.0]
    assert found[7] == 1.0
    assert all(abs(abs(x) - SIZE / 2) < 1e-20 for x in found[8:11]), "the other tree rests"


def test_zeros_stay_but_for_trees_that_have_nothing_else(told: Told) -> None:
    text = "data.qpos[0] = 0.5\n" + FORWARD + "tell('q', data.qpos)\ntell('v', data.qvel)"
    found = told(text)
    assert moved(found["q"][0], 0.5)
    assert abs(found["q"][1]) == SIZE
    assert found["v"] == [0.0, 0.0]
    text = "data.qvel[0] = 0.5\n" + FORWARD + "tell('q', data.qpos)\ntell('v', data.qvel)"
    found = told(text)
    assert found["q"][0] == 0.0
    assert moved(found["v"][0], 0.5)


def test_the_correction_of_a_rounding_is_no_initial_state(told: Told) -> None:
    text = """
model = mujoco.MjModel.from_xml_string(BODY)
data = mujoco.MjData(model)
data.qvel[3:6] = 1, 2, 3
for _ in range(1000):
    mujoco.mj_step(model, data)
    data.qpos[3:7] /= np.linalg.norm(data.qpos[3:7]) * (1 + 1e-15)
tell("q", data.qpos)
"""
    plain, other = told(text, 0)["q"], told(text, 1)["q"]
    assert other == pytest.approx(plain, rel=1e-10, abs=1e-10)


def test_two_models_at_once(told: Told) -> None:
    text = """
other = mujoco.MjModel.from_xml_string(BODY)
second = mujoco.MjData(other)
data.qpos[:] = 0.5, 0.25
mujoco.mj_step1(model, data)
mujoco.mj_step1(other, second)
tell("q", data.qpos)
tell("z", second.qpos[2])
mujoco.mj_step2(model, data)
mujoco.mj_step2(other, second)
"""
    found = told(text)
    assert moved(found["q"][0], 0.5)
    assert moved(found["z"][0], 1.0)


def test_the_model_the_time_and_what_drives_stay(told: Told) -> None:
    text = PULL + "data.time = 3.0\ndata.qfrc_applied[0] = 5.0\ndata.xfrc_applied[1, 0] = 2.0\n"
    text += FORWARD + "tell('t', data.time)\ntell('f', data.qfrc_applied)\n"
    text += "tell('x', data.xfrc_applied)\ntell('sizes', model.geom_size)\n"
    text += "tell('mass', model.body_mass)\ntell('qpos0', model.qpos0)\ntell('key', model.key_qpos)"
    assert told(text, 1) == told(text, 0)


def test_rollouts(told: Told) -> None:
    text = """
from mujoco import rollout
states = np.zeros((2, mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS)))
states[:, 1:3] = (0.5, 0.25), (1.0, 2.0)
model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_SPRING
end, _ = rollout.rollout(model, data, states, nstep=3)
tell("given", states[:, 1:3])
tell("end", end[:, -1, 1:3])
"""
    found = told(text)
    assert found["given"] == [0.5, 0.25, 1.0, 2.0]
    assert all(moved(a, b) for a, b in zip(found["end"], found["given"], strict=True))


def test_what_became_of_the_states_is_noted(run: Callable[..., ScriptRun]) -> None:
    trace = run(PULL + STEP, 1).trace
    assert trace is not None
    assert trace.moved
    [state] = trace.states
    number, length, position, velocity, *end = state.split()
    assert (number, length, len(end)) == ("0", "2", 4)
    assert moved(float.fromhex(position), 0.5)
    assert float.fromhex(velocity) == pytest.approx(0.5 / 0.002), "as far in the whole time"


def sizes(run: Callable[..., ScriptRun], text: str) -> tuple[float, float]:
    trace = run(text, 1).trace
    assert trace is not None
    _, _, position, velocity, *_ = trace.states[0].split()
    return float.fromhex(position), float.fromhex(velocity)


def test_states_are_compared_by_the_largest_since_the_simulation_began(
    run: Callable[..., ScriptRun],
) -> None:
    to_zero = "data.qpos[:] = 0.5\nwhile data.qpos[0] > 0: mujoco.mj_step(model, data)\n"
    position, velocity = sizes(run, to_zero)
    assert position == pytest.approx(0.5)
    assert velocity == pytest.approx(0.5 * math.sqrt(10), rel=1e-3)
    anew = "mujoco.mj_resetData(model, data)\ndata.qpos[:] = 0.001\nmujoco.mj_step(model, data)\n"
    position, velocity = sizes(run, to_zero + anew)
    assert (position, velocity) == pytest.approx((0.001, 0.001 / 0.002))
    lost = "data.qpos[:] = 0.5\ndata.qvel[0] = 1e12\nmujoco.mj_step(model, data)\n"
    assert sizes(run, lost + to_zero)[0] < 1


def test_what_was_moved_from_zero_is_of_size_one_at_least(run: Callable[..., ScriptRun]) -> None:
    steps = "for _ in range(1000): mujoco.mj_step(model, data)\n"
    assert sizes(run, steps) == pytest.approx((1.0, 1 / 2.0))
    assert sizes(run, "data.qvel[0] = 40\n" + steps)[0] > 10
    assert sizes(run, "data.qpos[:] = 0.01\n" + steps)[0] == pytest.approx(0.01, rel=1e-3)


def test_without_a_simulation_nothing_is_moved(run: Callable[..., ScriptRun]) -> None:
    trace = run("tell('mass', model.body_mass)", 1).trace
    assert trace is not None
    assert not trace.moved
    assert trace.states == ()
