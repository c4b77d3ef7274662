"""`quiz` fences: what they become."""

from __future__ import annotations

import hashlib
import json

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coursebuild.core.model import Block, Math, Paragraph, Text, document_blocks, document_inlines
from coursebuild.core.model.vocabulary import CALLOUTS
from coursebuild.core.syntax.document import parse_document
from coursebuild.core.text.source import Source
from coursebuild.features.quiz.model import (
    ChoiceQuestion,
    NumericQuestion,
    OpenQuestion,
    OrderQuestion,
    OutputQuestion,
    Quiz,
)
from coursebuild.features.quiz.parse import parse_quiz
from support.quiz_fences import MCQ, Plain, fence, parse


def words(blocks: tuple[Block, ...]) -> str:
    return "|".join(
        inline.text
        for block in blocks
        if isinstance(block, Paragraph)
        for inline in block.children
        if isinstance(inline, Text)
    )


COMPLETE = r"""{"id": "4.2-check", "title": "Knowledge check", "questions": [
  {"kind": "mcq", "q": "Which?", "options": ["a", "b $x$", "c"], "answer": 2,
   "explain": "<p>since $I_1 < I_2$</p>", "label": "first", "hints": ["one", "two"],
   "feedback": ["no", "", "yes"]},
  {"kind": "mcq", "q": "All?", "options": ["a", "b", "c"], "answer": [2, 0]},
  {"kind": "numeric", "q": "How much?", "answer": 8.0e-2, "tol": 0.0001, "unit": "kg m^2"},
  {"kind": "numeric", "q": "Less?", "answer": -5},
  {"kind": "numeric", "q": "None?", "answer": 0, "tol": 0},
  {"kind": "predict", "q": "What?", "options": ["up", "down"], "answer": 1,
   "sim": {"model": "tumbling_box", "note": "Press *Play*.", "key": "major"}},
  {"kind": "open", "q": "Why?", "reference": "Because."},
  {"kind": "output", "q": "What is printed?", "of": "examples/x.py", "line": 7},
  {"kind": "order", "q": "In order?", "items": ["first", "second", "third"]}]}"""


@pytest.mark.parametrize(("prefix", "newline"), [("", "\n"), ("> ", "\n"), ("  ", "\r\n")])
def test_a_complete_quiz(prefix: str, newline: str) -> None:
    parsed = parse(COMPLETE, prefix, newline)
    assert parsed.diagnostics == ()
    quiz = parsed.value
    assert quiz is not None
    assert (quiz.id, quiz.title, quiz.id_span.text) == (
        "4.2-check",
        "Knowledge check",
        '"4.2-check"',
    )
    assert quiz.span.text.startswith("```quiz") and quiz.span.text.endswith("```")
    one, several, exact, rough, zero, predict, open_, output, order = quiz.questions
    assert isinstance(one, ChoiceQuestion)
    assert [words((Paragraph(o.span, o.text),)) for o in one.options] == ["a", "b $x$", "c"]
    assert [words(o.feedback) for o in one.options] == ["no", "", "yes"]
    assert [o.span.text for o in one.options] == ['"a"', '"b $x$"', '"c"']
    assert (one.answers, one.several, one.predict, one.sim) == ((2,), False, False, None)
    assert (one.label, words(one.text), [words(h) for h in one.hints]) == (
        "first",
        "Which?",
        ["one", "two"],
    )
    assert words(one.explain) == "<p>since $I_1 < I_2$</p>"
    assert one.span.text.startswith('{"kind": "mcq"') and one.span.text.endswith('"yes"]}')
    assert one.span.line == 4
    assert isinstance(several, ChoiceQuestion)
    assert (several.answers, several.several, several.options[0].feedback) == ((0, 2), True, ())
    assert isinstance(exact, NumericQuestion) and isinstance(rough, NumericQuestion)
    assert (exact.answer, exact.answer_text, exact.tolerance, exact.unit) == (
        0.08,
        "8.0e-2",
        0.0001,
        "kg m^2",
    )
    assert (rough.answer, rough.answer_text, rough.tolerance) == (-5.0, "-5", 0.1)
    assert isinstance(zero, NumericQuestion) and zero.tolerance == 0.0
    assert isinstance(predict, ChoiceQuestion) and predict.predict
    lab = predict.sim
    assert lab is not None
    assert (lab.kind, lab.fields.model, lab.fields.key) == ("simlab", "tumbling_box", "major")
    assert lab.place(("model",)).text == '"tumbling_box"'
    assert (
        lab.span.text
        == lab.config
        == ('{"model": "tumbling_box", "note": "Press *Play*.", "key": "major"}')
    )
    assert words(lab.note) == "Press *Play*."
    assert isinstance(open_, OpenQuestion) and words(open_.reference) == "Because."
    assert isinstance(output, OutputQuestion)
    assert (output.script, output.script_span.text) == ("examples/x.py", '"examples/x.py"')
    assert (output.line, output.line_span.text) == (7, "7")
    assert isinstance(order, OrderQuestion)
    assert [words((Paragraph(order.span, item),)) for item in order.items] == [
        "first",
        "second",
        "third",
    ]


