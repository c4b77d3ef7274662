"""A built-in feature can be taken out of an installation without breaking the rest."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from support.scratch_course import GOOD, ROOT, Folder

pytestmark = pytest.mark.site

QUIZ = """
```quiz
{"id": "q", "questions": [{"kind": "numeric", "q": "How much?", "answer": 2}]}
```
"""


@pytest.fixture
def course(tmp_path: Path, stores: Path) -> Folder:
    folder = Folder(tmp_path / "a course")
    folder.fill([GOOD, GOOD.replace("hello.py", "again.py")], stores)
    return folder


@pytest.fixture(scope="module")
def environments(tmp_path_factory: pytest.TempPathFactory) -> dict[str, dict[str, str]]:
    """Those of installations of the tool that lack the folder of a feature, by its name."""
    made = {}
    taken = {"bench": ("numerics",), "markdown": ("notebook",), "quiz": (), "search": ()}
    for feature, others in taken.items():
        installed = tmp_path_factory.mktemp("installed")
        for name in ("coursebuild", "mjcourse", "templates"):
            shutil.copytree(ROOT / name, installed / name)
        (installed / "site").mkdir()
        (installed / "site" / "dist").symlink_to(ROOT / "site" / "dist")
        for name in (feature, *others):
            shutil.rmtree(installed / "coursebuild" / "features" / name)
        made[feature] = {"PYTHONPATH": str(installed)}
    return made


@pytest.fixture
def without_quizzes(environments: dict[str, dict[str, str]]) -> dict[str, str]:
    return environments["quiz"]


def test_a_course_is_built_without_a_feature(
    course: Folder, environments: dict[str, dict[str, str]]
) -> None:
    for feature, environment in environments.items():
        done = course.run("build", env=environment)
        said = done.status, done.out.splitlines()[-1].partition(": ")[2]
        assert said == (0, "everything holds"), feature
        assert "<h2" in course.text("public/lessons/1.1-one.html")
    assert "there is no command `bench`" in course.run("bench", env=environments["bench"]).err


def test_without_copies_no_page_offers_them(
    course: Folder, environments: dict[str, dict[str, str]]
) -> None:
    assert course.run("build", env=environments["markdown"]).status == 0
    site = course.tree("public")
    assert not [path for path in site if path.endswith((".md", ".ipynb")) or path == "llms.txt"]
    for path, data in site.items():
        if path.endswith(".html"):
            assert b"markdown" not in data.lower() and b"Jupyter" not in data, path


def test_without_the_search_no_page_offers_it(
    course: Folder, environments: dict[str, dict[str, str]]
) -> None:
    assert course.run("build", env=environments["search"]).status == 0
    site = course.tree("public")
    assert not [path for path in site if "search" in path]
    for path, data in site.items():
        if path.endswith(".html"):
            assert b"search/index.html" not in data and b"data-search" not in data, path


def test_a_quiz_says_what_is_missing(course: Folder, without_quizzes: dict[str, str]) -> None:
    course.write(course.lesson(1), GOOD + QUIZ)
    done = course.run("check", env=without_quizzes)
    assert done.status == 1
    assert "nothing that is installed reads a block of kind `quiz`" in done.out
    assert "help: install coursebuild with its quizzes" in done.out


def test_there_is_no_schema_and_no_export_of_quizzes(
    course: Folder, without_quizzes: dict[str, str]
) -> None:
    done = course.run("export", "qti", env=without_quizzes)
    reason = "`export qti` needs quiz: install coursebuild with its quizzes"
    assert (done.status, done.err) == (2, f"coursebuild: {reason}\n")
    done = course.run("schema", "quiz", env=without_quizzes)
    assert (done.status, done.err) == (
        2,
        "coursebuild: there is no schema 'quiz': choose from course, lab, model\n",
    )
