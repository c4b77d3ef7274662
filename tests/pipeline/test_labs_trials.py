"""When labs are tried: what is kept of a trial, and what runs beside it."""

from __future__ import annotations

import os
import signal
import subprocess
import time
from typing import Any
from unittest.mock import patch

import pytest

from coursebuild.effects.errors import EffectError
from coursebuild.effects.lab_engine import LabEngine
from coursebuild.effects.native import NativeEngine
from coursebuild.pipeline import labs as pipeline_labs
from support.lab_lessons import BALL, RIGHT, Make, checked, course, fence
from support.scratch_course import Folder, block, ended, wait_until_alone


class TestKept:
    """What a trial depends on, and what it does not."""

    LAB = (
        '{"title": "T", "model": "ball", "height": 200, "toggles": ["frames"], "note": "A note.",\n'
        ' "setup": "ctx.a = 1", "controller": "ctx.b = 2",\n'
        ' "controls": [{"label": "s", "min": 0, "max": 1, "value": 0.5, "param": "p"}],\n'
        ' "readouts": [{"label": "r", "expr": "ctx.a"}],\n'
        ' "verify": {"seconds": 0.2}}'
    )

    def folder(self, make: Make) -> Folder:
        folder = course(make, "## A lab\n\nText.\n\n" + fence(self.LAB))
        folder.write(
            "models/ball.xml", BALL.replace("<worldbody>", '<include file="part.xml"/><worldbody>')
        )
        folder.write("models/part.xml", '<mujoco><option timestep="0.002"/></mujoco>')
        assert checked(folder, status=0)["labs"][0]["cached"] is False
        return folder

    def cached(self, folder: Folder) -> list[bool]:
        return [lab["cached"] for lab in checked(folder, status=0)["labs"]]

    def test_what_changes_nothing(self, make: Make) -> None:
        folder = self.folder(make)
        lesson = folder.lesson(2)
        for old, new in (
            ("Text.", "Another text."),
            ('"title": "T"', '"title": "Another"'),
            ('"height": 200', '"height": 300'),
            ('"toggles": ["frames"]', '"toggles": ["com"]'),
            ('"note": "A note."', '"note": "Another *note*."'),
            ('{"title"', '{ "dock": true,\n\n "title"'),
            ('"setup": "ctx.a = 1"', '"setup": "ctx.a \\u003d 1"'),
        ):
            folder.replace(lesson, old, new)
            assert self.cached(folder) == [True], new
        folder.replace(lesson, "## A lab\n", "## A lab\n\n" + fence(RIGHT))
        assert self.cached(folder) == [False, True], "its name has changed"

    def test_what_changes_something(self, make: Make) -> None:
        folder = self.folder(make)
        for path, old, new in (
            ("lesson", "ctx.a = 1", "ctx.a = 3"),
            ("lesson", "ctx.b = 2", "ctx.b = 3"),
            ("lesson", '"max": 1', '"max": 2'),
            ("lesson", '"value": 0.5', '"value": 0.6'),
            ("lesson", '"expr": "ctx.a"', '"expr": "ctx.a + 1"'),
            ("lesson", '"seconds": 0.2', '"seconds": 0.3'),
            ("lesson", '"seconds": 0.3', '"seconds": 0.3, "rtol": 0'),
            ("lesson", '"height"', '"camera": {"azimuth": 3}, "height"'),
            ("lesson", '"height"', '"seed": 3, "height"'),
            ("lesson", '"height"', '"stopAt": 3, "height"'),
            ("lesson", '"height"', '"expect": [{"t": 0, "expr": "1", "min": 1}], "height"'),
            ("lesson", '"height"', '"key": 0, "height"'),
            ("models/ball.xml", 'mass="1"', 'mass="2"'),
            ("models/part.xml", '"0.002"', '"0.001"'),
        ):
            folder.replace(folder.lesson(2) if path == "lesson" else path, old, new)
            assert self.cached(folder) == [False], new
        assert self.cached(folder) == [True]

    def test_another_engine(self, make: Make, monkeypatch: pytest.MonkeyPatch) -> None:
        folder = self.folder(make)
        for name in ("engine_digest", "native_digest"):
            with monkeypatch.context() as changed:
                changed.setattr(pipeline_labs, name, lambda: "another")
                assert self.cached(folder) == [False]
        assert self.cached(folder) == [True]

    def test_a_damaged_entry_is_tried_again(self, make: Make) -> None:
        folder = self.folder(make)
        for kind in ("labs", "mjb"):
            (entry,) = (folder.root / ".coursebuild" / kind).iterdir()
            entry.write_bytes(entry.read_bytes()[:-1])
        assert self.cached(folder) == [False]
        assert self.cached(folder) == [True]

    def test_no_engine_is_started_where_all_is_kept(self, make: Make) -> None:
        folder = self.folder(make)
        no = AssertionError("started")
        with (
            patch.object(LabEngine, "_start", side_effect=no),
            patch.object(NativeEngine, "_start", side_effect=no),
        ):
            assert self.cached(folder) == [True]

    def test_what_fails_is_kept_and_told_again(self, make: Make) -> None:
        wrong = '{"model": "ball", "verify": {"seconds": 0.1}, "setup": "null.x"}'
        folder = course(make, "## A\n\n" + fence(wrong))
        first, again = checked(folder, status=1), checked(folder, status=1)
        assert first["diagnostics"] == again["diagnostics"]
        assert [r["labs"][0]["cached"] for r in (first, again)] == [False, True]

    def test_what_took_too_long_is_tried_again(
        self, make: Make, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        slow = '{"model": "ball", "verify": {"seconds": 20}}'
        folder = course(make, "## A\n\n" + fence(slow))
        with monkeypatch.context() as hasty:
            hasty.setattr(pipeline_labs, "WALL", 0.01)
            assert checked(folder, status=1)["diagnostics"][0]["rule"] == "lab-timeout"
        assert self.cached(folder) == [False]


class TestBeside:
    """Labs are tried in a thread while scripts run."""

    def test_what_goes_wrong_in_the_thread_is_told(
        self, make: Make, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        def broken(self: NativeEngine) -> None:
            raise EffectError("MuJoCo cannot be loaded: no library x")

        monkeypatch.setattr(NativeEngine, "_start", broken)
        folder = course(make, "## A\n\n" + fence(RIGHT))
        done = folder.main("check")
        assert done.status == 1
        assert "coursebuild: MuJoCo cannot be loaded: no library x" in done.err
        wait_until_alone(folder)

    def test_a_mistake_of_our_own_hangs_nothing(
        self, make: Make, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        def broken(*_: object) -> None:
            raise ZeroDivisionError

        monkeypatch.setattr(pipeline_labs, "compile_lab", broken)
        folder = course(make, "## A\n\n" + fence(RIGHT))
        with pytest.raises(ZeroDivisionError):
            folder.main("check")
        wait_until_alone(folder)

    def test_native_mujoco_that_dies_is_told_at_the_lab(
        self, make: Make, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        original = NativeEngine.parity

        def dies(self: NativeEngine, *arguments: Any) -> Any:
            assert self._process is not None
            self._process.kill()
            return original(self, *arguments)

        monkeypatch.setattr(NativeEngine, "parity", dies)
        folder = course(make, "## A\n\n" + fence(RIGHT))
        (found,) = checked(folder, status=1)["diagnostics"]
        assert (found["rule"], found["line"]) == ("lab-engine", 3)
        assert found["message"] == "native MuJoCo crashed (SIGKILL)"
        monkeypatch.undo()
        assert checked(folder, status=0)["labs"][0]["cached"] is False

    @pytest.mark.parametrize(
        ("number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)], ids=["int", "term"]
    )
    @pytest.mark.parametrize("where", ["script", "lab"])
    def test_a_signal_ends_it_at_once_and_leaves_nothing(
        self, make: Make, number: int, status: int, where: str
    ) -> None:
        script = (
            "import time\nprint('x', flush=True)\ntime.sleep(600)\n" if where == "script" else "1\n"
        )
        lesson = (
            "## A\n\n"
            + block("slow.py", script)
            + fence(
                '{"model": "ball", "controls": '
                '[{"type": "button", "label": "b", "run": "for (;;) ;"}]}'
            )
        )
        folder = course(make, lesson)
        process = folder.start("check", "1.2", stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        with ended(process):
            assert process.stderr is not None
            awaited = b"slow.py" if where == "script" else b"trying labs"
            for line in process.stderr:
                if awaited in line:
                    break
            time.sleep(1.5)  # until the loop runs
            began = time.monotonic()
            os.kill(process.pid, number)
            assert process.wait(120) == status
            assert time.monotonic() - began < 45  # and a lab may take a minute
        wait_until_alone(folder)
        assert list(folder.tmp.iterdir()) == []
