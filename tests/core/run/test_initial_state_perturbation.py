"""Scripts run from moved initial states, and with shorter steps, and do not notice."""

from __future__ import annotations

import json
import math
import tomllib
from collections.abc import Callable, Sequence
from typing import Any

import pytest

from coursebuild.core.model.results import Outcome, ScriptRun, Trace
from support.fixture_cases import fixture_text
from support.runners import Run, both_ways

pytestmark = pytest.mark.site

HEAD = fixture_text("scripts/moved_states.txt")
SCRIPTS = tomllib.loads(fixture_text("scripts/moved_states.toml"))
SIZE = 1e-12
FORWARD = "mujoco.mj_forward(model, data)\n"
STEP = "mujoco.mj_step(model, data)\n"
PULL = "data.qpos[:] = 0.5, 0.25\n"
NEW_BODY = "model = mujoco.MjModel.from_xml_string(BODY)\ndata = mujoco.MjData(model)\n"
STATE = "tell('q', data.qpos)\ntell('v', data.qvel)\n"
ReadValues = Callable[..., dict[str, list[float]]]


@pytest.fixture
def run_perturbed(run: Run) -> Run:
    def run_script(text: str, perturbation: int = 1) -> ScriptRun:
        result = run(f"{HEAD}{text}\nprint(json.dumps(told))\n", perturbation=perturbation)
        assert result.outcome is Outcome.OK, result.stderr
        return result

    return run_script


@pytest.fixture
def read_values(run_perturbed: Run) -> ReadValues:
    def read_values(text: str, perturbation: int = 1) -> dict[str, list[float]]:
        values: Any = json.loads(run_perturbed(text, perturbation).stdout)
        return dict(values)

    return read_values


def is_moved(values: Sequence[float], *by: float) -> bool:
    """Whether values differ from what was set by as much as initial states are moved."""
    pairs = zip(values, by, strict=True)
    return all(abs(abs(value / base - 1.0) - SIZE) < SIZE / 100 for value, base in pairs)


@both_ways
def test_an_unperturbed_run_is_unchanged(read_values: ReadValues) -> None:
    text = PULL + STEP * 20 + STATE
    assert read_values(text, 0) == read_values(text, 0)
    assert read_values(text, 0) != read_values(text, 1)


DISABLE_SPRING = "model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_SPRING\n"
PERTURBED_SCRIPTS = (
    *(
        f"{PULL}mujoco.{function}(model, data)\n"
        for function in ("mj_forward", "mj_step1", "mj_kinematics", "mj_inverse", "mj_fwdPosition")
    ),
    f"{PULL}{DISABLE_SPRING}for _ in range(100):\n    mujoco.mj_step(m=model, d=data, nstep=2)\n",
    f"{STEP * 5}{PULL}data.qvel[:] = 0\n{FORWARD}",
)


def test_a_state_is_moved_once_before_anything_is_computed_from_it(read_values: ReadValues) -> None:
    for text in PERTURBED_SCRIPTS:
        assert is_moved(read_values(text + STATE)["q"], 0.5, 0.25), text


def test_runs_of_a_pair_go_in_opposite_directions(read_values: ReadValues) -> None:
    text = PULL + FORWARD + "tell('q', data.qpos - [0.5, 0.25])"
    first, second, third, fourth = (read_values(text, number)["q"] for number in (1, 2, 3, 4))
    assert first == pytest.approx([-x for x in second], rel=1e-3)
    assert third == pytest.approx([-x for x in fourth], rel=1e-3)
    assert abs(third[0]) == pytest.approx(abs(first[0]) / 2, rel=1e-3)
    assert first[0] * first[1] * third[0] * third[1] < 0, "the second pair goes another way"


def test_after_a_reset_the_state_is_moved_again_and_alike(read_values: ReadValues) -> None:
    values = read_values(SCRIPTS["after a reset"])
    assert is_moved(values["a"][::3], 0.5, 2.0)
    assert values["a"] == values["b"]


