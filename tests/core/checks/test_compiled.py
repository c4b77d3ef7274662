"""What MuJoCo said of models and MJCF blocks, at the line where it stands."""

from __future__ import annotations

import pytest

from coursebuild.core.checks.compiled import check_compiled, mjcf_texts
from coursebuild.core.model import Course
from coursebuild.core.model.results import CompileResult, ModelFacts
from coursebuild.core.text.diagnostics import Diagnostic
from support.made_courses import BOX, facts, make_course, said, told

GOOD = CompileResult("", None, facts())


def failed(line: int | None = None, error: str = "XML Error: no good") -> CompileResult:
    return CompileResult(error, line)


def checked(
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
    (found,) = mjcf_texts(block(keys, "<geom/>"))
    assert (found.text, found.lines_before) == (text, before)


def test_texts_of_blocks_and_labs_are_compiled_in_their_order() -> None:
    lab = '```lab\n{"xml": "<mujoco/>"}\n```\n'
    by_name = '```lab\n{"model": "box"}\n```\n'
    course = make_course(f"```mjcf\n<a/>\n```\n\n{lab}", f"{by_name}\n```mjcf\n<b/>\n```\n")
    assert [found.text for found in mjcf_texts(course)] == ["<a/>\n", "<mujoco/>", "<b/>\n"]


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
def test_an_error_is_told_at_its_line_without_indent(
    keys: str, line: int | None, expected: str
) -> None:
    assert told(checked(block(keys), failed(line))) == [f"mjcf-error: {expected}"]


@pytest.mark.parametrize(
    ("course", "message"),
    [
        (block("", "<geom/>"), "this block does not compile: xml error: no good"
         ' [if it is a part of a model say so: `fragment="worldbody"`]'),
        (block("", "<mujoco/>"), "this block does not compile: xml error: no good"),
        (block(" fragment=worldbody", "<x/>"), "this block does not compile: xml error: no good"),
        (make_course('```lab\n{"xml": "<x/>"}\n```\n'),
         "the model in this lab does not compile: xml error: no good"),
    ],
)  # fmt: skip
def test_what_does_not_compile_is_said_with_what_may_help(course: Course, message: str) -> None:
    assert said(checked(course, failed())) == [message]


PART = "<!-- a part -->\n<mujocoinclude/>\n"


@pytest.mark.parametrize(
    ("part", "whole", "expected"),
    [
        (PART, GOOD, []),
        ("<?xml version='1.0'?>" + PART, GOOD, []),
        (BOX, CompileResult("", None, facts(includes=("models/part.xml",))), []),
        (BOX, GOOD, ["model-error: "]),
        ("<x/>" + PART, GOOD, ["model-error: "]),
    ],
)
def test_a_file_that_others_include_need_not_compile(
    part: str, whole: CompileResult, expected: list[str]
) -> None:
    course = make_course(models={"part": part, "whole": BOX})
    assert told(checked(course, part=failed(), whole=whole)) == expected


def test_a_part_that_a_lab_uses_as_its_model_must_compile() -> None:
    course = make_course('```lab\n{"model": "part"}\n```\n', models={"part": PART})
    assert told(checked(course, part=failed())) == ["model-error: "]


NAMED = facts(keyframes=("home", "", "up"), sites=("tip",))


@pytest.mark.parametrize(
    ("fields", "model", "expected"),
    [
        ('"key": "up", "trail": "tip"', NAMED, []),
        ('"key": 2', NAMED, []),
        ('"key": 3', NAMED, ["3; the model has no keyframe 3: it has 3, counted from 0"]),
        ('"key": 0', facts(), ["0; the model has no keyframe 0: it has none, counted from 0"]),
        ('"key": "hom"', NAMED, ['"hom"; the model has no keyframe `hom` [did you mean `home`?]']),
        ('"key": "zzzzz"', NAMED,
         ['"zzzzz"; the model has no keyframe `zzzzz` [known: `home`, `up`]']),
        ('"trail": "top"', NAMED, ['"top"; the model has no site `top` [did you mean `tip`?]']),
        ('"trail": "top", "key": 9', NAMED,
         ["9; the model has no keyframe 9: it has 3, counted from 0",
          '"top"; the model has no site `top` [did you mean `tip`?]']),
    ],
)  # fmt: skip
@pytest.mark.parametrize("source", ['"model": "box"', '"xml": "<mujoco/>"'])
def test_names_that_a_lab_uses_are_in_its_model(
    source: str, fields: str, model: ModelFacts, expected: list[str]
) -> None:
    course = make_course(f"```lab\n{{{source}, {fields}}}\n```\n", models={"box": BOX})
    compiled = CompileResult("", None, model)
    other = CompileResult("", None, facts(sites=("other",)))
    in_file = "model" in source
    found = checked(course, other if in_file else compiled, box=compiled if in_file else other)
    assert [f"{a}; {b}" for a, b in zip(told(found), said(found), strict=True)] == [
        f"lab-name: {one}" for one in expected
    ]


def test_names_are_not_looked_for_in_a_model_that_does_not_compile() -> None:
    course = make_course('```lab\n{"model": "box", "key": 9}\n```\n', models={"box": BOX})
    assert told(checked(course, box=failed())) == ["model-error: "]


def test_scenarios_are_held_against_the_compiled_model() -> None:
    report = "```bench box scenario=fall\n```\n"
    home = CompileResult("", None, facts(keyframes=("home",)))
    undeclared = make_course(report, models={"box": BOX})
    assert told(checked(undeclared, box=home)) == ["bench-scenario: fall"]
    assert told(checked(undeclared, box=failed())) == ["model-error: "]
    declared = '[[scenario]]\nname = "swing"\nkeyframe = 1\n'
    course = make_course(report, models={"box": BOX}, declared={"box": declared})
    # That the scenario is none of those declared is known before anything is compiled.
    assert told(checked(course, box=home)) == ["scenario-model: 1"]
    assert told(checked(course, box=failed())) == ["model-error: "]
