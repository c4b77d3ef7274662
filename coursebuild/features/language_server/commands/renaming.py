"""Another id for a lesson, wherever the course names it, as `coursebuild rename` gives it.

Entry points: `named_lesson`, at a place; `renamed`, the edits and the file's new path.
"""

from __future__ import annotations

from msgspec.structs import replace

from coursebuild.core.model import Lesson, LessonTarget, Link, document_inlines, resolve
from coursebuild.core.pages.library import Library
from coursebuild.core.text.diagnostics import Edit
from coursebuild.core.text.source import Source, Span
from coursebuild.features.authoring.course_map import with_lesson_renamed
from coursebuild.features.authoring.references import references
from coursebuild.features.language_server.commands.fields import field_place
from coursebuild.features.language_server.commands.texts import OpenTexts


def named_lesson(texts: OpenTexts, source: Source, offset: int) -> tuple[Lesson, Span] | None:
    """The lesson whose id stands at an offset, and where the id stands."""
    library, document = texts.library, texts.document(source)
    if library is None:
        return None
    if document is None:
        place = field_place(source, offset)
        is_id = place is not None and place.key in ("id", "prerequisites")
        return _named(library, place.text, place.span) if place is not None and is_id else None
    for inline in document_inlines(document):
        if isinstance(inline, Link) and inline.span.start <= offset <= inline.span.end:
            target = resolve(inline.target, library.course, source.path)
            if isinstance(target, LessonTarget):
                return _named(library, target.id, inline.target_span)
    return None


def _named(library: Library, id: str, span: Span) -> tuple[Lesson, Span] | None:
    lesson, start = library.lessons.get(id), span.start + max(span.text.find(id), 0)
    return None if lesson is None else (lesson, Span(span.source, start, start + len(id)))


def renamed(library: Library, lesson: Lesson, id: str) -> tuple[list[Edit], tuple[str, str] | None]:
    """The edits, and the path of the lesson's file, if it has one, before and after.

    Raises:
        UsageError: the map cannot have this id.
    """
    course = library.course
    edits = references(course, lesson, id)
    of_map = [edit for edit in edits if edit.span.source == course.map]
    whole_map = Edit(course.map.span(), with_lesson_renamed(course, lesson, id, of_map))
    moved = None if lesson.document is None else (lesson.path, replace(lesson, id=id).path)
    return [whole_map, *(edit for edit in edits if edit not in of_map)], moved
