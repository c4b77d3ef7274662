"""A controller in the loop: rate, delay, noise, and up to where it does what it does."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from msgspec.structs import replace

from mjbench.bench import CompiledModel, compile_subject, read_subject
from mjbench.cli import main
from mjbench.host import LocalHost
from mjbench.loop import Loop, read_loop
from mjbench.measured_setting import find_references
from mjbench.parts import Parts
from mjbench.pilot import run_pilot
from mjbench.problem import Array, Integrator, Scenario, Setup
from mjbench.simulation import simulate, with_integrator
from mjbench.stability import stable_rows
from mjbench.stability_runs import loop_note

CART = """<mujoco>
  <option timestep="0.01" integrator="RK4" gravity="0 0 0"/>
  <worldbody>
    <body><joint name="x" type="slide" axis="1 0 0"/><geom size=".1" mass="1"/>
      <site name="s"/></body>
  </worldbody>
  <actuator><motor joint="x" ctrlrange="-100 100" ctrllimited="true"/></actuator>
  <sensor>
    <framepos name="place" objtype="site" objname="s"/>
    <accelerometer name="shake" site="s"/>
  </sensor>
  <keyframe><key name="home" qpos="1"/></keyframe>
</mujoco>"""
STIFFNESS, DAMPING = 10.0, 2.0
POLICY = f"""
period = 0.04
calls = 0

def control(model, data):
    global calls
    calls += 1
    pushed = float(data.sensor("place").data[0])  # of this state, not of the last step
    data.qpos[:] = 7
    return [-{STIFFNESS} * pushed - {DAMPING} * data.qvel[0] + 0.01 * calls]
"""


@pytest.fixture
def model(tmp_path: Path) -> Path:
    (tmp_path / "policy.py").write_text(POLICY, "utf-8")
    path = tmp_path / "cart.xml"
    path.write_text(CART, "utf-8")
    return path


def run(loop: Loop, timestep: float) -> Array:
    cart = mujoco.MjModel.from_xml_string(CART)
    scenario = Scenario(0.4, 0.08, qpos=(1.0,), loop=loop)
    variant = with_integrator(cart, Integrator.RK4, timestep)
    states = simulate(Setup(scenario=scenario), variant).states
    return np.hstack([states.qpos, states.qvel])


def sampled(period: float, delay: float) -> Array:
    """The same motion by hand: RK4 is exact where a force is constant, and delays are periods."""
    x, v, states = 1.0, 0.0, []
    forces = [0.0] * round(delay / period)
    for number in range(round(0.4 / period)):
        forces.append(-STIFFNESS * x - DAMPING * v + 0.01 * (number + 1))
        x, v = x + period * v + period**2 / 2 * forces[number], v + period * forces[number]
        if (number + 1) * period % 0.08 < 1e-9 or (number + 1) * period % 0.08 > 0.08 - 1e-9:
            states.append((x, v))
    return np.array(states)


def test_commands_come_at_their_own_rate_and_late_at_every_timestep(model: Path) -> None:
    file = model.with_name("policy.py")
    for delay in (0.0, 0.04, 0.12):
        loop = read_loop(file, None, delay, 0.0)
        for timestep in (0.04, 0.02, 0.008, 0.005):
            label = f"{delay} s late in steps of {timestep} s"
            if timestep != 0.008:
                expected = sampled(0.04, delay)
                assert run(loop, timestep) == pytest.approx(expected, abs=1e-9), label
            assert np.array_equal(run(loop, timestep), run(loop, timestep)), label
    # Where steps are longer than the period it is asked at every step.
    fast = read_loop(file, 0.01, 0.0, 0.0)
    assert run(fast, 0.04) == pytest.approx(sampled(0.04, 0.0), abs=1e-9)
    assert run(fast, 0.01) == pytest.approx(sampled(0.01, 0.0), abs=1e-9)


def test_noise_is_the_same_at_every_timestep(model: Path) -> None:
    loop = read_loop(model.with_name("policy.py"), None, 0.0, 0.01)
    coarse, fine = run(loop, 0.04), run(loop, 0.005)
    assert coarse == pytest.approx(fine, abs=1e-9)
    assert np.abs(coarse - sampled(0.04, 0.0)).max() > 1e-3


def compiled_loop(model: Path, policy: str, scenario: str) -> CompiledModel:
    file = model.with_name("policy.py")
    file.write_text(policy, "utf-8")
    model.with_suffix(".toml").write_text(f"[[scenario]]\nname = 'a'\n{scenario}", "utf-8")
    host = LocalHost(model.parent, lambda _: None)
    loop = read_loop(file, None, 0.0, 0.0)
    return compile_subject(read_subject(model), host, quick=True, loop=loop, task="s")


@pytest.mark.long
def test_a_loop_is_stable_up_to_the_timestep_of_theory(model: Path) -> None:
    policy = f"""
