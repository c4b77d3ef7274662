"""Quizzes before any script runs: every question and every answer is in the page."""

from __future__ import annotations

import json
import re
from typing import Any

import pytest

from coursebuild.core.model.results import Outcome, ScriptRun
from coursebuild.features.quiz.keys import text_key
from coursebuild.features.quiz.page import letter, shuffle, unit_html
from support.rendered_course import Make

SCRIPT = "```python file=examples/a.py\nprint(1)\n```\n\n"


def quiz(*questions: dict[str, Any], title: str = "Check", id: str = "0.1-check") -> str:
    data = {"id": id, "title": title, "questions": list(questions)}
    return f"```quiz\n{json.dumps(data)}\n```\n"


def test_a_multiple_choice_question_has_options_hints_and_feedback(make: Make) -> None:
    question = {
        "kind": "mcq", "q": "Which *one*?", "options": ["A < B", "$x$"], "answer": 1,
        "explain": "<p>Because.</p>", "feedback": ["No.", "Yes."], "hints": ["Look."],
    }  # fmt: skip
    key, a, b = text_key("mcq", "Which *one*?"), *(text_key("option", o) for o in ("A < B", "$x$"))
    assert make(quiz(question)).html() == (
        '<section class="quiz" id="0.1-check" data-quiz="0.1-check" aria-label="Check">\n'
        '<p class="quiz-title">Check</p>\n<ol class="questions">\n'
        f'<li class="question" id="0.1-check.{key}" data-question="{key}" data-number="1"'
        f' data-kind="mcq" data-answer="{b}">\n'
        '<div class="question-text">\n<p>Which <em>one</em>?</p>\n</div>\n'
        f'<ol class="options">\n<li data-key="{a}">A &lt; B</li>\n'
        f'<li data-key="{b}"><math class="inline"><mi>x</mi></math></li>\n</ol>\n'
        '<details class="hint">\n<summary>Hint 1</summary>\n<p>Look.</p>\n</details>\n'
        '<details class="answer">\n<summary>Answer</summary>\n<div class="solution">\n'
        '<p class="key"><strong>B.</strong> <math class="inline"><mi>x</mi></math></p>\n</div>\n'
        '<div class="explain">\n<p>Because.</p>\n</div>\n'
        f'<div class="feedback" data-key="{a}">\n<p class="feedback-label">If you chose A</p>\n'
        f'<p>No.</p>\n</div>\n<div class="feedback" data-key="{b}">\n'
        '<p class="feedback-label">If you chose B</p>\n<p>Yes.</p>\n</div>\n'
        "</details>\n</li>\n</ol>\n</section>\n"
    )  # fmt: skip


def test_a_question_with_an_id_is_named_by_it(make: Make) -> None:
    question = {"kind": "open", "id": "why", "q": "Why?", "reference": "So."}
    html = make(quiz(question)).html()
    assert 'id="0.1-check.why" data-question="why" data-number="1" data-kind="open">' in html


def test_a_question_can_be_linked_to(make: Make) -> None:
    question = {"kind": "open", "id": "why", "q": "Why?", "reference": "So."}
    html = make("See [it](#0.1-check.why).\n\n" + quiz(question)).html()
    assert '<a href="#0.1-check.why">it</a>' in html


def test_a_question_with_several_right_options_says_so(make: Make) -> None:
    options = ["a", "b", "c"]
    question = {"kind": "mcq", "q": "Which?", "options": options, "answer": [0, 2], "explain": "E."}
    html = make(quiz(question)).html()
    assert 'data-kind="several"' in html
    assert "Choose all that are right." in html
    assert '<p class="key"><strong>A.</strong> a<br><strong>C.</strong> c</p>' in html


