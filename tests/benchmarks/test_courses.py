"""Courses that are generated for benchmarks, and the mistakes that benchmarks make in them."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import pytest

from benchmarks.courses import FLAVORS, names_of, write_course
from benchmarks.measure.building import make_site, remove
from benchmarks.measure.running import measure_scripts
from benchmarks.measure.tools import Places, all_tools
from benchmarks.mistakes import describe, run, table
from benchmarks.slips.changes import KINDS, parts
from benchmarks.slips.pages import compare_pages
from coursebuild.cli import main
from support.scratch_course import Folder

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))


def files(folder: Path) -> dict[str, bytes]:
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


@pytest.fixture(scope="module")
def course(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """All topics, each twice, in two levels."""
    folder = tmp_path_factory.mktemp("course") / "course"
    write_course(folder, 16)
    return folder


@pytest.mark.site
def test_the_recorded_outputs_are_those_of_the_scripts(course: Path) -> None:
    result = Folder(course).main("check").require_success()
    assert "16 lessons, 16 scripts run: everything holds" in result.out


@pytest.mark.site
def test_so_are_those_of_scripts_with_mujoco(tmp_path: Path) -> None:
    folder = tmp_path / "course"
    write_course(folder, 2, scripts="mujoco")
    result = Folder(folder).main("check").require_success()
    assert "2 lessons, 2 scripts run: everything holds" in result.out


@pytest.mark.long
@pytest.mark.site
def test_scripts_are_run_in_all_ways(tmp_path: Path) -> None:
    scripts = measure_scripts(1, 1, tmp_path, Places(None, None), lambda text: None)
    assert len(scripts.figures) == 6
    assert all(ratio > 0 for way in scripts.figures for ratio in scripts.ratios(way))


def test_two_runs_write_the_same_bytes(tmp_path: Path) -> None:
    for flavor in FLAVORS:
        for name in ("one", "two"):
            write_course(tmp_path / name / flavor, 3, flavor)
    assert files(tmp_path / "one") == files(tmp_path / "two")


def test_lessons_are_as_large_as_the_benchmark_says(course: Path) -> None:
    paths = sorted((course / "content" / "lessons").glob("*.md"))
    assert {path.stem for path in paths} == set(names_of(16))
    scripts = set()
    for path in paths:
        text = path.read_text(encoding="utf-8")
        assert 13_000 < len(text.encode()) < 17_000
        fences = re.findall(r"^```(\w+).*\n((?s:.*?))^```$", text, re.MULTILINE)
        assert [kind for kind, _ in fences] == ["io", "python", "text", "quiz"]
        assert 85 <= fences[1][1].count("\n") <= 95
        scripts.add(fences[1][1])
        prose = re.sub(r"^```(?s:.*?)^```$", "", text, flags=re.MULTILINE)
        displays = re.findall(r"(?s)\$\$.+?\$\$", prose)
        inline = re.findall(r"\$[^$\n]+\$", re.sub(r"(?s)\$\$.+?\$\$", "", prose))
        assert len(displays) == 10
        assert 12 <= len(inline) <= 24
        assert text.count("\n> [!") == 4
    assert len(scripts) == 16, "every lesson has a script of its own"


@pytest.mark.parametrize("flavor", FLAVORS)
def test_every_flavor_has_the_whole_lesson(tmp_path: Path, course: Path, flavor: str) -> None:
    """Prose, formulas, code and output are there, and nothing that only coursebuild knows."""
    folder = tmp_path / flavor
    (name,) = write_course(folder, 1, flavor)
    (ours,) = course.glob(f"content/lessons/{name}.md")
    (theirs,) = [
        path for path in folder.rglob("*.md") if path.stem in (name, name.replace(".", "-"))
    ]
    text = theirs.read_text(encoding="utf-8")
    lesson_text = ours.read_text(encoding="utf-8")
    for pattern in (r"observed order [\d.]+", r"\\frac[^$]{3,9}", r"def \w+\(", r"^## .+$"):
        matches = re.findall(pattern, lesson_text, re.MULTILINE)
        assert matches
        assert set(matches) <= set(re.findall(pattern, text, re.MULTILINE))
    if flavor != "coursebuild":
        assert "{out}" not in text
        assert "lesson:" not in text


@pytest.mark.long
@pytest.mark.site
def test_a_course_of_a_hundred_lessons_moves_in_without_an_edit(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Every construct of the flavor is in it; what is left is a block of another tool's kind."""
    write_course(tmp_path / "old", 100, "course_json")
    assert main(["import", str(tmp_path / "old"), "--out", str(tmp_path / "new")]) == 0
    report = capsys.readouterr().out
    assert "90 lessons, 0 scripts run: holds" in report
    assert "error[" not in report and "warning[" not in report
    account = (tmp_path / "new/IMPORT.md").read_text(encoding="utf-8")
    left, words = account.partition("## Left")[2].split("## Words that are nowhere")
    assert set(re.findall(r"^- (.*)", left, re.MULTILINE)) == {
        "a block `debug`, which is shown as JSON",
        "a link to `#the-end`, which no text sets",
    }
    names = re.findall(r"line \d+: (\w+)", words)
    assert sorted(names) == ["description", "done", "estimated", "stub", "toc"]


