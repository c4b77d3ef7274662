"""The map of the new course.

Entry points: `with_texts`, what its texts are and where they go; `map_lines`.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping

from msgspec.structs import replace

from coursebuild.core.syntax.course_schema import slug_of
from coursebuild.core.syntax.toml_text import quoted
from coursebuild.features.importer.lesson import read_segments
from coursebuild.features.importer.values import Files, ImportedCourse, ImportedText, name_of

_COMPLETE = ("", "complete", "completed", "done", "published", "final", "ready")
"""Words for the status of a lesson that is written; with any other one it is a draft."""


def with_texts(course: ImportedCourse, files: Files) -> ImportedCourse:
    """The course with its texts read, and with the ids and paths that they get.

    Raises:
        UsageError: a file cannot be read.
    """
    levels = []
    for number, level in enumerate(course.levels, 1):
        id = level.id if re.fullmatch("[A-Za-z0-9]+", level.id) else str(number)
        lessons = []
        for place, lesson in enumerate(level.lessons, 1):
            own = re.fullmatch(rf"{re.escape(id)}(\.[A-Za-z0-9]+)+", lesson.old_id)
            lessons.append(_read(lesson, lesson.old_id if own else f"{id}.{place}", files))
        title = level.title or f"Level {id}"
        levels.append(replace(level, id=id, title=title, lessons=tuple(lessons)))
    pages = (_read(page, "", files) for page in course.pages if page.file)
    return replace(course, levels=tuple(levels), pages=tuple(pages))


def _read(text: ImportedText, id: str, files: Files) -> ImportedText:
    """A lesson of this id, or a page, which has none yet."""
    title, slug = text.title, text.slug
    if not text.file:
        title = title or id
        return replace(text, id=id, slug=slug_of(slug or title), title=title)
    found, segments, pictures = read_segments(files[text.file], text.file)
    title = " ".join((title or found or name_of(text.file)).split())
    slug = slug_of(slug or name_of(text.file))
    if not re.search("[a-z]", slug):
        slug = slug_of(title)
    page = slug_of(text.old_id or title)
    path = f"content/lessons/{id}-{slug}.md" if id else f"content/pages/{page}.md"
    read = replace(text, segments=tuple(segments), pictures=pictures)
    return replace(read, id=id or page, slug=slug, title=title, path=path)


def map_lines(
    course: ImportedCourse,
    ids: Mapping[str, str],
    callouts: Mapping[str, str],
    packages: tuple[str, ...],
) -> Iterator[str]:
    """The lines of `course.toml`; `ids` are those of lessons now, by those that they had."""
    yield "[course]"
    yield from _fields(
        title=course.title, summary=course.summary, language=course.language, packages=packages
    )
    yield from ("", "[verify]", 'compare = "digits"')
    if callouts:
        yield from ("", "[callouts]")
        yield from (f"{quoted(kind)} = {quoted(label)}" for kind, label in callouts.items())
    for level in course.levels:
        yield from ("", "[[level]]")
        yield from _fields(id=level.id, title=level.title, summary=level.summary)
        for lesson in level.lessons:
            yield from ("", "[[level.lesson]]")
            yield from _fields(
                id=lesson.id,
                slug=lesson.slug,
                title=lesson.title,
                status=_status(lesson),
                summary=lesson.summary,
                objectives=lesson.objectives,
                prerequisites=tuple(ids[p] for p in lesson.prerequisites if p in ids),
                minutes=lesson.minutes,
            )
    for page in course.pages:
        yield from ("", "[[page]]")
        yield from _fields(id=page.id, title=page.title, file=page.path)


def _status(lesson: ImportedText) -> str:
    if not lesson.path:
        return "planned"
    return "complete" if lesson.status.lower() in _COMPLETE else "draft"


def _fields(**values: str | tuple[str, ...] | int | None) -> Iterator[str]:
    for name, value in values.items():
        if isinstance(value, tuple) and value:
            yield f"{name} = [{', '.join(map(quoted, value))}]"
        elif isinstance(value, str) and value:
            yield f"{name} = {quoted(value)}"
        elif isinstance(value, int):
            yield f"{name} = {value}"
