"""`coursebuild bench --engines`: what it prints, and what pages show."""

from __future__ import annotations

from pathlib import Path

import pytest
from msgspec.structs import replace

from coursebuild.cli import main
from coursebuild.core.model.measurements import (
    BatchCost,
    EngineReport,
    EngineRow,
    EngineScenario,
    Interval,
)
from coursebuild.core.model.report_files import ENGINES
from coursebuild.core.model.results import Reports
from support.bench_reports import MACHINE, swing
from support.measured_course import TOML, bench_course, write
from support.rendered_course import Make

PATH = "content/reports/box.engines.json"


@pytest.fixture
def course(tmp_path: Path) -> Path:
    course = bench_course(tmp_path)
    write(course / "models" / "box.toml", TOML)
    return course


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


@pytest.mark.long
@pytest.mark.site
def test_engines_agree_with_mujoco_where_they_are_mujoco(
    course: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["-C", str(course), "bench", "box", "--engines", "mujoco,threads", "--record"]
    assert main(command) == 0
    assert capsys.readouterr().out.endswith(f"wrote {PATH}\n")
    (scenario,) = ENGINES.decode((course / PATH).read_bytes(), "box").scenarios
    single, threads = scenario.rows
    assert single.apart == 0 and threads.apart is not None and threads.apart < 1e-12
    assert [cost.worlds for cost in single.costs] == [1]
    assert [cost.worlds for cost in threads.costs] == [1, 64, 4096]
    assert main([*command[:5], "mjocuo"]) == 2
    assert "there is no engine `mjocuo`: known are mujoco, " in capsys.readouterr().err
