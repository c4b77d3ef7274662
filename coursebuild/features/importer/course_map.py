"""The map of the new course.

Entry points: `read_texts`, which reads the texts and gives each an id and a path; `map_lines`.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator, Mapping

from msgspec.structs import replace

from coursebuild.core.files.errors import UsageError
from coursebuild.core.syntax.course_schema import slug_of
from coursebuild.core.syntax.coursemap import RESERVED_IDS
from coursebuild.core.syntax.toml_text import toml_string
from coursebuild.features.importer.segments import read_segments
from coursebuild.features.importer.source_files import SourceFiles
from coursebuild.features.importer.values import ImportedCourse, ImportedText, title_of_file

_COMPLETE = ("", "complete", "completed", "done", "published", "final", "ready")
"""Statuses of a lesson that is finished; with any other it is a draft."""


def read_texts(course: ImportedCourse, files: SourceFiles) -> ImportedCourse:
    """Return the course with its texts read, and with their new ids and paths.

    Raises:
        UsageError: a file cannot be read.
    """
    levels = []
    used_ids = set[str]()
    for number, level in enumerate(course.levels, 1):
        own_id = level.id if re.fullmatch("[A-Za-z0-9]+", level.id) else str(number)
        id = _free_id(own_id, (f"{own_id}x{n}" for n in itertools.count(2)), used_ids)
        lessons, used_lesson_ids = [], set[str]()
        for place, lesson in enumerate(level.lessons, 1):
            fits = re.fullmatch(rf"{re.escape(id)}(\.[A-Za-z0-9]+)+", lesson.old_id)
            other_ids = (f"{id}.{n}" for n in itertools.count(place))
            lesson_id = _free_id(
                lesson.old_id if fits else next(other_ids), other_ids, used_lesson_ids
            )
            lessons.append(_read_text(lesson, lesson_id, files))
        title = level.title or f"Level {id}"
        levels.append(replace(level, id=id, title=title, lessons=tuple(lessons)))
    used_ids = {*RESERVED_IDS}
    pages = (_read_text(page, "", files, used_ids) for page in course.pages if page.file)
    return replace(course, levels=tuple(levels), pages=tuple(pages))


def _free_id(id: str, other_ids: Iterator[str], used_ids: set[str]) -> str:
    """Return an id that nothing has yet, whatever the case of its letters; it is taken then."""
    free = next(new for new in itertools.chain([id], other_ids) if new.casefold() not in used_ids)
    used_ids.add(free.casefold())
    return free


def _read_text(
    text: ImportedText, id: str, files: SourceFiles, used_ids: set[str] | None = None
) -> ImportedText:
    """Read the file of a lesson with this id, or of a page, whose id is made from its title.

    `used_ids` are the ids that a page cannot have.
    """
    title, slug = text.title, text.slug
    if not text.file:
        title = title or id
        return replace(text, id=id, slug=slug_of(slug or title), title=title)
    try:
        heading, segments, pictures = read_segments(files.read_text(text.file), text.file)
    except RecursionError:
        raise UsageError(f"{text.file} is nested too deeply") from None
    title = " ".join((title or heading or title_of_file(text.file)).split())
    slug = slug_of(slug or title_of_file(text.file))
    if not re.search("[a-z]", slug):
        slug = slug_of(title)
    page = slug_of(text.old_id or title)
    if used_ids is not None:
        page = _free_id(page, (f"{page}-{n}" for n in itertools.count(2)), used_ids)
    path = f"content/lessons/{id}-{slug}.md" if id else f"content/pages/{page}.md"
    read = replace(text, segments=tuple(segments), pictures=pictures)
    return replace(read, id=id or page, slug=slug, title=title, path=path)


def map_lines(
    course: ImportedCourse,
    ids: Mapping[str, str],
    callouts: Mapping[str, str],
    packages: tuple[str, ...],
) -> Iterator[str]:
    """Yield the lines of `course.toml`; `ids` are the new ids of lessons, by the old ones."""
    yield "[course]"
    yield from _field_lines(
        title=course.title, summary=course.summary, language=course.language, packages=packages
    )
    yield from ("", "[verify]", 'compare = "digits"')
    if callouts:
        yield from ("", "[callouts]")
        yield from (f"{toml_string(k)} = {toml_string(label)}" for k, label in callouts.items())
    for level in course.levels:
        yield from ("", "[[level]]")
        yield from _field_lines(id=level.id, title=level.title, summary=level.summary)
        for lesson in level.lessons:
            yield from ("", "[[level.lesson]]")
            yield from _field_lines(
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
        yield from _field_lines(id=page.id, title=page.title, file=page.path)


def _status(lesson: ImportedText) -> str:
    if not lesson.path:
        return "planned"
    return "complete" if lesson.status.lower() in _COMPLETE else "draft"


def _field_lines(**values: str | tuple[str, ...] | int | None) -> Iterator[str]:
    for name, value in values.items():
        if isinstance(value, tuple) and value:
            yield f"{name} = [{', '.join(map(toml_string, value))}]"
        elif isinstance(value, str) and value:
            yield f"{name} = {toml_string(value)}"
        elif isinstance(value, int):
            yield f"{name} = {value}"