period = 0.01
def control(model, data):
    return [-{STIFFNESS} * data.qpos[0] - {DAMPING} * data.qvel[0]]
"""
    scenario = "keyframe = 'home'\nduration = 16\nsample = 0.16\n"
    scenario += "timesteps = [0.01]\nsearch = [0.02, 0.64]"
    cart = compiled_loop(model, policy, scenario)
    [scene] = cart.scenarios
    assert scene.declaration.measure == "site:s"
    pilot = run_pilot(cart.model, scene)
    assert pilot.jumps == ("a controller in the loop",)
    [cone] = find_references(cart.model, pilot, quick=True).values()
    states = cone.reference.states
    parts = Parts()
    rows = stable_rows(cart.model, pilot, states, parts, quick=True)
    assert not parts.failures
    [row] = [row for row in rows if row.integrator == "RK4"]
    # Asked at every step, it loses the cart where a step multiplies what is there by more than 1.
    largest = next(h for h in np.arange(0.01, 1, 0.001) if growth(h, 0) > 1)
    assert row.theory is None and isinstance(row.largest, float)
    assert largest < row.largest < 1.25 * largest
    assert isinstance(row.near, float) and row.near < row.largest


PENDULUM = """<mujoco>
  <option timestep="0.01" integrator="RK4"/>
  <worldbody>
    <body><joint name="pin" axis="0 1 0"/>
      <inertial pos="0 0 -1" mass="1" diaginertia="1e-9 1e-9 1e-9"/><site name="s"/></body>
  </worldbody>
  <actuator><motor joint="pin"/></actuator>
  <keyframe><key name="home" qpos="0.1"/></keyframe>
