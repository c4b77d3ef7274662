"""When labs are tried, what is stored of a trial, and what runs at the same time."""

from __future__ import annotations

import json
import os
import resource
import shutil
import signal
import subprocess
import zlib
from collections import Counter
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from coursebuild.core.engine.store import Store
from coursebuild.core.features import TrialContext
from coursebuild.core.files.errors import EffectError
from coursebuild.core.files.trust import seal, store_key, unseal
from coursebuild.core.run.mjcf import compile_all
from coursebuild.core.run.run_store import RunStore
from coursebuild.features.lab.engines.browser import LabEngine
from coursebuild.features.lab.engines.native import NativeEngine, NativeError
from coursebuild.features.lab.model import LabCode, lab_trials
from coursebuild.features.lab.reply import LabOutput
from coursebuild.features.lab.trial import Engines, LabTrials
from coursebuild.pipeline.load import load_course
from coursebuild.pipeline.options import Options
from support.lab_lessons import BALL, course, fence, run_check
from support.lab_values import OpenEngines, try_labs
from support.made_courses import make_course
from support.poisoned_values import mutations
from support.scratch_course import Folder, block, kill_at_end, wait_until_alone
from support.waiting import wait_until

pytestmark = pytest.mark.engine

LAB = """{"title": "T", "model": "ball", "height": 80, "setup": "ctx.a = 1",
 "controls": [{"label": "s", "min": 0, "max": 1, "value": 0.5, "param": "p"}],
 "readouts": [{"label": "r", "expr": "ctx.a"}], "verify": {"seconds": 0.2}}"""


def are_cached(folder: Folder) -> list[bool]:
    """Whether each lab was taken from the store; `--shard` makes the command look at the labs."""
    return [lab["cached"] for lab in run_check(folder, "--shard", "1/1", status=0)["labs"]]


@pytest.fixture(scope="module")
def tried_course(tmp_path_factory: pytest.TempPathFactory, stores: Path) -> Folder:
    """A course with a lab whose trial is stored, and whose model includes another file."""
    root = tmp_path_factory.mktemp("kept") / "course"
    folder = course(root, stores, "## A lab\n\n" + fence(LAB))
    include = '<include file="part.xml"/><worldbody>'
    folder.write("models/ball.xml", BALL.replace("<worldbody>", include))
    # With a light there is no floor to draw, which takes longest.
    part = '<mujoco><worldbody><light pos="0 0 3"/></worldbody></mujoco>'
    folder.write("models/part.xml", part)
    assert are_cached(folder) == [False]
    return folder


def test_lab_is_tried_again_after_an_edit_of_its_model_or_damage_of_what_is_kept(
    tried_course: Folder,
) -> None:
    tried_course.replace("models/ball.xml", 'mass="1"', 'mass="2"')
    assert are_cached(tried_course) == [False]
    for kind in ("labs", "mjb"):
        for entry in (tried_course.root / ".coursebuild" / kind).iterdir():
            entry.write_bytes(entry.read_bytes()[:-1])
    assert are_cached(tried_course) == [False]
    assert are_cached(tried_course) == [True]


class NoBrowser(LabEngine):
    """An engine that must not be needed to try the lab."""

    def check_code(self, pieces: Sequence[LabCode]) -> list[str | None]:
        raise MissedError


class NoNative(NativeEngine):
    """An engine that runs no script."""

    def script(self, request: dict[str, Any]) -> dict[str, Any]:
        raise NativeError("is not run")


class MissedError(Exception):
    pass


@pytest.mark.long
@pytest.mark.filterwarnings("ignore:.* encountered:RuntimeWarning")
@pytest.mark.parametrize("count", [15, pytest.param(500, marks=pytest.mark.slow)])
def test_poisoned_trials_are_one_that_can_be_shown_or_told(
    tried_course: Folder, count: int
) -> None:
    """A stored reply is used as a whole, for its page, or the lab is tried again.

    A sound reply gives a page with a script, and starts no engine.
    """
    shutil.rmtree(tried_course.root / ".coursebuild/labs")
    assert are_cached(tried_course) == [False]
    (entry,) = (tried_course.root / ".coursebuild/labs").iterdir()
    name = f"labs/{entry.name}"
    sound = entry.read_bytes()
    key = store_key(str(tried_course.root))
    reply = unseal(name, sound, key)
    assert reply is not None
    course, ball = load_course(tried_course.root), tried_course.text("models/ball.xml")
    models = {"ball": compile_all(tried_course.root, [("models/ball.xml", ball)])[0]}
    engines = Engines(tried_course.root)
    engines.browser, engines.native = NoBrowser(), NoNative(tried_course.root)
    messages: list[str] = []
    outcomes = Counter[str]()
    bombs = (zlib.compress(data, 1) for data in (b" " * (1 + (1 << 28)), b"[" * 100_000))
    text = zlib.decompress(reply)
    without_main = json.dumps({**json.loads(text), "main": None}).encode()
    texts = map(zlib.compress, (text[:-1], without_main, *mutations(text, count)))
    for data in (reply, *bombs, *texts):
        entry.write_bytes(seal(name, data, key))
        shutil.rmtree(tried_course.root / ".coursebuild/pictures", ignore_errors=True)
        run_store = RunStore(tried_course.root, Store(tried_course.root))
        messages.clear()
        run_store.store.listen(messages.append)
        context = TrialContext(tried_course.root, course, models, run_store, static=True)
        try:
            ((result,), diagnostics) = LabTrials(context, engines).run(lab_trials(course))
        except MissedError:
            assert not messages
            outcomes["missed"] += 1
        else:
            assert isinstance(result.output, LabOutput)
            assert not messages and result.output.config
            assert diagnostics or result.output.picture.startswith(b"\x89PNG")
            assert data is not reply or result.output.script
            outcomes["shown"] += 1
    assert min(outcomes.values()) > count / 20, outcomes
    entry.write_bytes(sound)


