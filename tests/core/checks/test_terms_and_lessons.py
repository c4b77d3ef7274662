"""Terms are defined once; a lesson that is complete has something to read."""

from __future__ import annotations

import pytest

from coursebuild.core.checks.course import check_course, check_document
from coursebuild.core.checks.links import link_targets
from coursebuild.core.model import Course, Document
from support.made_courses import make_course, told


def document_of(course: Course, number: int) -> Document:
    return course.documents[number]


def test_a_term_that_two_lessons_define_at_the_same_place_is_told() -> None:
    text = "The [mass]{term}.\n"
    assert told(check_course(make_course(text, text))) == ["term-repeated: [mass]{term}"]


def test_a_term_that_two_lessons_define_is_told_at_the_second() -> None:
    (found,) = check_course(make_course("The [mass]{term}.\n", "Text: [mass]{term}.\n"))
    assert (found.rule, found.span.path, found.span.column) == (
        "term-repeated",
        "content/lessons/1.2-second.md",
        7,
    )
    assert [(n.message, n.span and n.span.path) for n in found.notes] == [
        ("the first one is here", "content/lessons/1.1-first.md")
    ]


def test_a_term_defined_twice_in_one_lesson_is_told_once_at_the_second() -> None:
    text = "The [mass]{term} and [mass]{term}, [weight]{term}, [m](term:mass).\n"
    (found,) = check_course(make_course(text))
    assert (found.rule, found.span.column) == ("term-repeated", 22)


@pytest.mark.parametrize("text", ["", "\n\n", "<!-- later -->\n"])
def test_a_complete_lesson_without_text_is_empty_and_a_draft_may_be(text: str) -> None:
    (found,) = check_course(make_course(text, text))
    assert (found.rule, found.span.path, found.span.start, found.span.end) == (
        "lesson-empty",
        "content/lessons/1.1-first.md",
        0,
        0,
    )


def test_a_page_may_be_empty() -> None:
    assert check_course(make_course(about="")) == ()


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
        for line in told(check_document(course, document, link_targets(course)))
    ]
    assert sorted(one_by_one) == sorted(told(check_course(course)))
    assert len(one_by_one) == 8
