"""When labs are tried: what is kept of a trial, and what runs beside it."""

from __future__ import annotations

import os
import resource
import signal
import subprocess
import time
from pathlib import Path
from typing import Any

import pytest

from coursebuild.core.files.errors import EffectError
from coursebuild.core.run.lab_engine import LabEngine
from coursebuild.core.run.native import NativeEngine
from coursebuild.pipeline import labs as pipeline_labs
from support.lab_lessons import BALL, RIGHT, Make, checked, course, fence
from support.scratch_course import GOOD, Folder, block, ended, wait_until_alone

pytestmark = pytest.mark.engine

LAB = (
    '{"title": "T", "model": "ball", "height": 200, "toggles": ["frames"], "note": "A note.",\n'
    ' "setup": "ctx.a = NUMBER", "controller": "ctx.b = 2",\n'
    ' "controls": [{"label": "s", "min": 0, "max": 1, "value": 0.5, "param": "p"}],\n'
    ' "readouts": [{"label": "r", "expr": "ctx.a"}],\n'
    ' "verify": {"seconds": 0.2}}'
)
NEUTRAL = [
    ("Text.", "Another text."),
    ('"title": "T"', '"title": "Another"'),
    ('"height": 200', '"height": 300'),
    ('"toggles": ["frames"]', '"toggles": ["com"]'),
    ('"note": "A note."', '"note": "Another *note*."'),
    ('{"title"', '{ "dock": true,\n\n "title"'),
    ('"setup": "ctx.a = ', '"setup": "ctx.a \\u003d '),
]
"""Edits that change nothing that a trial depends on."""
EDITS = [
    ('"ctx.a = ', '"ctx.a = 100 + '),
    ("ctx.b = 2", "ctx.b = 3"),
    ('"max": 1', '"max": 2'),
    ('"value": 0.5', '"value": 0.6'),
    ('"expr": "ctx.a"', '"expr": "ctx.a + 1"'),
    ('"seconds": 0.2', '"seconds": 0.3'),
    ('"seconds": 0.2', '"seconds": 0.2, "rtol": 0'),
    ('"height"', '"camera": {"azimuth": 3}, "height"'),
    ('"height"', '"seed": 3, "height"'),
    ('"height"', '"stopAt": 3, "height"'),
    ('"height"', '"expect": [{"t": 0, "expr": "1", "min": 1}], "height"'),
    ('"height"', '"key": 0, "height"'),
]
"""Edits after which a lab must be tried again."""


def write_models(folder: Folder) -> None:
    """A ball whose model has another file as a part."""
    include = '<include file="part.xml"/><worldbody>'
    folder.write("models/ball.xml", BALL.replace("<worldbody>", include))
    folder.write("models/part.xml", '<mujoco><option timestep="0.002"/></mujoco>')


def cached(folder: Folder) -> list[bool]:
    """Of each lab: whether it was not tried again; in parts, so that the labs are looked at."""
    return [lab["cached"] for lab in checked(folder, "--shard", "1/1", status=0)["labs"]]


def test_labs_are_tried_again_exactly_where_a_trial_depends_on_an_edit(make: Make) -> None:
    """One lab for each edit, and one more."""
    edits = [*NEUTRAL, *EDITS, ("", "")]
    labs = ["Text.\n\n" + fence(LAB.replace("NUMBER", str(n))) for n in range(len(edits))]
    folder = course(make, "## Labs\n\n" + "".join(labs))
    write_models(folder)
    assert cached(folder) == [False] * len(edits)
    edited = [
        lab.replace(*edit, 1) if edit[0] else lab for lab, edit in zip(labs, edits, strict=True)
    ]
    unedited = [edit for lab, new, edit in zip(labs, edited, edits, strict=True) if lab == new]
    assert unedited == [("", "")]
    folder.write(folder.lesson(2), "## Labs\n\n" + "".join(edited))
    again = [edit for edit, kept in zip(edits, cached(folder), strict=True) if not kept]
    assert again == EDITS
    assert cached(folder) == [True] * len(edits)
    folder.write(folder.lesson(2), "## Labs\n\n" + fence(RIGHT) + labs[0])
    assert cached(folder) == [False, True], "its name has changed"
    folder.write(folder.lesson(2), "## Labs\n\n" + labs[0])
    for path, old, new in (
        ("models/ball.xml", 'mass="1"', 'mass="2"'),
        ("models/part.xml", '"0.002"', '"0.001"'),
    ):
        folder.replace(path, old, new)
        assert cached(folder) == [False], path


@pytest.fixture(scope="module")
def kept(tmp_path_factory: pytest.TempPathFactory, stores: Path) -> Folder:
    """A course with a lab whose trial is kept; each test leaves it so."""
    folder = Folder(tmp_path_factory.mktemp("kept") / "course")
    folder.fill([GOOD, "## A lab\n\n" + fence(LAB.replace("NUMBER", "1"))], stores)
    write_models(folder)
    assert cached(folder) == [False]
    return folder


