"""`coursebuild diet`."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import pytest

from coursebuild.cli import main
from coursebuild.core.model.report_files import DIET
from support.fixture_cases import fixture_text
from support.scratch_course import ROOT, course_map

Capture = pytest.CaptureFixture[str]
pytestmark = pytest.mark.site

MODEL = fixture_text("documents/diet_model.xml")
LESSON = fixture_text("documents/diet_lesson.md")
CLEAN = MODEL.replace('    <flag energy="enable"/> <!-- for the plot -->\n', "")


@pytest.fixture
def course(tmp_path: Path) -> Path:
    (tmp_path / "content").mkdir()
    (tmp_path / "content" / "course.toml").write_text(course_map(1))
    (tmp_path / "models").mkdir()
    (tmp_path / "models" / "swing.xml").write_text(MODEL)
    return tmp_path


def run(course: Path, *arguments: str) -> int:
    return main(["-C", str(course), "diet", "--quick", *arguments])


def values(course: Path, capsys: Capture, *arguments: str) -> tuple[int, Any]:
    capsys.readouterr()
    status = run(course, *arguments, "--format", "json", "-q")
    out, err = capsys.readouterr()
    assert err == ""
    return status, json.loads(out)


def test_diet_shows_a_finding_as_text_and_as_json(course: Path, capsys: Capture) -> None:
    assert run(course) == run(course) == 1
    out, err = capsys.readouterr()
    assert err.count("swing: looked at after") == 1, "the model did not change"
    text = "  energy-flag: energy is computed in every step, and nothing reads it\n    proved; "
    assert text in out and "shown by `coursebuild diet swing --only energy-flag`" in out
    assert '    models/swing.xml:6:5\n    - <flag energy="enable"/>\n' in out
    assert "1 finding not explained, 1 of them for `coursebuild diet swing --fix`" in out
    assert "integrator and timestep are judged against a reference" in out
    status, value = values(course, capsys)
    assert status == 1
    (model,) = value["models"]
    assert model["model"] == "swing" and model["quick"] and not model["ok"]
    assert [scenario["status"] for scenario in model["scenarios"]] == ["ok"]
    (finding,) = model["findings"]
    assert finding["label"] == "proved" and finding["fixable"]
    element = "mujoco/option/flag"
    place = {
        "name": "energy",
        "element": element,
        "path": "models/swing.xml",
        "line": 6,
        "column": 5,
    }
    assert finding["places"] == [place]
    (edit,) = finding["edits"]
    assert edit["old"].strip() == '<flag energy="enable"/>' and edit["new"] == ""


def test_fix_changes_only_what_is_in_vain_and_then_nothing(course: Path, capsys: Capture) -> None:
    """Line ends, a byte order mark and letters beyond ASCII stay."""
    file = course / "models" / "swing.xml"
    text = "\ufeff" + MODEL.replace("bob", "Kügelchen")
    file.write_bytes(text.replace("\n", "\r\n").encode())
    file.chmod(0o640)
    assert run(course, "--fix") == 0
    assert "changed models/swing.xml: energy-flag" in capsys.readouterr().out
    expected = text.replace('<flag energy="enable"/> ', "").replace("\n", "\r\n").encode()
    assert file.read_bytes() == expected and file.stat().st_mode & 0o777 == 0o640
    status = file.stat()
    assert run(course, "--fix") == 0
    assert "changed" not in capsys.readouterr().out
    assert file.stat().st_mtime_ns == status.st_mtime_ns and file.read_bytes() == expected


def test_fix_takes_what_goes_together_and_leaves_what_only_runs_speak_for(
    course: Path, capsys: Capture
) -> None:
    file = course / "models" / "swing.xml"
    spare = """  <asset>
    <material name="spare" texture="spots"/>
    <texture name="spots" type="2d" builtin="flat" width="8" height="8"/>
  </asset>