def test_texts_are_read_in_the_order_of_the_page() -> None:
    texts = Plain()
    parse_quiz(
        *fence(
            '{"questions": [{"explain": "2", "q": "3", "options": ["4", "5"], "kind": "mcq",'
            ' "answer": 0, "feedback": ["6", ""], "hints": ["7"]},'
            ' {"kind": "open", "reference": "8", "q": "9"}], "id": "x"}'
        ),
        texts,
    )
    assert texts.asked == [
        ("blocks", "2"),
        ("blocks", "3"),
        ("inlines", "4"),
        ("inlines", "5"),
        ("blocks", "6"),
        ("blocks", "7"),
        ("blocks", "8"),
        ("blocks", "9"),
    ]


def test_an_escaped_text_points_into_the_lesson() -> None:
    parsed = parse(
        '{"id": "x", "questions": [\n{"kind": "open", "q": "\\u00e9\\\\o BAD", "reference": "r"}]}'
    )
    assert [(d.rule, d.span.text, d.span.line, d.span.column) for d in parsed.diagnostics] == [
        ("math-syntax", "BAD", 4, 34)
    ]


def keys(*questions: str) -> list[str]:
    quiz = parse('{"id": "x", "questions": [' + ",".join(questions) + "]}").value
    assert quiz is not None
    assert quiz.keys == tuple(question.key for question in quiz.questions)
    return list(quiz.keys)


WHY = '{"kind": "open", "q": "Why is it?", "reference": "R"}'


def test_the_key_of_a_question_is_its_id_or_comes_from_its_kind_and_text() -> None:
    hashed = hashlib.sha256(b"open\nWhy is it?").hexdigest()[:8]
    assert keys(WHY) == [hashed]
    assert keys(WHY.replace('"R"', '"Another"').replace("is it", "\\n is   it")) == [hashed]
    assert keys(WHY.replace('"open"', '"open", "id": "own"')) == ["own"]
    assert keys(WHY.replace("Why", "How")) != [hashed]
    output = WHY.replace("open", "output").replace('"reference": "R"', '"of": "a.py", "line": 1')
    assert keys(output) != [hashed]
    # Others of the quiz are no matter, wherever they stand.
    assert keys(MCQ % '"answer": 0', WHY)[1] == keys(WHY, MCQ % '"answer": 1')[0] == hashed


def test_keys_of_a_quiz_are_never_the_same() -> None:
    hashed = keys(WHY)[0]
    taken = WHY.replace('"open"', f'"open", "id": "{hashed}-2"')
    assert keys(WHY, WHY, WHY, taken) == [hashed, f"{hashed}-3", f"{hashed}-4", f"{hashed}-2"]


def test_options_and_items_have_keys_of_their_texts_alone() -> None:
    def options(*texts: str) -> tuple[str, ...]:
        listed = json.dumps(texts)
        one = f'{{"kind": "mcq", "q": "Q", "options": {listed}, "answer": 0}}'
        two = f'{{"kind": "order", "q": "Q", "items": {listed}}}'
        quiz = parse('{"id": "x", "questions": [' + one + "," + two + "]}").value
        assert quiz is not None
        choice, order = quiz.questions
        assert isinstance(choice, ChoiceQuestion) and isinstance(order, OrderQuestion)
        keys = [option.key for option in choice.options]
        assert len({*keys, *order.item_keys}) == 2 * len(texts)
        return (*keys, *order.item_keys)

    a, b, c, *items = options("a", "b  c", "$d$")
    assert options("$d$", "b c", "a") == (c, b, a, items[2], items[1], items[0])
    assert options("b c", "b  c")[:2] == (b, f"{b}-2")


