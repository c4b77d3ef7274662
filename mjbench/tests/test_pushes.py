"""Forces on bodies, poses of mocap bodies and activations, as a scenario declares them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from mjbench.cli import main
from mjbench.costs import inputs_of, scenario_job
from mjbench.integrate import dop853, forward_states
from mjbench.problem import Setup
from mjbench.scene import Scene, SceneError, scenes
from mjbench.simulation import initial_data, simulate
from samples.surveys import parse_declared

PUCK = """\
<mujoco>
  <option timestep="0.01" gravity="0 0 0"/>
  <worldbody>
    <body name="target" mocap="true" pos="0 1 0"/>
    <body name="hand" mocap="true"/>
    <body name="puck">
      <joint name="x" type="slide" axis="1 0 0"/><joint name="turn" axis="0 0 1"/>
      <geom name="disc" type="box" size=".1 .1 .1" mass="2" contype="0" conaffinity="0"/>
    </body>
  </worldbody>
  <actuator>
    <motor name="m" joint="turn"/>
    <general name="lag" joint="turn" dyntype="filter" dynprm="0.5" gainprm="0"/>
  </actuator>
</mujoco>
"""
BEGIN = '[[scenario]]\nname = "s"\nduration = 1\n'
PUSH = 'push = [{ body = "puck", at = 0.2, duration = 0.1, force = [10, 0, 0] }]\n'


def scene_of(text: str) -> tuple[Any, Scene]:
    model = mujoco.MjModel.from_xml_string(PUCK)
    (scene,) = scenes(model, parse_declared(BEGIN + text))
    return model, scene


def test_a_push_gives_its_impulse_in_the_reference_and_in_the_engine() -> None:
    model, scene = scene_of(PUSH)
    exact_end = 0.5 * 0.1 / 2 + 0.5 * 0.7  # 10 N on 2 kg for 0.1 s: 0.5 m/s
    reference = forward_states(model, scene.scenario, scene.scenario.times, dop853)
    assert reference.qpos[-1, 0] == pytest.approx(exact_end, abs=1e-9)
    run = simulate(Setup(scenario=scene.scenario), model)
    assert run.states.qvel[-1, 0] == pytest.approx(0.5, abs=1e-12)
    before = run.states.times <= 0.2 + 1e-9
    assert not run.states.qpos[before].any(), "it rests before the push"
    # Semi-implicit Euler moves half a step further: g h t / 2 with the speed that it gains.
    assert run.states.qpos[-1, 0] - exact_end == pytest.approx(0.5 * 0.01 / 2, abs=1e-9)


def test_pushes_of_one_body_add_up_and_torques_turn() -> None:
    two = 'push = [{ body = "puck", at = 0, duration = 0.5, torque = [0, 0, 0.1] },\n'
    two += '{ body = "puck", at = 0.25, duration = 0.5, torque = [0, 0, 0.1] }]\n'
    model, scene = scene_of(two)
    assert scene.scenario.hold == 0.25
    run = simulate(Setup(scenario=scene.scenario), model)
    inertia = 2 * (0.2**2 + 0.2**2) / 12
    assert run.states.qvel[-1, 1] == pytest.approx(0.1 / inertia, rel=1e-9)


def test_commands_hold_as_long_as_without_a_push() -> None:
    commands = "controls = [[1, 0], [2, 0], [3, 0]]\nhold = 0.25\n"
    model, scene = scene_of(commands + PUSH)
    assert scene.scenario.hold == pytest.approx(0.05)
    rows = [inputs.controls[0] for inputs in scene.scenario.inputs(0.01)]
    assert rows == [1.0] * 25 + [2.0] * 25 + [3.0] * 50, "the last to the end"
    body = int(model.body("puck").id)
    data, pushed = mujoco.MjData(model), []
    for number, inputs in enumerate(scene.scenario.inputs(0.01)):
        inputs.give(data)
        pushed += [number] if data.xfrc_applied[body, 0] else []
    assert pushed == list(range(20, 30))


def test_what_is_timed_is_pushed_too() -> None:
    model, scene = scene_of(PUSH)
    assert sum(steps for _, steps in inputs_of(model, scene.scenario, 0.01)) == 100
    times: list[float] = []
    mujoco.set_mjcb_control(lambda _, data: times.append(float(data.xfrc_applied.max())))
    try:
        scenario_job(model, [scene.scenario], 0.01)()
    finally:
        mujoco.set_mjcb_control(None)
    assert [n for n, force in enumerate(times) if force] == list(range(20, 30))


def test_poses_follow_each_other_and_others_stay() -> None:
    poses = "hold = 0.5\n[scenario.poses]\nhand = [[1, 0, 0, 2, 0, 0, 0], [0, 0, 3, 1, 0, 0, 0]]\n"
    model, scene = scene_of(poses)
    data = initial_data(scene.scenario, model)
    hand, target = (model.body(name).mocapid[0] for name in ("hand", "target"))
    assert data.mocap_pos[hand].tolist() == [1, 0, 0]
    assert data.mocap_quat[hand].tolist() == [1, 0, 0, 0], "lengths of quaternions are mended"
    rows = list(scene.scenario.inputs(0.01))
    rows[49].give(data)
    assert data.mocap_pos[hand].tolist() == [1, 0, 0]
    rows[50].give(data)
    assert data.mocap_pos[hand].tolist() == [0, 0, 3]
    assert data.mocap_pos[target].tolist() == [0, 1, 0]


def test_activations_begin_as_they_are_declared() -> None:
    model, scene = scene_of("act = [0.8]\n")
    states = forward_states(model, scene.scenario, scene.scenario.times, dop853)
    assert states.act[-1, 0] == pytest.approx(0.8 * np.exp(-1 / 0.5), rel=1e-9)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (PUSH.replace("puck", "pluck"), "the model has no body `pluck`"),
        (PUSH.replace("0.2", "0.203"), "a time of `push`, 0.203 s, is no multiple of the timestep"),
        ("sample = 0.05\n" + PUSH.replace("0.1", "0.02"), "is no multiple of the `sample`"),
        ("act = [1, 2]\n", "`act` has 2 numbers, and the model takes 1"),
        ("[scenario.poses]\npuck = [[0, 0, 0, 1, 0, 0, 0]]\n", "`puck` is no mocap body"),
        (
            "[scenario.poses]\nhand = [[0, 0, 0, 1, 0, 0, 0], [1, 0, 0, 1, 0, 0, 0]]\n",
            "`hold` is missing",
        ),
    ],
)
def test_what_does_not_fit_the_model_is_told(text: str, message: str) -> None:
    with pytest.raises(SceneError) as caught:
        scene_of(text)
    assert message in caught.value.message


@pytest.fixture
def puck(tmp_path: Path) -> Path:
    file = tmp_path / "puck.xml"
    file.write_text(PUCK)
    file.with_suffix(".toml").write_text(BEGIN + PUSH)
    return file


def test_a_controller_is_pushed_and_still_commands(puck: Path) -> None:
    from mjbench.bench import compile_subject, read_subject
    from mjbench.host import LocalHost
    from mjbench.loop import read_loop

    policy = puck.with_name("policy.py")
    policy.write_text(
        "period = 0.02\ndef control(model, data):\n    return [1 - data.qvel[1], 0]\n"
    )
    loop = read_loop(policy, None, 0.0, 0.0)
    host = LocalHost(puck.parent, lambda _: None)
    compiled_model = compile_subject(read_subject(puck), host, quick=True, loop=loop)
    scenario = compiled_model.scenarios[0].scenario
    run = simulate(Setup(scenario=scenario), compiled_model.model)
    assert run.states.qvel[-1, 0] == pytest.approx(0.5, abs=1e-12), "pushed"
    assert run.states.qvel[-1, 1] == pytest.approx(1.0, abs=1e-3), "and turned by the controller"
    holds = inputs_of(compiled_model.model, scenario, 0.01)
    assert sum(steps for _, steps in holds) == 100
    assert any(inputs.controls[0] and any(inputs.forces) for inputs, _ in holds)


def test_who_does_not_know_pushes_says_so(puck: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["diet", str(puck), "--quick"]) == 1
    assert "the diet does not know what pushes and poses need" in capsys.readouterr().err
    assert main([str(puck), "--engines", "mujoco", "--quick"]) in (1, 2)
    assert "without pushes and poses" in capsys.readouterr().err