"""
    far = '    <body name="far" pos="900 0 1"><freejoint/><geom size=".1"/></body>\n'
    whole = CLEAN.replace("  </worldbody>", far + "  </worldbody>")
    file.write_text(whole.replace("<mujoco>\n", "<mujoco>\n" + spare))
    assert run(course, "--fix") == 0
    out = capsys.readouterr().out
    assert "changed models/swing.xml: unused-material, unused-texture" in out
    assert file.read_text() == whole
    assert "far-body: what the scene is about (bob) moves in the same way without the body far" in (
        " ".join(out.split())
    )


def test_a_finding_is_kept_with_a_reason(course: Path, capsys: Capture) -> None:
    declarations = course / "models" / "swing.toml"
    declarations.write_text('[[keep]]\nfinding = "energy-flag"\nreason = "shown in class"\n')
    assert run(course) == 0
    out = capsys.readouterr().out
    assert "    kept: shown in class\n" in out and "nothing else in it is proved useless" in out
    assert run(course, "--fix") == 0
    assert (course / "models" / "swing.xml").read_text() == MODEL
    declarations.write_text('[[keep]]\nfinding = "energy-flags"\nreason = "shown in class"\n')
    status, value = values(course, capsys)
    assert status == 1 and value["models"][0]["stale"] == [
        {"finding": "energy-flags", "path": "models/swing.toml", "line": 2, "column": 11}
    ]


@pytest.mark.long
def test_energy_that_a_lesson_reads_is_no_finding(course: Path, capsys: Capture) -> None:
    lessons = course / "content" / "lessons"
    lessons.mkdir()
    lesson = lessons / "1.1-one.md"
    lesson.write_text(LESSON.replace("SCRIPT", 'print("another model")'))
    assert run(course) == 1
    for name in ('"sw" + "ing"', '"swing"'):
        use = f"model_path({name})\nprint(data.energy)"
        lesson.write_text(LESSON.replace("SCRIPT", use))
        assert run(course) == 0
    # A lab's own code may read for the lesson.
    lesson.write_text(LESSON.replace("SCRIPT", 'model_path("swing")'))
    assert run(course) == 1
    (course / "content" / "labs").mkdir()
    twin = course / "content" / "labs" / "twin.js"
    twin.write_text("data.energy[0]")
    assert run(course) == 0
    # What a script imports may load the model for it, and what it hands on to may read.
    twin.unlink()
    (course / "content" / "course.toml").write_text(
        course_map(1).replace("[course]", '[course]\npackages = ["lib"]')
    )
    (course / "lib").mkdir()
    (course / "lib" / "swings.py").write_text('model_path("swing")\n')
    shows = course / "lib" / "shows.py"
    shows.write_text("def show(data):\n    print(data.energy)\n")
    lesson.write_text(LESSON.replace("SCRIPT", "import swings\nprint(data.energy)"))
    assert run(course) == 0
    lesson.write_text(LESSON.replace("SCRIPT", "import swings, shows"))
    assert run(course) == 0
    shows.write_text("def show(data):\n    print(data.qpos)\n")
    assert run(course) == 1


@pytest.mark.long
def test_a_part_without_which_a_script_prints_something_else_is_no_finding(
    course: Path, capsys: Capture
) -> None:
    """No scenario shows that the far body is gone, but the number of positions does."""
    far = '<body pos="900 0 1"><freejoint/><geom size=".1"/></body>\n  </worldbody>'
    (course / "models" / "swing.xml").write_text(CLEAN.replace("  </worldbody>", far))
    lessons = course / "content" / "lessons"
    lessons.mkdir()
    script = 'import mujoco\nm = mujoco.MjModel.from_xml_path(str(model_path("swing")))\nprint('
    (lessons / "1.1-one.md").write_text(LESSON.replace("SCRIPT", f"{script}m.nq)"))
    main(["-C", str(course), "diet"])
    output = " ".join(capsys.readouterr().out.split())
    assert "far-body: what the scene is about" not in output
    assert "because examples/a.py prints something else then: far-body" in output


@pytest.mark.long
def test_measured_sensor_is_read_and_unused_keyframe_is_interface(
    course: Path, capsys: Capture
) -> None:
    keys = '  <keyframe><key name="go" qpos="1"/><key name="rest"/></keyframe>\n</mujoco>'
    sensor = '  <sensor><clock name="time"/></sensor>\n'
    (course / "models" / "swing.xml").write_text(CLEAN.replace("</mujoco>", sensor + keys))
    declarations = course / "models" / "swing.toml"
    declarations.write_text('[[scenario]]\nname = "a"\nkeyframe = "go"\nmeasure = "sensor:time"\n')
    status, value = values(course, capsys)
    (finding,) = value["models"][0]["findings"]
    assert status == 0 and finding["kind"] == "unused-keyframe"
    assert finding["label"] == "interface", "its code may be elsewhere"
    assert [place["name"] for place in finding["places"]] == ["rest"]
    declarations.write_text('[[scenario]]\nname = "a"\nkeyframe = 0\nconserved = ["energy"]\n')
    status, value = values(course, capsys)
    findings = {finding["kind"]: finding for finding in value["models"][0]["findings"]}
    assert set(findings) == {"unused-keyframe", "sensor-unread"}
    assert [place["name"] for place in findings["unused-keyframe"]["places"]] == ["rest"]
    declarations.write_text('[[scenario]]\nname = "a"\nkeyframe = "rest"\n')
    _, value = values(course, capsys)
    kinds_found = {finding["kind"] for finding in value["models"][0]["findings"]}
    assert "unused-keyframe" not in kinds_found, "the page of the model begins in the first one"
    sweep = '[[sweep]]\nname = "noise"\nvary = { "sensor:time.cutoff" = [1], "VARIED" = [1] }\n'
    # A ball of this size would hit the wall that the pendulum's cannot reach.
    wall = '<worldbody><geom size=".1" pos="2 0 1"/>'
    text = CLEAN.replace("<worldbody>", wall).replace("</mujoco>", sensor + "</mujoco>")
    (course / "models" / "swing.xml").write_text(text)
    for varied, kinds in (("joint.damping", {"contact-off"}), ("geom.size[0]", set())):
        declarations.write_text(sweep.replace("VARIED", varied))
        status, value = values(course, capsys)
        findings = value["models"][0]["findings"]
        assert {finding["kind"] for finding in findings if finding["fixable"]} == kinds


SHARED_PART = fixture_text("documents/shared_part.xml")


def test_a_file_of_two_models_is_not_changed(course: Path, capsys: Capture) -> None:
    models = course / "models"
    (models / "part.xml").write_text(SHARED_PART)
    text = CLEAN.replace("<mujoco>", '<mujoco>\n  <include file="part.xml"/>')
    (models / "swing.xml").write_text(text)
    assert run(course, "swing", "--fix") == 0
    assert "energy" not in (models / "part.xml").read_text()
    (models / "part.xml").write_text(SHARED_PART)
    (models / "other.xml").write_text(text)
    capsys.readouterr()
    assert run(course, "swing", "--fix") == 1
    out = " ".join(capsys.readouterr().out.split())
    assert "not for --fix: models/other.xml uses models/part.xml too" in out
    assert (models / "part.xml").read_text() == SHARED_PART


def test_other_users_of_a_file_need_what_they_name(course: Path, capsys: Capture) -> None:
    """Another model, a text in a lesson, and what is measured on a part and read of it."""
    models, lessons = course / "models", course / "content" / "lessons"
    materials = "".join(f'<material name="{name}"/>' for name in "abc")
    sites = "".join(f'<site name="at_{name}"/>' for name in "de")
    part = "<mujoco><asset>{}</asset><worldbody>{}</worldbody></mujoco>".format
    (models / "arm.xml").write_text(part(materials, sites))
    include = '<mujoco>\n  <include file="arm.xml"/>'
    (models / "swing.xml").write_text(CLEAN.replace("<mujoco>", include))
    user = f'{include}<worldbody><geom size="1" material="{{}}"/></worldbody></mujoco>'
    (models / "other.xml").write_text(user.format("a"))
    (models / "arm.toml").write_text('[[scenario]]\nname = "a"\nmeasure = "site:at_d"\n')
    lessons.mkdir()
    (lessons / "1.1-one.md").write_text(f"## A\n\n```mjcf\n{user.format('b')}\n```\n")
    _, value = values(course, capsys, "swing")
    findings = value["models"][0]["findings"]
    faults = {f["kind"]: [p["name"] for p in f["places"]] for f in findings}
    assert faults == {"unused-material": ["c"], "unused-site": ["at_e"]}
    attached = """<mujoco><asset><model name="a" file="swing.xml"/></asset><worldbody>
    <attach model="a" body="bob" prefix="p"/></worldbody></mujoco>"""
    (lessons / "1.1-one.md").write_text(f"## A\n\n```mjcf\n{attached}\n```\n")
    status, value = values(course, capsys, "swing")
    assert status == 0 and {t["reason"] for t in value["models"][0]["tried"]} >= {
        "content/lessons/1.1-one.md:3 may notice (it attaches models/swing.xml)"
    }


def test_where_a_file_cannot_be_written_none_is(course: Path, capsys: Capture) -> None:
    models = course / "models"
    (models / "part.xml").write_text(SHARED_PART)
    text = MODEL.replace("<mujoco>", '<mujoco>\n  <include file="part.xml"/>')
    (models / "swing.xml").write_text(text)
    (models / "swing.xml").chmod(0o444)
    assert run(course, "--fix") == 1
    assert "error: models/swing.xml is read-only" in capsys.readouterr().out
    assert (models / "part.xml").read_text() == SHARED_PART
    (models / "swing.xml").chmod(0o644)
    assert run(course) == 1, "what was not written is not taken for done"
    assert run(course, "--fix") == 0
    assert (models / "part.xml").read_text() != SHARED_PART


def test_a_report_is_recorded(course: Path, capsys: Capture) -> None:
    path = course / "content" / "reports" / "swing.diet.json"
    assert main(["-C", str(course), "diet", "--record"]) == 1
    assert "wrote content/reports/swing.diet.json" in capsys.readouterr().out
    report = DIET.decode(path.read_bytes())
    assert report.model == "swing"
    assert [finding.kind for finding in report.findings] == ["energy-flag"]


def test_what_is_recorded_is_whole_and_nothing_else_is_done(course: Path, capsys: Capture) -> None:
    assert run(course, "--record") == 2
    assert "--record cannot be combined with --quick" in capsys.readouterr().err
    with pytest.raises(SystemExit):
        run(course, "--record", "--fix")


def test_diet_without_models_says_so(course: Path, capsys: Capture) -> None:
    shutil.rmtree(course / "models")
    assert run(course) == 0
    assert capsys.readouterr().out == "there is no model to look at\n"


def test_a_broken_model_keeps_no_other_from_being_looked_at(course: Path, capsys: Capture) -> None:
    models = course / "models"
    (models / "broken.xml").write_text("<mujoco><worldbody><gem/></worldbody></mujoco>")
    # MuJoCo's own parser takes a bare ampersand.
    (models / "loose.xml").write_text('<mujoco model="a & b"/>')
    (models / "swing.toml").write_text('[[scenario]]\nname = "a"\nqpos = [1, 2]\n')
    (models / "good.xml").write_text(CLEAN)
    assert run(course, "-q", "good") == 0
    assert capsys.readouterr().out == "", "a quiet run tells only what is wrong"
    status, value = values(course, capsys)
    assert status == 1 and [model["model"] for model in value["models"]] == ["good"]
    messages = {d["path"]: d["message"] for d in value["diagnostics"]}
    assert set(messages) == {"models/broken.xml", "models/loose.xml", "models/swing.toml"}
    assert messages["models/loose.xml"] == (
        "models/loose.xml:1:19 is not XML: not well-formed (invalid token)"
    )
    expected = "`qpos` has 2 numbers, and the model has 1 positions (`nq`)"
    assert messages["models/swing.toml"] == expected


def test_a_scenario_that_diverges_is_reported(course: Path, capsys: Capture) -> None:
    text = MODEL.replace("<joint", '<joint stiffness="1e7"')
    key = '  <keyframe><key name="go" qpos="1"/></keyframe>\n</mujoco>'
    (course / "models" / "swing.xml").write_text(text.replace("</mujoco>", key))
    assert main(["-C", str(course), "diet"]) == 1
    out = " ".join(capsys.readouterr().out.split())
    assert (
        "in no scenario scenario go: diverged: the state is not finite; MuJoCo warned of bad" in out
    )
    assert "nothing is claimed from it" in out and "energy-flag" not in out


@pytest.mark.slow
def test_the_models_of_this_course_pass_their_own_diet(tmp_path: Path, capsys: Capture) -> None:
    for name in ("content", "models"):
        shutil.copytree(ROOT / name, tmp_path / name)
    status = run(tmp_path)
    assert status == 0, capsys.readouterr().out