def test_numbers_have_unit_and_tolerance(make: Make) -> None:
    question = {"kind": "numeric", "q": "How much?", "answer": 0.08, "tol": 0.0001,
                "unit": "kg m^2", "explain": "So."}  # fmt: skip
    html = make(quiz(question)).html()
    assert 'data-answer="0.08" data-tolerance="0.0001" data-unit="kg m^2">' in html
    how = 'Give the answer in <span class="unit">kg m<sup>2</sup></span>'
    assert f'<p class="question-how">{how}</p>' in html
    assert (
        '<p class="key"><strong>0.08 kg m<sup>2</sup></strong> '
        '<span class="tolerance">within 0.0001 kg m<sup>2</sup></span></p>'
    ) in html


def test_a_prediction_keeps_its_simulation_behind_the_answer(make: Make) -> None:
    sim = {"model": "box", "title": "The simulation"}
    question = {"kind": "predict", "q": "What?", "options": ["a", "b"], "answer": 0, "sim": sim}
    html = make(quiz(question)).html()
    assert "Decide before you look." in html
    before, after = html.split("<summary>Answer</summary>")
    assert "The simulation" not in before
    assert 'data-kind="simlab"' in after.split("</details>")[0]


def test_open_questions_have_a_reference(make: Make) -> None:
    html = make(quiz({"kind": "open", "q": "Why?", "reference": "Since **so**."})).html()
    assert '<p class="key">A good answer</p>\n<p>Since <strong>so</strong>.</p>' in html


def output_question(line: int) -> str:
    return SCRIPT + quiz(
        {"kind": "output", "q": "What?", "of": "examples/a.py", "line": line, "explain": "E."}
    )


def test_the_key_of_an_output_question_is_what_the_script_printed(make: Make) -> None:
    html = make(output_question(2)).html()
    assert "What does examples/a.py print in line 2 of its output?" in html
    assert "<samp>two</samp></pre>" in html
    assert 'data-answer="two" data-compare="digits">' in html


@pytest.mark.parametrize(
    ("how", "rule"),
    [
        ("exact", "exact"),
        ("digits", "digits"),
        ("rtol=1e-6 atol=1e-12", "rtol=1e-06 atol=1e-12"),
        ("volatile", "digits"),
    ],
)
def test_an_output_question_is_graded_as_its_recording_is_compared(
    make: Make, how: str, rule: str
) -> None:
    recorded = f"Output:\n\n```text {how}\none\ntwo\n```\n\n"
    html = make(output_question(2).replace("```quiz", f"{recorded}```quiz")).html()
    assert f'data-answer="two" data-compare="{rule}">' in html


def test_an_output_question_is_graded_by_the_recording_of_its_own_script(make: Make) -> None:
    other = SCRIPT.replace("a.py", "b.py") + "Output:\n\n```text exact\none\ntwo\n```\n\n"
    own = "Output:\n\n```text rtol=1e-3\none\ntwo\n```\n\n```quiz"
    html = make(other + output_question(2).replace("```quiz", own)).html()
    assert 'data-compare="rtol=0.001 atol=0.0">' in html


def test_an_empty_line_of_an_output_is_shown_and_not_graded(make: Make) -> None:
    run = ScriptRun("examples/a.py", Outcome.OK, 0, "one\n\nthree\n", "", 0.0)
    html = make(output_question(2), runs={"examples/a.py": run}).html()
    assert "<samp></samp></pre>" in html
    assert "data-answer" not in html


def test_what_a_script_prints_stays_inside_its_attribute(make: Make) -> None:
    line = '"><script>alert(1)</script> &amp; \u202e'
    run = ScriptRun("examples/a.py", Outcome.OK, 0, f"one\n{line}\n", "", 0.0)
    html = make(output_question(2), runs={"examples/a.py": run}).html()
    assert "<script>" not in html
    assert 'data-answer="&#34;&gt;&lt;script&gt;alert(1)&lt;/script&gt; &amp;amp; ' in html


