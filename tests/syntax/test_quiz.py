"""`quiz` fences: what they become, and everything that can be wrong in one."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass, field

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coursebuild.diagnostics import Parsed, diagnose
from coursebuild.model import (
    Block,
    ChoiceQuestion,
    Inline,
    Math,
    NumericQuestion,
    OpenQuestion,
    OrderQuestion,
    OutputQuestion,
    Paragraph,
    Quiz,
    Text,
    document_blocks,
    document_inlines,
)
from coursebuild.source import Excerpt, Source, Span
from coursebuild.syntax.document import parse_document
from coursebuild.syntax.quiz import parse_quiz
from coursebuild.vocabulary import CALLOUTS


@dataclass
class Plain:
    """A parser of texts to which all is text, and `BAD` a mistake."""

    asked: list[tuple[str, str]] = field(default_factory=list)

    def blocks(self, excerpt: Excerpt) -> Parsed[tuple[Block, ...]]:
        inner = self.inlines(excerpt)
        self.asked[-1] = ("blocks", excerpt.text)
        return Parsed((Paragraph(excerpt.span(), inner.value),), inner.diagnostics)

    def inlines(self, excerpt: Excerpt) -> Parsed[tuple[Inline, ...]]:
        self.asked.append(("inlines", excerpt.text))
        at = excerpt.text.find("BAD")
        found = (diagnose("math-syntax", excerpt.span(at, at + 3), "bad"),) if at >= 0 else ()
        return Parsed((Text(excerpt.span(), excerpt.text),), found)


def fence(body: str, prefix: str = "", newline: str = "\n") -> tuple[Span, Excerpt]:
    """The body between fences, each line after a prefix, from the third line on."""
    rows = ["Before.", "```quiz", *(body.split("\n") if body else []), "```", "After."]
    text = newline.join(prefix + row for row in rows) + newline
    source = Source("content/lessons/4.2-x.md", text)
    starts = source.line_starts
    inner = [(row, starts[i + 2] + len(prefix)) for i, row in enumerate(rows[2:-2])]
    last = len(rows) - 2
    span = source.span(starts[1] + len(prefix), starts[last] + len(prefix) + 3)
    if inner:
        return span, Excerpt.of_lines(source, inner)
    return span, Excerpt.of_span(source.span(starts[2], starts[2]))


def parse(body: str, prefix: str = "", newline: str = "\n") -> Parsed[Quiz | None]:
    return parse_quiz(*fence(body, prefix, newline), Plain())


def told(body: str) -> list[str]:
    return [
        f"{d.span.line}:{d.span.column}-{d.span.end_column} {d.rule}: {d.message}"
        + (f" [{d.help}]" if d.help else "")
        for d in parse(body).diagnostics
    ]


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
    assert (lab.kind, lab.model, lab.key) == ("simlab", "tumbling_box", "major")
    assert lab.model_span is not None and lab.model_span.text == '"tumbling_box"'
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


QUESTION = '{"id": "x", "questions": [\n%s]}'
MCQ = '{"kind": "mcq", "q": "Q", "options": ["a", "b"], %s}'


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        ("", '2:1-8 json-syntax: the block is empty: a JSON object is expected'
         ' [write `{"field": value, …}`]'),
        ("[]", "3:1-2 field-type: the quiz must be an object, not an array"),
        ('"x"', "3:1-4 field-type: the quiz must be an object, not a string"),
        ('{"id": "x"}', "3:1-2 field-missing: `questions` is missing"
         " [`questions`: in the order of the page]"),
        ('{"id": "x", "questions": []}', "3:26-27 field-value: `questions` is empty"),
        ('{"id": 42, "questions": [' + MCQ % '"answer": 0' + "]}",
         '3:8-10 field-type: `id` must be a string, not the number 42'
         ' [put it between quotes: `"42"`]'),
        ('{"id": "my quiz", "questions": [' + MCQ % '"answer": 0' + "]}",
         "3:8-17 field-value: `id` cannot be `my quiz`"
         " [expected: letters, digits, `.`, `_` and `-`, with a letter or digit first]"),
        (QUESTION % "1", "4:1-2 field-type: `questions[0]` must be an object, not the number 1"),
        (QUESTION % '{"q": "Q"}', "4:1-2 field-missing: `kind` is missing [known: `mcq`, `numeric`,"
         " `open`, `order`, `output`, `predict`]"),
        (QUESTION % '{"kind": "mqc"}', "4:10-15 field-value: `kind` cannot be `mqc`"
         " [did you mean `mcq`?]"),
        (QUESTION % '{"kind": "open", "q": "Q"}',
         "4:1-2 field-missing: `reference` is missing [`reference`: the answer to compare with]"),
        (QUESTION % '{"kind": "open", "q": "Q", "refrence": "R"}',
         "4:28-38 field-unknown: unknown field `refrence` [did you mean `reference`?]"),
        (QUESTION % '{"kind": "open", "q": " ", "reference": "R"}',
         "4:23-26 field-value: `q` is empty"),
        # answers
        (QUESTION % MCQ % '"answer": 2',
         "4:60-61 quiz-answer: there is no option 2: they are numbered 0 to 1"),
        (QUESTION % MCQ % '"answer": -1',
         "4:60-62 quiz-answer: there is no option -1: they are numbered 0 to 1"),
        (QUESTION % MCQ % '"answer": [0, 7]',
         "4:64-65 quiz-answer: there is no option 7: they are numbered 0 to 1"),
        (QUESTION % MCQ % '"answer": [1, 0, 1]',
         "4:67-68 quiz-answer: the option 1 is named twice"),
        (QUESTION % MCQ % '"answer": []', "4:60-61 field-value: `answer` is empty"),
        (QUESTION % MCQ % '"answer": true',
         "4:60-64 field-type: `answer` must be an integer or an array of integers, not `true`"),
        (QUESTION % MCQ % '"answer": "a"',
         "4:60-63 field-type: `answer` must be an integer or an array of integers, not a string"),
        (QUESTION % MCQ % '"answer": "1"',
         "4:60-63 field-type: `answer` must be an integer or an array of integers, not a string"
         " [write it without quotes: `1`]"),
        (QUESTION % MCQ % '"answer": 0, "feedback": ["f"]',
         "4:75-76 field-value: `feedback` has 1 text for 2 options"
         ' [an option without feedback has `""`]'),
        (QUESTION % MCQ % '"answer": 0, "sim": {"model": "m"}',
         '4:63-68 field-unknown: unknown field `sim` [it is a field of `"kind": "predict"`]'),
        (QUESTION % MCQ % '"answer": 0, "hints": "h"',
         "4:72-75 field-type: `hints` must be an array of strings, not a string"
         ' [put it between brackets: `["h"]`]'),
        (QUESTION % '{"kind": "mcq", "q": "Q", "options": ["a", ""], "answer": 0}',
         "4:44-46 field-value: `options[1]` is empty"),
        (QUESTION % '{"kind": "mcq", "q": "Q", "options": [], "answer": 0}',
         "4:38-39 field-value: `options` is empty"),
        (QUESTION % '{"kind": "mcq", "q": "Q", "options": ["a"], "answer": 0}',
         "4:38-39 field-value: `options` needs at least 2 entries, and has 1"),
        (QUESTION % '{"kind": "mcq", "q": "Q", "options": ["a", " a"], "answer": 0}',
         "4:44-48 field-value: two options are the same: `a`"),
        # numbers
        (QUESTION % '{"kind": "numeric", "q": "Q", "answer": 0}',
         "4:41-42 field-missing: `tol` is missing: of an answer that is 0 it cannot be a share"),
        (QUESTION % '{"kind": "numeric", "q": "Q", "answer": "0.08"}',
         "4:41-47 field-type: `answer` must be a number, not a string"
         " [write it without quotes: `0.08`]"),
        (QUESTION % '{"kind": "numeric", "q": "Q", "answer": 1e999}',
         "4:41-46 field-value: `answer` is too large: numbers end at about 1.8e308"),
        (QUESTION % '{"kind": "numeric", "q": "Q", "answer": 1, "tol": -0.1}',
         "4:51-55 field-value: `tol` must be at least 0, not -0.1"),
        # other kinds
        (QUESTION % '{"kind": "output", "q": "Q", "of": "examples/x.py", "line": 0}',
         "4:61-62 field-value: `line` must be at least 1, not 0"),
        (QUESTION % '{"kind": "order", "q": "Q", "items": ["a"]}',
         "4:38-39 field-value: `items` needs at least 2 entries, and has 1"),
        (QUESTION % '{"kind": "order", "q": "Q", "items": ["a", "b", "a"]}',
         "4:49-52 field-value: two items are the same: `a`"),
        (QUESTION % '{"kind": "predict", "q": "Q", "options": ["a", "b"], "answer": 0,'
         ' "sim": {"modle": "m"}}',
         "4:75-82 field-unknown: unknown field `modle` [did you mean `model`?]"),
        (QUESTION % '{"kind": "predict", "q": "Q", "options": ["a", "b"], "answer": 0,'
         ' "sim": {}}',
         "4:74-75 field-missing: `model` or `xml` is missing"),
        (QUESTION % '{"kind": "open", "q": "Q", "q": "P", "reference": "R"}',
         "4:28-31 field-repeated: `q` is given twice"),
        # ids of questions
        (QUESTION % '{"kind": "open", "id": "Why", "q": "Q", "reference": "R"}',
         "4:24-29 field-value: `id` cannot be `Why`"
         " [expected: lower-case letters, digits and `-`, with a letter or digit first]"),
        (QUESTION % '{"kind": "open", "id": 1, "q": "Q", "reference": "R"}',
         "4:24-25 field-type: `id` must be a string, not the number 1"
         ' [put it between quotes: `"1"`]'),
        (QUESTION % '{"kind": "open", "id": "a", "q": "Q", "reference": "R"},'
         '\n{"kind": "order", "id": "a", "q": "P", "items": ["b", "c"]}',
         "5:25-28 question-id-repeated: the question id `a` is used twice in this quiz"
         " [a learner's answer hangs on it; give each question its own, or none]"),
    ],
)  # fmt: skip
def test_what_an_author_is_told(body: str, expected: str) -> None:
    assert told(body) == [expected]


def test_everything_wrong_is_told_in_one_run_in_order() -> None:
    body = (
        '{"id": "x", "titel": "T", "questions": [\n'
        '  {"kind": "mcq", "q": "$\\omega$", "options": ["a", "b"], "answer": 2},\n'
        '  {"kind": "mcq", "q": "BAD", "options": ["a", "b"], "answer": 5, "tol": 1},\n'
        '  {"kind": "numeric", "q": "Q", "answer": 0},\n'
        '  {"kind": "predict", "q": "Q", "options": ["a", "b"], "answer": 0,\n'
        '   "sim": {"model": "m", "controls": [\n'
        '    {"label": "s", "min": 2, "max": 1, "value": 2, "set": "x"}]}},\n'
        '  {"kind": "numeric", "q": "Q", "answer": 01,}\n'
        "]}"
    )
    assert [line.split(" [")[0] for line in told(body)] == [
        "3:13-20 field-unknown: unknown field `titel`",
        "4:26-28 json-syntax: `\\o` is not an escape of JSON",
        "4:69-70 quiz-answer: there is no option 2: they are numbered 0 to 1",
        "5:25-28 math-syntax: bad",
        "5:64-65 quiz-answer: there is no option 5: they are numbered 0 to 1",
        "5:67-72 field-unknown: unknown field `tol`",
        "6:43-44 field-missing: `tol` is missing: of an answer that is 0 it cannot be a share",
        "9:37-38 field-value: `max` must be greater than `min`, which is 2",
        "10:43-45 json-syntax: `01` is not a number of JSON",
        "10:45-46 json-syntax: a comma before `}`",
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


@settings(max_examples=400)
@given(st.data())
def test_a_mutation_is_never_too_much(data: st.DataObject) -> None:
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


@settings(max_examples=400)
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
