"""Recorded reports on the pages of a built site: what fits is shown, and nothing else is drawn."""

from __future__ import annotations

import time
from collections.abc import Callable

import pytest
from msgspec.structs import replace

from coursebuild.core.run.versions import engine_version
from coursebuild.numerics.reports.records import BENCH, STABILITY
from coursebuild.pipeline.load import load
from coursebuild.pipeline.scenes import scene_digest
from support.model_reports import case
from support.preview_process import serving
from support.recorded_course import BOX, NUMERICS, PAGE, Course
from support.scratch_course import GOOD, Folder

pytestmark = pytest.mark.site


@pytest.fixture
def course(make: Callable[..., Folder]) -> Course:
    made = Course(make(GOOD))
    made.record()
    return made


def test_what_was_recorded_is_shown(course: Course) -> None:
    assert course.build() == ""
    page = course.page()
    assert 'class="work-precision"' in page and "Nobody reads it." in page
    assert "It swings." in course.page(NUMERICS)
    assert (course.folder.root / "public/files/reports/box.bench.json").is_file()
    assert "not measured" in course.page("models/cup.html").lower()


def test_a_report_draws_its_page_and_no_other(course: Course) -> None:
    assert course.drawn() > {PAGE, NUMERICS}
    assert course.drawn() == set()
    course.write_diet("it is far away")
    assert course.drawn() == {PAGE}
    course.write_cases("it hangs")
    assert course.drawn() == {NUMERICS}
    slower = replace(course.bench(), card=None)
    course.folder.write(BENCH.path("box"), BENCH.encode(slower))
    assert course.drawn() == {PAGE}
    (course.folder.root / STABILITY.path()).unlink()
    assert course.drawn() == {"index.html", PAGE, "models/cup.html", "models/arm/part.html"}


def stale(course: Course) -> str:
    told = course.build()
    assert 'class="work-precision"' not in course.page()
    assert "Not measured." in course.page()
    return told


@pytest.mark.parametrize("path", ["models/box.xml", "models/arm/part.xml"])
def test_a_model_or_a_part_of_it_that_changed_leaves_its_reports_out(
    course: Course, path: str
) -> None:
    course.build()
    course.folder.write(
        path, course.folder.text(path).replace("</mujoco>", "<!-- new --></mujoco>")
    )
    told = stale(course)
    assert told.count("warning[report-stale]") == 2
    assert "`box`, its files or its scenarios have changed since" in told
    assert "help: make it again with `coursebuild bench box --record`" in told
    assert "help: make it again with `coursebuild diet box --record`" in told
    assert "It swings." in course.page(NUMERICS)
    course.record()
    assert course.build() == ""
    assert 'class="work-precision"' in course.page()


def test_scenarios_that_changed_leave_reports_out(course: Course) -> None:
    course.folder.write("models/box.toml", '[[scenario]]\nname = "fall"\nduration = 1\n')
    assert "scenarios have changed since" in stale(course)


def test_another_version_of_mujoco_leaves_reports_out(course: Course) -> None:
    machine = replace(course.bench().machine, engine="3.0.0")
    course.folder.write(BENCH.path("box"), BENCH.encode(course.bench(machine=machine)))
    told = stale(course)
    installed = engine_version()
    assert f"it is of MuJoCo 3.0.0, and {installed} is installed" in told
    cases = (case("spring", 5, machine=machine),)
    course.folder.write(STABILITY.path(), STABILITY.encode(cases))
    assert stale(course).count("warning[report-stale]") == 2
    assert not (course.folder.root / "public" / NUMERICS).exists()


def test_damaged_reports_keep_nothing_from_being_published(course: Course) -> None:
    for path in (BENCH.path("box"), STABILITY.path()):
        course.folder.write(path, course.folder.read(path)[:-40])
    course.folder.write("content/reports/notes.json", "mine")
    told = stale(course)
    assert told.count("is damaged: ") == 2
    assert "notes.json" not in told


def test_the_preview_follows_a_report(course: Course) -> None:
    def shown(path: str, text: str) -> bool:
        until = time.monotonic() + 300
        while text not in preview.get(path)[2].decode():
            if time.monotonic() > until:
                return False
            time.sleep(0.05)
        return True

    with serving(course.folder) as preview:
        assert shown(PAGE, "Nobody reads it.")
        assert shown(NUMERICS, "It swings.")
        course.write_diet("it is far away")
        course.write_cases("it hangs")
        assert shown(PAGE, "It is far away.")
        assert shown(NUMERICS, "It hangs.")
        course.folder.write("models/box.xml", BOX.replace("<mujoco>", "<mujoco >"))
        assert shown(PAGE, "Not measured.")


def test_a_model_with_an_unusual_name(course: Course) -> None:
    name = "odd & old/it's a <cup> ü"
    course.folder.write(f"models/{name}.xml", "<mujoco/>\n")
    found = load(course.folder.root).course
    assert found is not None
    model = next(one for one in found.models if one.name == name)
    digest = scene_digest(course.folder.root, model, None)
    report = replace(course.bench(), model=name, digest=digest)
    course.folder.write(BENCH.path(name), BENCH.encode(report))
    assert course.build() == ""
    page = course.page(f"models/{name}.html")
    assert "coursebuild bench &#39;odd &amp; old/it&#39;&#34;&#39;" in page
    assert "reports/odd%20&amp;%20old/" in page or "reports/odd%20%26%20old/" in page
    course.folder.write(f"models/{name}.xml", "<mujoco></mujoco>\n")
    assert f"`{name}`, its files or its scenarios have changed since" in course.build()
