"""`coursebuild bench --engines`: rows of engines that work, refuse, fail, crash and hang."""

from __future__ import annotations

import importlib.util
from collections.abc import Sequence
from pathlib import Path

import pytest
from msgspec.structs import replace

from coursebuild.cli import main
from coursebuild.core.files.errors import EffectError, UsageError
from coursebuild.core.model.measurements import (
    BatchCost,
    EngineReport,
    EngineRow,
    EngineScenario,
    Interval,
)
from coursebuild.core.model.report_files import ENGINES
from coursebuild.core.model.results import Reports
from coursebuild.features.bench.commands.engines import (
    ChosenEngine,
    bench_engines,
    chosen_engines,
    engines_text,
)
from coursebuild.report.text import Style
from support.bench_reports import MACHINE, swing
from support.fake_engines import ENGINES as FAKE_ENGINES
from support.measured_course import TOML, bench_course, options, write
from support.rendered_course import Make

FAKES = ("support.fake_engines",)
PATH = "content/reports/box.engines.json"


@pytest.fixture
def course(tmp_path: Path) -> Path:
    course = bench_course(tmp_path)
    write(course / "models" / "box.toml", TOML)
    return course


def choose(names: Sequence[str]) -> tuple[ChosenEngine, ...]:
    return chosen_engines(",".join(names), FAKES)[0]


def rows(course: Path, *names: str, seconds: float = 900.0) -> dict[str, EngineRow]:
    engines = choose(names)
    (report,) = bench_engines(
        options(course), ("box",), engines, quick=True, seconds=seconds
    ).reports
    return {row.engine: row for row in report.scenarios[0].rows}


@pytest.mark.long
@pytest.mark.site
def test_each_engine_has_a_row_whatever_it_does(course: Path) -> None:
    names = ("single", "wild", "alone", "picky", "broken", "crash", "driverless")
    found_rows = rows(course, *names)
    assert tuple(found_rows) == names
    messages = {name: (row.status, row.message) for name, row in found_rows.items()}
    long = messages.pop("broken")
    assert messages == {
        "single": ("ok", ""),
        "wild": ("diverged", "the state is not finite at 0.02 s"),
        "alone": ("ok", ""),
        "picky": ("unsupported", "NotImplementedError: hinges are not implemented"),
        "crash": ("failed", "its process ended with status 7"),
        "driverless": ("failed", "ImportError: no driver"),
    }
    assert long[0] == "failed" and long[1].startswith("ValueError: what what")
    assert len(long[1]) == 300
    single, alone = found_rows["single"], found_rows["alone"]
    assert single.bits == 32 and single.versions[0][0] == "mujoco"
    assert single.position is not None and 0 < single.position[0] < 0.01
    assert single.apart is not None and 1e-12 < single.apart < 1e-5, "rounding, and nothing else"
    assert single.energy_drift is not None and abs(single.energy_drift) < 0.1
    assert [cost.worlds for cost in single.costs] == [1, 64]
    for cost in single.costs:
        assert cost.seconds is not None and cost.seconds.low <= cost.seconds.value
        assert cost.ratio is not None and cost.ratio.value > 0 and cost.compile_seconds is not None
    assert alone.apart == single.apart
    assert [cost.remark for cost in alone.costs] == ["", "its process ended with status 3"]


@pytest.mark.site
def test_an_engine_that_hangs_costs_its_row_only(course: Path) -> None:
    """The limit is shorter than a process takes to start; where it strikes makes no difference."""
    row = rows(course, "hang", seconds=2.0)["hang"]
    assert (row.status, row.message) == ("failed", "its process took longer than 2 s")


@pytest.mark.long
@pytest.mark.site
def test_engines_agree_with_mujoco_where_they_are_mujoco(course: Path) -> None:
    engines, _ = chosen_engines("mujoco,threads")
    measurement = bench_engines(options(course), ("box",), engines, record=True)
    assert measurement.remarks == (f"wrote {PATH}",)
    report = ENGINES.decode((course / PATH).read_bytes(), "box")
    assert report == measurement.reports[0]
    single, threads = report.scenarios[0].rows
    assert single.apart == 0 and threads.apart is not None and threads.apart < 1e-12
    assert [cost.worlds for cost in single.costs] == [1]
    assert [cost.worlds for cost in threads.costs] == [1, 64, 4096]


def test_engines_are_chosen_by_name() -> None:
    names = [engine.name for engine in choose(("crash", " single", "crash"))]
    assert names == ["crash", "single"]
    with pytest.raises(UsageError) as unknown:
        choose(("singel",))
    assert str(unknown.value).startswith("there is no engine `singel`; did you mean `single`?")
    with pytest.raises(EffectError) as absent:
        choose(("absent",))
    assert (absent.value.message, absent.value.help) == (
        "the engine `absent` needs the package an_engine_that_nobody_has",
        "run `pip install 'coursebuild[engines]'`",
    )
    installed, remarks = chosen_engines("", FAKES)
    assert [engine.name for engine in installed] == [n for n in FAKE_ENGINES if n != "absent"]
    assert remarks == ("Absent is not installed: `pip install 'coursebuild[engines]'` brings it",)


