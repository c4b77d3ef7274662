"""Every lost simulation of a script is noticed, without any effect on the script."""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest

from coursebuild.core.model.results import Divergence, Outcome, Sign
from coursebuild.core.run.script_environment import clean_environment
from support.fixture_cases import fixture_text
from support.runners import Run, both_ways

pytestmark = pytest.mark.site

SCRIPTS = tomllib.loads(fixture_text("scripts/watched.toml"))
HEAD: str = SCRIPTS["head"]
FAST = "data.qvel[0] = 1e20\n"
STEP = "mujoco.mj_step(model, data)\n"
LINE = len(HEAD.splitlines())
WARNING_TEXT = "WARNING: Nan, Inf or huge value in QVEL at DOF 0. The simulation is unstable."
FindDivergences = Callable[[str], tuple[Divergence, ...]]


@pytest.fixture
def find_divergences(run: Run, root: Path) -> FindDivergences:
    def of_script(text: str) -> tuple[Divergence, ...]:
        result = run(text)
        assert result.outcome is Outcome.OK, result.stderr
        assert [path.name for path in root.iterdir()] == ["examples"], "something was left"
        assert result.trace is not None
        return result.trace.divergences

    return of_script


def signs(divergences: tuple[Divergence, ...]) -> list[Sign]:
    return [divergence.sign for divergence in divergences]


# --- what is noticed


@both_ways
def test_a_warning_is_noticed_with_its_line_time_and_model(
    find_divergences: FindDivergences,
) -> None:
    def warned(line: int, time: str = "0.0000") -> tuple[Divergence, ...]:
        return (Divergence(Sign.VELOCITIES, time, "spinner", "examples/x.py", LINE + line),)

    assert find_divergences(HEAD + STEP * 4 + FAST + STEP) == warned(6, "0.0080")
    assert find_divergences(HEAD + "import numpy.random\n" + FAST + STEP) == warned(3)


def test_a_warning_is_noticed_however_the_script_goes_about_it(
    find_divergences: FindDivergences,
) -> None:
    scripts = [HEAD + FAST + STEP + after for after in SCRIPTS["after"]]
    scripts += [f"{HEAD}{FAST}{step}\n" for step in SCRIPTS["steps"]]
    imports = SCRIPTS["imports"]
    scripts += [HEAD.replace("import mujoco\n", text, 1) + FAST + STEP for text in imports]
    for script in scripts:
        assert signs(find_divergences(script)) == [Sign.VELOCITIES], script


def test_a_warning_in_the_threads_of_a_rollout_has_the_line_that_began_it(
    find_divergences: FindDivergences,
) -> None:
    [divergence] = find_divergences(HEAD + SCRIPTS["rollout"])
    assert (divergence.sign, divergence.model) == (Sign.VELOCITIES, "spinner")
    assert divergence.line == LINE + 6


def test_each_warning_and_each_lost_state_has_its_name(find_divergences: FindDivergences) -> None:
    losing = "data.qvel[0] = float('nan')\n"
    for script, sign in (
        ("data.qpos[0] = float('nan')\n" + STEP, Sign.POSITIONS),
        ("data.qvel[0] = float('-inf')\n" + STEP, Sign.VELOCITIES),
        ("data.qfrc_applied[0] = 1e30\n" + STEP, Sign.ACCELERATIONS),
        (STEP + losing + "data = mujoco.MjData(model)\n" * 9, Sign.STATE),
        (STEP + "import copy\nother = copy.copy(data)\nother.qpos[0] = 1e400\n", Sign.STATE),
    ):
        assert signs(find_divergences(HEAD + script)) == [sign], script
    assert find_divergences(HEAD + STEP + losing) == (
        Divergence(Sign.STATE, "0.002", "spinner", "", 0),
    )
    for harmless in ("data.qvel[0] = 3.0\n" + STEP * 5, losing):  # a state that was never stepped
        assert find_divergences(HEAD + harmless) == ()


