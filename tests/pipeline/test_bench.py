"""`coursebuild bench`: which models, what is kept, what is recorded and checked."""

from __future__ import annotations

import io
import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
from coursekit import ROOT

sys.path.insert(0, str(ROOT / "tests" / "measured"))

from benchkit import swing

from coursebuild.cli import main
from coursebuild.diagnostics import Diagnostic, diagnose
from coursebuild.effects.store import Store
from coursebuild.measured.bench import ScenarioReport
from coursebuild.measured.records import decode_bench, encode_bench
from coursebuild.pipeline.bench import Benched, bench, check, record
from coursebuild.pipeline.measuring import Loaded
from coursebuild.pipeline.options import Options, UsageError
from coursebuild.pipeline.progress import Progress
from coursebuild.pipeline.scenes import Scene, find_scenes
from coursebuild.values import replace

BOX = """\
<mujoco>
  <option timestep="0.002"/>
  <worldbody>
    <body>
      <joint axis="0 1 0"/>
      <geom size="0.1" pos="0 0 -1"/>
    </body>
  </worldbody>
</mujoco>
"""
TOML = '[[scenario]]\nname = "swing"\nduration = 0.2\nsample = 0.02\nqvel = [1.0]\n'


class Fake:
    """Says what it was told to, and what it was asked."""

    def __init__(self, *found: ScenarioReport | Diagnostic | BaseException) -> None:
        self.found = list(found) or [swing()]
        self.asked: list[tuple[str, int, bool, bool]] = []

    def scenarios_of(self, root: Path, scene: Scene, *, quick: bool) -> Loaded | Diagnostic:
        assert root.is_absolute()
        scenes: Any = tuple(self.found)
        return Loaded(scene, None, scenes)

    def measured(
        self, loaded: Loaded, number: int, *, quick: bool, timed: bool, tell: Callable[[str], None]
    ) -> ScenarioReport | Diagnostic:
        tell("swing: Euler")
        self.asked.append((loaded.scene.name, number, quick, timed))
        found = self.found[number]
        if isinstance(found, BaseException):
            raise found
        return found


@pytest.fixture
def course(tmp_path: Path) -> Path:
    root = tmp_path / "a cöurse"
    write(root / "content" / "course.toml", "")
    write(root / "models" / "box.xml", BOX)
    return root


def write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")


def options(root: Path, **other: Any) -> Options:
    return Options(root, 1, True, Store(root, **other))


def asked(fake: Fake) -> list[str]:
    names = [name for name, *_ in fake.asked]
    fake.asked.clear()
    return names


# --- which


def test_every_model_that_is_no_part_of_another(course: Path) -> None:
    write(course / "models" / "arms" / "left arm.xml", BOX)
    write(course / "models" / "part.xml", "<mujocoinclude/>")
    write(course / "models" / "legs.xml", BOX)
    write(course / "models" / "walker.xml", '<mujoco><include file="legs.xml"/></mujoco>')
    fake = Fake()
    found = bench(options(course), measuring=fake)
    assert [scene.model for scene in found.scenes] == ["arms/left arm", "box", "walker"]
    assert found.ok
    for name in ("arms/left arm", "models/arms/left arm.xml", "./models/arms/left arm.xml"):
        assert [s.model for s in bench(options(course), (name,), measuring=fake).scenes] == [
            "arms/left arm"
        ]
    assert [s.model for s in bench(options(course), ("legs",), measuring=fake).scenes] == ["legs"]


def test_a_name_that_is_none(course: Path) -> None:
    with pytest.raises(UsageError, match="no model is called `bix`; did you mean `box`\\?"):
        bench(options(course), ("bix",), measuring=Fake())
    with pytest.raises(UsageError, match="no model is called `\\*`; known: `box`"):
        bench(options(course), ("*",), measuring=Fake())


