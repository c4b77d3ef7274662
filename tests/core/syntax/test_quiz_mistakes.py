"""Everything that can be wrong in a `quiz` fence."""

from __future__ import annotations

import pytest

from coursebuild.features.quiz.model import ChoiceQuestion, OutputQuestion
from support.quiz_fences import MCQ, parse, told

QUESTION = '{"id": "x", "questions": [\n%s]}'


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
