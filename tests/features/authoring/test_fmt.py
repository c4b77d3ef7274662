"""Formatted lessons are tidy, mean the same, and do not change when formatted again."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from support.fixture_cases import Case, check_cases
from support.plain_html import check_formatting, format_text
from support.random_lessons import markdown
from support.scratch_course import CommandResult, Make

HERE = Path(__file__).parent
ROOT = HERE.parents[2]
MAP = "content/course.toml"
DOCUMENTS = [*ROOT.glob("content/*/*.md"), *ROOT.glob("docs/reference/*.md")]


def test_text_is_tidied_and_keeps_its_lines(rewriting: bool) -> None:
    check_cases(HERE / "tidied.md", lambda case: tidy(case.input), rewriting=rewriting)
    assert tidy("## A\r\ntext \r\n\r\n\r\nmore") == "## A\r\n\r\ntext\r\n\r\nmore\r\n"


def test_paragraphs_are_wrapped_at_a_width(rewriting: bool) -> None:
    def wrap(case: Case) -> str:
        assert tidy(case.input) == case.input, case.title
        return tidy(case.input, width=18)

    check_cases(HERE / "wrapped.md", wrap, rewriting=rewriting)


def tidy(text: str, width: int = 0) -> str:
    result = format_text(text, width)
    assert not result.diagnostics
    return result.value


@settings(max_examples=150)
@given(markdown(), st.booleans(), st.sampled_from((0, 1, 12, 40)))
def test_any_text_says_the_same(text: str, lesson: bool, width: int) -> None:
    check_formatting(text, width, lesson)


@pytest.mark.site
def test_real_documents_say_the_same() -> None:
    for name in ("text", "quizzes", "scripts", "9.2-soft-contact"):
        (path,) = (path for path in DOCUMENTS if path.stem == name)
        check_formatting(path.read_text(), 60, path.parent.name == "lessons")


@pytest.mark.site
def test_lines_of_the_course_stay() -> None:
    """Where the map names no width, only tables and white space change."""
    for path in DOCUMENTS:
        text, lesson = path.read_text(), path.parent.name == "lessons"
        lines = format_text(text, 0, lesson).value.splitlines()
        new_lines = {*lines} - {*text.splitlines()}
        assert all(line.lstrip("> ").startswith("|") for line in new_lines), path


def test_command_formats_the_course_by_the_width_of_its_map(make: Make) -> None:
    course = make("## A\none two three four\n", "## B\n\ntext\n")
    course.write(MAP, course.text(MAP) + "\n[format]\nwidth = 10\n")
    path, before = course.lesson(1), course.tree()
    assert course.main("fmt", "--check") == CommandResult(1, f"would format {path}\n", "")
    preview = course.main("fmt", "1.1", "--diff")
    assert (preview.status, "\n+one two\n+three four" in preview.out) == (1, True)
    assert course.tree() == before
    assert course.main("fmt") == CommandResult(0, f"changed {path}\n", "")
    assert course.text(path) == "## A\n\none two\nthree four\n"
    assert course.main("fmt", "--check") == CommandResult(0, "", "")


def test_command_leaves_unreadable_files(make: Make) -> None:
    course = make('## A\n\n```quiz\n{ "id": "x"\n```\n', b"## B\ncaf\xe9\n", "## C\ntext\n")
    before = course.tree()
    result = course.main("fmt")
    assert (result.status, result.out) == (1, f"changed {course.lesson(3)}\n")
    assert result.err.splitlines() == [
        f"coursebuild: {course.lesson(1)} has mistakes, and is left as it is",
        f"  help: fix this first: {course.lesson(1)}:4:1: `{{` is never closed",
        f"coursebuild: {course.lesson(2)} has mistakes, and is left as it is",
        f"  help: fix this first: {course.lesson(2)} is not UTF-8",
    ]
    changed_paths = {path for path, data in course.tree().items() if before[path] != data}
    assert changed_paths == {course.lesson(3)}
