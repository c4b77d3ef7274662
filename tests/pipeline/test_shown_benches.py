"""Recorded reports inside of lessons: on the page and in its other forms, drawn again when due."""

from __future__ import annotations

import json
import re
import time
import zipfile
from collections.abc import Callable

import pytest
from msgspec.structs import replace

from coursebuild.numerics.reports.records import BENCH
from support.preview_process import serving
from support.recorded_course import PAGE, Course
from support.scratch_course import GOOD, Folder

pytestmark = pytest.mark.site

SCENARIOS = '[[scenario]]\nname = "swing"\n\n[[scenario]]\nname = "awkward"\n'
FENCES = """## Speed

What it costs, as [the model's page](model:box#measured-awkward) has it.

```bench box
```

```bench box scenario=awkward show=stable,orders
```

- in a list

  ```bench box show=table
  ```
"""


@pytest.fixture
def course(make: Callable[..., Folder]) -> Course:
    made = Course(make(GOOD, FENCES))
    made.folder.write("models/box.toml", SCENARIOS)
    made.record()
    return made


def lesson(course: Course, suffix: str = "html") -> str:
    (path,) = (course.folder.root / "public/lessons").glob(f"1.2-*.{suffix}")
    return path.read_text("utf-8")


def figures(page: str) -> list[str]:
    """The shown reports of a page, without what is drawn."""
    parts = page.split('<figure class="bench scenario">')[1:]
    return [
        re.sub(r"<svg.*?</svg>", "<svg>", part.split("</figure>")[0], flags=re.S) for part in parts
    ]


def test_a_report_stands_in_the_lesson(course: Course) -> None:
    assert course.build() == ""
    page = lesson(course)
    whole, tables, alone = figures(page)
    assert '<a href="../models/box.html#measured-swing">box</a>: A pendulum swings' in whole
    assert whole.count("<svg>") == 2 and '<details class="more-figures">' in whole
    assert "RK4 at 20 ms costs 0.39 times as much" in whole
    assert "coursebuild bench box --record" in whole and "NumPy 2.3.0" in whole
    assert "#measured-awkward" in tables and "<svg>" not in tables and "<details" not in tables
    assert "<svg>" not in alone and "<details" not in alone
    assert 'aria-label="Settings: A pendulum swings"' in alone
    names = {
        n for pair in re.findall(r'aria-labelledby="(_bench[^"]*)"', page) for n in pair.split()
    }
    assert len(names) == 4 and all(page.count(f'id="{name}"') == 1 for name in names)
    anchors = re.findall(r'id="(measured[^"]*)"', course.page())
    assert anchors == ["measured", "measured-swing", "measured-awkward"]
    assert "1.2" in course.page().split('id="used"')[1]  # the lesson uses the model


def test_report_is_in_markdown_notebook_ebook_and_search(course: Course) -> None:
    course.build()
    root = course.folder.root / "public"
    twin = lesson(course, "md")
    assert "**[box](../models/box.md#measured-swing): A pendulum swings**" in twin
    assert "error of" in twin and "| Euler at 2 ms |" in twin and "<svg" not in twin
    cells = json.loads(lesson(course, "ipynb"))["cells"]
    assert any("| Euler at 2 ms |" in "".join(cell["source"]) for cell in cells)
    assert course.folder.main("export", "epub").status == 0
    with zipfile.ZipFile(course.folder.root / "course.epub") as book:
        texts = [book.read(n).decode() for n in book.namelist() if n.endswith(".xhtml")]
    assert sum(text.count('class="work-precision"') for text in texts) == 1
    assert not any("plot-wide" in text for text in texts)
    searched = [path.read_text("utf-8") for path in root.rglob("*.js")]
    assert any("A pendulum swings" in text and "What it costs" in text for text in searched)


def test_another_report_draws_the_lesson_and_nothing_else(course: Course) -> None:
    def path(drawn: set[str]) -> set[str]:
        return {re.sub(r"1\.2-.*", "1.2", one) for one in drawn}

    assert {PAGE, "lessons/1.2"} < path(course.drawn())
    assert course.drawn() == set()
    report = course.bench()
    course.folder.write(BENCH.path("box"), BENCH.encode(replace(report, card=None)))
    assert course.drawn() == {PAGE}
    swing, awkward = report.scenarios
    changed = replace(report, card=None, scenarios=(swing, replace(awkward, title="Other")))
    course.folder.write(BENCH.path("box"), BENCH.encode(changed))
    assert path(course.drawn()) == {PAGE, "lessons/1.2"}


def test_an_incremental_build_gives_what_a_clean_one_gives(
    course: Course, make: Callable[..., Folder]
) -> None:
    course.build()
    first = course.bench().scenarios[0]
    changed = replace(course.bench(), scenarios=(replace(first, title="Swings"),))
    course.folder.write(BENCH.path("box"), BENCH.encode(changed))
    assert "no scenario" not in course.build()
    clean = Course(make(GOOD, FENCES, name="clean"))
    clean.folder.write("models/box.toml", SCENARIOS)
    for path, data in course.folder.tree("content").items():
        clean.folder.write(f"content/{path}", data)
    clean.build()
    assert clean.folder.tree("public") == course.folder.tree("public")


def test_a_report_that_does_not_fit_is_not_shown(course: Course) -> None:
    course.folder.write("models/box.xml", "<mujoco/>\n")
    told = course.build()
    assert told.count("warning[report-stale]") == 2 and "bench-" not in told
    for figure in figures(lesson(course)):
        assert "Not measured. This measures it:" in figure and "<svg>" not in figure
        assert '<a href="../models/box.html#measured">box</a></figcaption>' in figure
    assert 'id="measured-awkward"' in course.page()  # so that links to it hold
    (course.folder.root / BENCH.path("box")).unlink()
    assert course.build().count("warning[bench-unrecorded]") == 3


def test_the_preview_follows_a_report_in_a_lesson(course: Course) -> None:
    with serving(course.folder) as preview:
        (path,) = (p.name for p in (course.folder.root / "content/lessons").glob("1.2-*.md"))
        page = f"lessons/{path.removesuffix('.md')}.html"

        def shown(text: str) -> bool:
            until = time.monotonic() + 300
            while text not in preview.get(page)[2].decode():
                if time.monotonic() > until:
                    return False
                time.sleep(0.05)
            return True

        assert shown("A pendulum swings")
        report = course.bench()
        first = replace(report.scenarios[0], title="It hangs")
        changed = replace(report, scenarios=(first, report.scenarios[1]))
        course.folder.write(BENCH.path("box"), BENCH.encode(changed))
        assert shown("It hangs")
        text = course.folder.text(f"content/lessons/{path}")
        course.folder.write(f"content/lessons/{path}", text.replace("=awkward", "=swing"))
        assert shown("#measured-swing")