</mujoco>"""


@pytest.mark.parametrize(("text", "gravity"), [(CART, 0.0), (PENDULUM, 9.81)])
def test_a_loop_that_grows_slowly_is_not_stable(model: Path, text: str, gravity: float) -> None:
    """In so short a run it stays bounded with half as much delay again."""
    model.write_text(text.replace("0.01", "0.02"), "utf-8")
    policy = "period = 0.02\ndef control(m, d):\n"
    policy += f"    return [-{STIFFNESS} * d.qpos[0] - {DAMPING} * d.qvel[0]]"
    scenario = "keyframe = 'home'\nduration = 6\nsample = 0.12\ntimesteps = [0.02]\n"
    loop = compiled_loop(model, policy, scenario)
    pilot = run_pilot(loop.model, loop.scenarios[0])
    states = simulate(pilot.setup, loop.model).states
    note = loop_note(loop.model, pilot, states)
    assert "every 0.02 s small differences stay small up to" in note
    calm = float(re.findall(r"delay of ([0-9.]+) s", note)[0])
    late = next(n for n in range(100) if growth(0.02, n, gravity) > 1)
    assert calm == pytest.approx(0.02 * (late - 1), abs=0.021)
    note = loop_note(loop.model, pilot, replace(states, qpos=states.qpos + 1.0))
    assert "the motion of small steps for the 6 s of the scenario at no delay, not even its" in note


def growth(period: float, late: int, gravity: float = 0.0) -> float:
    """The factor by which a period multiplies what grows first, with commands so many late."""
    feedback = np.array([-STIFFNESS, -DAMPING])
    matrix = np.zeros((2 + late, 2 + late))
    swing = np.array([[0, 1], [-gravity, 0]]) * period
    matrix[:2, :2] = np.eye(2) + swing + swing @ swing / 2 + swing @ swing @ swing / 6
    push = np.array([period**2 / 2, period])
    if not late:
        matrix += np.outer(push, feedback)
    else:
        matrix[:2, 2] = push
        matrix[2:-1, 3:] = np.eye(late - 1)
        matrix[-1, :2] = feedback
    return float(np.abs(np.linalg.eigvals(matrix)).max())


@pytest.mark.parametrize(
    ("policy", "arguments", "message"),
    [
        ("def control(m, d): return [0]", [], "how often is"),
        ("period = 1", [], "defines no `control(model, data)`"),
        ("period = ", [], "is no Python"),
        ("1 / 0", [], "fails: ZeroDivisionError"),
        (POLICY, ["--delay", "-1"], "a delay and a noise are 0 or more"),
        (POLICY, ["--engines"], "other engines are measured without controller, task and profile"),
        (POLICY, ["--task", "t"], "no sensor, site or body `t`"),
        (POLICY, ["--task", "shake"], "the sensor `shake` reads what commands do"),
        ("def control(m, d): return [0, 0]", ["--period", "1"], "number of commands is 1, and"),
        ("def control(m, d): d.ctrl[0] = 1", ["--period", "1"], "policy.py returns none"),
        (
            "def control(m, d): exit('no key')",
            ["--period", "1"],
            "fails at 0 s: SystemExit: no key",
        ),
        (
            "import os\ndef control(m, d): return [os.urandom(1)[0]]",
            ["--period", "0.05"],
            "policy.py commands another motion each time it is run: seed what is random in it",
        ),
        ("def control(m, d): d.body('z')", ["--period", "1"], "fails at 0 s: KeyError"),
        (
            "def control(m, d): return float('nan') if d.time else 0",
            ["--period", "1"],
            "a command is no number, or huge, before",
        ),
    ],
)
def test_mistakes_in_a_loop_are_told(
    model: Path, policy: str, arguments: list[str], message: str, capsys: Any
) -> None:
    file = model.with_name("policy.py")
    file.write_text(policy, "utf-8")
    status = main([str(model), "--quick", "--control", str(file), *arguments])
    captured = capsys.readouterr()
    assert message in " ".join(f"{captured.out} {captured.err}".split())
    assert status in (1, 2)


def test_what_a_controller_prints_is_not_in_the_report(model: Path, capsys: Any) -> None:
    policy = "print('loaded')\ndef control(m, d):\n    print('asked')\n    1 / 0"
    model.with_name("policy.py").write_text(policy, "utf-8")
    words = ["--quick", "--json", "--control", str(model.with_name("policy.py")), "--period", "1"]
    main([str(model), *words])
    captured = capsys.readouterr()
    assert "loaded\nasked\n" in captured.err and "asked" not in captured.out


def test_commands_of_a_scenario_and_a_controller_exclude_each_other(
    model: Path, capsys: Any
) -> None:
    model.with_suffix(".toml").write_text("[[scenario]]\nname = 'a'\ncontrols = [[1]]\n", "utf-8")
    assert main([str(model), "--quick", "--control", str(model.with_name("policy.py"))]) == 1
    error = capsys.readouterr().err
    assert "cart.toml: scenario.0.controls: it has commands of its own" in error
    assert main([str(model), "--quick", "--delay", "1"]) == 2
    assert "are of a controller: --control FILE" in capsys.readouterr().err
