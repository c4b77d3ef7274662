"""`coursebuild stability`."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from coursebuild.cli import main

pytestmark = pytest.mark.site


@pytest.fixture
def course(tmp_path: Path) -> Path:
    (tmp_path / "content").mkdir()
    (tmp_path / "content" / "course.toml").write_text("")
    return tmp_path


def test_stability_prints_text_and_then_json_without_measuring_again(
    course: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["-C", str(course), "stability", "projectile"]) == 0
    out, err = capsys.readouterr()
    assert out.startswith("projectile  case 4: Projectile\n")
    assert "\n  References: x = v₀t + gt²/2; MuJoCo’s accelerations over the MJCF, DOP853.\n" in out
    assert "−0.049" in out
    assert "projectile: measured after" in err
    assert main(["-C", str(course), "stability", "projectile", "--format", "json", "-q"]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    (report,) = json.loads(out)
    assert report["case"] == 4
    assert report["reference"]["position"] < 1e-13
    figures = {one["integrator"]: one for one in report["figures"]}
    assert figures["Euler"]["exact"] == -0.04905
    assert abs(figures["Euler"]["measured"] + 0.04905) < 1e-13
    assert {one["integrator"] for one in report["errors"]} == set(figures)
    assert main(["-C", str(course), "stability", "projectile", "--no-cache"]) == 0
    assert "projectile: measured after" in capsys.readouterr().err


def test_stability_of_a_family_and_of_an_unknown_case(
    course: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["-C", str(course), "stability", "tumbling-bocks"]) == 2
    said = capsys.readouterr().err
    assert "no hard case is called `tumbling-bocks`; did you mean `tumbling-box`?" in said
    assert main(["-C", str(course), "stability", "nope"]) == 2
    said = capsys.readouterr().err
    assert said.startswith(
        "coursebuild: no hard case is called `nope`; known: tumbling-box, pendulum-hinge-90, "
    )
    assert main(["-C", str(course), "stability", "flat", "millimetre", "-q"]) == 0
    out = capsys.readouterr().out
    heads = [line.split()[0] for line in out.splitlines() if line[:1] not in (" ", "")]
    assert heads == ["millimetre-cube", "flat-plate"]
