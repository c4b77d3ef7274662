"""Checks that `fixtures/rules` and `fixtures/mistakes` do not show: links, formulas, models."""

from __future__ import annotations

from pathlib import Path

import pytest

from coursebuild.core.checks.compiled import check_compiled, mjcf_texts
from coursebuild.core.checks.formulas import document_formulas
from coursebuild.core.checks.lessons import check_course, check_document
from coursebuild.core.checks.links import anchors, link_targets
from coursebuild.core.engine.store import Store
from coursebuild.core.model.results import CompileResult
from coursebuild.pipeline.check import judge
from coursebuild.pipeline.load import load
from coursebuild.pipeline.options import Options
from coursebuild.pipeline.reader import Reader
from support.fixture_cases import fixture_text
from support.made_courses import document, make_course, rules_and_texts
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
    course = make_course(f"```mjcf{keys}\n<mujoco>\n  <world/>\n</mujoco>\n```\n")
    texts = [(text, CompileResult("XML Error: no good", line)) for text in mjcf_texts(course)]
    diagnostics = check_compiled(course, {}, texts, str)
    assert rules_and_texts(diagnostics) == [f"mjcf-error: {expected}"]