def test_in_a_lesson() -> None:
    body = (
        '{"id": "c", "questions": [{"kind": "mcq", "q": "Is $\\\\omega_1$ *large*?",\n'
        '"options": ["$a$", "no"], "answer": 1, "explain": "<p>It is $I_1 < I_2$.</p>"}]}'
    )
    rows = ["[!try] Now", "", "```quiz", *body.split("\n"), "```"]
    lesson = "## Check\n\n" + "".join(f"> {row}\n" for row in rows)
    source = Source("content/lessons/4.2-x.md", lesson)
    parsed = parse_document(source, frozenset(kind.name for kind in CALLOUTS), lesson=True)
    assert parsed.diagnostics == ()
    quiz = next(block for block in document_blocks(parsed.value) if isinstance(block, Quiz))
    assert quiz.questions[0].span.line == 6
    formulas = [i for i in document_inlines(parsed.value) if isinstance(i, Math)]
    assert {(m.tex.text, m.tex.span().line) for m in formulas} == {
        ("\\omega_1", 6),
        ("a", 7),
        ("I_1 < I_2", 7),
    }


# ------------------------------------------------------------------------------------- properties


@settings(max_examples=150)
@given(st.data())
def test_any_edit_of_a_good_text_is_read_or_told(data: st.DataObject) -> None:
    at = data.draw(st.integers(0, len(COMPLETE)))
    piece = data.draw(
        st.sampled_from([*'{}[],:"\\\n 0-1e', "null", "true", "kind", '"x":', "BAD", "“", "\x00"])
        | st.text(max_size=3)
    )
    mutated = COMPLETE[:at] + piece + COMPLETE[at + data.draw(st.integers(0, 12)) :]
    span, body = fence(mutated.replace("\r", ""))
    parsed = parse_quiz(span, body, Plain())
    assert parsed.value is not None or parsed.diagnostics
    orders = [d.order for d in parsed.diagnostics]
    assert orders == sorted(orders)
    assert all(span.contains(d.span) for d in parsed.diagnostics)


VALUES = st.recursive(
    st.sampled_from([None, True, 0, 1, -1, 2.5, "", "x", "mcq", "numeric", "examples/x.py"]),
    lambda inner: st.lists(inner, max_size=3),
    max_leaves=3,
)
FIELDS = st.sampled_from(
    [
        *("kind", "q", "options", "answer", "explain", "label", "hints", "feedback", "sim", "tol"),
        *("unit", "reference", "of", "line", "items"),
    ]
)


@settings(max_examples=150)
@given(
    st.sampled_from(["mcq", "predict", "numeric", "open", "output", "order"]),
    st.dictionaries(FIELDS, VALUES, max_size=8),
)
def test_any_question_becomes_one_or_is_told_why_not(kind: str, fields: dict[str, object]) -> None:
    body = json.dumps({"id": "x", "questions": [{"kind": kind, "q": "Q", **fields}]}, indent=1)
    parsed = parse(body)
    assert parsed.value is not None
    assert parsed.diagnostics or len(parsed.value.questions) == 1
    if not parsed.diagnostics:
        question = parsed.value.questions[0]
        if isinstance(question, ChoiceQuestion):
            assert all(0 <= index < len(question.options) for index in question.answers)
            assert question.answers
        if isinstance(question, NumericQuestion):
            assert question.tolerance >= 0


def test_a_quiz_with_mistakes_is_there_with_its_right_questions() -> None:
    body = (
        '{"id": "x", "questions": [\n'
        '{"kind": "output", "q": "Q", "of": "examples/a.py", "line": 1, "tol": 1},\n'
        '{"kind": "open", "q": "Q"},\n'
        '{"kind": "predict", "q": "Q", "options": ["a", "b"], "answer": 0,\n'
        ' "sim": {"model": "m", "note": "BAD"}}]}'
    )
    parsed = parse(body)
    assert [d.rule for d in parsed.diagnostics] == ["field-unknown", "field-missing", "math-syntax"]
    assert parsed.value is not None
    output, predict = parsed.value.questions
    assert isinstance(output, OutputQuestion) and output.script == "examples/a.py"
    assert isinstance(predict, ChoiceQuestion) and predict.sim is None
    nameless = parse(body.replace('"id": "x"', '"id": "my quiz"')).value
    assert nameless is not None and (nameless.id, len(nameless.questions)) == ("", 2)