def test_a_cold_build_finds_nothing_but_the_results_of_scripts(tmp_path: Path) -> None:
    places = Places(None, None)
    tool = next(tool for tool in all_tools(places) if tool.key == "coursebuild")
    site = make_site(tool, 1, tmp_path, places)
    before = files(site.folder)
    site.clear()  # there is nothing yet
    assert files(site.earlier) == {}
    for _ in range(2):
        for name in ("public/index.html", ".coursebuild/packs/1", ".coursebuild/scripts/1"):
            path = site.folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(name, encoding="utf-8")
        site.clear()
        left = {path: data for path, data in files(site.folder).items() if path not in before}
        assert left == {".coursebuild/scripts/1": b".coursebuild/scripts/1"}
    assert len(files(site.earlier)) == 4
    remove(site.earlier)
    assert not site.earlier.exists()


sys.path.insert(0, str(ROOT))

COURSE = ROOT / "tests/courses/full/course"
EXPECTED = Path(__file__).parent / "mistakes.md"


@pytest.mark.long
@pytest.mark.site
def test_mistakes_of_each_kind_end_as_they_did(rewriting: bool) -> None:
    outcomes = list(run(COURSE, [37], 2 * len(KINDS), KINDS, 1))
    lines = table(outcomes)
    for outcome in outcomes:
        if outcome.end in ("silent", "elsewhere", "hinted", "unproved"):
            lines += ["", *describe(outcome, (COURSE / outcome.change.path).read_text("utf-8"))]
    text = "\n".join(["# How a sample of mistakes ends", "", *lines, ""])
    if rewriting:
        EXPECTED.write_text(text, encoding="utf-8")
    assert text == EXPECTED.read_text(encoding="utf-8")
    kinds = {outcome.change.kind for outcome in outcomes}
    assert {*KINDS} - kinds <= {"commands", "formulas", "declarations of models"}


def test_what_only_names_or_says_something_is_no_claim() -> None:
    text = (
        "So $m$ is in $F = \\mathrm{k}a$, $m = 2$, $1 + 1 = 2$, "
        '`3`{given="ISO 9"}.\n\n```sh\nls\n```\n'
    )
    places = [text[part.start : part.end] + " " + part.place for part in parts("a.md", text)]
    relation = "$F = \\mathrm{k}a$ relation"
    assert {
        "$m$ symbols",
        relation,
        "$m = 2$ relation",
        "$1 + 1 = 2$ formula",
        "ISO 9 words",
        "ls shown",
    } <= {*places}
    pages = [f'<main><pre><i class="d">"""{w}."""</i></pre></main>'.encode() for w in ("A", "B")]
    assert compare_pages(*pages) == "prose"