def test_velocities_and_activations(read_values: ReadValues) -> None:
    values = read_values(SCRIPTS["velocities and activations"])
    assert is_moved(values["set"], 3.0, 7.0)
    assert values["v"][0] == 0.0


def test_only_what_was_set_is_moved_again(read_values: ReadValues) -> None:
    text = PULL + STEP * 5 + "tell('kept', data.qpos)\ndata.qpos[1] = 3.0\n" + FORWARD
    values = read_values(text + STATE)
    assert values["q"][0] == values["kept"][0]
    assert is_moved(values["q"][1:], 3.0)


def test_what_is_put_back_or_copied_is_not_moved(read_values: ReadValues) -> None:
    assert read_values(SCRIPTS["put back"])["apart"] == [0.0, 0.0]
    for name in ("copy", "copied data", "copied state"):
        text = PULL + STEP * 5 + SCRIPTS[name] + STEP * 5 + "mujoco.mj_step(model, other, 5)\n"
        values = read_values(text + "tell('apart', other.qpos - data.qpos)")
        assert values["apart"] == [0.0, 0.0], name


def test_equal_states_are_moved_equally_so_that_differences_stay(read_values: ReadValues) -> None:
    text = SCRIPTS["slope and error"]
    plain, perturbed = read_values(text, 0), read_values(text, 1)
    assert perturbed["slope"] == pytest.approx(plain["slope"], rel=1e-9)
    assert perturbed["error"] == pytest.approx(plain["error"], rel=1e-10)


def test_quaternions_keep_their_length(read_values: ReadValues) -> None:
    values = read_values(NEW_BODY + SCRIPTS["quaternions"] + STATE)
    assert values["lengths"] == pytest.approx([1.0, 1.0], abs=3e-16)
    assert all(1e-13 < apart < 1e-12 for apart in values["apart"])
    assert is_moved(values["q"][2:3], 1.0)


def test_zeros_stay_but_for_trees_that_have_nothing_else(read_values: ReadValues) -> None:
    values = read_values("data.qpos[0] = 0.5\n" + FORWARD + STATE)
    assert is_moved(values["q"][:1], 0.5) and abs(values["q"][1]) == SIZE
    assert values["v"] == [0.0, 0.0]
    values = read_values("data.qvel[0] = 0.5\n" + FORWARD + STATE)
    assert values["q"][0] == 0.0 and is_moved(values["v"][:1], 0.5)
    positions = read_values(NEW_BODY + FORWARD + STATE)["q"]
    assert (positions[:2], positions[3:8]) == ([0.0] * 2, [1.0, 0.0, 0.0, 0.0, 1.0])
    assert all(abs(abs(x) - SIZE / 2) < 1e-20 for x in positions[8:11]), "the other tree rests"


def test_the_correction_of_a_rounding_is_no_initial_state(read_values: ReadValues) -> None:
    text = SCRIPTS["corrections"]
    plain, perturbed = (read_values(NEW_BODY + text + STATE, number)["q"] for number in (0, 1))
    assert perturbed == pytest.approx(plain, rel=1e-10, abs=1e-10)


def test_two_models_at_once(read_values: ReadValues) -> None:
    values = read_values(SCRIPTS["two models"])
    assert is_moved(values["q"], 0.5, 0.25, 1.0)


def test_model_time_and_forces_stay(read_values: ReadValues) -> None:
    text = SCRIPTS["forces"]
    assert read_values(text, 1) == read_values(text, 0)


def test_rollouts(read_values: ReadValues) -> None:
    values = read_values(SCRIPTS["rollouts"])
    assert values["given"] == [0.5, 0.25, 1.0, 2.0]
    assert is_moved(values["end"], *values["given"])


# --- what is noted


def trace(script_run: ScriptRun) -> Trace:
    assert script_run.trace is not None
    return script_run.trace


