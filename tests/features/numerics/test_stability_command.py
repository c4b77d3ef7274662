"""`coursebuild stability`, with `--record` and `--check`."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import pytest
from msgspec.structs import replace

from coursebuild.cli import main
from coursebuild.core.model.report_files import STABILITY
from coursebuild.features.bench.commands.measuring import FailedJobError, Failure
from coursebuild.features.numerics.commands import stability
from coursebuild.pipeline.scenes import CourseScene
from mjbench.reports import records
from support.measured_course import Fake, options

Capture = pytest.CaptureFixture[str]
pytestmark = pytest.mark.site


@pytest.fixture(scope="module")
def measured_course(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A course in which one case was measured; what that gave is kept in its store."""
    course = tmp_path_factory.mktemp("measured")
    (course / "content").mkdir()
    (course / "content" / "course.toml").write_text("")
    assert run(course, "projectile") == 0
    return course


@pytest.fixture
def course(measured_course: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(measured_course, tmp_path / "course"))


def run(course: Path, *arguments: str) -> int:
    return main(["-C", str(course), "stability", *arguments, "-q"])


class Disagreeing(Fake):
    """A bench whose references of every case differ, as with a constant that was mistyped."""

    def do(self, job: str, scene: CourseScene | None = None, **values: Any) -> bytes:
        if job == "case":
            raise FailedJobError(DISAGREEMENT)
        return super().do(job, scene, **values)


DISAGREEMENT = Failure("the references of `flat-plate` differ by 3e-06 in position")


def names(course: Path) -> list[str]:
    return [case.name for case in STABILITY.decode((course / STABILITY.path()).read_bytes())]


def test_stability_prints_text_and_then_json_without_measuring_again(
    course: Path, capsys: Capture
) -> None:
    assert main(["-C", str(course), "stability", "projectile", "--no-cache"]) == 0
    out, err = capsys.readouterr()
    assert out.startswith("projectile  case 4: Projectile\n")
    assert "\n  against x = v₀t + gt²/2, and MuJoCo’s accelerations over the MJCF, DOP853\n" in out
    assert "-0.049" in out
    assert "projectile: measured after" in err
    assert main(["-C", str(course), "stability", "projectile", "--format", "json"]) == 0
    out, err = capsys.readouterr()
    assert "measured after" not in err
    (report,) = json.loads(out)
    assert report["case"] == 4
    assert report["reference"]["position"] < 1e-13
    figures = {figure["integrator"]: figure for figure in report["figures"]}
    assert figures["Euler"]["exact"] == -0.04905
    assert abs(figures["Euler"]["measured"] + 0.04905) < 1e-13
    assert {figure["integrator"] for figure in report["errors"]} == set(figures)


def test_stability_of_a_family_and_of_an_unknown_case(course: Path, capsys: Capture) -> None:
    assert main(["-C", str(course), "stability", "tumbling-bocks"]) == 2
    message = capsys.readouterr().err
    assert "no hard case is called `tumbling-bocks`; did you mean `tumbling-box`?" in message
    assert main(["-C", str(course), "stability", "nope"]) == 2
    message = capsys.readouterr().err
    assert message.startswith(
        "coursebuild: no hard case is called `nope`; known: tumbling-box, pendulum-hin"
    )
    assert run(course, "flat", "millimetre") == 0
    out = capsys.readouterr().out
    heads = [line.split()[0] for line in out.splitlines() if line[:1] not in (" ", "")]
    assert heads == ["millimetre-cube", "flat-plate"]


def test_recorded_then_checked(course: Path, capsys: Capture) -> None:
    assert run(course, "projectile", "--record") == 0
    out = capsys.readouterr().out
    assert out.startswith("projectile  case 4: Projectile\n")
    assert out.endswith(f"\nwrote {STABILITY.path()}\n")
    assert run(course, "projectile", "--check") == 0
    assert capsys.readouterr().out == f"stability  as recorded in {STABILITY.path()}\n"


def test_references_that_differ_are_an_error_and_nothing_is_recorded(course: Path) -> None:
    measurement = stability(options(course), Disagreeing(), ("flat-plate",), record=True)
    assert not measurement.ok and measurement.failures[0].message == DISAGREEMENT.message
    assert not (course / STABILITY.path()).exists()


def test_recording_some_cases_leaves_the_others(course: Path) -> None:
    run(course, "flat-plate", "--record")
    before = (course / STABILITY.path()).read_bytes()
    assert run(course, "projectile", "--record") == 0
    assert names(course) == ["projectile", "flat-plate"]
    path = course / STABILITY.path()
    old = replace(records.STABILITY.decode(before)[0], name="no-more")
    path.write_bytes(records.STABILITY.encode((old,)))
    assert run(course, "projectile", "--record") == 0
    assert names(course) == ["projectile"]


def test_a_figure_that_left_its_band(course: Path, capsys: Capture) -> None:
    run(course, "projectile", "--record")
    path = course / STABILITY.path()
    (case,) = records.STABILITY.decode(path.read_bytes())
    figures = tuple(
        replace(line, measured=-0.06) if line.integrator == "Euler" else line
        for line in case.figures
    )
    changed_case = replace(case, machine=replace(case.machine, engine="3.7.0"), figures=figures)
    path.write_bytes(records.STABILITY.encode((changed_case,)))
    capsys.readouterr()
    assert run(course, "projectile", "--check") == 1
    head, remark, _, name, _, figure, _, faults = capsys.readouterr().out.splitlines()
    assert head == f"stability  1 figure not as recorded in {STABILITY.path()}"
    assert remark.startswith("  recorded with MuJoCo 3.7.0, measured with ")
    assert name == "  projectile"
    assert figure.startswith(
        "    Euler    error of the height after 1 s at 10 ms, against theory  -0.01095  "
    )
    assert faults == "1 figure not as recorded"
    assert run(course, "projectile", "--check", "--format", "json") == 1
    document = json.loads(capsys.readouterr().out)
    assert sorted(document) == ["cases", "checked", "diagnostics", "failures", "remarks"]
    (departure,) = document["checked"][0]["departures"]
    assert departure["recorded"] == "-0.01095"


def test_where_there_is_no_report_or_a_damaged_one(course: Path, capsys: Capture) -> None:
    path = course / STABILITY.path()
    assert run(course, "--check") == 1
    assert capsys.readouterr().out.startswith(f"error: {STABILITY.path()} is not there\n  help: ")
    path.parent.mkdir()
    path.write_bytes(b"{}")
    assert run(course, "--check") == 1
    assert capsys.readouterr().out == (
        f"error: {STABILITY.path()} holds no report of `coursebuild stability`\n"
        "  help: make it again with `coursebuild stability --record`\n"
        "\n1 error\n"
    )
    assert run(course, "projectile", "--record") == 1
    assert "holds no report of" in capsys.readouterr().out
    assert path.read_bytes() == b"{}"
