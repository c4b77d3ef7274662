"""What is another between two states of a course, and the second made from the first.

Entry points: `with_owners` and `renewed_places`, a course and its places with some documents in the
place of others; `same_course`, `same_frame`; `changed_runs`, `changed_references`,
`changed_questions`; `offered`, what others may refer to.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from msgspec.structs import replace

from coursebuild.checks.links import Places, anchors, defined_terms
from coursebuild.diagnostics import Diagnostic, Severity
from coursebuild.model import Course, Document, FeatureBlock, Lesson, Page, Script, document_blocks
from coursebuild.render import urls
from coursebuild.render.library import Library, Owner
from coursebuild.render.lookup.references import owner_path
from coursebuild.results import ScriptRun
from coursebuild.source import Span


def offered(document: Document) -> tuple[object, ...]:
    """What other documents may refer to, or clash with."""
    blocks = tuple(document_blocks(document))
    quizzes = tuple(b.progress_keys() for b in blocks if isinstance(b, FeatureBlock))
    scripts = tuple((block.path, block.norun) for block in blocks if isinstance(block, Script))
    return anchors(document), quizzes, scripts


def has_errors(diagnostics: Iterable[Diagnostic]) -> bool:
    """Whether anything is wrong; warnings do not count."""
    return any(d.severity is Severity.ERROR for d in diagnostics)


def with_owners(course: Course, fresh: Iterable[Owner]) -> Course:
    """The course with other lessons and pages in the places of those with their ids."""
    lessons = {owner.id: owner for owner in fresh if isinstance(owner, Lesson)}
    pages = {owner.id: owner for owner in fresh if isinstance(owner, Page)}
    touched = {lesson.level for lesson in lessons.values()}
    levels = tuple(
        replace(level, lessons=tuple(lessons.get(old.id, old) for old in level.lessons))
        if level.id in touched
        else level
        for level in course.levels
    )
    return replace(course, levels=levels, pages=tuple(pages.get(p.id, p) for p in course.pages))


def renewed_places(known: Places, fresh: Iterable[Owner], library: Library) -> Places:
    """What there is to link to, now that some documents are others."""
    lessons = {owner.id: owner.document for owner in fresh if isinstance(owner, Lesson)}
    pages = {owner.id: owner.document for owner in fresh if isinstance(owner, Page)}
    return replace(
        known,
        lessons={**known.lessons, **lessons},
        pages={**known.pages, **pages},
        scripts=frozenset(library.scripts),
        terms=_renewed_terms(known, fresh),
    )


def _renewed_terms(known: Places, fresh: Iterable[Owner]) -> dict[str, Span]:
    documents = [owner.document for owner in fresh if owner.document is not None]
    paths = {document.source.path for document in documents}
    terms = {id: span for id, span in known.terms.items() if span.path not in paths}
    for document in documents:
        terms = defined_terms(document) | terms
    return terms


def changed_runs(old: Mapping[str, ScriptRun], new: Mapping[str, ScriptRun]) -> frozenset[str]:
    """The scripts of which there is another run, or none any more."""
    return frozenset(path for path in old.keys() | new.keys() if old.get(path) is not new.get(path))


def changed_questions(old: Library, new: Library) -> frozenset[str]:
    """The pages that list lessons with their questions, as far as these changed."""
    if old.asked is new.asked:
        return frozenset()
    levels = {o.level for o in new.order if old.asked.get(o.path) != new.asked.get(o.path)}
    paths = (urls.level_path(new.levels[id]) for id in levels)
    return frozenset((urls.HOME, urls.PROGRESS, urls.REVIEW, *paths))


def changed_references(old: Library, new: Library) -> frozenset[str]:
    """The pages that show who refers to whom, as far as that changed."""
    before, after = old.references, new.references
    if before is after:
        return frozenset()
    ids = before.referrers.keys() | after.referrers.keys()
    found = {
        urls.lesson_path(new.lessons[id])
        for id in ids
        if id in new.lessons and _ids(before.referrers.get(id)) != _ids(after.referrers.get(id))
    }
    for id in before.terms.keys() | after.terms.keys():
        one, two = before.terms.get(id), after.terms.get(id)
        if one is None or two is None or one.owner.id != two.owner.id:
            users = (*(one.used if one else ()), *(two.used if two else ()))
            found |= {owner_path(owner) for owner in users}
    return frozenset({*found, urls.GLOSSARY, urls.SYMBOLS})


def _ids(owners: tuple[Owner, ...] | None) -> tuple[str, ...]:
    return tuple(owner.id for owner in owners or ())


def same_course(old: Course, new: Course) -> bool:
    """Whether two readings gave the same course."""
    pairs = zip(old.documents, new.documents, strict=False)
    return same_frame(old, new) and all(one is two for one, two in pairs)


def same_frame(old: Course, new: Course) -> bool:
    """Whether two readings differ in nothing but the texts of documents."""
    return (
        old.map.text == new.map.text
        and old.models == new.models
        and old.declarations == new.declarations
        and old.files == new.files
        and [d.source.path for d in old.documents] == [d.source.path for d in new.documents]
    )
