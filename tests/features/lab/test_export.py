"""Labs exported as Python: the script does what the lab does, or there is none."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, TypeAlias

import pytest
from msgspec.structs import replace

from coursebuild.core.model.results import Results, TrialResult
from coursebuild.core.pages.assets import Assets
from coursebuild.core.run.mjcf import compile_all
from coursebuild.core.run.v8 import Isolate
from coursebuild.features.lab.engines.native import NativeEngine
from coursebuild.features.lab.export import trial as lab_export
from coursebuild.features.lab.export.script import (
    Export,
    ExportMetadata,
    export_script,
    file_name,
    filled,
    initial_values,
)
from coursebuild.features.lab.files import publish_labs
from coursebuild.features.lab.trial import Engines
from coursebuild.pipeline.load import load
from coursebuild.pipeline.options import Options
from coursebuild.report import Style
from coursebuild.report.text import lab_line
from support.lab_values import BALL, OpenEngines, make_lab, try_labs

pytestmark = pytest.mark.engine

ROOT = Path(__file__).parents[3]
Tried: TypeAlias = Callable[..., list[TrialResult]]

METADATA = ExportMetadata("lab_1_1_1.py", "a lab of lesson 1.1, “First”", "A course", "3.14.0", 1.0)

PENDULUM = """<mujoco><option timestep="0.005"/><worldbody>
  <body name="arm" pos="0 0 1"><joint name="hinge" axis="0 1 0"/>
    <geom name="rod" type="capsule" size=".02" fromto="0 0 0 .5 0 0" mass="1"/>
    <site name="end" pos=".5 0 0"/></body>
  <body name="goal" mocap="true" pos="1 0 1"><geom size=".02" contype="0" conaffinity="0"/></body>
  <body name="ball" pos="2 0 .3"><freejoint name="float"/>
    <geom name="ball" size=".1" rgba="1 .5 .25 1"/></body>
  <geom name="floor" type="plane" size="5 5 .1"/></worldbody>
  <actuator><motor name="motor" joint="hinge"/></actuator>
  <keyframe><key name="up" qpos="0.4  2 0 .5 1 0 0 0"/></keyframe></mujoco>"""

RICH: dict[str, Any] = {
    "title": 'A "lab" with \\ everything',
    "xml": PENDULUM,
    "key": "up",
    "setup": "ctx.count = 0; ctx.start = lib.sitePos('end'); ctx.high = false\n"
    "const kick = 0.3 - 0.5\ndata.qvel[0] = kick / 4\n"
    "model.geom_rgba[2] = data.ncon > 0 ? 0.1 : 0.9; model.geom_rgba[5] *= 0.99",
    "controller": "ctx.count++\n"
    "const q = lib.qpos('hinge'), v = data.qvel[0]\n"
    "if (sim.time > 0.1 && !ctx.high) data.ctrl[0] = -ctx.gain * q - ctx.damping * v\n"
    "else { data.ctrl[0] = 0 }\n"
    "for (let i = 1; i < model.nv; i++) { data.qfrc_applied[i] -= 0.01 * data.qvel[i] }\n"
    "data.qfrc_applied.fill(0, 1, 3)\n"
    "data.mocap_pos.set([1, 0, 1 + data.time / 10], 0)\n"
    "ctx.high = data.xpos[3 * lib.bodyId('arm') + 2] > 100",
    "controls": [
        {"label": "gain", "param": "gain", "min": 0, "max": 4, "value": 2, "unit": "N m"},
        {"label": "damping", "param": "damping", "min": 0, "max": 1, "value": 0.3, "reset": True},
        {"label": "gravity", "set": "model.opt.gravity[2]", "min": -20, "max": 0, "value": -9.81},
        {"label": "lift", "apply": "const up = value * 2; data.qpos[3] += up", "init": True,
         "min": 0, "max": 0.5, "value": 0.125},
        {"type": "select", "label": "integrator", "set": "model.opt.integrator", "reset": True,
         "options": [["RK4", 1], ["Euler", 0]], "value": 1},
        {"type": "select", "label": "mode", "param": "mode",
         "options": [["free", "free"], ["held", "held"]]},
        {"type": "button", "label": "Kick",
         "run": "if (ctx.mode === 'held') return\ndata.qvel[0] += 1; sim.play()"},
        {"type": "button", "label": "Again", "run": "sim.reset(); data.qvel[0] = -1"},
    ],
    "readouts": [
        {"label": "energy", "expr": "lib.energy().total"},
        {"label": "momentum", "expr": "lib.norm(lib.momentum())"},
        {"label": "spin", "expr": "lib.angmom()[1]", "digits": 5},
        {"label": "force", "expr": "lib.normalForce('ball') + lib.normalForce()"},
        {"label": "angle", "expr": "lib.deg(lib.qpos('hinge')) + lib.rad(1)"},
        {"label": "way", "expr": "Math.abs(lib.sitePos('end')[2] - ctx.start[2])"},
        {"label": "state", "expr": "data.ncon > 0 ? 'touches' : 'flies'"},
        {"label": "colour", "expr": "model.geom_rgba[5] * 3 + model.jnt_qposadr[1]"},
        {"label": "steps", "expr": "ctx.count", "digits": 0},
        {"label": "told", "expr": "`${data.xpos[2].toFixed(2)} m, ${ctx.count} ${ctx.gain}`"},
        {"label": "told too", "expr": "(1 / 3).toFixed(3) + 'm'"},
    ],
    "verify": {"seconds": 1},
}  # fmt: skip


@pytest.fixture(scope="module")
def open_engines(tmp_path_factory: pytest.TempPathFactory) -> Iterator[OpenEngines]:
    engines = OpenEngines(tmp_path_factory.mktemp("engines"))
    yield engines
    engines.close()


@pytest.fixture
def tried(course: Path, open_engines: OpenEngines) -> Tried:
    """Tries the labs of a lesson."""

    def tried(*labs: dict[str, Any]) -> list[TrialResult]:
        return try_all(course, open_engines, *labs)

    return tried


@pytest.fixture
def course(tmp_path: Path) -> Path:
    root = tmp_path / "course"
    (root / "content" / "lessons").mkdir(parents=True)
    (root / "content" / "course.toml").write_text(
        '[course]\ntitle = "A course"\n\n[[level]]\nid = "1"\ntitle = "One"\n\n[[level.lesson]]\n'
        'id = "1.1"\nslug = "first"\ntitle = "First"\nstatus = "complete"\n'
    )
    return root


def try_all(root: Path, engines: Engines, *labs: dict[str, Any]) -> list[TrialResult]:
    """The labs of a lesson after their trials."""
    fences = "".join(f"```lab\n{json.dumps(lab, ensure_ascii=False)}\n```\n\n" for lab in labs)
    (root / "content" / "lessons" / "1.1-first.md").write_text(f"## First\n\n{fences}")
    loaded = load(root)
    assert loaded.course is not None and not loaded.diagnostics, loaded.diagnostics
    options = Options(root=root, jobs=1, quiet=True)
    results, found = try_labs(loaded.course, options, engines)
    # A start that is random every time is told, and is no error.
    assert all(d.rule == "lab-reset" and "random" in fences for d in found)
    return list(results)


def exported(**fields: Any) -> Export | str:
    return export_script(make_lab(**fields), METADATA)


def script(root: Path, result: TrialResult, *values: object) -> str:
    """What a script prints with these values in place of the marks."""
    assert result.output.script is not None, result.line.unexported
    name, text = result.output.script
    for i, value in enumerate(values):
        text = text.replace(f"{{{{control:{i}}}}}", repr(value))
    path = root / name
    path.write_text(text)
    command = [sys.executable, "-W", "error", str(path)]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(command, capture_output=True, text=True, cwd=root, env=environment)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_the_labs_of_lesson_4_2_are_exported(tmp_path: Path) -> None:
    root = tmp_path / "course"
    for part in ("content", "models"):
        shutil.copytree(ROOT / part, root / part)
    loaded = load(root)
    assert loaded.course is not None
    lesson = next(lesson for lesson in loaded.course.lessons if lesson.id == "4.2")
    models = loaded.course.models
    compiled = compile_all(root, [(model.source.path, model.source.text) for model in models])
    facts = {model.name: result for model, result in zip(models, compiled, strict=True)}
    options = Options(root=root, jobs=1, quiet=True)
    documents = frozenset({lesson.path})
    results, found = try_labs(loaded.course, options, Engines(root), facts, documents=documents)
    assert found == ()
    ours = {r.line.name: r for r in results if r.line.tried}
    assert {name: r.line.unexported for name, r in ours.items()} == dict.fromkeys(ours, "")
    assert len(ours) == 3
    (root / "examples").mkdir()
    first = ours["4.2-lab-1"]
    printed = script(root / "examples", first, *[0] * 3, 1)
    assert "kinetic energy (J): 0.06240\n" in printed and "time: 20 s\n" in printed
    # Under Euler the lesson measures 0.06654 J.
    assert "kinetic energy (J): 0.06654\n" in script(root / "examples", first, *[0] * 3, 0)


def test_everything_at_once(tried: Tried, course: Path) -> None:
    (result,) = tried(RICH)
    assert result.line.unexported == ""
    printed = script(course, result, 2, 0.3, -9.81, 0.125, 1, "free").splitlines()
    assert printed[6] == "state: flies" or printed[6] == "state: touches"
    assert printed[8] == "steps: 200" and printed[11] == "time: 1 s"
    assert printed[9:11] == ["told: 0.00 m, 200 2", "told too: 0.333m"]
    other = script(course, result, 4, 0.3, -9.81, 0.125, 0, "held").splitlines()
    assert other[0] != printed[0]


def test_a_script_reads_well(course: Path) -> None:
    lab = make_lab(**RICH)
    export = export_script(lab, METADATA)
    assert isinstance(export, Export)
    assert export.buttons == ("kick", "again")
    text = filled(export, initial_values(lab))
    assert '"""A \'lab\' with / everything: a lab of lesson 1.1, “First”, as a script.\n' in text
    assert "# The control “gain” (N m), from 0 to 4\nGAIN = 2\n" in text
    assert "\nINTEGRATOR = 1\n" in text and '\nMODE = "free"\n' in text
    assert "def reset(model, data, ctx):" in text
    compile(text, "lab.py", "exec")
    assert "normal_force" in text and "def linear_momentum" in text
    ruff = [sys.executable, "-m", "ruff"]
    path = course / "lab.py"
    path.write_text(text)
    done = subprocess.run(
        [*ruff, "check", "--isolated", "--line-length", "130", "--select", "E,F", str(path)],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stdout


@pytest.mark.parametrize(
    "fields, reason",
    [
        ({"setup": "data.qpos[0] = Math.random()"}, "a call of `Math.random`"),
        ({"controller": "sim.pause()"}, "a call of `sim.pause`"),
        ({"controller": "lib.force()"}, "a call of `lib.force`"),
        ({"setup": "[1, 2].forEach((x) => x)"}, "`=>`"),
        ({"setup": "data.contact.get(0)"}, "a call of `data.contact.get`"),
        ({"readouts": [{"label": "x", "expr": "ctx.unknown"}]}, "`ctx.unknown`"),
        ({"readouts": [{"label": "x", "expr": "data.qpos[2].toString()"}]}, "a call"),
        ({"readouts": [{"label": "{{control:0}}", "expr": "1"}]}, "a text that no script can hold"),
    ],
)
def test_what_cannot_be_translated_has_no_script(fields: dict[str, Any], reason: str) -> None:
    assert exported(**fields) == f"{reason} has no counterpart in Python"


def test_code_that_is_nested_too_deeply_has_no_script() -> None:
    for depth in (250, 100_000):
        deep = exported(setup=f"data.qpos[0] = {'Math.abs(' * depth}1{')' * depth}")
        assert deep == "code that is nested too deeply has no counterpart in Python"


def test_a_model_of_several_files_has_no_script() -> None:
    xml = '<mujoco><asset><mesh name="m" file="m.obj"/></asset></mujoco>'
    assert exported(xml=xml) == "the model in the lab may be made of several files"


def test_a_reason_is_told_and_nothing_offered(tried: Tried) -> None:
    lab = {"xml": PENDULUM, "setup": "data.qpos[0] = Math.random()", "verify": {"seconds": 0.1}}
    (result,) = tried(lab)
    assert result.line.status == "ok" and result.output.script is None
    assert result.line.unexported == "a call of `Math.random` has no counterpart in Python"


def wrong(monkeypatch: pytest.MonkeyPatch, old: str, new: str) -> None:
    """Make a mistake in each script."""

    def spoilt(lab: Any, metadata: ExportMetadata) -> Export | str:
        export = export_script(lab, metadata)
        assert isinstance(export, Export) and old in export.text
        return replace(export, text=export.text.replace(old, new))

    monkeypatch.setattr(lab_export, "export_script", spoilt)


@pytest.mark.parametrize(
    "old, new, reason",
    [
        (
            "data.qvel[0] = kick / 4",
            "data.qvel[0] = kick / 4.00001",
            "its state after 200 steps is",
        ),
        ("SECONDS = 1 ", "SECONDS = 0.9 ", "it makes 180 steps, and the lab 200"),
        (
            "linear_momentum(model, data))",
            "linear_momentum(model, data)) + 1",
            "its readout `momentum` is ",
        ),
        ("'flies'", "'sinks'", "its readout `state` is sinks at the start, and that of the lab "),
        ("data.qvel[0] += 1", "data.qvel[77] += 1", "the script fails: IndexError: index 77"),
        ("import math", "import maths", "the script fails: ModuleNotFoundError: No module named"),
    ],
)
def test_a_script_that_differs_is_withheld(
    tried: Tried, monkeypatch: pytest.MonkeyPatch, old: str, new: str, reason: str
) -> None:
    wrong(monkeypatch, old, new)
    (result,) = tried(RICH)
    assert result.output.script is None and result.line.unexported.startswith(reason), (
        result.line.unexported
    )
    assert result.line.status == "ok"


def test_a_script_that_never_ends_is_withheld(
    course: Path, open_engines: OpenEngines, monkeypatch: pytest.MonkeyPatch
) -> None:
    wrong(monkeypatch, "    step(model", "    pass; 0 and step(model")
    with NativeEngine(course, seconds=2.0) as native:
        (result,) = try_all(course, open_engines.but(native=native), RICH)
    assert (result.output.script, result.line.unexported) == (
        None,
        "the script took longer than 2 s",
    )


def test_functions_of_the_c_library_may_differ_in_the_last_bit(tried: Tried) -> None:
    (result,) = tried(
        {"xml": PENDULUM, "controller": "data.ctrl[0] = Math.sin(3 * data.time) ** 3"}
    )
    assert result.line.unexported == ""


def test_what_changes_the_model_is_compared_too(
    tried: Tried, monkeypatch: pytest.MonkeyPatch
) -> None:
    lab = {"xml": PENDULUM, "controller": "model.opt.gravity[0] = sim.time > 0.5 ? 2 : 0"}
    (result,) = tried(lab)
    assert result.line.parity == "compared with native MuJoCo as its Python export"
    assert result.line.unexported == ""
    wrong(monkeypatch, "data.time > 0.5", "data.time > 0.25")
    (result,) = tried({**lab, "title": "another text"})
    assert result.line.unexported.startswith(
        "its state after 200 steps is apart from the lab's by "
    )
    why = "its controller changes the model"
    assert result.line.parity == f"not compared with native MuJoCo: {why}"


def test_the_comparison_is_kept(tried: Tried, monkeypatch: pytest.MonkeyPatch) -> None:
    lab = {"xml": PENDULUM, "verify": {"seconds": 0.1}}
    (first,) = tried(lab)
    runs: list[object] = []
    monkeypatch.setattr(NativeEngine, "script", lambda self, request: runs.append(request))
    (second,) = tried(lab)
    assert second.line.cached and second.output.script == first.output.script and runs == []


def test_a_short_trial_and_a_stop(tried: Tried) -> None:
    fine = PENDULUM.replace('timestep="0.005"', 'timestep="0.0001" iterations="5"')
    labs = [
        {"xml": fine},
        {"xml": PENDULUM, "stopAt": 0.333},
        {"xml": PENDULUM, "stopAt": 0.2, "verify": {"seconds": 0.5}},
        {"xml": PENDULUM, "verify": {"seconds": 0.0125}},
    ]
    assert [result.line.unexported for result in tried(*labs)] == [""] * 4


def test_names_of_files() -> None:
    names = ["4.2-lab-1", "about-lab-2", "Ü b-lab-10"]
    assert [file_name(name) for name in names] == ["lab_4_2_1.py", "lab_about_2.py", "lab_b_10.py"]


def test_a_failed_lab_offers_nothing(course: Path) -> None:
    fences = json.dumps({"xml": PENDULUM, "expect": [{"t": 0, "expr": "1", "min": 2}]})
    (course / "content" / "lessons" / "1.1-first.md").write_text(f"## F\n\n```lab\n{fences}\n```\n")
    loaded = load(course)
    assert loaded.course is not None
    options = Options(root=course, jobs=1, quiet=True)
    (result,), found = try_labs(loaded.course, options, Engines(course))
    assert len(found) == 1 and result.output.script is None and result.line.unexported == ""


def test_the_page_gets_the_script_and_the_report_the_reason(tried: Tried) -> None:
    fine = {"xml": BALL, "verify": {"seconds": 0.1}}
    results = tried(fine, {**fine, "setup": "data.qvel[0] = Math.random()"})
    bundle = [(f"js/{name}", b"") for name in ("lab.js", "lab-worker.js")]
    published = publish_labs(
        Results((), (), (), (), "", "", tuple(results)),
        Assets((), (*bundle, ("mujoco/mujoco.wasm", b""))),
    )
    configs = [json.loads(f.data) for f in published.files if f.path.endswith(".json")]
    scripts = [config.get("exportPython") for config in configs]
    assert results[0].output.script is not None
    assert scripts == [dict(zip(("name", "text"), results[0].output.script, strict=True)), None]
    lines = [lab_line(result.line, Style()) for result in results]
    assert "no Python export" not in lines[0]
    assert "no Python export: a call of `Math.random` has no counterpart" in lines[1]


def test_the_page_fills_a_script_as_the_build_does() -> None:
    source = (ROOT / "site" / "js" / "lab" / "page" / "export.js").read_text()
    isolate = Isolate(
        source.replace("export function", "function")
        + "globalThis.fill = (json) => fillScript(...JSON.parse(json))"
    )
    values: dict[int, float | str] = {0: 1.0, 1: -0.25, 2: 1e-7, 3: 1e21, 4: 'a "b" \\', 5: 1.5e300}
    text = "\n".join(f"{{{{control:{i}}}}}" for i in values)
    theirs = isolate.call("fill", json.dumps([text, list(values.values())]), 10.0).splitlines()
    isolate.close()
    ours = filled(Export("x.py", text, ()), values).splitlines()
    assert [eval(line) for line in theirs] == [eval(line) for line in ours] == [*values.values()]
    assert theirs[0] == ours[0] == "1"
