"""No simulation of a script is lost unnoticed, and the script notices nothing of that."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from coursebuild.core.model.results import Divergence, Outcome, ScriptJob, ScriptRun, Sign
from coursebuild.core.run.runner import ScriptServer, clean_environment
from support.runners import both_ways

pytestmark = pytest.mark.site

HEAD = """\
import mujoco
XML = '''
<mujoco model="spinner">
  <worldbody><body><joint/><geom size="1" contype="0"/></body></worldbody>
</mujoco>
'''
model = mujoco.MjModel.from_xml_string(XML)
data = mujoco.MjData(model)
"""
FAST = "data.qvel[0] = 1e20\n"
STEP = "mujoco.mj_step(model, data)\n"
LINE = len(HEAD.splitlines())
WARNED = "WARNING: Nan, Inf or huge value in QVEL at DOF 0. The simulation is unstable."

FALL = """\
import mujoco
XML = '''
<mujoco model="press">
  <worldbody>
    <geom name="floor" type="plane" size="1 1 1"/>
    <body pos="0 0 0.1">
      <joint type="slide" axis="0 0 1"/>
      <geom size="0.1" mass="1"/>
    </body>
  </worldbody>
</mujoco>
'''
model = mujoco.MjModel.from_xml_string(XML)
"""
PRESS = """\
def press(data, force):
    data.qfrc_applied[0] = -force
    for _ in range(300):
        mujoco.mj_step(model, data)
"""

Run = Callable[[str], ScriptRun]


@pytest.fixture
def run(server: ScriptServer, tmp_path: Path) -> Run:
    (tmp_path / "examples").mkdir()

    def run_script(text: str) -> ScriptRun:
        (tmp_path / "examples/a.py").write_text(text)
        job = ScriptJob("examples/a.py", (), 120.0, (), False)
        [run] = server.run(tmp_path, [job], parallel=1)
        assert [path.name for path in tmp_path.iterdir()] == ["examples"], "something was left"
        return run

    return run_script


def found(run: ScriptRun) -> tuple[Divergence, ...]:
    assert run.outcome is Outcome.OK, run.stderr
    assert run.trace is not None
    return run.trace.divergences


def warned(line: int, time: str = "0.0000", model: str = "spinner") -> tuple[Divergence, ...]:
    return (Divergence(Sign.VELOCITIES, time, model, "examples/a.py", line),)


# --- what is noticed


def test_a_sound_simulation_is_not_remarked_on(run: Run) -> None:
    assert found(run(HEAD + "data.qvel[0] = 3.0\n" + STEP * 5)) == ()


@both_ways
def test_a_warning_is_noticed_with_its_line_time_and_model(run: Run) -> None:
    assert found(run(HEAD + STEP * 4 + FAST + STEP)) == warned(LINE + 6, "0.0080")


def test_a_warning_is_noticed_once_when_more_packages_were_imported_later(run: Run) -> None:
    for more in ("", "import numpy.random\n"):
        assert found(run(HEAD + more + FAST + STEP))[1:] == ()


@pytest.mark.parametrize(
    ("value", "sign"),
    [
        ("data.qpos[0] = float('nan')", Sign.POSITIONS),
        ("data.qvel[0] = float('-inf')", Sign.VELOCITIES),
        ("data.qfrc_applied[0] = 1e30", Sign.ACCELERATIONS),
    ],
)
def test_each_warning_has_its_name(run: Run, value: str, sign: Sign) -> None:
    [one] = found(run(f"{HEAD}{value}\n{STEP}"))
    assert one.sign is sign


@pytest.mark.parametrize(
    "after",
    [
        "mujoco.mj_resetData(model, data)\n",
        "data.warning[mujoco.mjtWarning.mjWARN_BADQVEL].number = 0\n",
        "data = mujoco.MjData(model)\n",
        "del data\n",
        "import os, sys; sys.stdout.flush(); os._exit(0)\n",
    ],
)
def test_what_the_script_does_afterwards_hides_nothing(run: Run, after: str) -> None:
    assert found(run(HEAD + FAST + STEP + after)) == warned(LINE + 2)


@pytest.mark.parametrize(
    "step",
    [
        "mujoco.mj_step(model, data, 10)",
        "mujoco.mj_step(model, data, nstep=3)",
        "mujoco.mj_step1(model, data); mujoco.mj_step2(model, data)",
        "model.opt.disableflags = mujoco.mjtDisableBit.mjDSBL_AUTORESET; "
        "mujoco.mj_step(model, data)",
        "from mujoco import mj_step as step; step(model, data)",
    ],
)
def test_however_it_steps(run: Run, step: str) -> None:
    assert found(run(f"{HEAD}{FAST}{step}\n")) == warned(LINE + 2)


def test_in_a_thread(run: Run) -> None:
    thread = "import threading\nt = threading.Thread(target=mujoco.mj_step, args=(model, data))\n"
    assert found(run(HEAD + FAST + thread + "t.start(); t.join()\n"))[0].sign is Sign.VELOCITIES


def test_in_the_threads_of_a_rollout(run: Run) -> None:
    rollout = """\
