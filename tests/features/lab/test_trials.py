"""When labs are tried: what is kept of a trial, and what runs beside it."""

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

from coursebuild.core.engine.memo import Memo, sealed, unsealed
from coursebuild.core.features import TrialContext
from coursebuild.core.files.errors import EffectError
from coursebuild.core.run.memory import Memory
from coursebuild.core.run.mjcf import compile_all
from coursebuild.features.lab.compile import LabCode
from coursebuild.features.lab.engines.browser import LabEngine
from coursebuild.features.lab.engines.native import NativeEngine, NativeError
from coursebuild.features.lab.files import LabOutput
from coursebuild.features.lab.inputs import lab_trials
from coursebuild.features.lab.trial import Engines, LabTrials
from coursebuild.pipeline.load import load_course
from coursebuild.pipeline.options import Options
from support.lab_lessons import BALL, checked, course, fence
from support.lab_values import OpenEngines, try_labs
from support.made_courses import make_course
from support.poisoned_values import poisoned
from support.scratch_course import Folder, block, ended, wait_until_alone
from support.waiting import wait_until

pytestmark = pytest.mark.engine

LAB = """{"title": "T", "model": "ball", "height": 80, "setup": "ctx.a = 1",
 "controls": [{"label": "s", "min": 0, "max": 1, "value": 0.5, "param": "p"}],
 "readouts": [{"label": "r", "expr": "ctx.a"}], "verify": {"seconds": 0.2}}"""


def cached(folder: Folder) -> list[bool]:
    """Of each lab: whether it was not tried again; in parts, so that the labs are looked at."""
    return [lab["cached"] for lab in checked(folder, "--shard", "1/1", status=0)["labs"]]


@pytest.fixture(scope="module")
def kept(tmp_path_factory: pytest.TempPathFactory, stores: Path) -> Folder:
    """A course with a lab whose trial is kept, and whose model has another file as a part."""
    root = tmp_path_factory.mktemp("kept") / "course"
    folder = course(root, stores, "## A lab\n\n" + fence(LAB))
    include = '<include file="part.xml"/><worldbody>'
    folder.write("models/ball.xml", BALL.replace("<worldbody>", include))
    # With a light there is no floor to draw, which takes longest.
    part = '<mujoco><worldbody><light pos="0 0 3"/></worldbody></mujoco>'
    folder.write("models/part.xml", part)
    assert cached(folder) == [False]
    return folder


def test_lab_is_tried_again_after_an_edit_of_its_model_or_damage_of_what_is_kept(
    kept: Folder,
) -> None:
    kept.replace("models/ball.xml", 'mass="1"', 'mass="2"')
    assert cached(kept) == [False]
    for kind in ("labs", "mjb"):
        for entry in (kept.root / ".coursebuild" / kind).iterdir():
            entry.write_bytes(entry.read_bytes()[:-1])
    assert cached(kept) == [False]
    assert cached(kept) == [True]


class NoBrowser(LabEngine):
    """Stands for an engine that would have to try the lab."""

    def mistakes(self, pieces: Sequence[LabCode]) -> list[str | None]:
        raise MissedError


class NoNative(NativeEngine):
    """One that runs no script."""

    def script(self, request: dict[str, Any]) -> dict[str, Any]:
        raise NativeError("is not run")


class MissedError(Exception):
    pass


@pytest.mark.filterwarnings("ignore:.* encountered:RuntimeWarning")
@pytest.mark.parametrize("count", [15, pytest.param(500, marks=pytest.mark.slow)])
def test_poisoned_trials_are_one_that_can_be_shown_or_told(kept: Folder, count: int) -> None:
    """A trial is believed as a whole: its page is drawn of it, or it is tried again.

    A sound one is shown with its script, and no engine is asked.
    """
    shutil.rmtree(kept.root / ".coursebuild/labs")
    assert cached(kept) == [False]
    (entry,) = (kept.root / ".coursebuild/labs").iterdir()
    name = f"labs/{entry.name}"
    sound = entry.read_bytes()
    whole = unsealed(name, sound)
    assert whole is not None
    course, ball = load_course(kept.root), kept.text("models/ball.xml")
    models = {"ball": compile_all(kept.root, [("models/ball.xml", ball)])[0]}
    engines = Engines(kept.root)
    engines.browser, engines.native = NoBrowser(), NoNative(kept.root)
    told: list[str] = []
    outcomes = Counter[str]()
    bombs = (zlib.compress(data, 1) for data in (b" " * (1 + (1 << 28)), b"[" * 100_000))
    text = zlib.decompress(whole)
    nothing = json.dumps({**json.loads(text), "main": None}).encode()
    texts = map(zlib.compress, (text[:-1], nothing, *poisoned(text, count)))
    for data in (whole, *bombs, *texts):
        entry.write_bytes(sealed(name, data))
        shutil.rmtree(kept.root / ".coursebuild/pictures", ignore_errors=True)
        memory = Memory(kept.root, Memo(kept.root))
        told.clear()
        memory.store.listen(told.append)
        context = TrialContext(kept.root, course, models, memory, static=True)
        try:
            ((result,), wrong) = LabTrials(context, engines).run(lab_trials(course))
        except MissedError:
            assert [line[:26] for line in told] == [f"the entry {name[:16]}"]
            assert not entry.exists()
            outcomes["missed"] += 1
        else:
            assert isinstance(result.output, LabOutput)
            assert not told and json.loads(result.output.config)
            assert wrong or result.output.picture.startswith(b"\x89PNG")
            assert data is not whole or result.output.script
            outcomes["shown"] += 1
    assert min(outcomes.values()) > count / 20, outcomes
    entry.write_bytes(sound)


