"""Lessons of the course against what the map says of them: a complete one has something in it.

Entry point: `lesson_findings`, for one document.
"""

from __future__ import annotations

from collections.abc import Iterable

from coursebuild.core.model import Block, Course, Document, Status, is_blank
from coursebuild.core.text.diagnostics import Diagnostic, diagnose


def lesson_findings(
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
        if lesson.document is document and lesson.status is Status.COMPLETE
    )
