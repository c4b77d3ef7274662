"""Questions about what scripts print."""

from __future__ import annotations

import json

import pytest

from coursebuild.core.checks.course import check_course
from coursebuild.core.model.results import Outcome, ScriptRun
from coursebuild.features.quiz.checks import check_output_lines
from support.made_courses import make_course, messages, rules_and_texts


def question(line: int = 1) -> str:
    """A quiz with a question about a line that a script prints."""
    question_json = {"kind": "output", "q": "Q", "of": "examples/x.py", "line": line}
    return f"```quiz\n{json.dumps({'id': 'q', 'questions': [question_json]})}\n```\n"


def script_run(stdout: str, outcome: Outcome = Outcome.OK) -> ScriptRun:
    return ScriptRun("examples/x.py", outcome, 0, stdout, "", 0.0)


def test_an_output_question_needs_a_script_that_runs() -> None:
    script = "```python file=examples/x.py\nprint(1)\n```\n"
    assert check_course(make_course(question(), script)) == ()
    diagnostics = check_course(make_course(question(), script.replace(".py", ".py norun")))
    assert rules_and_texts(diagnostics) == ['quiz-output: "examples/x.py"']
    assert messages(diagnostics) == ["`examples/x.py` is marked `norun`, so it has no output"]


@pytest.mark.parametrize(
    ("line", "stdout", "lines"),
    [
        (1, "a\n", None),
        (2, "a\nb\n\n", None),
        (2, "\n\nb", None),
        (3, "a\nb\n\n", 2),
        (2, "a", 1),
    ],
)
def test_an_output_question_is_about_a_line_that_is_printed(
    line: int, stdout: str, lines: int | None
) -> None:
    course = make_course(question(line))
    message = f"`examples/x.py` has no line {line}: it prints {lines}"
    assert messages(check_output_lines(course, [script_run(stdout)])) == (
        [message] if lines else []
    )
    for runs in ([], [script_run(stdout, Outcome.FAILED)]):
        assert not list(check_output_lines(course, runs)), "it did not run to its end"
