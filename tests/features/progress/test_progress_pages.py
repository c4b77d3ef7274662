"""The data about lessons in pages for the reader's progress, and the two pages about it."""

from __future__ import annotations

import json
import re
from typing import Any

import pytest

from coursebuild.features.quiz.parse import text_key
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
    """The pages of a course with questions in a lesson and in another page."""
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

    lesson = {"progress.lesson", "progress.trouble"}
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