@pytest.mark.parametrize("name", ["engine_digest", "native_digest"])
def test_lab_is_tried_again_by_another_engine(
    kept: Folder, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    with monkeypatch.context() as changed:
        changed.setattr(pipeline_labs, name, lambda: "another")
        assert cached(kept) == [False]
    assert cached(kept) == [True]


def test_lab_with_damaged_entries_is_tried_again(kept: Folder) -> None:
    for kind in ("labs", "mjb"):
        for entry in (kept.root / ".coursebuild" / kind).iterdir():
            entry.write_bytes(entry.read_bytes()[:-1])
    assert cached(kept) == [False]
    assert cached(kept) == [True]


def test_no_engine_is_asked_where_all_is_kept(
    kept: Folder, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> None:
        raise AssertionError("an engine was asked")

    for engine, names in ((LabEngine, ("mistakes", "trial")), (NativeEngine, ("save", "parity"))):
        for name in names:
            monkeypatch.setattr(engine, name, refuse)
    assert cached(kept) == [True]


def test_failure_of_a_lab_is_kept_and_told_again(make: Make) -> None:
    wrong = '{"model": "ball", "verify": {"seconds": 0.1}, "setup": "null.x"}'
    folder = course(make, "## A\n\n" + fence(wrong))
    first, again = checked(folder, status=1), checked(folder, status=1)
    assert first["diagnostics"] == again["diagnostics"]
    assert [r["labs"][0]["cached"] for r in (first, again)] == [False, True]


def test_lab_that_took_too_long_is_tried_again(make: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = course(make, "## A\n\n" + fence('{"model": "ball", "verify": {"seconds": 20}}'))
    with monkeypatch.context() as hasty:
        hasty.setattr(pipeline_labs, "SECONDS", 0.01)
        assert checked(folder, status=1)["diagnostics"][0]["rule"] == "lab-timeout"
    assert cached(folder) == [False]


# --- labs are tried in a thread while scripts run


def test_mujoco_that_cannot_be_loaded_is_told(make: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object) -> None:
        raise EffectError("MuJoCo cannot be loaded: no library x")

    monkeypatch.setattr(NativeEngine, "save", broken)
    folder = course(make, "## A\n\n" + fence(RIGHT))
    done = folder.main("check")
    assert done.status == 1
    assert "coursebuild: MuJoCo cannot be loaded: no library x" in done.err
    wait_until_alone(folder)


def test_mistake_of_our_own_in_a_trial_hangs_nothing(
    make: Make, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*_: object) -> None:
        raise ZeroDivisionError

    monkeypatch.setattr(pipeline_labs, "compile_lab", broken)
    folder = course(make, "## A\n\n" + fence(RIGHT))
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
    make: Make, monkeypatch: pytest.MonkeyPatch
) -> None:
    original = NativeEngine.parity

    def dies(engine: NativeEngine, *arguments: Any) -> Any:
        (process,) = native_processes()
        os.kill(process, signal.SIGKILL)
        return original(engine, *arguments)

    monkeypatch.setattr(NativeEngine, "parity", dies)
    folder = course(make, "## A\n\n" + fence(RIGHT))
    (found,) = checked(folder, status=1)["diagnostics"]
    assert (found["rule"], found["line"]) == ("lab-engine", 3)
    assert found["message"] == "native MuJoCo crashed (SIGKILL)"
    monkeypatch.undo()
    assert cached(folder) == [False]


@pytest.mark.parametrize(
    ("number", "status", "where"),
    [(signal.SIGINT, 130, "lab"), (signal.SIGTERM, 143, "script")],
    ids=["interrupted in a lab", "terminated in a script"],
)
def test_signal_ends_labs_and_scripts_at_once_and_leaves_nothing(
    make: Make, number: int, status: int, where: str
) -> None:
    """The code of the second lab never returns; its time is over after a minute."""
    script = "from pathlib import Path\nPath('running').touch()\n"
    script += "import time\ntime.sleep(600)\n" if where == "script" else ""
    fine = '{"model": "ball", "verify": {"seconds": 0.1}}'
    endless = '{"model": "ball", "controller": "for (;;) ;"}'
    folder = course(
        make,
        "## A\n\n" + block("a.py", script, info="timeout=600") + fence(fine) + fence(endless),
    )
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    pipes = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    with ended(folder.start("check", "1.2", **pipes)) as process:
        while not ((folder.root / "running").exists() and kept_trials(folder)):
            assert process.poll() is None
            time.sleep(0.01)
        os.kill(process.pid, number)
        assert process.wait(600) == status
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    assert after.ru_utime - before.ru_utime < 45, "it waited until the lab's time was over"
    wait_until_alone(folder)
    assert list(folder.tmp.iterdir()) == []


def kept_trials(folder: Folder) -> list[Path]:
    return list((folder.root / ".coursebuild" / "labs").glob("*"))
