"""A whole course checked: lessons, links, mentions, labs, terms and features, against each other.

Entry points: `check_course`; `check_document`, the same for one document.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from coursebuild.core.checks.links import LinkTargets, document_links, link_targets
from coursebuild.core.model import (
    Block,
    Course,
    Document,
    Term,
    block_inlines,
    document_blocks,
    is_blank,
    walk_inlines,
)
from coursebuild.core.model.blocks import title_line
from coursebuild.core.registry import features
from coursebuild.core.text.diagnostics import Diagnostic, Note, diagnose
from coursebuild.core.text.source import Span


def check_course(course: Course) -> tuple[Diagnostic, ...]:
    """Lessons, links, mentions, terms and features, checked against each other."""
    targets, documents = link_targets(course), course.documents
    found = [wrong for one in documents for wrong in _document_findings(course, one, targets)]
    return (*found, *feature_findings(course, documents))


def check_document(
    course: Course, document: Document, targets: LinkTargets
) -> tuple[Diagnostic, ...]:
    """What `check_course` finds in one document, given what the rest of the course offers."""
    own = _document_findings(course, document, targets)
    return (*own, *feature_findings(course, (document,)))


def _document_findings(
    course: Course, document: Document, targets: LinkTargets
) -> Iterator[Diagnostic]:
    blocks = tuple(document_blocks(document))
    yield from _lesson_findings(course, document, blocks)
    yield from _title_findings(course, document)
    yield from document_links(course, document, targets)
    yield from _term_findings(blocks, targets.terms)


def feature_findings(course: Course, documents: Iterable[Document]) -> Iterator[Diagnostic]:
    """What features find wrong in some documents of a course."""
    for feature in features():
        if feature.check is not None:
            yield from feature.check(course, documents)


def _lesson_findings(
    course: Course, document: Document, blocks: Iterable[Block]
) -> tuple[Diagnostic, ...]:
    """A lesson that is said to be complete and shows nothing; `blocks` are the document's.

    A draft says itself that there is more to come.
    """
    if not is_blank(blocks):
        return ()
    source = document.source
    return tuple(
        diagnose(
            "lesson-empty",
            source.span(0, 0),
            f"lesson {lesson.id} is complete, and there is nothing to read in {source.path}",
            help='write it, say `status = "draft"` in the map, '
            'or say `status = "planned"` and remove the file',
        )
        for lesson in course.lessons
        if lesson.document is document and lesson.status == "complete"
    )


def _title_findings(course: Course, document: Document) -> Iterator[Diagnostic]:
    """A page that opens with a title other than the one that the map gives it."""
    span = title_line(document.source)
    for page in course.pages:
        if page.document is document and span is not None and span.text != page.title:
            message = f"the course map calls this page `{page.title}`"
            yield diagnose("heading-top", span, message, help="give it one title in both")


def _term_findings(blocks: Iterable[Block], known: Mapping[str, Span]) -> tuple[Diagnostic, ...]:
    """Terms that are defined elsewhere as well; `known` says where each is defined first."""
    found: list[Diagnostic] = []
    for inline in walk_inlines(tuple(i for block in blocks for i in block_inlines(block))):
        if not isinstance(inline, Term):
            continue
        first = known.get(inline.id)
        if first is None or (first.path, first.start) == (inline.span.path, inline.span.start):
            continue
        message = f"the term `{inline.id}` is defined twice"
        help = "leave one definition, and link to it from here: "
        help += f'`[…](term:{inline.id})`; or name this one by `{{term="…"}}`'
        notes = [Note("the first one is here", first)]
        found.append(diagnose("term-repeated", inline.span, message, help=help, notes=notes))
    return tuple(found)
