"""Checks of one document are those of the whole course."""

from __future__ import annotations

from coursebuild.core.checks.lessons import check_course, check_document
from coursebuild.core.checks.links import link_targets
from support.made_courses import make_course, rules_and_texts


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
        for line in rules_and_texts(check_document(course, document, link_targets(course)))
    ]
    assert sorted(one_by_one) == sorted(rules_and_texts(check_course(course)))
    assert len(one_by_one) == 8
