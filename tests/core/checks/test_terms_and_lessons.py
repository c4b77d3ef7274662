"""Terms are defined once; a lesson that is complete has something to read."""

from __future__ import annotations

from coursebuild.core.checks.course import check_course, check_document
from coursebuild.core.checks.links import link_targets
from support.made_courses import make_course, told


def test_a_term_that_two_lessons_define_at_the_same_place_is_told() -> None:
    text = "The [mass]{term}.\n"
    assert told(check_course(make_course(text, text))) == ["term-repeated: [mass]{term}"]


def test_a_term_defined_twice_in_one_lesson_is_told_once_at_the_second() -> None:
    text = "The [mass]{term} and [mass]{term}, [weight]{term}, [m](term:mass).\n"
    (found,) = check_course(make_course(text))
    assert (found.rule, found.span.column) == ("term-repeated", 22)


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