@pytest.mark.parametrize("outcome", [Outcome.SKIPPED, Outcome.FAILED])
def test_without_a_run_there_is_no_key(make: Make, outcome: Outcome) -> None:
    run = ScriptRun("examples/a.py", outcome, 1, "one\ntwo\n", "", 0.0)
    html = make(output_question(2), runs={"examples/a.py": run}).html()
    assert "<samp>" not in html and "data-answer" not in html
    assert "The answer is not known" in html


def test_items_are_shown_shuffled_and_solved_in_order(make: Make) -> None:
    items = ["first", "second", "third"]
    html = make(quiz({"kind": "order", "q": "Sort.", "items": items, "explain": "E."})).html()
    shown, solved = html.split("The right order")
    assert re.findall(r"<li>(\w+)</li>", solved) == items
    assert f'data-answer="{" ".join(text_key("item", item) for item in items)}"' in html
    keyed = re.findall(r'<li data-key="(\w+)">(\w+)</li>', shown)
    assert all(key == text_key("item", item) for key, item in keyed)
    mixed = [item for _, item in keyed]
    assert sorted(mixed) == sorted(items) != mixed or mixed != items
    assert mixed != items


def test_a_title_that_a_heading_says_is_not_said_twice(make: Make) -> None:
    question = {"kind": "open", "q": "Why?", "reference": "So."}
    html = make("## Check\n\n" + quiz(question)).html()
    assert 'aria-label="Check">\n<ol class="questions">' in html


def test_a_heading_that_has_the_quizs_id_keeps_it(make: Make) -> None:
    question = {"kind": "open", "id": "why", "q": "Why?", "reference": "So."}
    html = make("## Check\n\nSee [it](#check).\n\n" + quiz(question, id="check")).html()
    assert html.count('id="check"') == 1
    assert '<section class="quiz" data-quiz="check"' in html
    assert 'id="check.why"' in html


def test_a_quiz_without_a_title_has_a_name_all_the_same(make: Make) -> None:
    html = make(quiz({"kind": "open", "q": "Why?", "reference": "So."}, title="")).html()
    assert 'aria-label="Questions">\n<ol class="questions">' in html


def test_a_prediction_with_several_right_options_says_so(make: Make) -> None:
    question = {"kind": "predict", "q": "Q", "options": ["a", "b", "c"], "answer": [0, 2]}
    html = make(quiz(question)).html()
    keys = " ".join(text_key("option", option) for option in ("a", "c"))
    assert f'data-kind="predict" data-answer="{keys}" data-several>' in html
    assert "Decide before you look. Choose all that are right." in html


def test_questions_work_without_any_form_control(make: Make) -> None:
    question = {"kind": "mcq", "q": "Which?", "options": ["a", "b"], "answer": 0, "explain": "E."}
    html = make(quiz(question)).html()
    assert not re.search("<(input|button|select|textarea|form)", html)


@pytest.mark.parametrize("count", range(0, 9))
def test_a_shuffle_is_a_permutation_and_never_the_right_order(count: int) -> None:
    for key in ("a", "b", "4.2-check/3"):
        order = shuffle(count, key)
        assert sorted(order) == list(range(count))
        assert order == shuffle(count, key)
        assert count < 2 or order != tuple(range(count))
    assert count < 4 or len({shuffle(count, str(i)) for i in range(20)}) > 3


def test_letters_go_on_after_z() -> None:
    assert [letter(i) for i in (0, 25, 26, 27, 701, 702)] == ["A", "Z", "AA", "AB", "ZZ", "AAA"]


@pytest.mark.parametrize(
    ("unit", "html"),
    [
        ("kg m^2", "kg m<sup>2</sup>"),
        ("m s^-1", "m s<sup>−1</sup>"),
        ("N m^{-2}/x^10", "N m<sup>−2</sup>/x<sup>10</sup>"),
        ("<b>^", "&lt;b&gt;^"),
        ("", ""),
    ],
)
def test_exponents_of_a_unit_are_raised(unit: str, html: str) -> None:
    assert unit_html(unit) == html
