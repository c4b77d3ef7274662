"""`quiz` fences: what they become, and the Markdown inside their JSON."""

from __future__ import annotations

import hashlib
import json

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coursebuild.core.model import (
    Block,
    FootnoteRef,
    HtmlFlow,
    Inline,
    Link,
    Math,
    Paragraph,
    SoftBreak,
    document_inlines,
)
from coursebuild.core.syntax.document import parse_document
from coursebuild.core.text.diagnostics import Diagnostic
from coursebuild.core.text.source import Source
from coursebuild.features.quiz.model import (
    ChoiceQuestion,
    NumericQuestion,
    OpenQuestion,
    OrderQuestion,
    OutputQuestion,
    Quiz,
)
from support.plain_html import plain_blocks
from support.text_cases import MCQ
from support.text_cases import parse_quiz as parse


def html(blocks: tuple[Block, ...]) -> str:
    return plain_blocks(blocks).removesuffix("\n")


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
    parsed_quiz = parse(COMPLETE, prefix, newline)
    assert parsed_quiz.diagnostics == ()
    quiz = parsed_quiz.value
    assert quiz is not None
    assert (quiz.id, quiz.title) == ("4.2-check", "Knowledge check")
    assert quiz.id_span.text == '"4.2-check"'
    assert quiz.span.text.startswith("```quiz") and quiz.span.text.endswith("```")
    choice, several, exact, rough, zero, predict, open_, output, order = quiz.questions
    assert isinstance(choice, ChoiceQuestion)
    assert [html(o.feedback) for o in choice.options] == ["<p>no</p>", "", "<p>yes</p>"]
    assert [o.span.text for o in choice.options] == ['"a"', '"b $x$"', '"c"']
    assert (choice.answers, choice.several, choice.predict, choice.sim) == (
        (2,),
        False,
        False,
        None,
    )
    assert (choice.label, html(choice.text)) == ("first", "<p>Which?</p>")
    assert [html(hint) for hint in choice.hints] == ["<p>one</p>", "<p>two</p>"]
    math = r'<span class="math">\(I_1 &lt; I_2\)</span>'
    assert html(choice.explain) == f"<p>since {math}</p>"
    assert choice.span.text.startswith('{"kind": "mcq"') and choice.span.text.endswith('"yes"]}')
    assert choice.span.line == 4
    assert isinstance(several, ChoiceQuestion)
    assert (several.answers, several.several, several.options[0].feedback) == ((0, 2), True, ())
    assert isinstance(exact, NumericQuestion) and isinstance(rough, NumericQuestion)
    assert (exact.answer, exact.answer_text, exact.tolerance) == (0.08, "8.0e-2", 0.0001)
    assert exact.unit == "kg m^2"
    assert (rough.answer, rough.answer_text, rough.tolerance) == (-5.0, "-5", 0.1)
    assert isinstance(zero, NumericQuestion) and zero.tolerance == 0.0
    assert isinstance(predict, ChoiceQuestion) and predict.predict
    lab = predict.sim
    assert lab is not None
    assert (lab.kind, lab.fields.model, lab.fields.key) == ("simlab", "tumbling_box", "major")
    assert lab.place(("model",)).text == '"tumbling_box"'
    text = '{"model": "tumbling_box", "note": "Press *Play*.", "key": "major"}'
    assert lab.span.text == lab.config == text
    assert html(lab.note) == "<p>Press <em>Play</em>.</p>"
    assert isinstance(open_, OpenQuestion) and html(open_.reference) == "<p>Because.</p>"
    assert isinstance(output, OutputQuestion)
    assert (output.script, output.script_span.text) == ("examples/x.py", '"examples/x.py"')
    assert (output.line, output.line_span.text) == (7, "7")
    assert isinstance(order, OrderQuestion)
    items = [html((Paragraph(order.span, item),))[3:-4] for item in order.items]
    assert items == ["first", "second", "third"]


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


# ------------------------------------------------------------------------------------- properties


@settings(max_examples=150)
@given(st.data())
def test_any_edit_of_a_valid_text_is_parsed_or_reported(data: st.DataObject) -> None:
    at = data.draw(st.integers(0, len(COMPLETE)))
    piece = data.draw(
        st.sampled_from([*'{}[],:"\\\n 0-1e', "null", "true", "kind", '"x":', "$$", "“", "\x00"])
        | st.text(max_size=3)
    )
    mutated = COMPLETE[:at] + piece + COMPLETE[at + data.draw(st.integers(0, 12)) :]
    parsed_quiz = parse(mutated.replace("\r", ""))
    assert parsed_quiz.value is not None or parsed_quiz.diagnostics
    orders = [d.order for d in parsed_quiz.diagnostics]
    assert orders == sorted(orders)


