"""`coursebuild bench`: which models are measured, and what is stored."""

from __future__ import annotations

import io
import re
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest
from msgspec.structs import replace

from coursebuild.features.bench.commands.bench import bench
from coursebuild.features.bench.commands.measuring import Failure, KeyPlace
from coursebuild.pipeline.options import Progress
from coursebuild.pipeline.scenes import CourseScene
from samples.reports import swing
from support.bench_reports import swing as shown_swing
from support.measured_course import BOX, TOML, Fake, bench_course, options, take_calls, write

pytestmark = pytest.mark.site


@pytest.fixture
def course(tmp_path: Path) -> Path:
    return bench_course(tmp_path)


def test_bench_measures_every_model_that_is_no_part_of_another(course: Path) -> None:
    write(course / "models" / "arms" / "left arm.xml", BOX)
    write(course / "models" / "part.xml", "<mujocoinclude/>")
    write(course / "models" / "legs.xml", BOX)
    write(course / "models" / "walker.xml", '<mujoco><include file="legs.xml"/></mujoco>')
    fake = Fake()
    measurement = bench(options(course), fake)
    assert [scene.model for scene in measurement.reports] == ["arms/left arm", "box", "walker"]
    assert measurement.ok
    for name in ("arms/left arm", "models/arms/left arm.xml", "./models/arms/left arm.xml", "legs"):
        (report,) = bench(options(course), fake, (name,)).reports
        assert report.model == ("legs" if name == "legs" else "arms/left arm")


def test_model_that_does_not_compile_keeps_no_other_from_being_measured(course: Path) -> None:
    write(course / "models" / "bad.xml", BOX.replace('size="0.1"', 'size="-1"'))
    write(course / "models" / "worse.xml", "<mujoco>\n  <worldbody>\n")
    measurement = bench(options(course), Fake())
    assert [scene.model for scene in measurement.reports] == ["box"]
    assert not measurement.ok
    first, second = measurement.diagnostics
    assert first.rule == second.rule == "model-error"
    assert first.message.startswith("the model `bad` does not compile: ")
    place = ("models/bad.xml", '<geom size="-1" pos="0 0 -1"/>')
    assert (first.span.path, first.span.text) == place
    assert second.span.path == "models/worse.xml"


def test_a_scenario_that_cannot_be_measured_is_reported(course: Path) -> None:
    write(course / "models" / "arm.xml", BOX)
    write(course / "models" / "box.toml", TOML)
    place = KeyPlace("models/box.toml", ("scenario", 0, "qvel"))
    measurement = bench(options(course), Fake(Failure("no way", "", place, "scenario")), ("box",))
    assert measurement.reports == ()
    (diagnostic,) = measurement.diagnostics
    assert (diagnostic.rule, diagnostic.message) == ("scenario-model", "no way")
    assert (diagnostic.span.path, diagnostic.span.text) == ("models/box.toml", "[")


def test_model_is_measured_again_only_where_something_changed(course: Path) -> None:
    write(course / "models" / "box.toml", TOML)
    fake = Fake()

    def run(**settings: Any) -> list[str]:
        measurement = bench(options(course, **settings), fake)
        assert measurement.reports[0].scenarios == (shown_swing(),)
        return take_calls(fake)

    assert run() == ["box"]
    assert run() == []
    assert run(fresh=True) == ["box"]
    keep = '\n# said\n[[keep]]\nfinding = "a"\nreason = "b"\n'
    write(course / "models" / "box.toml", TOML + keep)
    assert run() == []  # it says the same of the scenario
    write(course / "models" / "box.toml", TOML.replace("0.2", "0.4"))
    assert run() == ["box"]
    write(course / "models" / "box.xml", BOX + "<!-- -->")
    assert run() == ["box"]
    bench(options(course), fake, quick=True)
    assert fake.calls == [("box", 0, True, True)]


def test_scenarios_measured_before_an_interruption_are_kept(course: Path) -> None:
    write(course / "models" / "box.toml", TOML + TOML.replace("swing", "other"))
    fake = Fake(swing(), KeyboardInterrupt())
    with pytest.raises(KeyboardInterrupt):
        bench(options(course), fake)
    assert [number for _, number, *_ in fake.calls] == [0, 1]
    fake = Fake(swing(), replace(swing(), name="other"))
    measurement = bench(options(course), fake)
    assert [number for _, number, *_ in fake.calls] == [1]
    assert [scenario.name for scenario in measurement.reports[0].scenarios] == ["swing", "other"]


def test_two_runs_at_once_measure_one_after_the_other(course: Path) -> None:
    running: list[int] = []
    most = 0

    class Slow(Fake):
        def measure(self, scene: CourseScene, **settings: Any) -> bytes:
            nonlocal most
            running.append(1)
            most = max(most, len(running))
            never.wait(0.2)
            running.pop()
            return super().measure(scene, **settings)

    never = threading.Event()
    fakes = [Slow(), Slow()]
    with ThreadPoolExecutor() as pool:
        list(pool.map(lambda fake: bench(options(course), fake), fakes))
    assert most == 1
    assert sum(len(fake.calls) for fake in fakes) == 1


class Terminal(io.StringIO):
    """A terminal that keeps what was written to it."""

    def isatty(self) -> bool:
        return True


def test_terminal_shows_what_is_measured_just_now(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TERM", "xterm")
    terminal = Terminal()
    progress = Progress(terminal)
    with progress.stage("measuring", 2):
        progress.start("box")
        progress.describe("box", "swing: RK4 at 0.002 s")
        until = time.monotonic() + 120
        while not re.search(r"box \(swing: RK4 at 0\.002 s\) \d+ s", terminal.getvalue()):
            assert time.monotonic() < until
            time.sleep(0.01)
        progress.finish("box", "measured", 1.0)
        progress.skip()
        while "measuring 2/2  \r" not in terminal.getvalue():
            assert time.monotonic() < until
            time.sleep(0.01)
