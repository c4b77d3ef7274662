"""What MuJoCo says of models and MJCF blocks, reported at the right line."""

from __future__ import annotations

import pytest

from coursebuild.core.checks.compiled import check_compiled, mjcf_texts
from coursebuild.core.model import Course
from coursebuild.core.model.results import CompileResult
from coursebuild.core.text.diagnostics import Diagnostic
from support.made_courses import BOX, facts, make_course, rules_and_texts

GOOD = CompileResult("", None, facts())


def failure(line: int | None = None, error: str = "XML Error: no good") -> CompileResult:
    return CompileResult(error, line)


def check(
    course: Course, of_text: CompileResult = GOOD, **models: CompileResult
) -> tuple[Diagnostic, ...]:
    texts = [(text, of_text) for text in mjcf_texts(course)]
    return check_compiled(course, models, texts, lambda error: error.splitlines()[0].lower())


def block(keys: str, *lines: str) -> Course:
    body = "\n".join(lines or ("<mujoco>", "  <world/>", "</mujoco>"))
    return make_course(f"```mjcf{keys}\n{body}\n```\n")


@pytest.mark.parametrize(
    ("keys", "text", "before"),
    [
        ("", "<geom/>\n", 0),
        (" fragment=mujoco", "<mujoco>\n<geom/>\n\n</mujoco>", 1),
        (" fragment=worldbody", "<mujoco><worldbody>\n<geom/>\n\n</worldbody></mujoco>", 1),
        (
            ' fragment="worldbody/body"',
            "<mujoco><worldbody><body>\n<geom/>\n\n</body></worldbody></mujoco>",
            1,
        ),
    ],
)
def test_a_fragment_gets_the_elements_around_it(keys: str, text: str, before: int) -> None:
    (wrapped,) = mjcf_texts(block(keys, "<geom/>"))
    assert (wrapped.text, wrapped.lines_before) == (text, before)


def test_texts_of_blocks_and_labs_are_compiled_in_their_order() -> None:
    lab = '```lab\n{"xml": "<mujoco/>"}\n```\n'
    by_name = '```lab\n{"model": "box"}\n```\n'
    course = make_course(f"```mjcf\n<a/>\n```\n\n{lab}", f"{by_name}\n```mjcf\n<b/>\n```\n")
    assert [text.text for text in mjcf_texts(course)] == ["<a/>\n", "<mujoco/>", "<b/>\n"]


@pytest.mark.parametrize(
    ("keys", "line", "expected"),
    [
        ("", 2, "<world/>"),
        ("", 1, "<mujoco>"),
        ("", 4, ""),
        ("", 5, "```mjcf"),
        ("", 0, "```mjcf"),
        ("", None, "```mjcf"),
        (" fragment=worldbody", 3, "<world/>"),
        (" fragment=worldbody", 1, "```mjcf fragment=worldbody"),
    ],
)
def test_an_error_is_reported_at_its_line_without_indent(
    keys: str, line: int | None, expected: str
) -> None:
    assert rules_and_texts(check(block(keys), failure(line))) == [f"mjcf-error: {expected}"]


PART = "<!-- a part -->\n<mujocoinclude/>\n"


@pytest.mark.parametrize(
    ("part", "whole", "expected"),
    [
        (PART, GOOD, []),
        ("<?xml version='1.0'?>" + PART, GOOD, []),
        (100 * "<!-- many -->\n" + PART, GOOD, []),
        (100 * "<!-- many -->\n" + BOX, GOOD, ["model-error: "]),
        (BOX, CompileResult("", None, facts(includes=("models/part.xml",))), []),
        (BOX, GOOD, ["model-error: "]),
        ("<x/>" + PART, GOOD, ["model-error: "]),
    ],
)
def test_a_file_that_others_include_need_not_compile(
    part: str, whole: CompileResult, expected: list[str]
) -> None:
    course = make_course(models={"part": part, "whole": BOX})
    assert rules_and_texts(check(course, part=failure(), whole=whole)) == expected


def test_names_that_a_lab_uses_are_in_its_own_model() -> None:
    with_names = CompileResult("", None, facts(keyframes=("home", "", "up"), sites=("tip",)))
    without_names = CompileResult("", None, facts(sites=("top",)))
    for source, of_text, box in (
        ('"model": "box"', without_names, with_names),
        ('"xml": "<x/>"', with_names, without_names),
    ):
        for fields, expected in (
            ('"key": "up", "trail": "tip"', []),
            ('"key": 2', []),
            ('"trail": "top", "key": 3', ["lab-name: 3", 'lab-name: "top"']),
        ):
            course = make_course(f"```lab\n{{{source}, {fields}}}\n```\n", models={"box": BOX})
            assert rules_and_texts(check(course, of_text, box=box)) == expected
    course = make_course('```lab\n{"model": "box", "key": 9}\n```\n', models={"box": BOX})
    assert rules_and_texts(check(course, box=failure())) == ["model-error: "]


def test_a_part_that_a_lab_uses_as_its_model_must_compile() -> None:
    course = make_course('```lab\n{"model": "part"}\n```\n', models={"part": PART})
    assert rules_and_texts(check(course, part=failure())) == ["model-error: "]


def test_scenarios_are_compared_with_the_compiled_model() -> None:
    report = "```bench box scenario=fall\n```\n"
    home = CompileResult("", None, facts(keyframes=("home",)))
    undeclared = make_course(report, models={"box": BOX})
    assert rules_and_texts(check(undeclared, box=home)) == ["bench-scenario: fall"]
    assert rules_and_texts(check(undeclared, box=failure())) == ["model-error: "]
    scenarios = '[[scenario]]\nname = "swing"\nkeyframe = 1\n'
    course = make_course(report, models={"box": BOX}, declaration_texts={"box": scenarios})
    # That the scenario is none of those declared is known before anything is compiled.
    assert rules_and_texts(check(course, box=home)) == ["scenario-model: 1"]
    assert rules_and_texts(check(course, box=failure())) == ["model-error: "]