TICKS = "```"


def read(
    text: str, before: str = "", after: str = ""
) -> tuple[tuple[Block, ...], list[Diagnostic]]:
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


def good(text: str) -> tuple[Block, ...]:
    blocks, diagnostics = read(text)
    assert diagnostics == []
    return blocks


def flow(text: str) -> tuple[Inline, ...]:
    (block,) = good(text)
    assert isinstance(block, HtmlFlow)
    return block.children


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("<p>a * b * c, *d*, x_1_</p>", "<p>a * b * c, *d*, x_1_</p>"),
        ("<p>\\$5 &lt;b> &nosuch; 3 < 4 $</p>", "<p>$5 &lt;b&gt; &amp;nosuch; 3 &lt; 4 $</p>"),
        (
            "<p>So $a < b$ &amp; on.</p>",
            r'<p>So <span class="math">\(a &lt; b\)</span> &amp; on.</p>',
        ),
        ("<div>$$a$$<!-- $b$ --></div>", r'<div><span class="math">\[a\]</span><!-- $b$ --></div>'),
        (
            "<p><code>$a$</code> <pre>$b$</pre> <script>'$c$ <b>'</script> $d$</p>",
            "<p><code>$a$</code> <pre>$b$</pre> <script>'$c$ <b>'</script>"
            r' <span class="math">\(d\)</span></p>',
        ),
        ("*a*\r\nb\n\n<p>*c*</p>\n\nd", "<p><em>a</em>\nb</p>\n<p>*c*</p>\n<p>d</p>"),
        ("Output:\n\n- a", "<p>Output:</p>\n<ul>\n<li>a</li>\n</ul>"),
    ],
)
def test_html_in_a_text(text: str, expected: str) -> None:
    assert plain_blocks(good(text)) == f"{expected}\n"


def test_mentions_and_line_ends_in_html() -> None:
    children = flow("<p>See Lesson\n2.2, not <a href='#x'>Lesson 2.3</a>.</p>")
    links = [child for child in children if isinstance(child, Link)]
    assert [link.target_span.text for link in links] == ["2.2"]
    assert any(isinstance(child, SoftBreak) for child in links[0].children)


def test_spans_point_into_the_json() -> None:
    (paragraph,) = good('say "a" and\n\\\\ then $\\frac{a}{b}$ and `c`')
    assert isinstance(paragraph, Paragraph)
    math = next(child for child in paragraph.children if isinstance(child, Math))
    assert math.tex.text == "\\frac{a}{b}"
    assert math.span.text == "$\\\\frac{a}{b}$"
    assert paragraph.children[-1].span.text == "`c`"


def test_links_and_footnotes_of_the_lesson_are_known() -> None:
    after = "\n[r]: lesson:1.1\n\n[^n]: Note.\n"
    blocks, diagnostics = read("[a][r] b[^n]", "First[^n].\n\n", after)
    assert diagnostics == []
    (paragraph,) = blocks
    assert isinstance(paragraph, Paragraph)
    references = [child for child in paragraph.children if isinstance(child, FootnoteRef)]
    assert [(r.number, r.occurrence) for r in references] == [(1, 2)]
    link = paragraph.children[0]
    assert isinstance(link, Link) and link.target_span.text == "lesson:1.1"


def test_link_definitions_of_a_text_are_its_own() -> None:
    blocks, diagnostics = read("[a]: /u\n\n[a]", "[a]\n\n")
    assert diagnostics == []
    lesson = parse_document(Source("x.md", "[a]"), frozenset(), lesson=True)
    assert not any(isinstance(i, Link) for i in document_inlines(lesson.value))
    assert isinstance(blocks[0], Paragraph) and isinstance(blocks[0].children[0], Link)


@pytest.mark.parametrize(
    ("text", "rule"),
    [
        (f"{TICKS}python file=examples/x.py\nprint(1)\n{TICKS}", "script-path"),
        (f"Output:\n\n{TICKS}text digits\n1\n{TICKS}", "recording-keys"),
        (f"{TICKS}quiz\n{{}}\n{TICKS}", "fence-info"),
        (f"{TICKS}lab\n{{}}\n{TICKS}", "fence-info"),
    ],
)
def test_a_text_cannot_hold_blocks_that_need_lines_of_the_lesson(text: str, rule: str) -> None:
    _, diagnostics = read(text)
    assert [d.rule for d in diagnostics] == [rule]