def test_what_does_not_compile_is_told_and_the_others_are_measured(course: Path) -> None:
    write(course / "models" / "bad.xml", BOX.replace('size="0.1"', 'size="-1"'))
    write(course / "models" / "worse.xml", "<mujoco>\n  <worldbody>\n")
    found = bench(options(course), measuring=Fake())
    assert [scene.model for scene in found.scenes] == ["box"]
    assert not found.ok
    first, second = found.diagnostics
    assert first.rule == second.rule == "model-error"
    assert first.message.startswith("the model `bad` does not compile: ")
    assert (first.span.path, first.span.text) == (
        "models/bad.xml",
        '<geom size="-1" pos="0 0 -1"/>',
    )
    assert second.span.path == "models/worse.xml"


def test_what_is_declared_wrongly_is_told(course: Path) -> None:
    write(course / "models" / "box.toml", TOML + 'keyframe = "up"\n')
    write(course / "models" / "arm.xml", BOX)
    write(course / "models" / "arm.toml", "[[scenarjo]]\n")
    write(course / "models" / "bocks.toml", TOML)
    found = bench(options(course), measuring=Fake())
    assert found.scenes == ()
    assert found.diagnostics[0].message.startswith("unknown")
    assert "there is no model models/bocks.xml to which these scenarios belong" in {
        d.message for d in found.diagnostics
    }
    assert "the model has no keyframe `up`" in {d.message for d in found.diagnostics}
    one = bench(options(course), ("box",), measuring=Fake())
    assert [d.span.path for d in one.diagnostics] == ["models/box.toml"]


def test_a_scenario_that_cannot_be_measured_is_told(course: Path) -> None:
    write(course / "models" / "arm.xml", BOX)
    scene = find_scenes(course, ("box",)).scenes[0]
    wrong = diagnose("scenario-model", scene.model.source.span(0, 0), "no way")
    found = bench(options(course), ("box",), measuring=Fake(swing(), wrong))
    assert found.scenes == () and [d.message for d in found.diagnostics] == ["no way"]


# --- what is kept


def test_measured_again_only_where_something_changed(course: Path) -> None:
    write(course / "models" / "box.toml", TOML)
    fake = Fake()

    def run(**how: Any) -> list[str]:
        found = bench(options(course, **how), measuring=fake)
        assert found.scenes[0].scenarios == (swing(),)
        return asked(fake)

    assert run() == ["box"]
    assert run() == []
    assert run(fresh=True) == ["box"]
    write(
        course / "models" / "box.toml", f'{TOML}\n# said\n[[keep]]\nfinding = "a"\nreason = "b"\n'
    )
    assert run() == []  # it says the same of the scenario
    write(course / "models" / "box.toml", TOML.replace("0.2", "0.4"))
    assert run() == ["box"]
    write(course / "models" / "box.xml", BOX + "<!-- -->")
    assert run() == ["box"]
    bench(options(course), quick=True, measuring=fake)
    assert fake.asked == [("box", 0, True, True)]


def test_files_that_a_model_pulls_in_count(course: Path) -> None:
    write(course / "models" / "in" / "legs.xml", BOX)
    write(course / "models" / "box.xml", '<mujoco><include file="in/legs.xml"/></mujoco>')
    before = find_scenes(course).scenes[0].digest
    assert before == find_scenes(course).scenes[0].digest
    write(course / "models" / "in" / "legs.xml", BOX.replace("0.1", "0.2"))
    assert find_scenes(course).scenes[0].digest != before


def test_what_was_done_before_a_run_was_stopped_is_kept(course: Path) -> None:
    fake = Fake(swing(), KeyboardInterrupt())
    with pytest.raises(KeyboardInterrupt):
        bench(options(course), measuring=fake)
    assert [number for _, number, *_ in fake.asked] == [0, 1]
    fake = Fake(swing(), replace(swing(), name="other"))
    found = bench(options(course), measuring=fake)
    assert [number for _, number, *_ in fake.asked] == [1]
    assert [one.name for one in found.scenes[0].scenarios] == ["swing", "other"]


def test_what_is_damaged_is_measured_again(course: Path) -> None:
    fake = Fake()
    bench(options(course), measuring=fake)
    for kind in ("bench", "bench-scenarios"):
        for path in (course / ".coursebuild" / kind).iterdir():
            path.write_bytes(path.read_bytes()[:-1])
    bench(options(course), measuring=fake)
    assert asked(fake) == ["box", "box"]