def test_a_warning_names_the_model_whose_clock_it_shows(find_divergences: FindDivergences) -> None:
    other_model = "model = mujoco.MjModel.from_xml_string(XML.replace('spinner', 'other'))\n"
    twice = HEAD + "first = data\nmujoco.mj_step(model, first)\n" + other_model
    [divergence] = find_divergences(twice + "data = mujoco.MjData(model)\n" + FAST + STEP)
    assert (divergence.model, divergence.line) == ("other", LINE + 6)


def test_a_loop_that_diverges_often_does_not_fill_the_notes(
    find_divergences: FindDivergences,
) -> None:
    loop = "for i in range(1000):\n    mujoco.mj_resetData(model, data)\n"
    loop += "    data.time = i\n    data.qvel[0] = 1e20\n    mujoco.mj_step(model, data)\n"
    assert len(find_divergences(HEAD + loop)) == 16


def test_with_another_handler_the_counter_is_noticed(
    find_divergences: FindDivergences,
) -> None:
    [divergence] = find_divergences(HEAD + SCRIPTS["silent"] + FAST + STEP)
    assert (divergence.sign, divergence.model, divergence.line) == (Sign.VELOCITIES, "spinner", 0)


# --- bodies deep in each other

FALL = fixture_text("scripts/press.txt")
PLATE = FALL.replace('size="0.1" mass', 'type="box" size="0.1 0.1 1e-4" mass').replace(
    'pos="0 0 0.1"', 'pos="0 0 1e-4"'
)
FALL_WITHOUT_CONTACT = FALL.replace('name="floor"', 'name="floor" contype="0" conaffinity="0"')


def test_a_body_that_is_pressed_into_another_by_half_its_thickness(
    find_divergences: FindDivergences,
) -> None:
    for text, force, is_deep in (
        (FALL, 5000, True),
        (FALL + "mujoco.mj_resetData(model, data)\n", 5000, True),
        (PLATE, 300, True),
        (FALL, 4500, False),
        (FALL, 0, False),
        (FALL_WITHOUT_CONTACT, 5000, False),  # an overlap without contact is the model's own
    ):
        deep = [
            (divergence.sign, divergence.geoms)
            for divergence in find_divergences(text.replace("{force}", str(force)))
        ]
        assert deep == ([(Sign.CONTACT, ("`floor`", "geom 1"))] if is_deep else []), force


# --- what the script notices


def plain(text: str) -> str:
    """The text without addresses, and without the list of native modules after a crash."""
    return re.sub("0x[0-9a-f]+", "0x", re.sub("Extension modules: .*", "", text))


def test_watched_script_does_what_it_does_alone(run: Run, root: Path) -> None:
    for code in (*SCRIPTS["plain"], FALL.replace("{force}", "5000")):
        watched = run(HEAD + code)
        alone = subprocess.run(
            [sys.executable, "examples/x.py"],
            cwd=root,
            env=clean_environment({}),
            capture_output=True,
            text=True,
        )
        assert plain(watched.stdout) == plain(alone.stdout), code
        assert plain(watched.stderr) == plain(alone.stderr), code
        assert abs(watched.status) == abs(alone.returncode), code
        (root / "MUJOCO_LOG.TXT").unlink(missing_ok=True)


def test_the_log_of_an_unwatched_process_is_removed_unless_it_was_there(
    run: Run, root: Path
) -> None:
    text = HEAD + FAST + STEP
    start = f"import subprocess, sys\nsubprocess.run([sys.executable, '-c', {text!r}])\n"
    assert WARNING_TEXT in run(start).stderr
    assert [path.name for path in root.iterdir()] == ["examples"]
    (root / "MUJOCO_LOG.TXT").write_text("mine\n")
    run(text)
    assert (root / "MUJOCO_LOG.TXT").read_text() == "mine\n"


def test_unused_data_is_freed(run: Run) -> None:
    text = HEAD + (
        "import weakref\nalive = weakref.WeakSet()\n"
        "for _ in range(500):\n    one = mujoco.MjData(model)\n    alive.add(one)\n"
        "print(len(alive) < 8)\n"
        "kept = [mujoco.MjData(model) for _ in range(300)]\ndel kept\n"
        "for _ in range(500):\n    one = mujoco.MjData(model)\n    alive.add(one)\n"
        "print(len(alive) < 700)\n"
    )
    assert run(text).stdout == "True\nTrue\n"
