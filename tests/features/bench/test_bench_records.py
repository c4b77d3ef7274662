"""`coursebuild bench --record` and `--check`: what is recorded, and how it is checked."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from msgspec.structs import replace

from coursebuild.features.bench.commands.bench import bench, check
from coursebuild.features.bench.commands.measurement import Measurement
from coursebuild.pipeline.options import UsageError
from coursebuild.pipeline.scenes import find_scenes
from mjbench.reports import records
from mjbench.reports.model_report import SceneReport
from mjbench.reports.scene_report import ScenarioReport
from samples.reports import interval, swing
from support.bench_reports import derived
from support.measured_course import BOX, PATH, TOML, Fake, bench_course, options, write

pytestmark = pytest.mark.site


@pytest.fixture
def course(tmp_path: Path) -> Path:
    return bench_course(tmp_path)


def record(course: Path, *reports: ScenarioReport) -> Measurement[Any]:
    return bench(options(course), Fake(*reports), record=True)


def recorded(course: Path) -> SceneReport:
    """The recorded report, with all its fields."""
    return records.BENCH.decode((course / PATH).read_bytes())


def test_what_is_recorded_is_checked(course: Path) -> None:
    write(course / "models" / "arms" / "left arm.xml", BOX)
    measurement = record(course)
    assert measurement.ok
    paths = ("content/reports/arms/left arm.bench.json", PATH)
    assert measurement.remarks == tuple(f"wrote {path}" for path in paths)
    report = recorded(course)
    assert report.model == "box" and report.scenarios == (derived(swing()),)
    assert report.digest == find_scenes(course, ("box",)).value[0].digest
    fake = Fake()
    check_again = check(options(course), fake)
    assert check_again.ok
    assert [comparison.departures for comparison in check_again.checked] == [(), ()]
    assert fake.calls == [("arms/left arm", 0, False, False), ("box", 0, False, False)]


def test_the_same_bytes_are_not_written_again(course: Path) -> None:
    record(course)
    before = (course / PATH).stat()
    measurement = record(course)
    assert measurement.remarks == (f"{PATH} is unchanged",)
    assert (course / PATH).stat().st_mtime_ns == before.st_mtime_ns


def test_a_figure_that_left_its_band_fails(course: Path) -> None:
    record(course)
    rows = list(swing().rows)
    rows[2] = replace(rows[2], velocity=(1.0, 1.0), cost=interval(1000.0))
    fake = Fake(replace(swing(), rows=tuple(rows)))
    measurement = check(options(course), fake)
    assert not measurement.ok
    (comparison,) = measurement.checked
    assert (comparison.name, comparison.path) == ("box", PATH)
    figures = {departure.figure for departure in comparison.departures}
    assert figures == {"error of velocity", "error of velocity at the end"}
    write(course / "models" / "box.toml", f"[bench]\nband = 1.0\n{TOML}")
    rows[2] = replace(rows[2], velocity=tuple(1.9 * x for x in swing().rows[2].velocity or ()))  # type: ignore[arg-type]
    wide = check(options(course), Fake(replace(swing(), rows=tuple(rows))))
    assert wide.ok
    remark = "the model or its scenarios have changed since it was recorded"
    assert wide.checked[0].remarks == (remark,)


def test_a_report_that_is_not_there_or_none_or_of_something_else(course: Path) -> None:
    write(course / "models" / "left arm.xml", BOX)
    fake = Fake()
    measurement = check(options(course), fake)
    assert not measurement.ok and fake.calls == []
    arm_path = "content/reports/left arm.bench.json"
    assert [(failure.message, failure.help) for failure in measurement.failures] == [
        (f"{path} is not there", f"make it with `coursebuild bench {name} --record`, and commit it")
        for path, name in ((PATH, "box"), (arm_path, "'left arm'"))
    ]
    record(course)
    report = recorded(course)
    for data, message in (
        (b'{"holds": "mjbench bench", "version": 2}', "has version 2 of its format, and this tool"),
        (records.BENCH.encode(replace(report, model="arm")), "holds a report of the model `arm`"),
        (
            records.BENCH.encode(replace(report, quick=True)),
            "holds a report of `coursebuild bench --quick`, which measures only a part",
        ),
    ):
        (course / PATH).write_bytes(data)
        (failure,) = check(options(course), Fake(), ("box",)).failures
        assert failure.message.startswith(f"{PATH} {message}")
        assert failure.help == "make it again with `coursebuild bench box --record`"


def test_a_part_is_not_recorded(course: Path) -> None:
    reason = " cannot be combined with --quick: recorded measurements are complete"
    with pytest.raises(UsageError, match=f"--record{reason}"):
        bench(options(course), Fake(), quick=True, record=True)
    with pytest.raises(UsageError, match=f"--check{reason}"):
        check(options(course), Fake(), quick=True)


def test_where_nothing_can_be_written(course: Path, tmp_path: Path) -> None:
    (tmp_path / "away").mkdir()
    (course / "content" / "reports").symlink_to(tmp_path / "away")
    (failure,) = record(course).failures
    assert failure.message == f"{PATH} leads out of the project"
    (course / "content" / "reports").unlink()
    (course / "content" / "reports").write_text("a file")
    (failure,) = record(course).failures
    assert failure.message == f"{PATH} cannot be written: file exists"
    assert list((tmp_path / "away").iterdir()) == []


def test_another_engine_is_reported(course: Path) -> None:
    record(course)
    report = recorded(course)
    machine = replace(report.machine, engine="3.13.0", system="Plan 9 mips")
    (course / PATH).write_bytes(records.BENCH.encode(replace(report, machine=machine)))
    (comparison,) = check(options(course), Fake()).checked
    assert comparison.remarks[0].startswith("recorded with MuJoCo 3.13.0, measured with ")
    assert comparison.remarks[1].startswith("recorded with Plan 9 mips, measured with ")