import numpy, threading
from mujoco import rollout
states = numpy.zeros((8, 3))
states[:, 2] = 1e20
datas = [mujoco.MjData(model) for _ in range(3)]
rollout.rollout(model, datas, states, nstep=20)
"""
    assert found(run(HEAD + rollout)) == warned(LINE + 6)


def test_in_a_process_that_is_forked(run: Run) -> None:
    fork = "import os\nif os.fork() == 0:\n    mujoco.mj_step(model, data)\n    os._exit(0)\n"
    assert found(run(HEAD + FAST + fork + "os.wait()\n")) == warned(LINE + 4)


def test_of_several_models_the_one_whose_clock_it_is(run: Run) -> None:
    other = "model = mujoco.MjModel.from_xml_string(XML.replace('spinner', 'other'))\n"
    twice = HEAD + "first = data\nmujoco.mj_step(model, first)\n" + other
    assert found(run(twice + "data = mujoco.MjData(model)\n" + FAST + STEP)) == warned(
        LINE + 6, model="other"
    )


def test_a_loop_that_diverges_often_does_not_fill_the_notes(run: Run) -> None:
    loop = "for i in range(1000):\n    mujoco.mj_resetData(model, data)\n"
    loop += "    data.time = i\n    data.qvel[0] = 1e20\n    mujoco.mj_step(model, data)\n"
    assert len(found(run(HEAD + loop))) == 16


def test_a_handler_that_nobody_knows_of_leaves_the_counter(run: Run) -> None:
    silent = """\
