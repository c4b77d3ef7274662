"""Labs through the commands: whatever a reader could run into is found first, at its line."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from unittest.mock import patch

import pytest

sys.path.insert(0, str(Path(__file__).parent))
from coursekit import GOOD, Folder, block, ended, wait_until_alone

from coursebuild.effects.errors import EffectError
from coursebuild.effects.lab_engine import LabEngine
from coursebuild.effects.native import NativeEngine
from coursebuild.pipeline import labs as pipeline_labs

Make = Callable[..., Folder]

BALL = """<mujoco><worldbody><body name="ball" pos="0 0 1"><freejoint/><geom size="0.1" mass="1"/>
<site name="tip" pos="0.1 0 0"/></body></worldbody>
<keyframe><key name="start" qpos="0 0 2 1 0 0 0"/></keyframe></mujoco>
"""
CART = """<mujoco><worldbody><body name="cart"><joint name="slide" type="slide" axis="1 0 0"
stiffness="1e5"/><geom size="0.1" mass="1"/></body></worldbody>
<actuator><motor joint="slide"/></actuator></mujoco>
"""
SLIDER = '"min": 0, "max": 1, "value": 0.5'


def fence(body: str) -> str:
    return f"```lab simlab\n{body}\n```\n\n".replace("SLIDER", SLIDER)


# What is wrong, its rule, and the lab; `‸` stands where the message must point.
MISTAKES = [
    ("a readout that throws", "lab-throws",
     '{"model": "ball",\n "readouts": [{"label": "r",\n  "expr": ‸"lib.bodyPos(\'bell\')"}]}'),
    ("a readout without a value", "lab-value",
     '{"model": "ball", "readouts": [\n{"label": "r", "expr": ‸"ctx.none"}]}'),
    ("a readout that becomes NaN", "lab-value",
     '{"model": "ball", "readouts": [\n{"label": "r", "expr": ‸"Math.sqrt(1 - sim.time)"}]}'),
    ("a readout that is infinite after a button", "lab-value",
     '{"model": "ball", "controls": [{"type": "button", "label": "b", "run": "ctx.d = 1"}],\n'
     '"readouts": [{"label": "r", "expr": ‸"ctx.d ? 1 / 0 : 0"}]}'),
    ("a trace that is a text", "lab-value",
     '{"model": "ball", "plots": [{"ylabel": "y",\n"traces": [{"label": "t", "expr": "1"},\n'
     '{"label": "u", "expr": ‸"\'text\'"}]}]}'),
    ("a trace that throws after a while", "lab-throws",
     '{"model": "ball", "plots": [{"ylabel": "y",\n"traces": [{"label": "t",\n'
     '"expr": ‸"sim.time > 0.3 ? null.x : 0"}]}]}'),
    ("a setter that cannot set", "lab-throws",
     '{"model": "ball", "controls": [{"label": "s", SLIDER,\n"set": ‸"ctx.none.x"}]}'),
    ("a control at its maximum", "lab-throws",
     '{"model": "ball", "controls": [{"label": "s", SLIDER,\n'
     '"apply": ‸"if (value === 1) null.x"}]}'),
    ("a control at its minimum", "lab-throws",
     '{"model": "ball", "controls": [{"label": "s", SLIDER,\n'
     '"apply": ‸"if (value === 0) null.x"}]}'),
    ("a control at its value", "lab-throws",
     '{"model": "ball", "controls": [{"label": "s", SLIDER,\n'
     '"apply": ‸"if (value === 0.5) null.x"}]}'),
    ("an option", "lab-throws",
     '{"model": "ball", "controls": [{"type": "select", "label": "s",\n'
     '"options": [["A", "a"], ["B", "b"], ["C", 3]],\n"apply": ‸"if (value === 3) null.x"}]}'),
    ("stepping after a control was moved", "lab-throws",
     '{"model": "ball", "controls": [{"label": "s", SLIDER, "param": "p"}],\n'
     '"controller": ‸"if (ctx.p > 0.9 && sim.time > 0.1) null.x"}'),
    ("a reset after a control was moved", "lab-throws",
     '{"model": "ball", "controls": [{"label": "s", SLIDER, "param": "p", "reset": true}],\n'
     '"setup": ‸"if (ctx.p > 0.9) null.x"}'),
    ("a button that throws", "lab-throws",
     '{"model": "ball", "controls": [{"type": "button", "label": "fine", "run": "ctx.a = 1"},\n'
     '{"type": "button", "label": "b",\n"run": ‸"data.qvell[0] = 1"}]}'),
    ("a button that does not parse", "lab-code",
     '{"model": "ball", "controls": [{"type": "button", "label": "b",\n"run": ‸"if ("}]}'),
    ("a setup that throws", "lab-throws", '{"model": "ball",\n\n"setup": ‸"undeclared = 1"}'),
    ("a warning after an option", "lab-warning",
     '{"model": "cart", "controls": [{"type": "select", "label": "s",\n'
     '"options": [["A", 0], ["B", 1]],\n"apply": ‸"data.ctrl[0] = value / (1 - value)"}]}'),
    ("divergence at the end of a slider", "lab-diverged",
     '{"model": "cart", "setup": "data.qpos[0] = 0.1", "controls": [\n{"label": "dt",\n'
     '"min": 0.001, "max": 0.1, "value": 0.001, "set": ‸"model.opt.timestep"}]}'),
    ("a position that is no number", "lab-diverged",
     '{"model": "ball", "controls": [{"type": "button", "label": "b",\n'
     '"run": ‸"data.qpos[2] = 0 / 0"}]}'),
    ("a claim from the start", "lab-expect",
     '{"model": "ball", "expect": [{"t": 0.5, "expr": "data.qpos[2]", "max": 1},\n'
     '{"t": 0.2,\n"expr": ‸"data.qpos[2]", "max": 0.5}]}'),
    ("a claim after a button", "lab-expect",
     '{"model": "ball", "controls": [{"type": "button", '
     '"label": "b", "run": "data.qvel[2] = 9"}],\n'
     '"expect": [{"after": "b", "t": 0.1, "min": 3,\n"expr": ‸"data.qpos[2]"}]}'),
    ("a claim with a control", "lab-expect",
     '{"model": "ball", "controls": [{"label": "s", SLIDER, "param": "p"}],\n'
     '"expect": [{"after": {"s": 0.25}, "t": 0.1, "max": 0.2,\n"expr": ‸"ctx.p"}]}'),
    ("a claim after a control and a button", "lab-expect",
     '{"model": "ball", "controls": [{"label": "s", SLIDER, "param": "p"}, {"type": "button",\n'
     '"label": "b", "run": "data.qvel[2] = ctx.p"}],\n'
     '"expect": [{"after": [{"s": 0.25}, "b"], "t": 0, "max": 0.25, "expr": "data.qvel[2]"},\n'
     '{"after": [{"s": 0.25}, "b"], "t": 0, "max": 0.2,\n"expr": ‸"data.qvel[2]"}]}'),
    ("a claim that is NaN", "lab-value",
     '{"model": "ball", "expect": [{"t": 0.1,\n"expr": ‸"0 / 0", "min": 0}]}'),
    ("a pause that is jumped over", "lab-expect",
     '{"model": "ball",\n"stopAt": ‸1, '
     '"controller": "if (sim.time > 0.5) data.time = 2 + sim.time"}'),
    ("engines that differ", "lab-parity",
     '‸{"model": "ball",\n'
     '"controller": "model.opt.gravity[0] = sim.time > 0.5 && sim.time < 1 ? 2 : 0"}'),
    ("a built-in that is another's too", "lab-shared",
     '{"model": "ball", "controls": [{"type": "button", "label": "b",\n'
     '"run": ‸"Math.sin = Math.cos"}]}'),
    ("a lab with its own model", "lab-throws",
     '{"xml": "<mujoco><worldbody><geom size=\'1\'/></worldbody></mujoco>",\n'
     '"readouts": [{"label": "r", "expr": ‸"null.x"}]}'),
]  # fmt: skip


@dataclass(frozen=True, slots=True)
class Checked:
    """A course of all mistakes, after one check."""

    status: int
    found: list[dict[str, Any]]
    labs: list[dict[str, Any]]
    lesson: str


def course(make: Make, *lessons: str) -> Folder:
    folder = make(GOOD, *lessons)
    folder.write("models/ball.xml", BALL)
    folder.write("models/cart.xml", CART)
    return folder


def checked(folder: Folder, *names: str, status: int | None = None) -> dict[str, Any]:
    """A check's report, as JSON."""
    done = folder.main("check", *names, "--format", "json")
    assert status is None or done.status == status, done.out + done.err
    return {"status": done.status, **json.loads(done.out)}


