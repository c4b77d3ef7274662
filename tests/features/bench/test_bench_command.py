"""`coursebuild bench` from end to end, as a process and through its arguments."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from coursebuild.cli import main
from support.measured_course import TOML, bench_course, write
from support.scratch_course import ROOT

Capture = pytest.CaptureFixture[str]
pytestmark = pytest.mark.site


@pytest.fixture
def course(tmp_path: Path) -> Path:
    return bench_course(tmp_path)


def run(course: Path, *arguments: str) -> int:
    return main(["-C", str(course), "bench", *arguments])


@pytest.mark.slow
def test_bench_prints_a_table_and_json(course: Path, capsys: Capture) -> None:
    write(course / "models" / "box.toml", TOML)
    assert run(course, "--quick") == 0
    out, err = capsys.readouterr()
    assert out.startswith("box  (quick: fewer settings, rough times)\n  swing\n")
    assert "\n  swing\n" in out and "RK4" in out and "the model's own" in out
    assert "measuring (1)\n  box\n  box: measured after " in err
    assert run(course, "--quick", "--format", "json", "-q") == 0
    out, err = capsys.readouterr()
    assert err == ""
    rows = json.loads(out)["scenes"][0]["scenarios"][0]["rows"]
    by_integrator = [(row["setting"]["integrator"], row) for row in rows]
    assert {name for name, _ in by_integrator} >= {"Euler", "RK4", "implicit", "discrete"}
    assert [row["setting"]["timestep"] for row in rows if row["own"]] == [0.002]
    assert all(row["position"][0] < 1e-3 for name, row in by_integrator if name == "RK4")


def test_bench_with_wrong_arguments_gives_2(course: Path, capsys: Capture) -> None:
    assert run(course, "bix") == 2
    assert "no model is called `bix`; did you mean `box`?" in capsys.readouterr().err
    with pytest.raises(SystemExit) as caught:
        run(course, "--record", "--check")
    assert caught.value.code == 2


def test_bench_without_models_says_so(course: Path, capsys: Capture) -> None:
    (course / "models" / "box.xml").unlink()
    assert run(course, "-q") == 0
    assert capsys.readouterr().out == "there is no model to measure\n"


@pytest.mark.slow
def test_ctrl_c_ends_bench_and_leaves_no_litter(course: Path) -> None:
    write(course / "models" / "box.toml", TOML.replace("0.2", "2000"))
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    with subprocess.Popen(
        [sys.executable, "-m", "coursebuild", "-C", str(course), "bench"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=environment,
        cwd=course,
    ) as process:
        assert process.stderr is not None
        while process.stderr.readline() != "  box\n":
            assert process.poll() is None
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=300)
    # Python ends by the signal itself if that came while an import executed a text.
    assert process.returncode in (130, -signal.SIGINT), err
    assert err.endswith("interrupted\n")
    assert out == ""
    assert sorted(path.name for path in course.iterdir()) == [".coursebuild", "content", "models"]
