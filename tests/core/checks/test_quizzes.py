"""Quizzes across the course: ids, anchors, and what scripts print."""

from __future__ import annotations

import json

import pytest

from coursebuild.core.checks.course import check_course
from coursebuild.core.model.results import Outcome, ScriptRun
from coursebuild.features.quiz.checks import check_output_lines
from support.made_courses import make_course, said, told

OPEN: dict[str, object] = {"id": "one", "kind": "open", "q": "Q", "reference": "R"}


def quiz(id: str, *questions: dict[str, object]) -> str:
    return f"```quiz\n{json.dumps({'id': id, 'questions': questions or [OPEN]})}\n```\n"


def output(script: str, line: int = 1) -> dict[str, object]:
    return {"kind": "output", "q": "Q", "of": script, "line": line}


def script(path: str, keys: str = "") -> str:
    return f"```python file={path}{keys}\nprint(1)\n```\n"


def ran(stdout: str, outcome: Outcome = Outcome.OK) -> ScriptRun:
    return ScriptRun("examples/x.py", outcome, 0, stdout, "", 0.0)


def test_three_quizzes_of_one_id_are_two_mistakes() -> None:
    found = check_course(make_course(quiz("q") + "\n" + quiz("q"), quiz("q")))
    assert told(found) == ['quiz-id-repeated: "q"'] * 2


@pytest.mark.parametrize(
    ("second", "message"),
    [
        ("Text.\n", "no lesson has a script `examples/x.py`"),
        (script("examples/y.py"), "no lesson has a script `examples/x.py`"
         " [did you mean `examples/y.py`?]"),
        (script("examples/x.py", " norun"),
         "`examples/x.py` is marked `norun`, so it has no output"),
    ],
)  # fmt: skip
def test_an_output_question_needs_a_script_that_runs(second: str, message: str) -> None:
    course = make_course(quiz("q", output("examples/x.py")), second)
    found = check_course(course)
    assert (told(found), said(found)) == (['quiz-output: "examples/x.py"'], [message])
    good = make_course(quiz("q", output("examples/x.py")), script("examples/x.py"))
    assert check_course(good) == ()


@pytest.mark.parametrize(
    ("line", "stdout", "message"),
    [
        (1, "a\n", None),
        (2, "a\nb\n", None),
        (2, "a\nb\n\n", None),
        (3, "a\nb\n\n", "`examples/x.py` has no line 3: it prints 2"),
        (2, "a", "`examples/x.py` has no line 2: it prints 1"),
        (2, "\n\nb", None),
    ],
)
def test_an_output_question_is_about_a_line_that_is_printed(
    line: int, stdout: str, message: str | None
) -> None:
    course = make_course(quiz("q", OPEN, output("examples/x.py", line)))
    found = tuple(check_output_lines(course, [ran(stdout)]))
    assert said(found) == ([] if message is None else [message])
    assert told(found) == ([] if message is None else [f"quiz-output: {line}"])


def test_a_script_that_did_not_run_to_its_end_has_no_missing_line() -> None:
    course = make_course(quiz("q", output("examples/x.py", 9)))
    assert not list(check_output_lines(course, [ran("a\n", Outcome.FAILED)]))
    assert not list(check_output_lines(course, []))