@pytest.fixture(scope="module")
def everything_wrong(tmp_path_factory: pytest.TempPathFactory, stores: Path) -> Checked:
    folder = Folder(tmp_path_factory.mktemp("labs") / "course")
    lesson = "## Labs\n\n" + "".join(fence(body) for _, _, body in MISTAKES)
    folder.fill([GOOD, lesson.replace("‸", "")], stores)
    folder.write("models/ball.xml", BALL)
    folder.write("models/cart.xml", CART)
    report = checked(folder)
    found = [d for d in report["diagnostics"] if d["rule"].startswith("lab-")]
    assert len(found) == len(report["diagnostics"])
    return Checked(report["status"], found, report["labs"], lesson)


def test_one_mistake_each_and_all_are_found(everything_wrong: Checked) -> None:
    assert everything_wrong.status == 1
    assert len(everything_wrong.found) == len(MISTAKES)
    assert [lab["status"] for lab in everything_wrong.labs] == ["failed"] * len(MISTAKES)


@pytest.mark.parametrize("number", range(len(MISTAKES)), ids=[title for title, _, _ in MISTAKES])
def test_it_is_found_at_its_line(everything_wrong: Checked, number: int) -> None:
    _, rule, _ = MISTAKES[number]
    parts = everything_wrong.lesson.split("‸")
    before = "".join(parts[: number + 1])
    line, column = before.count("\n") + 1, len(before) - before.rfind("\n")
    if rule == "lab-parity":  # it is about the lab, which begins with its fence
        line, column = line - 1, 1
    found = everything_wrong.found[number]
    assert (found["rule"], found["line"], found["column"]) == (rule, line, column), found["message"]


