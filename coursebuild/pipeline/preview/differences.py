"""What is another between two states of a course, and the second made from the first.

Entry points: `with_owners` and `renewed_places`, a course and its places with some documents in the
place of others; `same_course`, `same_frame`; `changed_runs`; `offered`, what others may refer to.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace

from coursebuild.checks import Places, anchors
from coursebuild.diagnostics import Diagnostic, Severity
from coursebuild.model import Course, Document, Lesson, Page, Quiz, Script, document_blocks
from coursebuild.render.library import Library, Owner
from coursebuild.results import ScriptRun


def offered(document: Document) -> tuple[object, ...]:
    """What other documents may refer to, or clash with."""
    blocks = tuple(document_blocks(document))
    quizzes = tuple(block.id for block in blocks if isinstance(block, Quiz))
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
    )


def changed_runs(old: Mapping[str, ScriptRun], new: Mapping[str, ScriptRun]) -> frozenset[str]:
    """The scripts of which there is another run, or none any more."""
    return frozenset(path for path in old.keys() | new.keys() if old.get(path) is not new.get(path))


def same_course(old: Course, new: Course) -> bool:
    """Whether two readings gave the same course."""
    pairs = zip(old.documents, new.documents, strict=False)
    return same_frame(old, new) and all(one is two for one, two in pairs)


def same_frame(old: Course, new: Course) -> bool:
    """Whether two readings differ in nothing but the texts of documents."""
    return (
        old.map.text == new.map.text
        and old.models == new.models
        and old.files == new.files
        and [d.source.path for d in old.documents] == [d.source.path for d in new.documents]
    )
