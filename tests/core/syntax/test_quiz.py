"""`quiz` fences: what they become, and the Markdown inside their JSON."""

from __future__ import annotations

import hashlib
import json

from coursebuild.core import model
from coursebuild.core.syntax.document import parse_document
from coursebuild.core.text.diagnostics import Diagnostic
from coursebuild.core.text.source import Source
from coursebuild.features.quiz.model import ChoiceQuestion, OpenQuestion, OrderQuestion, Quiz
from support.text_cases import MCQ
from support.text_cases import parse_quiz as parse


def keys(*questions: str) -> list[str]:
    quiz = parse('{"id": "x", "questions": [' + ",".join(questions) + "]}").value
    assert quiz is not None
    return [question.key for question in quiz.questions]


QUESTION = '{"kind": "open", "q": "Why is it?", "reference": "R"}'


def test_the_key_of_a_question_is_its_id_or_comes_from_its_kind_and_text() -> None:
    key = hashlib.sha256(b"open\nWhy is it?").hexdigest()[:8]
    assert keys(QUESTION) == [key]
    assert keys(QUESTION.replace('"R"', '"Another"').replace("is it", "\\n is   it")) == [key]
    assert keys(QUESTION.replace('"open"', '"open", "id": "own"')) == ["own"]
    assert keys(QUESTION.replace("Why", "How")) != [key]
    composed, decomposed = (QUESTION.replace("Why", f"Wh{y}") for y in ("ý", "y\u0301"))
    assert keys(composed) == keys(decomposed) != [key]
    output = QUESTION.replace("open", "output").replace(
        '"reference": "R"', '"of": "a.py", "line": 1'
    )
    assert keys(output) != [key]
    # Others of the quiz are no matter, wherever they stand.
    assert keys(MCQ % '"answer": 0', QUESTION)[1] == keys(QUESTION, MCQ % '"answer": 1')[0] == key


def test_question_whose_json_is_wrong_is_left_out() -> None:
    result = parse(f'{{"id": "x", "questions": [{QUESTION[:-1]}, }}, {QUESTION}]}}')
    assert result.value is not None
    assert [d.rule for d in result.diagnostics] == ["json-syntax"]
    assert len(result.value.questions) == 1


def test_keys_of_a_quiz_are_never_the_same() -> None:
    key = keys(QUESTION)[0]
    with_used_id = QUESTION.replace('"open"', f'"open", "id": "{key}-2"')
    assert keys(QUESTION, QUESTION, QUESTION, with_used_id) == [
        key,
        f"{key}-3",
        f"{key}-4",
        f"{key}-2",
    ]


def test_options_and_items_have_keys_of_their_texts_alone() -> None:
    def options(*texts: str) -> tuple[str, ...]:
        texts_json = json.dumps(texts)
        choice_json = f'{{"kind": "mcq", "q": "Q", "options": {texts_json}, "answer": 0}}'
        order_json = f'{{"kind": "order", "q": "Q", "items": {texts_json}}}'
        quiz = parse('{"id": "x", "questions": [' + choice_json + "," + order_json + "]}").value
        assert quiz is not None
        choice, order = quiz.questions
        assert isinstance(choice, ChoiceQuestion) and isinstance(order, OrderQuestion)
        keys = [option.key for option in choice.options]
        assert len({*keys, *order.item_keys}) == 2 * len(texts)
        return (*keys, *order.item_keys)

    a, b, c, *items = options("a", "b  c", "$d$")
    assert options("$d$", "b c", "a") == (c, b, a, items[2], items[1], items[0])
    assert options("b c", "b  c")[:2] == (b, f"{b}-2")


TICKS = "```"


def read(
    text: str, before: str = "", after: str = ""
) -> tuple[tuple[model.Block, ...], list[Diagnostic]]:
    """The blocks of a question's text, written as JSON in a lesson."""
    question = {"kind": "open", "q": text, "reference": "R"}
    quiz = json.dumps({"id": "q", "questions": [question]}, ensure_ascii=False)
    lesson = f"{before}{TICKS}quiz\n{quiz}\n{TICKS}\n{after}"
    result = parse_document(Source("x.md", lesson), frozenset({"note"}), lesson=True)
    for block in result.value.blocks:
        if isinstance(block, Quiz):
            question_read = block.questions[0]
            assert isinstance(question_read, OpenQuestion)
            return question_read.text, list(result.diagnostics)
    return (), list(result.diagnostics)


def test_links_and_footnotes_of_the_lesson_are_known() -> None:
    after = "\n[r]: lesson:1.1\n\n[^n]: Note.\n"
    blocks, diagnostics = read("[a][r] b[^n]", "First[^n].\n\n", after)
    assert diagnostics == []
    (paragraph,) = blocks
    assert isinstance(paragraph, model.Paragraph)
    references = [child for child in paragraph.children if isinstance(child, model.FootnoteRef)]
    assert [(r.number, r.occurrence) for r in references] == [(1, 2)]
    link = paragraph.children[0]
    assert isinstance(link, model.Link) and link.target_span.text == "lesson:1.1"


def test_link_definitions_of_a_text_are_its_own() -> None:
    blocks, diagnostics = read("[a]: /u\n\n[a]", "[a]\n\n")
    assert diagnostics == []
    lesson = parse_document(Source("x.md", "[a]"), frozenset(), lesson=True)
    assert not any(isinstance(i, model.Link) for i in model.document_inlines(lesson.value))
    assert isinstance(blocks[0], model.Paragraph) and isinstance(blocks[0].children[0], model.Link)