RIGHT = '''{
  "title": "All of it", "model": "ball", "key": "start", "camera": {"azimuth": 30},
  "toggles": ["frames"], "seed": 3, "stopAt": 1, "trail": "tip",
  "setup": "ctx.n = 0; ctx.r = lib.random()",
  "controller": "ctx.n += 1; data.qfrc_applied[2] = ctx.lift",
  "controls": [
    {"label": "lift", "unit": "N", "min": 0, "max": 9, "value": 1, "param": "lift"},
    {"label": "mass", "min": 0.5, "max": 2, "value": 1, "set": "model.body_mass[1]"},
    {"label": "g", "type": "select", "options": [["earth", -9.81], ["moon", -1.6]],
     "set": "model.opt.gravity[2]", "reset": true},
    {"label": "kick", "type": "button", "run": "data.qvel[0] = 1"}
  ],
  "readouts": [{"label": "height", "expr": "data.qpos[2]"},
               {"label": "state", "expr": "sim.time < 0.5 ? 'early' : 'late'"}],
  "plots": [{"ylabel": "z (m)", "traces": [{"label": "z", "expr": "data.qpos[2]"}]}],
  "expect": [
    {"t": 0, "expr": "data.qpos[2]", "min": 2, "max": 2},
    {"t": 1, "expr": "ctx.n", "min": 500, "max": 500},
    {"after": "kick", "t": 0.5, "expr": "data.qpos[0]", "min": 0.4999, "max": 0.5001},
    {"after": {"g": -1.6}, "t": 0.5, "expr": "data.qpos[2]", "min": 1.9, "max": 2},
    {"after": {"g": -1.6, "lift": 0}, "t": 0.5, "expr": "data.qpos[2]", "min": 1.79, "max": 1.81},
    {"after": [{"g": -1.6}, "kick"], "t": 0.5, "expr": "data.qpos[0]", "min": 0.499, "max": 0.501},
    {"after": ["kick", {"g": -1.6}], "t": 0.5, "expr": "data.qpos[0]", "min": 0, "max": 0}
  ]
}'''  # fmt: skip


def test_a_lab_in_which_everything_holds(make: Make) -> None:
    folder = course(make, "## A lab\n\n" + fence(RIGHT))
    report = checked(folder, status=0)
    assert report["diagnostics"] == []
    (lab,) = report["labs"]
    assert {k: lab[k] for k in ("name", "title", "lesson", "status", "tried", "cached")} == {
        "name": "1.2-lab-1", "title": "All of it", "lesson": "1.2", "status": "ok",
        "tried": 1 + 3 + 3 + 2 + 1 + 6, "cached": False,
    }  # fmt: skip
    assert lab["parity"] == "bit-identical to native MuJoCo over 500 steps"
    assert lab["steps_per_second"] > 100
    text = folder.main("check").out
    assert re.search(
        r"^ok       1\.2-lab-1  [\d,]+ steps/s, 16 things tried, "
        r"bit-identical to native MuJoCo over 500 steps, cached$",
        text,
        re.MULTILINE,
    )
    assert "1 lab tried" in text


