"""`pytest --coursebuild`: the parts of a course are tests."""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest

from support.markdown_files import DOCS, fences
from support.scratch_course import DRIFTED_LESSON, GOOD, ROOT, Folder, block

pytestmark = pytest.mark.site

NAME = "coursebuild.cli.pytest_plugin"
QUIZ = """
```quiz
{"id": "1.2-quiz", "questions": [{"kind": "numeric", "q": "How much?", "answer": 2}]}
```
"""
FAULTY_LESSON = (
    DRIFTED_LESSON
    + block("broken.py", "import one\nraise SystemExit(3)")
    + block("absent.py", "import nowhere", info="requires=nowhere")
    + "See lesson [four](lesson:4.4).\n\n#### Skipped\n"
    + QUIZ.replace("answer", "anwser")
)


@pytest.fixture
def course(tmp_path: Path, stores: Path) -> Folder:
    folder = Folder(tmp_path / "course")
    folder.fill([GOOD, GOOD.replace("hello.py", "again.py") + QUIZ], stores)
    folder.write("models/ball.xml", "<mujoco><worldbody><geom size='1'/></worldbody></mujoco>")
    return folder


def run(course: Folder, *arguments: str) -> tuple[int, str]:
    plugins = ("-p", NAME, "-p", "no:cacheprovider")
    result = subprocess.run(
        [sys.executable, "-m", "pytest", *plugins, *arguments],
        cwd=course.root,
        env=course.environment({"PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1", "PYTHONWARNINGS": ""}),
        capture_output=True,
        text=True,
    )
    assert result.stderr == ""
    return result.returncode, result.stdout


def outcomes(printed: str) -> dict[str, str]:
    return dict(re.findall(r"^(\S+::.*?) ([A-Z]+)\b", printed, re.MULTILINE))


def parts(course: Folder) -> Iterator[str]:
    yield "content/course.toml::map"
    for number, names in ((1, ("hello.py",)), (2, ("again.py",))):
        yield f"{course.lesson(number)}::page"
        yield from (f"{course.lesson(number)}::examples/{name}" for name in names)
    yield f"{course.lesson(2)}::1.2-quiz"
    yield "models/ball.xml::model"


def test_each_part_of_a_course_is_a_test(course: Folder) -> None:
    status, printed = run(course, "--coursebuild", "-v", "content", "models")
    assert (status, outcomes(printed)) == (0, dict.fromkeys(parts(course), "PASSED"))


def test_a_test_fails_with_the_mistakes_in_its_text(course: Folder) -> None:
    course.write(course.lesson(2), FAULTY_LESSON)
    course.write("content/lessons/9.9-stray.md", "## Stray\n")
    status, printed = run(course, "--coursebuild", "-v", "content")
    assert status == 1
    outcome_by_test = {
        name.rpartition("::")[2]: outcome for name, outcome in outcomes(printed).items()
    }
    failed_tests = [name for name, outcome in outcome_by_test.items() if outcome == "FAILED"]
    assert failed_tests == ["map", "page", "examples/one.py", "examples/broken.py", "1.2-quiz"]
    assert outcome_by_test["examples/absent.py"] == "SKIPPED"
    sections = dict(
        re.findall(r"^_+ (?:\S+): (\S+) _+\n((?:(?![=_]{9}).*\n)*)", printed, re.MULTILINE)
    )
    rules = {name: re.findall(r"^error\[(.*?)\]", text, re.M) for name, text in sections.items()}
    assert rules == {
        "map": ["lesson-unlisted"],
        "page": ["link-lesson"],
        "examples/one.py": ["output-drift"],
        "examples/broken.py": ["script-failed"],
        "1.2-quiz": ["field-unknown"],
    }
    assert sections["examples/one.py"].startswith(
        "examples/one.py: drift\n\n"
        "error[output-drift]: recorded output differs from this run (numeric: 1)\n"
        f"  --> {course.lesson(2)}:10:7\n"
    )
    assert "CourseWarning: warning[heading-skip]: " in printed
    assert run(course, "--coursebuild", "-W", "error", "content", "-k", "two and page")[0] == 1


def test_each_test_says_why_nothing_could_be_checked(course: Folder) -> None:
    course.write("examples", "a file in the place of a folder")
    status, printed = run(course, "--coursebuild", "content", "models", "-v")
    assert status == 1
    assert outcomes(printed) == dict.fromkeys(parts(course), "FAILED")
    assert printed.count("\ncoursebuild: examples") == len(list(parts(course)))


def test_what_is_not_chosen_does_not_run(course: Folder) -> None:
    status, printed = run(course, "--coursebuild", "content", "-k", "hello")
    assert (status, "1 passed, 5 deselected" in printed) == (0, True)
    assert course.main("check").out.endswith(
        "2 lessons, 1 script run, 1 cached: everything holds\n"
    )


def test_nothing_is_collected_unless_it_is_asked_for(course: Folder, tmp_path: Path) -> None:
    assert run(course, "content")[0] == pytest.ExitCode.NO_TESTS_COLLECTED
    course.write("pytest.ini", "[pytest]\ncoursebuild = true\ntestpaths = content\n")
    course.write("content/notes.md", "No part of the course.\n")
    assert "6 passed" in run(course)[1]
    course.write("content/course.toml", "[course\n")
    status, printed = run(course)
    assert (status, "error[map-syntax]: " in printed) == (1, True)


def test_pytest_finds_the_plugin_and_the_documentation_shows_what_it_prints() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert project["entry-points"]["pytest11"] == {"coursebuild": NAME}
    lines = [
        fence.text
        for fence in fences(DOCS / "how-to/continuous-integration.md")
        if fence.kind == "text"
    ]
    assert outcomes(lines[-1])["content/lessons/1.1-pendulum.md::1.1-lab-1"] == "PASSED"