def test_two_runs_at_once_measure_one_after_the_other(course: Path) -> None:
    running: list[int] = []
    most = 0

    class Slow(Fake):
        def measured(self, *args: Any, **how: Any) -> ScenarioReport | Diagnostic:
            nonlocal most
            running.append(1)
            most = max(most, len(running))
            gone.wait(0.2)
            running.pop()
            return super().measured(*args, **how)

    gone = threading.Event()
    fakes = [Slow(), Slow()]
    threads = [
        threading.Thread(target=lambda fake=fake: bench(options(course), measuring=fake))
        for fake in fakes
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert most == 1
    assert sum(len(fake.asked) for fake in fakes) == 1


class Terminal(io.StringIO):
    """A terminal that keeps what was written to it."""

    def isatty(self) -> bool:
        return True


def test_a_terminal_is_told_what_is_at_work(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TERM", "xterm")
    terminal = Terminal()
    progress = Progress(terminal)
    with progress.stage("measuring", 2):
        progress.started("box")
        progress.doing("box", "swing: RK4 at 0.002 s")
        until = time.monotonic() + 10
        while "box (swing: RK4 at 0.002 s) 0 s" not in terminal.getvalue():
            assert time.monotonic() < until
            time.sleep(0.01)
        progress.finished("box", "measured", 1.0)
        progress.known()
        while "measuring 2/2  \r" not in terminal.getvalue():
            assert time.monotonic() < until
            time.sleep(0.01)


# --- recorded

PATH = "content/reports/box.bench.json"


def recorded(course: Path, *found: ScenarioReport) -> Benched:
    fake: Any = Fake(*found)
    return record(options(course), measuring=fake)


@pytest.fixture
def no_cards(monkeypatch: pytest.MonkeyPatch) -> None:
    """What a model is made of is told elsewhere."""
    monkeypatch.setattr("coursebuild.pipeline.cards.with_card", lambda root, scene, report: report)


@pytest.mark.usefixtures("no_cards")
class TestRecords:
    """`--record` and `--check`."""

    def test_what_is_recorded_is_checked(self, course: Path) -> None:
        write(course / "models" / "arms" / "left arm.xml", BOX)
        found = recorded(course)
        assert found.ok
        assert found.remarks == (
            "wrote content/reports/arms/left arm.bench.json",
            f"wrote {PATH}",
        )
        report = decode_bench((course / PATH).read_bytes())
        assert report.model == "box" and report.scenarios == (swing(),)
        assert report.digest == find_scenes(course, ("box",)).scenes[0].digest
        fake = Fake()
        again = check(options(course), measuring=fake)
        assert again.ok
        assert [one.departures for one in again.checked] == [(), ()]
        assert fake.asked == [("arms/left arm", 0, False, False), ("box", 0, False, False)]

    def test_the_same_bytes_are_not_written_again(self, course: Path) -> None:
        recorded(course)
        before = (course / PATH).stat()
        found = recorded(course)
        assert found.remarks == (f"{PATH} is as it was",)
        assert (course / PATH).stat().st_mtime_ns == before.st_mtime_ns

    def test_a_figure_that_left_its_band_fails(self, course: Path) -> None:
        recorded(course)
        rows = list(swing().rows)
        rows[2] = replace(rows[2], velocity=(1.0, 1.0), cost=1000.0)
        fake = Fake(replace(swing(), rows=tuple(rows)))
        found = check(options(course), measuring=fake)
        assert not found.ok
        (one,) = found.checked
        assert (one.name, one.path) == ("box", PATH)
        assert {d.figure for d in one.departures} == {
            "error of velocity",
            "error of velocity at the end",
        }
        write(course / "models" / "box.toml", f"[bench]\nband = 1.0\n{TOML}")
        rows[2] = replace(rows[2], velocity=tuple(1.9 * x for x in swing().rows[2].velocity or ()))  # type: ignore[arg-type]
        wide = check(options(course), measuring=Fake(replace(swing(), rows=tuple(rows))))
        assert wide.ok
        assert wide.checked[0].remarks == (
            "the model or its scenarios have changed since it was recorded",
        )

    def test_a_report_that_is_not_there(self, course: Path) -> None:
        write(course / "models" / "left arm.xml", BOX)
        fake = Fake()
        found = check(options(course), measuring=fake)
        assert not found.ok and fake.asked == []
        assert [(one.message, one.help) for one in found.failures] == [
            (
                f"{PATH} is not there",
                "make it with `coursebuild bench box --record`, and commit it",
            ),
            (
                "content/reports/left arm.bench.json is not there",
                "make it with `coursebuild bench 'left arm' --record`, and commit it",
            ),
        ]

    @pytest.mark.parametrize(
        ("data", "message"),
        [
            (b"{", f"{PATH} is damaged: input data was truncated"),
            (b"{}", f"{PATH} holds no report of `coursebuild bench`"),
            (
                b'{"holds": "coursebuild bench", "form": 0}',
                f"{PATH} was written by an older version of this tool (form 0, not 1)",
            ),
        ],
    )
    def test_a_report_that_is_none(self, course: Path, data: bytes, message: str) -> None:
        (course / "content" / "reports").mkdir()
        (course / PATH).write_bytes(data)
        (failure,) = check(options(course), measuring=Fake()).failures
        assert failure.message == message
        assert failure.help == "make it again with `coursebuild bench box --record`"

    def test_a_report_of_something_else(self, course: Path) -> None:
        recorded(course)
        report = decode_bench((course / PATH).read_bytes())
        for other, message in (
            (replace(report, model="arm"), f"{PATH} holds a report of the model `arm`"),
            (
                replace(report, quick=True),
                f"{PATH} holds a report of `coursebuild bench --quick`, which measures only a part",
            ),
        ):
            (course / PATH).write_bytes(encode_bench(other))
            (failure,) = check(options(course), measuring=Fake()).failures
            assert failure.message == message

    def test_a_report_of_no_model_is_told(self, course: Path) -> None:
        recorded(course)
        (course / "content/reports/gone").mkdir()
        (course / "content/reports/gone/arm.bench.json").write_bytes(b"{}")
        found = check(options(course), measuring=Fake())
        assert found.ok
        assert found.remarks == ("content/reports/gone/arm.bench.json belongs to no model",)
        assert check(options(course), ("box",), measuring=Fake()).remarks == ()

    def test_a_part_is_not_recorded(self, course: Path) -> None:
        for command, option in ((record, "--record"), (check, "--check")):
            why = f"{option} takes no --quick: what is recorded is measured in full"
            with pytest.raises(UsageError, match=why):
                command(options(course), quick=True, measuring=Fake())

    def test_where_nothing_can_be_written(self, course: Path, tmp_path: Path) -> None:
        (tmp_path / "away").mkdir()
        (course / "content" / "reports").symlink_to(tmp_path / "away")
        (failure,) = recorded(course).failures
        assert failure.message == f"{PATH} leads out of the project"
        (course / "content" / "reports").unlink()
        (course / "content" / "reports").write_text("a file")
        (failure,) = recorded(course).failures
        assert failure.message == f"{PATH} cannot be written: file exists"
        assert list((tmp_path / "away").iterdir()) == []

    def test_another_engine_is_told(self, course: Path) -> None:
        recorded(course)
        report = decode_bench((course / PATH).read_bytes())
        machine = replace(report.machine, engine="3.13.0", system="Plan 9 mips")
        (course / PATH).write_bytes(encode_bench(replace(report, machine=machine)))
        (one,) = check(options(course), measuring=Fake()).checked
        assert one.remarks[0].startswith("recorded with MuJoCo 3.13.0, measured with ")
        assert one.remarks[1].startswith("recorded with Plan 9 mips, measured with ")


# --- the command


def run(course: Path, *arguments: str) -> int:
    return main(["-C", str(course), "bench", *arguments])


@pytest.mark.slow
def test_the_command_from_end_to_end(course: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write(course / "models" / "box.toml", TOML)
    plot = course / "plot.svg"
    assert run(course, "--quick", "--plot", str(plot)) == 0
    out, err = capsys.readouterr()
    assert out.startswith("box  quick: fewer settings, rough times\n  MuJoCo ")
    assert "\n  swing  " in out and "RK4" in out and "the scene's own" in out
    assert out.endswith("\nwrote plot.svg\n")
    assert "measuring (1)\n  box\n  box: measured after " in err
    assert ElementTree.fromstring(plot.read_bytes()).tag.endswith("svg")
    assert run(course, "--quick", "--format", "json", "-q") == 0
    out, err = capsys.readouterr()
    assert err == ""
    rows = json.loads(out)["rows"]
    assert {one["integrator"] for one in rows} >= {"Euler", "RK4", "implicit", "discrete"}
    assert [one["timestep"] for one in rows if one["own"]] == [0.002]
    errors = [one["position_error"] for one in rows if one["integrator"] == "RK4"]
    assert all(error is not None and error < 1e-3 for error in errors)


@pytest.mark.slow
def test_recorded_by_one_command_and_checked_by_another(
    course: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write(course / "models" / "box.toml", TOML)
    assert run(course, "--check", "-q") == 1
    assert "make it with `coursebuild bench box --record`" in capsys.readouterr().out
    assert run(course, "--record", "-q") == 0
    assert capsys.readouterr().out.endswith(f"\nwrote {PATH}\n")
    assert run(course, "--check", "-q") == 0
    assert capsys.readouterr().out == f"box  as recorded in {PATH}\n"
    path = course / PATH
    report = decode_bench(path.read_bytes())
    (one,) = report.scenarios
    wrong = tuple(replace(r, velocity=(0.5, 0.5)) if r.own else r for r in one.rows)
    path.write_bytes(encode_bench(replace(report, scenarios=(replace(one, rows=wrong),))))
    assert run(course, "--check", "-q") == 1
    out = capsys.readouterr().out
    assert out.startswith(f"box  2 figures not as recorded in {PATH}\n\n  swing\n")
    assert "error of velocity " in out and "0.5" in out and "± 5 %" in out


def test_wrong_usage(course: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(course, "bix") == 2
    assert "no model is called `bix`; did you mean `box`?" in capsys.readouterr().err
    assert run(course, "--check", "--quick") == 2
    assert "--check takes no --quick" in capsys.readouterr().err
    assert run(course, "--plot", "plot.png") == 2
    assert "--plot: 'plot.png' is no name of an SVG file: plot.svg" in capsys.readouterr().err
    assert run(course, "--plot", str(course / "no" / "plot.svg")) == 2
    assert "--plot: there is no folder" in capsys.readouterr().err
    with pytest.raises(SystemExit) as caught:
        run(course, "--record", "--check")
    assert caught.value.code == 2


def test_a_course_without_models(course: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (course / "models" / "box.xml").unlink()
    assert run(course, "-q") == 0
    assert capsys.readouterr().out == "there is no model to measure\n"


def test_a_model_that_does_not_compile(course: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write(course / "models" / "box.xml", BOX.replace("<joint", "<joynt"))
    assert run(course, "-q") == 1
    out = capsys.readouterr().out
    assert out.startswith("error[model-error]: the model `box` does not compile: ")
    assert " --> models/box.xml:5:7" in out


@pytest.mark.slow
def test_ctrl_c_ends_it_and_leaves_no_litter(course: Path) -> None:
    write(course / "models" / "box.toml", TOML.replace("0.2", "2000"))
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    with subprocess.Popen(
        [sys.executable, "-m", "coursebuild", "-C", str(course), "bench"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=environment,
        cwd=course,
    ) as running:
        assert running.stderr is not None
        while running.stderr.readline() != "  box\n":
            assert running.poll() is None
        running.send_signal(signal.SIGINT)
        out, err = running.communicate(timeout=60)
    assert running.returncode == 130
    assert err.endswith("interrupted\n")
    assert out == ""
    assert sorted(path.name for path in course.iterdir()) == [".coursebuild", "content", "models"]