def test_final_states_are_noted(run_perturbed: Run) -> None:
    state_trace = trace(run_perturbed(PULL + STEP))
    assert state_trace.is_perturbed
    number, length, position, velocity, *end = state_trace.states[0].split()
    assert (number, length, len(end)) == ("0", "2", 4)
    assert is_moved([float.fromhex(position)], 0.5)
    assert float.fromhex(velocity) == pytest.approx(0.5 / 0.002), "as far in the whole time"
    empty_trace = trace(run_perturbed("tell('mass', model.body_mass)"))
    assert (empty_trace.is_perturbed, empty_trace.states) == (False, ())


def test_states_are_compared_by_the_largest_since_the_simulation_began(run_perturbed: Run) -> None:
    def sizes(text: str) -> tuple[float, float]:
        _, _, position, velocity, *_ = trace(run_perturbed(text)).states[0].split()
        return float.fromhex(position), float.fromhex(velocity)

    to_zero = "data.qpos[:] = 0.5\nwhile data.qpos[0] > 0: mujoco.mj_step(model, data)\n"
    position, velocity = sizes(to_zero)
    assert position == pytest.approx(0.5)
    assert velocity == pytest.approx(0.5 * math.sqrt(10), rel=1e-3)
    anew = "mujoco.mj_resetData(model, data)\ndata.qpos[:] = 0.001\nmujoco.mj_step(model, data)\n"
    assert sizes(to_zero + anew) == pytest.approx((0.001, 0.001 / 0.002))
    lost = "data.qpos[:] = 0.5\ndata.qvel[0] = 1e12\nmujoco.mj_step(model, data)\n"
    assert sizes(lost + to_zero)[0] < 1
    steps = "for _ in range(1000): mujoco.mj_step(model, data)\n"
    assert sizes(steps) == pytest.approx((1.0, 1 / 2.0)), "what was zero counts as of size one"
    assert sizes("data.qvel[0] = 40\n" + steps)[0] > 10
    assert sizes("data.qpos[:] = 0.01\n" + steps)[0] == pytest.approx(0.01, rel=1e-3)


SPRING_HEAD = fixture_text("scripts/spring.txt")
TEN = SCRIPTS["ten steps"]


def spring(timestep: float, force: float = 2.0) -> tuple[float, float]:
    """Where 1 s of semi-implicit Euler leads to."""
    x, v = 1.0, 0.0
    for _ in range(round(1 / timestep)):
        v += timestep * (force - 10 * x)
        x += timestep * v
    return x, v


def test_a_run_with_shifted_steps_is_ahead_of_its_clock(run: Run) -> None:
    """By a third of a timestep whenever a simulation begins; the first states are its own."""
    text = """
ends = []
for _ in range(2):
    mujoco.mj_resetData(model, data)
    data.qpos[:], data.ctrl[:] = 1, 2
    mujoco.mj_forward(model, data)
    ends += [float(data.qpos[0])]
    mujoco.mj_step(model, data, 2)
    ends += [float(data.qpos[0]), data.time, model.opt.timestep]
print(json.dumps(ends))
"""
    x, v = 1.0, 0.0
    for timestep in (0.1 / 3, 0.1, 0.1):
        v += timestep * (2 - 10 * x)
        x += timestep * v
    result = run(SPRING_HEAD + text, perturbation=-3)
    assert json.loads(result.stdout) == pytest.approx([1.0, x, 0.2, 0.1] * 2), result.stderr
    assert result.trace is not None and result.trace.is_perturbed


def test_steps_are_divided_however_they_are_made(run: Run) -> None:
    def run_to_end(text: str, number: int) -> tuple[bool, Any]:
        end = "print(json.dumps([*data.qpos, *data.qvel, data.time, model.opt.timestep]))\n"
        script_run = run(f"{SPRING_HEAD}data.ctrl[0] = 2\n{text}{end}", perturbation=number)
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