def test_a_lab_whose_reset_leads_elsewhere_is_warned_of_and_published(make: Make) -> None:
    lab = '{"model": "ball",\n"setup": "ctx.n = (ctx.n ?? 0) + 1; data.qvel[1] = ctx.n"}'
    folder = course(make, "## A\n\n" + fence(lab))
    for cached in (False, True):
        report = checked(folder, status=0)
        (found,) = report["diagnostics"]
        assert (found["rule"], found["severity"], found["line"]) == ("lab-reset", "warning", 5)
        assert [(made["status"], made["cached"]) for made in report["labs"]] == [("ok", cached)]
    done = folder.main("build")
    assert done.status == 0, done.out + done.err
    (page,) = (folder.root / "public/lessons").glob("1.2-*.html")
    assert '<div class="lab-static">' in page.read_text(encoding="utf-8")


def test_a_lab_of_a_quiz_is_tried_at_its_place(make: Make) -> None:
    quiz = (
        '```quiz\n{"id": "q", "questions": [{"kind": "predict", "q": "Which?",\n'
        '"options": ["a", "b"], "answer": 0,\n'
        '"sim": {"model": "ball",\n"readouts": [{"label": "r", "expr": "null.x"}]}}]}\n```\n'
    )
    report = checked(course(make, "## A quiz\n\n" + quiz), status=1)
    (found,) = report["diagnostics"]
    assert (found["rule"], found["line"], found["column"]) == ("lab-throws", 7, 37)
    assert [lab["status"] for lab in report["labs"]] == ["failed"]


def test_only_the_lessons_that_are_asked_for(make: Make) -> None:
    wrong = '{"model": "ball", "setup": "null.x"}'
    folder = course(make, "## A\n\n" + fence(wrong), "## B\n\n" + fence(RIGHT))
    assert [lab["name"] for lab in checked(folder, "1.3")["labs"]] == ["1.3-lab-1"]
    assert checked(folder, "1.1", status=0)["labs"] == []
    assert checked(folder, "1.2", status=1)["labs"][0]["name"] == "1.2-lab-1"


def test_a_model_that_does_not_compile_is_told_once(make: Make) -> None:
    folder = course(make, "## A\n\n" + fence('{"model": "ball"}'))
    folder.write("models/ball.xml", "<mujoco><nonsense/></mujoco>")
    report = checked(folder, status=1)
    assert [d["rule"] for d in report["diagnostics"]] == ["model-error"]


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
            "import time\nprint('x', flush=True)\ntime.sleep(60)\n" if where == "script" else "1\n"
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
            assert time.monotonic() - began < 8
        wait_until_alone(folder)
        assert list(folder.tmp.iterdir()) == []


def test_a_build_shows_and_compresses(make: Make) -> None:
    import gzip

    import brotli

    folder = course(make, "## A lab\n\n" + fence(RIGHT))
    assert folder.main("build").status == 0
    public = folder.root / "public"
    page = next(public.glob("**/1.2*.html"), None) or next(
        p for p in public.rglob("*.html") if 'data-lab="1.2-lab-1"' in p.read_text()
    )
    text = page.read_text()
    assert text.count('<svg class="lab-plot"') == 1
    assert "<dt>state</dt><dd>late</dd>" in text
    assert "bit-identical to native MuJoCo over 500 steps" in text
    assert len(list(public.glob("assets/labs/1.2-lab-1.*.png"))) == 1
    found = (p for p in public.rglob("*") if p.suffix in (".br", ".gz"))
    copies = [p for p in found if "search" not in p.relative_to(public).parts]
    assert {p.name.split(".")[-2] for p in copies} == {"js", "css", "wasm", "json", "mjb"}
    for copy in copies:
        data = copy.read_bytes()
        plain = brotli.decompress(data) if copy.suffix == ".br" else gzip.decompress(data)
        assert plain == copy.with_suffix("").read_bytes()
        assert len(data) < len(plain)
        assert len(plain) >= 1024 and "assets" in copy.relative_to(public).parts
    whole = list(public.glob("assets/**/*.wasm"))
    assert len(whole) == 1 and whole[0].with_name(whole[0].name + ".br") in copies
