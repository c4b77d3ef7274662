"""Checks that `fixtures/rules` and `fixtures/mistakes` do not show: links, formulas, models."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from msgspec.structs import replace

from coursebuild.core.checks.compiled import check_compiled, check_scenarios, mjcf_texts
from coursebuild.core.checks.formulas import check_formulas, document_formulas
from coursebuild.core.checks.lessons import check_course, check_document
from coursebuild.core.checks.links import anchors, link_targets
from coursebuild.core.engine.store import Store
from coursebuild.core.model import Course
from coursebuild.core.model.results import CompileResult, Formula, MathError, ModelFacts
from coursebuild.core.text.diagnostics import Diagnostic
from coursebuild.pipeline.check import judge
from coursebuild.pipeline.load import load
from coursebuild.pipeline.options import Options
from coursebuild.pipeline.reader import Reader
from support.fixture_cases import fixture_text
from support.made_courses import BOX, document, facts, make_course, messages, rules_and_texts
from support.rule_cases import Layout


def test_one_document_is_checked_as_in_the_whole_course() -> None:
    first = (
        "[mass]{term} [a](lesson:9) and [mass]{term}\n\n"
        '```lab simlb\n{"model": "box"}\n```\n\n```bench box\n```\n\n'
        '```quiz\n{"id": "q", "questions": [{"kind": "output", "q": "Q",'
        ' "of": "examples/x.py", "line": 1}]}\n```\n'
    )
    second = "[b](term:mass) [c](examples/y.py) [mass]{term}\n"
    course = make_course(first, second, "[d](#nowhere)\n")
    one_by_one = [
        line
        for document in course.documents
        for line in rules_and_texts(check_document(course, document, link_targets(course)))
    ]
    assert sorted(one_by_one) == sorted(rules_and_texts(check_course(course)))
    assert len(one_by_one) == 8


def test_each_formula_is_listed_once_in_order_of_first_use() -> None:
    course = make_course("A $b$ and $$a$$ and $b$.\n\n$$\nb\n$$\n\n- $a$ and $$a$$\n\n$c$\n")
    assert document_formulas(course.documents[0]) == (
        Formula("b", False),
        Formula("a", True),
        Formula("b", True),
        Formula("a", False),
        Formula("c", False),
    )


def test_a_wrong_formula_is_reported_at_each_place() -> None:
    document = make_course("Text $a$ and $x + y$.\n\n> $x + y$, $$x + y$$\n").documents[0]
    good = {Formula("a", False): "", Formula("x + y", True): ""}
    for position, expected in ((None, "x + y"), (0, "x"), (4, "y"), (5, "y"), (99, "y")):
        typeset = {**good, Formula("x + y", False): MathError("no good", position)}
        diagnostics = check_formulas(document, typeset)
        assert rules_and_texts(diagnostics) == [f"math-syntax: {expected}"] * 2
        assert messages(diagnostics) == ["the formula does not parse: no good"] * 2
        assert [d.span.line for d in diagnostics] == [1, 3]


@pytest.mark.engine
def test_right_formulas_of_every_field_are_told_nothing(tmp_path: Path) -> None:
    text = fixture_text("documents/right_formulas.md")
    assert len(document_formulas(make_course(text).documents[0])) >= 300
    mistake = "\nIt takes $O(\\sqrt{n}$) steps.\n"
    for name, line, expected in (("right", "", []), ("wrong", mistake, ["math-brackets: ("])):
        root = tmp_path / name
        Layout.of(text + line).write(root)
        with Reader(Options(root, 1, Store(root))) as reader:
            course_load = load(root, reader)
        assert course_load.value is not None
        diagnostics = judge(course_load.value, course_load.diagnostics).diagnostics
        assert rules_and_texts(diagnostics) == expected


MODEL = facts(
    nq=3,
    nv=2,
    nu=1,
    timestep=0.002,
    keyframes=("home", "", "up"),
    body_names=("world", "arm"),
    sites=("tip",),
    sensors=("", "gyro"),
)
GOOD_SCENARIOS = (
    *("", "keyframe = 0", "keyframe = 2", 'keyframe = "up"', "qpos = [1, 2, 3]", "qvel = [1, 2]"),
    *("controls = [[1], [2]]\nhold = 0.5", 'measure = "body:arm"', 'measure = "site:tip"'),
    *('measure = "sensor:gyro"', "duration = 1.0\nsample = 0.01", "duration = 0.5"),
    "duration = 0.002\nsample = 0.002",
)


def scenario_messages(*scenarios: str, model: ModelFacts = MODEL) -> list[str]:
    texts = (f'[[scenario]]\nname = "s{n}"\n{text}\n' for n, text in enumerate(scenarios))
    (declarations,) = make_course(models={}, declaration_texts={"box": "".join(texts)}).declarations
    diagnostics = tuple(check_scenarios(declarations, model))
    return [
        f"{a}; {b}"
        for a, b in zip(rules_and_texts(diagnostics), messages(diagnostics), strict=True)
    ]


def test_scenarios_that_fit_their_model_are_good() -> None:
    assert scenario_messages(*GOOD_SCENARIOS) == []


def test_a_mismatch_with_the_model_is_reported_at_its_value() -> None:
    divides = "the model's timestep, 0.002 s, does not divide"
    for line, expected in (
        ('measure = "sensor:tip"', '"sensor:tip"; the model has no sensor `tip` [known: `gyro`]'),
        (
            "duration = 0.001",
            f"0.001; {divides} `duration` (0.001 s) [a multiple near it is 0.002]",
        ),
        (
            "controls = [[1], [2]]\nhold = 0.003",
            f"0.003; {divides} `hold` (0.003 s) [a multiple near it is 0.004]",
        ),
    ):
        assert scenario_messages(line) == [f"scenario-model: {expected}"]


@pytest.mark.parametrize("step", [0.0, -0.1, 1e-320, math.inf, math.nan])
def test_any_timestep_that_the_compiler_takes_is_judged(step: float) -> None:
    model = replace(MODEL, timestep=step)
    assert scenario_messages("", model=model) == []
    (message,) = scenario_messages("duration = 1.0", model=model)
    assert message.endswith(f"the model's timestep, {step:g} s, does not divide `duration` (1 s)")


def test_all_mismatches_of_all_scenarios_are_reported() -> None:
    messages = scenario_messages("keyframe = 8\nduration = 0.003", "keyframe = 7\nqvel = [1]")
    assert [message.partition(";")[0] for message in messages] == [
        f"scenario-model: {place}" for place in ("8", "0.003", "7", "[")
    ]


SCRIPT = "```python file=examples/a_b.py\nx = 1\nprint(x)\n```\n\nOutput:\n\n```text\n1\n```\n"
QUESTION = '{"id": "one", "kind": "open", "q": "Q", "reference": "R"}'
QUIZ = f'```quiz\n{{"id": "q1", "questions": [{QUESTION}]}}\n```\n'


def test_anchors_of_a_document() -> None:
    text = (
        "## A B {#a}\n\n"
        + SCRIPT
        + "Output:\n\n```text\n1\n```\n\n"
        + QUIZ
        + '\n$$\nx\n$$ {#eq:one}\n\n<div id="raw">\n</div>\n\nText <b id=in>b</b>'
        + " and [mass]{term}.\n"
    )
    spans = anchors(document("content/lessons/1.1-x.md", text))
    assert spans.keys() == {
        *("a", "a_b.py", "a_b.out", "a_b.out-2", "q1", "q1.one", "eq:one", "raw", "in", "term:mass")
    }
    assert [spans[id].text for id in ("a", "in", "term:mass")] == [
        *("## A B {#a}", "<b id=in>", "[mass]{term}")
    ]
    assert spans["eq:one"].start == text.index("$$")


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


def test_a_fragment_gets_the_elements_around_it() -> None:
    for keys, opening, closing in (
        (" fragment=mujoco", "<mujoco>", "</mujoco>"),
        (
            ' fragment="worldbody/body"',
            "<mujoco><worldbody><body>",
            "</body></worldbody></mujoco>",
        ),
    ):
        (wrapped,) = mjcf_texts(block(keys, "<geom/>"))
        assert (wrapped.text, wrapped.lines_before) == (f"{opening}\n<geom/>\n\n{closing}", 1)


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
