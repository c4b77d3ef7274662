"""Recorded reports on pages and in lessons, and MuJoCo's warnings while a model is measured."""

from __future__ import annotations

import html
import json
import re
import shlex
import zipfile
from pathlib import Path
from typing import Any

import pytest
from msgspec.structs import replace

from coursebuild.cli import main
from coursebuild.core.model import Declarations
from coursebuild.core.model.measurements import SceneReport
from coursebuild.core.model.report_files import BENCH, DIET, STABILITY
from coursebuild.core.run.script_environment import engine_version
from coursebuild.pipeline.load import load_course
from coursebuild.pipeline.scenes import scene_digest
from support.bench_reports import file_of
from support.edited_course import drawn_pages
from support.fixture_cases import fixture_text
from support.measured_course import TOML, write
from support.model_reports import box, case, diet, finding
from support.preview_process import serve_preview
from support.scratch_course import GOOD, Folder
from support.waiting import wait_until

pytestmark = pytest.mark.site


BOX = '<mujoco><include file="arm/part.xml"/></mujoco>\n'
PART = '<mujoco><worldbody><geom name="g" size="1"/></worldbody></mujoco>\n'
SCENARIOS = '[[scenario]]\nname = "swing"\n\n[[scenario]]\nname = "awkward"\n'
LESSON = fixture_text("documents/measured.md")
PAGE, NUMERICS, SCENARIO_LESSON = "models/box.html", "numerics/case-5.html", "lessons/1.2-two.html"


class Course:
    """A course with a model that was measured."""

    def __init__(self, folder: Folder) -> None:
        self.folder = folder

    def bench(self, name: str = "box", **fields: Any) -> SceneReport:
        course = load_course(self.folder.root)
        model = next(m for m in course.models if m.name == name)
        no_declarations = Declarations(name, model.source)
        declarations = next((d for d in course.declarations if d.model == name), no_declarations)
        digest = scene_digest(self.folder.root, model, declarations)
        machine = replace(box().machine, engine=engine_version())
        return replace(box(), **{"model": name, "digest": digest, "machine": machine, **fields})

    def record(self) -> None:
        self.write_bench(self.bench())
        self.write_diet("nothing reads it")
        self.write_cases("it swings")

    def write_bench(self, report: SceneReport) -> None:
        self.folder.write(BENCH.path(report.model), file_of(BENCH, report))

    def write_diet(self, message: str) -> None:
        bench_report = self.bench()
        report = replace(
            diet(finding(message=message)), digest=bench_report.digest, machine=bench_report.machine
        )
        self.folder.write(DIET.path("box"), file_of(DIET, report))

    def write_cases(self, note: str, engine: str = "") -> None:
        machine = replace(box().machine, engine=engine or engine_version())
        cases = (case("spring", 5, machine=machine, note=note),)
        self.folder.write(STABILITY.path(), file_of(STABILITY, cases))

    def build(self) -> str:
        result = self.folder.main("build", "-q").require_success()
        return result.out

    def page(self, path: str = PAGE) -> str:
        return self.folder.text(f"public/{path}")

    def figures(self) -> list[str]:
        """The reports that the lesson shows, without their drawings."""
        parts = self.page(SCENARIO_LESSON).split('<figure class="bench scenario">')[1:]
        figures = (part.split("</figure>")[0] for part in parts)
        return [re.sub(r"<svg.*?</svg>", "<svg>", part, flags=re.S) for part in figures]


def words(page: str) -> str:
    """The text of a page's main part."""
    main = page[page.index("<main") : page.index("</main>")]
    return " ".join(re.sub(r"<[^>]*>", " ", main).split())


@pytest.fixture(scope="module")
def built_course(tmp_path_factory: pytest.TempPathFactory, stores: Path) -> Folder:
    """The course with its site, before any change."""
    folder = Folder(tmp_path_factory.mktemp("measured") / "course")
    folder.fill([GOOD, LESSON], stores)
    folder.write("models/box.xml", BOX)
    folder.write("models/arm/part.xml", PART)
    folder.write("models/cup.xml", PART)
    folder.write("models/box.toml", SCENARIOS)
    course = Course(folder)
    course.record()
    assert course.build() == ""
    return folder


@pytest.fixture
def course(built_course: Folder, tmp_path: Path) -> Course:
    return Course(built_course.duplicate(tmp_path / "course"))


