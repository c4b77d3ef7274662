"""The map of the new course.

Entry points: `ImportedText`, a lesson or page on its way; `texts_of`, `map_lines`.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence

from msgspec import Struct

from coursebuild.core.syntax.course_schema import slug_of
from coursebuild.core.syntax.toml_text import quoted
from coursebuild.features.importer.lesson import read_segments
from coursebuild.features.importer.values import (
    Files,
    Segment,
    SourceCourse,
    SourceLesson,
    SourceLevel,
    name_of,
)

_COMPLETE = ("", "complete", "completed", "done", "published", "final", "ready")
"""Words for the status of a lesson that is written; with any other one it is a draft."""


class ImportedText(Struct, frozen=True):
    """A lesson or page on its way into the new course."""

    source: SourceLesson
    id: str
    slug: str
    title: str
    path: str
    """Of its new file; empty where it is only planned."""
    segments: tuple[Segment, ...]
    pictures: Mapping[str, bytes]
    """What its file holds itself."""

    @property
    def link(self) -> str:
        """What leads to it."""
        kind = "page" if self.path.startswith("content/pages/") else "lesson"
        return f"{kind}:{self.id}"


def level_id(level: SourceLevel, number: int) -> str:
    """The id of a level, its own one if it can be."""
    return level.id if re.fullmatch("[A-Za-z0-9]+", level.id) else str(number)


def texts_of(course: SourceCourse, files: Files) -> tuple[ImportedText, ...]:
    """All lessons in the order of the course, then its pages.

    Raises:
        UsageError: a file cannot be read.
    """
    found = []
    for number, level in enumerate(course.levels, 1):
        first = level_id(level, number)
        for place, lesson in enumerate(level.lessons, 1):
            own = re.fullmatch(rf"{re.escape(first)}(\.[A-Za-z0-9]+)+", lesson.id)
            found.append(_text(lesson, lesson.id if own else f"{first}.{place}", files))
    for page in course.pages:
        if page.path:
            found.append(_text(page, slug_of(page.id), files, page=True))
    return tuple(found)


def _text(source: SourceLesson, id: str, files: Files, *, page: bool = False) -> ImportedText:
    title, slug = source.title, source.slug
    if not source.path:
        return ImportedText(source, id, slug_of(slug or title or id), title or id, "", (), {})
    found, segments, pictures = read_segments(files[source.path], source.path)
    title = " ".join((title or found or name_of(source.path)).split())
    slug = slug_of(slug or name_of(source.path))
    if not re.search("[a-z]", slug):
        slug = slug_of(title)
    if page and not source.id:
        id = slug_of(title)
    path = f"content/pages/{id}.md" if page else f"content/lessons/{id}-{slug}.md"
    return ImportedText(source, id, slug, title, path, tuple(segments), pictures)


def map_lines(
    course: SourceCourse,
    texts: Sequence[ImportedText],
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
    rest = iter(texts)
    for number, level in enumerate(course.levels, 1):
        yield from ("", "[[level]]")
        title = level.title or f"Level {level_id(level, number)}"
        yield from _fields(id=level_id(level, number), title=title, summary=level.summary)
        for lesson, text in zip(level.lessons, rest, strict=False):
            yield from ("", "[[level.lesson]]")
            yield from _fields(
                id=text.id,
                slug=text.slug,
                title=text.title,
                status=_status(lesson) if text.path else "planned",
                summary=lesson.summary,
                objectives=lesson.objectives,
                prerequisites=tuple(ids[p] for p in lesson.prerequisites if p in ids),
                minutes=lesson.minutes,
            )
    for text in rest:
        yield from ("", "[[page]]")
        yield from _fields(id=text.id, title=text.title, file=text.path)


def _status(lesson: SourceLesson) -> str:
    return "complete" if lesson.status.lower() in _COMPLETE else "draft"


def _fields(**values: str | tuple[str, ...] | int | None) -> Iterator[str]:
    for name, value in values.items():
        if isinstance(value, tuple) and value:
            yield f"{name} = [{', '.join(map(quoted, value))}]"
        elif isinstance(value, str) and value:
            yield f"{name} = {quoted(value)}"
        elif isinstance(value, int):
            yield f"{name} = {value}"
