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


@pytest.fixture
def without_quizzes(tmp_path: Path) -> dict[str, str]:
    """The environment of an installation of the tool that lacks the folder of the quizzes."""
    installed = tmp_path / "installed"
    for name in ("coursebuild", "mjcourse", "templates"):
        shutil.copytree(ROOT / name, installed / name)
    (installed / "site").mkdir()
    (installed / "site" / "dist").symlink_to(ROOT / "site" / "dist")
    shutil.rmtree(installed / "coursebuild" / "features" / "quiz")
    return {"PYTHONPATH": str(installed)}


def test_a_course_without_quizzes_is_built(course: Folder, without_quizzes: dict[str, str]) -> None:
    done = course.run("build", env=without_quizzes)
    assert (done.status, done.out.splitlines()[-1].partition(": ")[2]) == (0, "everything holds")
    assert "<h2" in course.text("public/lessons/1.1-one.html")


def test_a_quiz_says_what_is_missing(course: Folder, without_quizzes: dict[str, str]) -> None:
    course.write(course.lesson(1), GOOD + QUIZ)
    done = course.run("check", env=without_quizzes)
    assert done.status == 1
    assert "nothing that is installed reads a block of kind `quiz`" in done.out
    assert "help: install coursebuild with its quizzes" in done.out


def test_there_is_no_schema_of_quizzes(course: Folder, without_quizzes: dict[str, str]) -> None:
    done = course.run("schema", "quiz", env=without_quizzes)
    assert (done.status, done.err) == (
        2,
        "coursebuild: there is no schema 'quiz': choose from course, lab, model\n",
    )
