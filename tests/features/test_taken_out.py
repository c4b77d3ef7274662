"""A built-in feature can be taken out of an installation without breaking the rest."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from support.scratch_course import GOOD, ROOT, CommandResult, Folder

pytestmark = pytest.mark.site

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
                ("schema", "quiz"): "there is no schema 'quiz': choose from course, lab, model",
            }
            for arguments, reason in messages.items():
                assert run(*arguments) == CommandResult(2, "", f"coursebuild: {reason}\n")
            course.write(course.lesson(1), GOOD + QUIZ)
            result = run("check")
            assert result.status == 1
            assert "nothing that is installed reads a block of kind `quiz`" in result.out
            assert "help: install coursebuild with its quizzes" in result.out