def test_failure_of_a_lab_is_kept_and_one_that_took_too_long_is_not(tmp_path: Path) -> None:
    """The first lab throws; the second takes longer than it may at first."""
    lab = '{{"model": "ball", "verify": {{"seconds": {}}}, "setup": "{}"}}'
    fences = fence(lab.format(0.1, "null.x")) + fence(lab.format(500, ""))
    course = make_course(fences, models={"ball": BALL})
    models = {"ball": compile_all(tmp_path, [("models/ball.xml", BALL)])[0]}
    options = Options(root=tmp_path, jobs=1, quiet=True)
    found = []
    with closing(OpenEngines(tmp_path)) as engines:
        for seconds in (0.2, 60.0):
            results, wrong = try_labs(course, options, engines, models, seconds=seconds)
            found.append(([d.rule for d in wrong], [result.line.cached for result in results]))
    assert found == [
        (["lab-throws", "lab-timeout"], [False, False]),
        (["lab-throws"], [True, False]),
    ]


# --- labs are tried in a thread while scripts run


def test_error_in_a_trial_ends_the_command_and_hangs_nothing(
    tmp_path: Path, stores: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = course(tmp_path / "course", stores, "## A\n\n" + fence(LAB))
    error: Exception = EffectError("MuJoCo cannot be loaded: no library x")

    def broken(*_: object) -> None:
        raise error

    monkeypatch.setattr(NativeEngine, "save", broken)
    done = folder.main("check")
    assert done.status == 1
    assert "coursebuild: MuJoCo cannot be loaded: no library x" in done.err
    wait_until_alone(folder)
    error = ZeroDivisionError()  # a mistake of the tool's own
    with pytest.raises(ZeroDivisionError):
        folder.main("check")
    wait_until_alone(folder)


def native_processes() -> list[int]:
    """Of MuJoCo's, those that this process started."""
    found = []
    for number in Path(f"/proc/{os.getpid()}/task").glob("*/children"):
        for child in number.read_text().split():
            if b"native_worker" in Path(f"/proc/{child}/cmdline").read_bytes():
                found.append(int(child))
    return found


def test_native_mujoco_that_dies_is_told_at_the_lab(
    tmp_path: Path, stores: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    original, others = NativeEngine.parity, {*native_processes()}

    def dies(engine: NativeEngine, *arguments: Any) -> Any:
        (process,) = {*native_processes()} - others
        os.kill(process, signal.SIGKILL)
        return original(engine, *arguments)

    monkeypatch.setattr(NativeEngine, "parity", dies)
    folder = course(tmp_path / "course", stores, "## A\n\n" + fence(LAB))
    (found,) = checked(folder, status=1)["diagnostics"]
    assert (found["rule"], found["line"]) == ("lab-engine", 3)
    assert found["message"] == "native MuJoCo crashed (SIGKILL)"
    monkeypatch.undo()
    assert cached(folder) == [False]


@pytest.mark.parametrize(
    ("number", "status", "where"), [(signal.SIGINT, 130, "lab"), (signal.SIGTERM, 143, "script")]
)
def test_signal_ends_labs_and_scripts_at_once_and_leaves_nothing(
    tmp_path: Path, stores: Path, number: int, status: int, where: str
) -> None:
    """The code of the second lab never returns; its time is over after a minute."""
    script = "from pathlib import Path\nPath('running').touch()\n"
    script += "import time\ntime.sleep(600)\n" if where == "script" else ""
    fine = '{"model": "ball", "verify": {"seconds": 0.1}}'
    endless = '{"model": "ball", "controller": "for (;;) ;"}'
    lesson = "## A\n\n" + block("a.py", script, info="timeout=600") + fence(fine) + fence(endless)
    folder = course(tmp_path / "course", stores, lesson)
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    pipes = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    with ended(folder.start("check", "1.2", **pipes)) as process:
        wait_until(lambda: (folder.root / "running").exists() and kept_trials(folder), "the loop")
        os.kill(process.pid, number)
        assert process.wait(600) == status
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    assert after.ru_utime - before.ru_utime < 45, "it waited until the lab's time was over"
    wait_until_alone(folder)
    assert list(folder.tmp.iterdir()) == []


def kept_trials(folder: Folder) -> bool:
    return any((folder.root / ".coursebuild" / "labs").glob("*"))
