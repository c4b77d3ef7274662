"""A whole course checked: lessons, links, mentions, labs, terms and features, against each other.

Entry points: `check_course`; `check_document`, the same for one document.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from coursebuild.core.checks.benches import bench_findings
from coursebuild.core.checks.labs import lab_findings
from coursebuild.core.checks.lessons import lesson_findings
from coursebuild.core.checks.links import (
    Places,
    defined_terms,
    document_links,
    places,
    remembered_anchors,
)
from coursebuild.core.checks.terms import term_findings
from coursebuild.core.features import features
from coursebuild.core.model import Course, Document, Script, document_blocks
from coursebuild.core.text.diagnostics import Diagnostic
from coursebuild.core.text.source import Span


def check_course(course: Course) -> tuple[Diagnostic, ...]:
    """Lessons, links, mentions, labs, terms and features, checked against each other."""
    scripts: dict[str, bool] = {}
    terms: dict[str, Span] = {}
    for document in course.documents:
        for block in document_blocks(document):
            if isinstance(block, Script):
                scripts[block.path] = block.norun
        for id, span in defined_terms(document).items():
            terms.setdefault(id, span)
    known = places(course, scripts, terms)
    anchors_of = remembered_anchors()
    found: list[Diagnostic] = []
    for document in course.documents:
        blocks = tuple(document_blocks(document))
        found += lesson_findings(course, document, blocks)
        found += document_links(course, document, known, anchors_of)
        found += lab_findings(blocks, course)
        found += bench_findings(blocks, course)
        found += term_findings(blocks, known.terms)
    return (*found, *feature_findings(course, course.documents))


def feature_findings(course: Course, documents: Iterable[Document]) -> Iterator[Diagnostic]:
    """What features find wrong in some documents of a course."""
    for feature in features():
        if feature.check is not None:
            yield from feature.check(course, documents)


def check_document(course: Course, document: Document, known: Places) -> tuple[Diagnostic, ...]:
    """What `check_course` finds in one document, given what the rest of the course offers."""
    blocks = tuple(document_blocks(document))
    whole = (*lesson_findings(course, document, blocks), *document_links(course, document, known))
    own = (*bench_findings(blocks, course), *term_findings(blocks, known.terms))
    return (*whole, *lab_findings(blocks, course), *own, *feature_findings(course, (document,)))