@pytest.mark.site
def test_what_cannot_be_asked_for(course: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for arguments, message in (
        (
            "--check",
            "--check takes no --engines: 32 bits do not repeat from one device to the next",
        ),
        ("--record --quick", "--record cannot be combined with --quick"),
    ):
        command = ["-C", str(course), "bench", "box", "--engines", "mujoco", *arguments.split()]
        assert main(command) == 2
        assert message in capsys.readouterr().err


def interval(value: float) -> Interval:
    return Interval(value, value * 0.99, value * 1.01)


def report() -> EngineReport:
    """What nobody measured."""
    base = EngineRow(None, None, None, "mjx", "MJX", (("mujoco-mjx", "3.14.0"),), "ok")
    single = replace(
        base,
        position=(2e-3, 1e-3),
        velocity=(1e-3, 1e-3),
        device="gpu",
        label="A Card",
        bits=32,
        apart=4.6e-7,
        energy_drift=0.01,
        compile_seconds=7.5,
        costs=(
            BatchCost(1, interval(9e-6), interval(12.0), 7.5),
            BatchCost(64, interval(1e-6), interval(1.25), 9.5),
            BatchCost(4096, remark="not tried: a step would take about 1e+02 s"),
        ),
    )
    double = replace(base, bits=64, device="cpu", status="failed", message="TypeError: <int64>")
    refusal = replace(base, engine="x", title="X", status="unsupported", message="no cones")
    setting = swing().rows[0].setting
    rows = (single, double, refusal)
    reference = ("ode", "a source", 1e-12, 1e-12)
    scenario = EngineScenario("swing", "A swing", 1.0, 0.5, *reference, setting, rows)
    return EngineReport("box", "0", False, MACHINE, 3.25, (scenario,))


def test_the_text_of_a_report() -> None:
    text = engines_text([report()], Style(width=160))
    words = " ".join(text.split())
    assert "MJX, 32 bits, A Card 0.00200" in words
    assert "9 µs ×12 1 µs ×1.2 –" in words
    assert "MJX, 64 bits: failed: TypeError: <int64>" in words
    assert "X: refused: no cones" in words
    assert "MJX, 32 bits, A Card, 4096 worlds: not tried: a step would take about 1e+02 s." in words
    assert "When it began, about 3.2 other programs wanted to run" in words


def test_no_column_is_left_out_where_the_terminal_is_narrow() -> None:
    lines = engines_text([report()], Style(width=60)).splitlines()
    start = lines.index("    Engine                Position (m or rad)")
    assert [line.strip() for line in lines[start::5]][:5] == [
        "Engine                Position (m or rad)",
        "Engine                From MuJoCo (rad, or of the extent)",
        "Engine                 1 world  64 worlds  4096 worlds",
        "Engine                Velocity (m/s or rad/s)",
        "Engine                Energy drift  To compile",
    ]
    assert lines[start + 11] == "    MJX, 32 bits, A Card  9 µs ×12  1 µs ×1.2            –"


def test_the_pages_show_a_report(make: Make) -> None:
    reports = Reports(engines={"box": report()})
    files = make("## A\n\n```bench box show=engines\n```\n").site(reports=reports)
    pages = [files[path].decode() for path in ("models/box.html", "1.1-a.html") if path in files]
    lesson = next(
        data.decode()
        for path, data in files.items()
        if path.endswith(".html") and b"bench scenario" in data
    )
    for page in (*pages, lesson):
        assert "TypeError: &lt;int64&gt;" in page and "refused: no cones" in page
        assert page.count('class="work-precision"') == 2
        assert "time of a step by the number of worlds" in page
    empty = make("## A\n\n```bench box show=engines\n```\n").site(reports=Reports())
    text = "".join(data.decode() for path, data in empty.items() if path.endswith(".html"))
    assert "coursebuild bench box --engines --record" in text


@pytest.mark.slow
@pytest.mark.parametrize("name", ["mjx", "warp"])
def test_a_real_engine_follows_mujoco(course: Path, name: str) -> None:
    module = {"mjx": "mujoco.mjx", "warp": "mujoco_warp"}[name]
    if importlib.util.find_spec(module) is None:
        pytest.skip(f"{module} is not installed: `pip install 'coursebuild[engines]'`")
    engines, _ = chosen_engines(name)
    measurement = bench_engines(options(course), ("box",), engines, quick=True)
    for row in measurement.reports[0].scenarios[0].rows:
        assert row.status == "ok", row.message
        assert row.apart is not None and row.apart < (1e-4 if row.bits == 32 else 1e-12)
        assert all(cost.seconds is not None for cost in row.costs), row.costs