def test_what_was_recorded_is_on_its_pages_and_in_the_lesson(built_course: Folder) -> None:
    course = Course(built_course)
    page, lesson = course.page(), course.page(SCENARIO_LESSON)
    assert 'class="work-precision"' in page and "Nothing reads it." in page
    assert "It swings." in course.page(NUMERICS)
    assert (course.folder.root / "public/files/reports/box.bench.json").is_file()
    cup = course.page("models/cup.html")
    assert "measured" not in words(cup), "of what nobody measured nothing is said"
    assert 'id="measured"' in cup, "so that links to it hold"
    whole, tables, alone = course.figures()
    assert '<a href="../models/box.html#measured-swing">box</a>: A pendulum swings' in whole
    assert whole.count("<svg>") == 2 and '<details class="more-figures">' in whole
    assert "RK4 at 20 ms costs 0.39 times as much" in whole
    assert "coursebuild bench" not in whole and "NumPy 2.3.0" in whole
    assert "#measured-awkward" in tables and "<svg>" not in tables and "more-figures" not in tables
    assert "<svg>" not in alone and "more-figures" not in alone
    assert 'aria-label="Settings: A pendulum swings"' in alone
    pairs = re.findall(r'aria-labelledby="(_bench[^"]*)"', lesson)
    names = {name for pair in pairs for name in pair.split()}
    assert len(names) == 4 and all(lesson.count(f'id="{name}"') == 1 for name in names)
    anchors = re.findall(r'id="(measured[^"]*)"', page)
    assert anchors == ["measured", "measured-swing", "measured-awkward"]
    assert '<p class="remark">' not in re.sub(r"(?s)<details.*?</details>", "", page), "all folds"
    assert "1.2" in page.split('id="used"')[1], "the lesson uses the model"


def test_report_is_in_markdown_notebook_ebook_and_search(course: Course) -> None:
    copy = course.page(SCENARIO_LESSON.replace("html", "md"))
    assert "**[box](../models/box.md#measured-swing): A pendulum swings**" in copy
    assert "error of" in copy and "| Euler at 2 ms |" in copy and "<svg" not in copy
    cells = json.loads(course.page(SCENARIO_LESSON.replace("html", "ipynb")))["cells"]
    assert any("| Euler at 2 ms |" in "".join(cell["source"]) for cell in cells)
    searched = (course.folder.root / "public").rglob("*.js")
    texts = [path.read_text("utf-8") for path in searched]
    assert any("A pendulum swings" in text and "What it costs" in text for text in texts)
    assert course.folder.main("export", "epub").status == 0
    with zipfile.ZipFile(course.folder.root / "course.epub") as book:
        texts = [book.read(n).decode() for n in book.namelist() if n.endswith(".xhtml")]
    assert sum(text.count('class="work-precision"') for text in texts) == 1
    assert not any("plot-wide" in text for text in texts)


def test_another_report_draws_the_pages_that_show_it_and_no_others(course: Course) -> None:
    assert drawn_pages(course.folder) == set()
    course.write_diet("it is far away")
    assert drawn_pages(course.folder) == {PAGE}
    course.write_cases("it hangs")
    assert drawn_pages(course.folder) == {NUMERICS}
    report = course.bench(card=None)
    course.write_bench(report)
    assert drawn_pages(course.folder) == {PAGE}
    swing, awkward = report.scenarios
    course.write_bench(replace(report, scenarios=(swing, replace(awkward, title="Other"))))
    assert drawn_pages(course.folder) == {PAGE, SCENARIO_LESSON}
    (course.folder.root / STABILITY.path()).unlink()
    assert drawn_pages(course.folder) == {
        "index.html",
        PAGE,
        "models/cup.html",
        "models/arm/part.html",
    }


def test_a_report_that_does_not_fit_is_told_and_not_shown(course: Course) -> None:
    def stale_warnings() -> str:
        result = course.build()
        assert 'class="work-precision"' not in course.page()
        assert "Speed against error" not in words(course.page())
        assert "Speed natively" not in words(course.page())
        for anchor in ("measured", "measured-swing", "measured-awkward", "diet"):
            assert f'id="{anchor}"' in course.page(), "so that links to it hold"
        for figure in course.figures():
            assert "Not measured. To measure it:" in figure and "<svg>" not in figure
            assert "coursebuild bench box --record" in figure
            assert '<a href="../models/box.html#measured">box</a></figcaption>' in figure
        return result

    folder = course.folder
    for path, old, new in (
        ("models/box.xml", "</mujoco>", "<!-- new --></mujoco>"),
        ("models/arm/part.xml", "</mujoco>", "<!-- new --></mujoco>"),
        ("models/box.toml", '"swing"', '"swing"\nduration = 1'),
    ):
        folder.replace(path, old, new)
        warnings = stale_warnings()
        assert "What it could do without" not in words(course.page())
        assert warnings.count("warning[report-stale]") == 2 and "bench-" not in warnings, path
        assert "`box`, its files or its scenarios have changed since" in warnings
        assert "help: make it again with `coursebuild bench box --record`" in warnings
        assert "help: make it again with `coursebuild diet box --record`" in warnings
        assert "It swings." in course.page(NUMERICS)
        folder.replace(path, new, old)
    course.write_bench(course.bench(machine=replace(box().machine, engine="3.0.0")))
    course.write_cases("it swings", "3.0.0")
    warnings = stale_warnings()
    assert warnings.count("warning[report-stale]") == 2
    assert f"it is of MuJoCo 3.0.0, and {engine_version()} is installed" in warnings
    assert not (folder.root / "public" / NUMERICS).exists()
    for path in (BENCH.path("box"), STABILITY.path()):
        folder.write(path, folder.read(path)[:-40])
    folder.write("content/reports/notes.json", "mine")
    warnings = stale_warnings()
    assert warnings.count("is damaged: ") == 2
    assert "notes.json" not in warnings
    (folder.root / BENCH.path("box")).unlink()
    assert course.build().count("warning[bench-unrecorded]") == 3