import ctypes
library = ctypes.PyDLL(mujoco._functions.__file__)
ignore = ctypes.CFUNCTYPE(None, ctypes.c_char_p)(lambda message: None)
pointer = ctypes.c_void_p.in_dll(library, "mju_user_warning")
pointer.value = ctypes.cast(ignore, ctypes.c_void_p).value
"""
    [one] = found(run(HEAD + silent + FAST + STEP))
    assert (one.sign, one.model, one.line) == (Sign.VELOCITIES, "spinner", 0)


def test_a_state_that_is_no_number_at_the_end(run: Run) -> None:
    text = HEAD + STEP + "data.qvel[0] = float('nan')\n"
    assert found(run(text)) == (Divergence(Sign.STATE, "0.002", "spinner", "", 0),)


def test_a_state_that_is_no_number_when_it_is_let_go(run: Run) -> None:
    text = HEAD + STEP + "data.qvel[0] = float('nan')\n" + "data = mujoco.MjData(model)\n" * 9
    assert [one.sign for one in found(run(text))] == [Sign.STATE]


def test_copies_are_looked_at_as_well(run: Run) -> None:
    text = HEAD + STEP + "import copy\nother = copy.copy(data)\nother.qpos[0] = float('inf')\n"
    assert [one.sign for one in found(run(text))] == [Sign.STATE]


@pytest.mark.parametrize(
    "imported",
    [
        "import importlib\nmujoco = importlib.import_module('mu' + 'joco')\n",
        "import importlib.util\nassert importlib.util.find_spec('mujoco')\nimport mujoco\n",
        "__import__('mujoco')\nimport sys\nmujoco = sys.modules['mu' + 'joco']\n",
    ],
)
def test_however_mujoco_is_imported(run: Run, imported: str) -> None:
    text = HEAD.replace("import mujoco\n", imported, 1) + FAST + STEP
    [one] = found(run(text))
    assert one.sign is Sign.VELOCITIES


def test_a_state_that_was_never_stepped_is_the_scripts_own(run: Run) -> None:
    assert found(run(HEAD + "data.qvel[0] = float('nan')\n")) == ()


# --- bodies deep in each other


def deep(run: ScriptRun) -> list[tuple[Sign, tuple[str, ...]]]:
    return [(one.sign, one.geoms) for one in found(run)]


SUNK = [(Sign.CONTACT, ("`floor`", "geom 1"))]


def test_a_body_that_is_pressed_into_the_floor_without_a_warning(run: Run) -> None:
    result = run(FALL + PRESS + "press(mujoco.MjData(model), 5000)\n")
    assert deep(result) == SUNK
    assert result.stderr == ""


def test_it_is_seen_though_the_script_resets_its_data(run: Run) -> None:
    after = "data = mujoco.MjData(model)\npress(data, 5000)\nmujoco.mj_resetData(model, data)\n"
    assert deep(run(FALL + PRESS + after)) == SUNK


def test_what_rests_on_the_floor_is_not_deep_in_it(run: Run) -> None:
    assert found(run(FALL + PRESS + "press(mujoco.MjData(model), 0)\n")) == ()


def test_a_thin_plate_counts_by_its_thickness(run: Run) -> None:
    plate = FALL.replace('size="0.1" mass', 'type="box" size="0.1 0.1 1e-4" mass')
    light = plate.replace('pos="0 0 0.1"', 'pos="0 0 1e-4"')
    assert deep(run(light + PRESS + "press(mujoco.MjData(model), 300)\n")) == SUNK
    assert deep(run(FALL + PRESS + "press(mujoco.MjData(model), 300)\n")) == []


def test_an_overlap_without_contact_is_the_models_own(run: Run) -> None:
    apart = FALL.replace('name="floor"', 'name="floor" contype="0" conaffinity="0"')
    assert found(run(apart + PRESS + "press(mujoco.MjData(model), 5000)\n")) == ()


# --- what the script notices


PLAIN = [
    HEAD + FAST + STEP + "print(data.qpos, data.time)\n",
    HEAD + "print(mujoco.get_mju_user_warning())\n",
    HEAD
    + "mujoco.set_mju_user_warning(lambda text: print('heard', text))\n"
    + "print(mujoco.get_mju_user_warning().__name__)\n"
    + FAST
    + STEP
    + "mujoco.set_mju_user_warning(None)\nprint(mujoco.get_mju_user_warning())\n"
    + "mujoco.mj_resetData(model, data)\n"
    + FAST
    + STEP,
    HEAD + "mujoco.set_mju_user_warning(3)\n",
    HEAD + "mujoco.MjData()\n",
    HEAD + "mujoco.mj_resetData(model)\n",
    HEAD + "print(mujoco.mj_resetData.__doc__, mujoco.MjData.__init__.__doc__)\n",
    HEAD + "import sys\nprint([m for m in sys.modules if 'course' in m], mujoco.mj_step)\n",
    HEAD + "import copy, pickle\nprint(pickle.loads(pickle.dumps(copy.deepcopy(data))).time)\n",
    HEAD
    + "def bad(text):\n    raise KeyError(text)\n"
    + "mujoco.set_mju_user_warning(bad)\n"
    + FAST
    + STEP,
]


def plain(text: str) -> str:
    """Without addresses, and without the list of native modules that a crash ends with."""
    return re.sub("0x[0-9a-f]+", "0x", re.sub("Extension modules: .*", "", text))


def test_watched_script_does_what_it_does_alone(run: Run, tmp_path: Path) -> None:
    for code in PLAIN:
        watched = run(code)
        alone = subprocess.run(
            [sys.executable, "examples/a.py"],
            cwd=tmp_path,
            env=clean_environment({}),
            capture_output=True,
            text=True,
            check=False,
        )
        assert plain(watched.stdout) == plain(alone.stdout), code
        assert plain(watched.stderr) == plain(alone.stderr), code
        assert abs(watched.status) == abs(alone.returncode), code
        (tmp_path / "MUJOCO_LOG.TXT").unlink(missing_ok=True)


def test_the_log_of_a_process_that_nobody_watches_does_not_stay(run: Run) -> None:
    text = HEAD + FAST + STEP
    start = f"import subprocess, sys\nsubprocess.run([sys.executable, '-c', {text!r}])\n"
    assert WARNED in run(start).stderr


def test_a_log_that_was_there_is_left(server: ScriptServer, tmp_path: Path) -> None:
    (tmp_path / "examples").mkdir()
    (tmp_path / "examples/a.py").write_text(HEAD + FAST + STEP)
    (tmp_path / "MUJOCO_LOG.TXT").write_text("mine\n")
    server.run(tmp_path, [ScriptJob("examples/a.py", (), 120.0, (), False)], parallel=1)
    assert (tmp_path / "MUJOCO_LOG.TXT").read_text() == "mine\n"


def test_data_that_is_let_go_is_given_back(run: Run) -> None:
    text = HEAD + (
        "import weakref\nalive = weakref.WeakSet()\n"
        "for _ in range(500):\n    one = mujoco.MjData(model)\n    alive.add(one)\n"
        "print(len(alive) < 8)\n"
        "kept = [mujoco.MjData(model) for _ in range(300)]\ndel kept\n"
        "for _ in range(500):\n    one = mujoco.MjData(model)\n    alive.add(one)\n"
        "print(len(alive) < 700)\n"
    )
    assert run(text).stdout == "True\nTrue\n"
