"""Features that packages beside the tool bring, and built-in ones that are taken out."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

import pytest
from playwright.sync_api import Browser, expect

from support.axe import violations
from support.fixture_cases import fixture_text
from support.scratch_course import GOOD, ROOT, CommandResult, Folder
from support.static_host import Host

pytestmark = pytest.mark.site


LESSON = fixture_text("documents/packaged.md")
PAGE = "public/lessons/1.1-one.html"


@pytest.fixture(scope="session")
def packages(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("packages")
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    offline = ["--no-deps", "--no-build-isolation", "--no-index", "--target", str(folder)]
    sources = [str(ROOT / "plugins" / name) for name in ("tabs", "mermaid")]
    subprocess.run([*pip, *offline, *sources], check=True)
    return folder


@pytest.fixture(scope="session")
def course(tmp_path_factory: pytest.TempPathFactory, stores: Path, packages: Path) -> Folder:
    folder = Folder(tmp_path_factory.mktemp("course") / "a course")
    folder.fill([LESSON], stores)
    result = run(folder, packages, "build")
    assert result.status == 0, result.out
    return folder


def run(folder: Folder, packages: Path, *arguments: str) -> CommandResult:
    return folder.run(*arguments, env={"PYTHONPATH": f"{packages}:{ROOT}"})


def test_pages_show_tabs_and_diagrams_without_a_script(course: Folder) -> None:
    html = course.text(PAGE)
    assert html.count('<p class="tab-title">') == 3
    assert "Energy &amp; more" in html
    assert '<a href="#below">below</a>' in html
    assert '<img src="data:image/svg+xml;base64,' in html
    assert 'alt="A lesson is read, and &lt;run&gt;"' in html
    assert "<summary>The diagram as text</summary>" in html
    assert "/tabs." in html
    assert "/tabs." not in course.text("public/index.html"), "a page without tabs"
    copy = course.text("public/lessons/1.1-one.md")
    assert "**Energy & more**\n\nThe energy is" in copy
    assert "```mermaid\nflowchart LR\n  read --> run\n```" in copy


def test_an_edit_of_an_installed_feature_is_seen(
    tmp_path: Path, stores: Path, packages: Path
) -> None:
    installation = tmp_path / "packages"
    shutil.copytree(packages, installation)
    folder = Folder(tmp_path / "a course")
    folder.fill([LESSON], stores)
    assert run(folder, installation, "build").status == 0
    script = installation / "coursebuild_tabs" / "__init__.py"
    script.write_text(script.read_text().replace('class="tab-title"', 'class="tab-title new"'))
    assert run(folder, installation, "build").status == 0
    assert '<p class="tab-title new">' in folder.text(PAGE)


def test_example_of_the_docs_adds_a_command(tmp_path: Path, stores: Path) -> None:
    page = (ROOT / "docs/how-to/features.md").read_text(encoding="utf-8")
    folder, package = Folder(tmp_path / "a course"), tmp_path / "coursebuild_slowest"
    folder.fill([GOOD], stores)
    package.mkdir()
    for name in ("__init__", "commands"):
        start = page.index(f"`coursebuild_slowest/{name}.py`")
        code = page[start:].split("```python\n")[1].split("```")[0]
        (package / f"{name}.py").write_text(code)
    info = tmp_path / "coursebuild_slowest-1.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Name: coursebuild-slowest\nVersion: 1\n")
    points = info / "entry_points.txt"
    points.write_text("[coursebuild.features]\nslowest = coursebuild_slowest:FEATURE\n")
    assert "list the scripts that took longest" in run(folder, tmp_path, "--help").out
    result = run(folder, tmp_path, "slowest", "--count", "1")
    assert result.status == 0
    assert re.fullmatch(r" +\d+\.\d\d s  examples/hello\.py\n", result.out)
    code = (package / "__init__.py").read_text()
    (package / "__init__.py").write_text(code.replace('name="slowest"', 'name="check"', 1))
    assert "there is already a command `check`" in run(folder, tmp_path, "--help").err


MISTAKES = {
    "~~~tabs\n=== One\nText.\n~~~\n": "error[tabs]: there is only one tab",
    "~~~tabs\nText.\n=== One\n=== Two\n~~~\n": "error[tabs]: this text stands in no tab",
    "~~~tabs\n=== One\n$\\x$\n=== Two\n~~~\n": "error[math-syntax]: ",
    "~~~tabs\n=== One\n[a](lesson:9)\n=== Two\n~~~\n": "error[link-lesson]: ",
    "```mermaid\nflowchart LR\n  a --> b\n```\n": "error[mermaid-alt]: ",
    '```mermaid alt="x"\nnonsense\n```\n': "error[mermaid-syntax]: Mermaid: No Mermaid ",
    '```mermaid alt="x" size=3\ngraph TD\n  a\n```\n': "error[fence-key-unknown]: ",
}


def test_mistakes_have_rules_and_places(tmp_path: Path, stores: Path, packages: Path) -> None:
    folder = Folder(tmp_path / "a course")
    folder.fill([f"## Hello\n\n{fence}" for fence in MISTAKES], stores)
    result = run(folder, packages, "check")
    assert result.status == 1
    errors = re.findall(r"(error\[.*)\n  --> (.*?):", result.out)
    assert [path for _, path in errors] == [folder.lesson(n) for n in range(1, len(MISTAKES) + 1)]
    expected = MISTAKES.values()
    assert [m for m, (error, _) in zip(expected, errors, strict=True) if m not in error] == []


@pytest.mark.browser
def test_keys_and_links_choose_tabs(browsers: Mapping[str, Browser], course: Folder) -> None:
    with (
        Host(course.root / "public") as host,
        browsers["plain"].new_context(service_workers="block") as context,
    ):
        page = context.new_page()
        page.goto(f"{host.url}lessons/1.1-one.html")
        tabs = page.get_by_role("tab")
        expect(tabs).to_have_count(3)
        expect(page.get_by_role("tabpanel")).to_have_count(1)
        assert violations(page, "main") == []
        tabs.first.focus()
        for key, index in (("ArrowLeft", 2), ("ArrowRight", 0), ("ArrowRight", 1), ("End", 2)):
            page.keyboard.press(key)
            expect(tabs.nth(index)).to_have_attribute("aria-selected", "true")
            expect(tabs.nth(index)).to_be_focused()
        expect(page.get_by_text("Nothing else.")).to_be_visible()
        expect(page.get_by_text("The energy is")).to_be_hidden()
        inside = page.get_by_role("heading", name="Inside")
        expect(inside).to_be_hidden()
        page.evaluate("location.hash = '#inside'")
        expect(inside).to_be_visible()


QUIZ = """
```quiz
{"id": "q", "questions": [{"kind": "numeric", "q": "How much?", "answer": 2}]}
```
"""


DEPENDENT_FEATURES = {"bench": ("numerics",), "markdown": ("notebook",), "quiz": (), "search": ()}
"""Features, and those that need them."""


@pytest.mark.parametrize("feature", DEPENDENT_FEATURES)
def test_a_course_is_built_without_a_feature(feature: str, tmp_path: Path, stores: Path) -> None:
    course, installed = Folder(tmp_path / "a course"), tmp_path / "installed"
    course.fill([GOOD, "## Two\n\nText.\n"], stores)
    for name in ("coursebuild", "mjcourse", "templates"):
        shutil.copytree(ROOT / name, installed / name)
    (installed / "site").mkdir()
    (installed / "site" / "dist").symlink_to(ROOT / "site" / "dist")
    for name in (feature, *DEPENDENT_FEATURES[feature]):
        shutil.rmtree(installed / "coursebuild" / "features" / name)

    def run(*arguments: str) -> CommandResult:
        return course.run(*arguments, env={"PYTHONPATH": str(installed)})

    result = run("build")
    assert (result.status, result.out.splitlines()[-1].partition(": ")[2]) == (
        0,
        "everything holds",
    )
    site = course.tree("public")
    pages = {path: data.lower() for path, data in site.items() if path.endswith(".html")}
    assert b"<h2" in pages["lessons/1.1-one.html"]
    match feature:
        case "bench":
            assert "there is no command `bench`" in run("bench").err
        case "markdown":
            copies = [path for path in site if path.endswith((".md", ".ipynb", "llms.txt"))]
            offers = [p for p, data in pages.items() if b"markdown" in data or b"jupyter" in data]
            assert (copies, offers) == ([], [])
        case "search":
            assert not [path for path in site if "search" in path]
            marks = b"search/index.html", b"data-search"
            assert not [p for p, data in pages.items() if any(mark in data for mark in marks)]
        case "quiz":
            messages = {
                ("export", "qti"): "`export qti` needs quiz: install coursebuild with its quizzes",
                (
                    "schema",
                    "quiz",
                ): (
                    "there is no schema 'quiz': choose from course, exercise, lab, lab-ode, "
                    "lab-plot, model"
                ),
            }
            for arguments, reason in messages.items():
                assert run(*arguments) == CommandResult(2, "", f"coursebuild: {reason}\n")
            course.write(course.lesson(1), GOOD + QUIZ)
            result = run("check")
            assert result.status == 1
            assert "nothing that is installed reads a block of kind `quiz`" in result.out
            assert "help: install coursebuild with its quizzes" in result.out