def test_failure_of_a_lab_is_kept_and_one_that_took_too_long_is_not(tmp_path: Path) -> None:
    """The first lab throws; the second takes longer than it may at first."""
    lab = '{{"model": "ball", "verify": {{"seconds": {}}}, "setup": "{}"}}'
    fences = fence(lab.format(0.1, "null.x")) + fence(lab.format(500, ""))
    course = make_course(fences, models={"ball": BALL})
    models = {"ball": compile_all(tmp_path, [("models/ball.xml", BALL)])[0]}
    options = Options(tmp_path, 1, Store(tmp_path))
    outcomes = []
    with closing(OpenEngines(tmp_path)) as engines:
        for seconds in (0.2, 60.0):
            results, diagnostics = try_labs(course, options, engines, models, seconds=seconds)
            rules = [diagnostic.rule for diagnostic in diagnostics]
            outcomes.append((rules, [result.line.cached for result in results]))
    assert outcomes == [
        (["lab-throws", "lab-timeout"], [False, False]),
        (["lab-throws"], [True, False]),
    ]


# --- labs are tried in a thread while scripts run


def test_error_in_a_trial_ends_the_command_and_hangs_nothing(
    tmp_path: Path, stores: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = course(tmp_path / "course", stores, "## A\n\n" + fence(LAB))
    error: Exception = EffectError("MuJoCo cannot be loaded: no library x")

    def fail(*_: object) -> None:
        raise error

    monkeypatch.setattr(NativeEngine, "save", fail)
    check = folder.main("check")
    assert check.status == 1
    assert "coursebuild: MuJoCo cannot be loaded: no library x" in check.err
    wait_until_alone(folder)
    error = ZeroDivisionError()  # a mistake of the tool's own
    with pytest.raises(ZeroDivisionError):
        folder.main("check")
    wait_until_alone(folder)


def native_processes() -> list[int]:
    ids = []
    for file in Path(f"/proc/{os.getpid()}/task").glob("*/children"):
        for child in file.read_text().split():
            if b"native_worker" in Path(f"/proc/{child}/cmdline").read_bytes():
                ids.append(int(child))
    return ids


def test_native_mujoco_that_dies_is_told_at_the_lab(
    tmp_path: Path, stores: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    original, earlier_processes = NativeEngine.parity, {*native_processes()}

    def kill_and_compare(engine: NativeEngine, *arguments: Any) -> Any:
        (process,) = {*native_processes()} - earlier_processes
        os.kill(process, signal.SIGKILL)
        return original(engine, *arguments)

    monkeypatch.setattr(NativeEngine, "parity", kill_and_compare)
    folder = course(tmp_path / "course", stores, "## A\n\n" + fence(LAB))
    (diagnostic,) = run_check(folder, status=1)["diagnostics"]
    assert (diagnostic["rule"], diagnostic["line"]) == ("lab-engine", 3)
    assert diagnostic["message"] == "native MuJoCo crashed (SIGKILL)"
    monkeypatch.undo()
    assert are_cached(folder) == [False]


@pytest.mark.parametrize(
    ("number", "status", "running"), [(signal.SIGINT, 130, "lab"), (signal.SIGTERM, 143, "script")]
)
def test_signal_ends_labs_and_scripts_at_once_and_leaves_nothing(
    tmp_path: Path, stores: Path, number: int, status: int, running: str
) -> None:
    """The code of the second lab never returns; its time is over after a minute."""
    script = "from pathlib import Path\nPath('running').touch()\n"
    script += "import time\ntime.sleep(600)\n" if running == "script" else ""
    fine = '{"model": "ball", "verify": {"seconds": 0.1}}'
    endless = '{"model": "ball", "controller": "for (;;) ;"}'
    lesson = "## A\n\n" + block("a.py", script, info="timeout=600") + fence(fine) + fence(endless)
    folder = course(tmp_path / "course", stores, lesson)
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    pipes = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    with kill_at_end(folder.start("check", "1.2", **pipes)) as process:
        wait_until(lambda: (folder.root / "running").exists() and kept_trials(folder), "the loop")
        os.kill(process.pid, number)
        assert process.wait(600) == status
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    assert after.ru_utime - before.ru_utime < 45, "it waited until the lab's time was over"
    wait_until_alone(folder)
    assert list(folder.tmp.iterdir()) == []


def kept_trials(folder: Folder) -> bool:
    return any((folder.root / ".coursebuild" / "labs").glob("*"))
