"""Check a whole course: lessons, terms and the rules of features."""

from __future__ import annotations

from collections.abc import Collection, Iterator

from coursebuild.core.checks.links import LinkTargets, check_links, link_targets
from coursebuild.core.model import (
    Course,
    Document,
    FeatureBlock,
    Term,
    document_blocks,
    document_scripts,
    find_blocks,
    find_inlines,
    is_blank,
)
from coursebuild.core.model.blocks import title_line
from coursebuild.core.registry import features
from coursebuild.core.text.diagnostics import Diagnostic, Note, diagnose, did_you_mean


def check_course(course: Course) -> tuple[Diagnostic, ...]:
    """Check lessons, links, mentions and terms against each other, and the rules of features."""
    targets, documents = link_targets(course), course.documents
    diagnostics = [
        diagnostic
        for document in documents
        for diagnostic in _check_core_rules(course, document, targets)
    ]
    scripts = {script.path for document in documents for script in document_scripts(document)}
    for entry in course.unproven:
        if entry.path not in scripts:
            message = f"no lesson or page has a script `{entry.path}`"
            help = did_you_mean(entry.path, scripts) or "remove it"
            diagnostics.append(diagnose("unproven-name", entry.span, message, help=help))
    return (*diagnostics, *_check_features(course, documents))


def check_document(
    course: Course, document: Document, targets: LinkTargets
) -> tuple[Diagnostic, ...]:
    """What `check_course` finds in one document, given what the rest of the course offers."""
    diagnostics = _check_core_rules(course, document, targets)
    return (*diagnostics, *_check_features(course, (document,)))


def _check_core_rules(
    course: Course, document: Document, targets: LinkTargets
) -> Iterator[Diagnostic]:
    source = document.source
    for lesson in course.lessons:
        if lesson.document is not document or not is_blank(document_blocks(document)):
            continue
        help = 'say `status = "planned"` in the map and remove the file'
        if lesson.status == "complete":
            message = f"lesson {lesson.id} is complete, but there is nothing to read in it"
            help = f'write it, say `status = "draft"` in the map, or {help}'
            yield diagnose("lesson-empty", source.span(0, 0), message, help=help)
        elif not document.blocks:
            message = f"lesson {lesson.id} is a draft, and its file is empty"
            yield diagnose("draft-empty", source.span(0, 0), message, help=f"begin it, or {help}")
    span = title_line(document.source)
    for page in course.pages:
        if page.document is document and span is not None and span.text != page.title:
            message = f"the course map calls this page `{page.title}`"
            yield diagnose("heading-top", span, message, help="give it one title in both")
    yield from check_links(course, document, targets)
    for term in find_inlines(document, Term):
        first = targets.terms.get(term.id)
        if first is None or (first.path, first.start) == (term.span.path, term.span.start):
            continue
        message = f"the term `{term.id}` is defined twice"
        help = "leave one definition, and link to it from here: "
        help += f'`[…](term:{term.id})`; or name this one by `{{term="…"}}`'
        notes = [Note("the first one is here", first)]
        yield diagnose("term-repeated", term.span, message, help=help, notes=notes)
    for id, place in filter(None, (b.given_id() for b in find_blocks(document, FeatureBlock))):
        first = targets.progress_ids.get(id, place)
        if (first.path, first.start) != (place.path, place.start):
            message = f"the id `{id}` is used twice"
            help = "a learner's progress is kept under the id; give each quiz and exercise its own"
            notes = [Note("the first one is here", first)]
            yield diagnose("progress-id-repeated", place, message, help=help, notes=notes)


def _check_features(course: Course, documents: Collection[Document]) -> Iterator[Diagnostic]:
    for feature in features():
        if feature.check is None:
            continue
        try:
            yield from feature.check(course, documents)
        except Exception as error:
            note = "it fails for no text alone"
            for document in documents:
                try:
                    tuple(feature.check(course, (document,)))
                except Exception:
                    note = f"it fails for {document.source.path}"
                    break
            error.add_note(note)
            raise
