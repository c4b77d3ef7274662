"""Hints change nothing: they are counted, and shown to those who ask."""

from __future__ import annotations

import json
from collections.abc import Callable

import pytest

from support.fixture_cases import fixture_text
from support.scratch_course import Folder

MakeCourse = Callable[..., Folder]
LIKELY = "## Heights\n\nThe box **falls.\n"
MODEL = fixture_text("documents/hinted_model.md")


@pytest.fixture
def course(make_course: MakeCourse) -> Folder:
    return make_course(f"{LIKELY}\n{MODEL}")


@pytest.mark.parametrize("options", [(), ("--strict",)])
def test_hints_are_counted_in_one_line_and_change_no_exit_status(
    course: Folder, options: tuple[str, ...]
) -> None:
    result = course.main("check", *options)
    assert result.status == 0
    assert "2 hints: `check --hints` shows them\n" in result.out
    assert "everything holds" in result.out
    assert "falls" not in result.out


def test_hints_are_printed_as_diagnostics_where_somebody_asks(course: Folder) -> None:
    result = course.main("check", "--hints")
    assert result.status == 0
    assert "hint[shown-as-written]: `**` would be shown as written" in result.out
    assert "hint[angle-unit]: `-1.5708` has the look of radians" in result.out
    assert "everything holds" in result.out and "shows them" not in result.out


def test_a_course_without_hints_says_nothing_of_them(make_course: MakeCourse) -> None:
    assert "hint" not in make_course("## Heights\n\nThe box falls.\n").main("check").out


def test_formats_for_programs_hold_hints_as_they_can(course: Folder) -> None:
    report = json.loads(course.main("check", "--format", "json", "-q").out)
    assert report["diagnostics"] == [] and report["summary"]["hints"] == 2
    report = json.loads(course.main("check", "--hints", "--format", "json", "-q").out)
    assert [d["severity"] for d in report["diagnostics"]] == ["hint", "hint"]
    sarif = json.loads(course.main("check", "--hints", "--format", "sarif", "-q").out)
    assert [result["level"] for result in sarif["runs"][0]["results"]] == ["note", "note"]
    lines = course.main("check", "--hints", "--format", "github", "-q").out.splitlines()
    assert [line.partition(" ")[0] for line in lines] == ["::notice", "::notice"]
    junit = course.main("check", "--hints", "--format", "junit", "-q").out
    assert 'failures="0"' in junit and junit.count("hint[") == 2


def test_a_kind_of_hint_can_be_silenced(course: Folder) -> None:
    silence = '[[silence]]\nrule = "shown-as-written"\nreason = "notes are raw"\n'
    course.write("content/course.toml", f"{course.text('content/course.toml')}\n{silence}")
    assert "1 hint: " in course.main("check").out


def test_fixes_leave_hints_alone(course: Folder) -> None:
    text = course.text(course.lesson())
    assert course.main("check", "--fix").status == 0
    assert course.text(course.lesson()) == text
