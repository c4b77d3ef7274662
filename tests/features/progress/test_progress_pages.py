"""Quizzes in pages before any script runs, and the data about lessons for the reader's progress."""

from __future__ import annotations

import json
import re
from typing import Any

import pytest

from coursebuild.core.model.results import Outcome, ScriptRun
from coursebuild.features.quiz.page import letter, shuffle, unit_html
from coursebuild.features.quiz.parse import text_key
from support.fixture_cases import fixture_tables
from support.rendered_course import Make


def quiz(id: str, *questions: dict[str, Any]) -> str:
    data = {"id": id, "title": "Check", "questions": list(questions)}
    return f"```quiz\n{json.dumps(data)}\n```\n\n"


def open_question(text: str, **fields: str) -> dict[str, Any]:
    return {"kind": "open", "q": text, "reference": "So.", **fields}


TWO_QUIZZES = quiz("0.1-one", open_question("Why?"), open_question("How?", id="how")) + quiz(
    "0.1-two", open_question("What?")
)
WHY_KEY, WHAT_KEY = text_key("open", "Why?"), text_key("open", "What?")
NAMES = f"0.1-one:{WHY_KEY},how 0.1-two:{WHAT_KEY}"


@pytest.fixture(scope="module")
def pages(make: Make) -> dict[str, str]:
    site = make(TWO_QUIZZES, about=quiz("about", open_question("Which?", id="which"))).site()
    return {path: data.decode() for path, data in site.items() if path.endswith(".html")}


def test_lists_of_lessons_name_their_questions(pages: dict[str, str]) -> None:
    row = f'data-lesson="0.1" data-quizzes="{NAMES}">'
    for path in ("index.html", "levels/0.html", "progress/index.html"):
        assert pages[path].count(row) == 1, path
    assert 'data-lesson="1.2">' in pages["progress/index.html"]
    assert 'data-quizzes="about:which">' in pages["progress/index.html"]
    assert re.findall(r'<li data-quizzes="(.*?)"(.*?)>', pages["review/index.html"]) == [
        (NAMES, ' data-lesson="0.1"'),
        ("about:which", ""),
    ]
    counts = re.findall(r'"asking-count">(.*?)<', pages["review/index.html"])
    assert counts == ["3 tasks", "1 task"]


def test_only_lists_of_lessons_name_questions(pages: dict[str, str]) -> None:
    """So that an edit of a quiz draws no other page."""
    lists = {"index.html", "levels/0.html", "progress/index.html", "review/index.html"}
    assert {path for path, html in pages.items() if "data-quizzes" in html} == lists


def test_a_course_without_questions_has_no_review(make: Make) -> None:
    site = make("Text.").site()
    assert "progress/index.html" in site
    assert "review/index.html" not in site
    foot = site["about.html"].decode().partition('class="site-foot"')[2]
    assert "progress/index.html" in foot
    assert "review" not in foot


def test_each_page_carries_the_words_that_it_shows(pages: dict[str, str]) -> None:
    words = {path: set(re.findall(r'data-key="([^"]+)"', html)) for path, html in pages.items()}

    def groups(path: str) -> set[str]:
        parts = (key.split(".") for key in words[path])
        return {".".join(p[:2]) for p in parts if p[0] in ("progress", "review")}

    lesson = {"progress.lesson", "progress.map", "progress.trouble"}
    assert groups("about.html") == set()
    assert groups("index.html") == groups("levels/0.html") == {"progress.map"}
    assert groups("lessons/0.1-falling.html") == lesson
    assert groups("progress/index.html") == {"progress.live", "progress.map", "progress.trouble"}
    assert groups("review/index.html") == {"review.live", "progress.trouble"}
    assert "quiz.live.check" in words["review/index.html"]


def test_only_the_pages_about_the_reader_load_their_script(pages: dict[str, str]) -> None:
    for script, page in (("progress", "progress/index.html"), ("review", "review/index.html")):
        loading = {path for path, html in pages.items() if f"assets/{script}." in html}
        assert loading == {page}


SCRIPT = "```python file=examples/a.py\nprint(1)\n```\n\n"


def quiz_of(*questions: dict[str, Any], title: str = "Check", id: str = "0.1-check") -> str:
    data = {"id": id, "title": title, "questions": list(questions)}
    return f"```quiz\n{json.dumps(data)}\n```\n"


def output_question(line: int) -> str:
    return SCRIPT + quiz_of(
        {"kind": "output", "q": "What?", "of": "examples/a.py", "line": line, "explain": "E."}
    )


def test_the_key_of_an_output_question_is_what_the_script_printed(make: Make) -> None:
    html = make(output_question(2)).html()
    assert "What does examples/a.py print in line 2 of its output?" in html
    assert "<samp>two</samp></pre>" in html
    assert 'data-answer="two" data-compare="digits">' in html


@pytest.mark.parametrize(("comparison", "rule"), fixture_tables("progress_pages")["outputs"])
def test_an_output_question_is_graded_as_its_recording_is_compared(
    make: Make, comparison: str, rule: str
) -> None:
    recorded = f"Output:\n\n```text {comparison}\none\ntwo\n```\n\n"
    html = make(output_question(2).replace("```quiz", f"{recorded}```quiz")).html()
    assert f'data-answer="two" data-compare="{rule}">' in html


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


def test_a_heading_that_has_the_quizs_id_keeps_it(make: Make) -> None:
    question = {"kind": "open", "id": "why", "q": "Why?", "reference": "So."}
    html = make("## Check\n\nSee [it](#check).\n\n" + quiz_of(question, id="check")).html()
    assert html.count('id="check"') == 1
    assert '<section class="quiz" role="group" data-quiz="check"' in html
    assert 'id="check.why"' in html


def test_a_prediction_with_several_right_options_says_so(make: Make) -> None:
    question = {"kind": "predict", "q": "Q", "options": ["a", "b", "c"], "answer": [0, 2]}
    html = make(quiz_of(question)).html()
    keys = " ".join(text_key("option", option) for option in ("a", "c"))
    assert f'data-kind="predict" data-answer="{keys}" data-several>' in html
    assert "Decide before you look. Choose all that are right." in html


def test_questions_work_without_any_form_control(make: Make) -> None:
    question = {"kind": "mcq", "q": "Which?", "options": ["a", "b"], "answer": 0, "explain": "E."}
    html = make(quiz_of(question)).html()
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


@pytest.mark.parametrize(("unit", "html"), fixture_tables("progress_pages")["units"])
def test_exponents_of_a_unit_are_raised(unit: str, html: str) -> None:
    assert unit_html(unit) == html