def test_the_preview_follows_reports(course: Course) -> None:
    with serve_preview(course.folder) as preview:

        def shows(path: str, text: str) -> None:
            wait_until(lambda: text in preview.get(path)[2].decode(), f"{text!r} on {path}")

        shows(SCENARIO_LESSON, "A pendulum swings")
        course.write_diet("it is far away")
        course.write_cases("it hangs")
        report = course.bench()
        first = replace(report.scenarios[0], title="It falls")
        course.write_bench(replace(report, scenarios=(first, report.scenarios[1])))
        shows(PAGE, "It is far away.")
        shows(NUMERICS, "It hangs.")
        shows(SCENARIO_LESSON, "It falls")
        course.folder.replace("content/lessons/1.2-two.md", "=awkward", "=swing")
        shows(SCENARIO_LESSON, "#measured-swing")
        course.folder.replace("models/box.xml", "<mujoco>", "<mujoco >")
        message = "It is far away."
        wait_until(
            lambda: message not in preview.get(PAGE)[2].decode(), f"no {message!r} on {PAGE}"
        )


def test_a_model_with_an_unusual_name(course: Course) -> None:
    name = "odd & old/it's a <cup> ü"
    course.folder.write(f"models/{name}.xml", "<mujoco/>\n")
    course.write_bench(course.bench(name))
    assert course.build() == ""
    page = course.page(f"models/{name}.html")
    assert "Speed against error" in words(page) and name in html.unescape(words(page))
    assert "reports/odd%20&amp;%20old/" in page or "reports/odd%20%26%20old/" in page
    course.folder.write(f"models/{name}.xml", "<mujoco></mujoco>\n")
    warnings = course.build()
    assert f"`{name}`, its files or its scenarios have changed since" in warnings
    assert f"`coursebuild bench {shlex.quote(name)} --record`" in warnings


SINGULAR = """\
<mujoco>
  <worldbody>
    <body>
      <joint axis="0 0 1"/>
      <joint axis="0 0 1"/>
      <geom size="0.1" pos="0.3 0 0"/>
    </body>
  </worldbody>
</mujoco>
"""
"""A model of whose inertia MuJoCo warns at compilation and in each `mj_forward`."""


@pytest.mark.long
@pytest.mark.parametrize(
    "command",
    [
        ("bench", "--quick"),
        pytest.param(("bench", "--record"), marks=pytest.mark.slow),
        ("diet", "--quick", "--fix"),
    ],
    ids=" ".join,
)
def test_measuring_leaves_no_log_of_mujoco(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
    command: tuple[str, ...],
) -> None:
    write(tmp_path / "content" / "course.toml", "")
    write(tmp_path / "models" / "box.xml", SINGULAR)
    declarations = TOML.replace("qvel = [1.0]", "qvel = [1.0, 0.0]")
    write(tmp_path / "models" / "box.toml", declarations)
    monkeypatch.chdir(tmp_path)
    assert main(command) == 0
    out, err = capfd.readouterr()
    assert "box" in out
    assert "WARNING" not in out + err
    assert not list(tmp_path.rglob("MUJOCO_LOG*"))


CROWDED_MODEL = f"""\
<mujoco>
  <size memory="10K"/>
  <worldbody>
    <geom type="plane" size="2 2 1"/>
    {'<body pos="0 0 0.1"><freejoint/><geom type="box" size="0.1 0.1 0.1"/></body>' * 9}
  </worldbody>
</mujoco>
"""
"""A model whose contacts need more memory than it sets."""


def test_bench_tells_a_model_that_mujoco_gives_up(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write(tmp_path / "content" / "course.toml", "")
    write(tmp_path / "models" / "box.xml", CROWDED_MODEL)
    write(tmp_path / "models" / "box.toml", TOML.replace("qvel = [1.0]\n", ""))
    assert main(["-C", str(tmp_path), "bench", "--quick"]) == 1
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith(
        "error[model-error]: the model `box` cannot be measured: mj_stackAlloc: out of memory"
    )
    assert lines[1] == "  --> models/box.xml:1:1"
    assert not list(tmp_path.rglob("MUJOCO_LOG*"))
