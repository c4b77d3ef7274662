"""The map of a course in a `course.json` of levels and lessons.

Entry point: `read_course_json`. Such files are written by hand in many dialects, so a field is
known by several names; what is known by none is left, and said once.
"""

from __future__ import annotations

import json
import posixpath
import re
from collections.abc import Mapping, Sequence
from typing import Any

from coursebuild.core.files.errors import UsageError
from coursebuild.features.importer.values import (
    Files,
    Leftover,
    SourceCourse,
    SourceLesson,
    SourceLevel,
    read_text,
    stem_of,
)

_NAMES = {
    "id": ("id", "number", "key"),
    "slug": ("slug",),
    "title": ("title", "name"),
    "summary": ("summary", "description", "subtitle", "tagline", "goal"),
    "file": ("file", "path", "source", "markdown"),
    "objectives": ("objectives", "outcomes", "goals", "learning_objectives"),
    "prerequisites": ("prerequisites", "prereqs", "requires", "depends_on", "dependencies"),
    "minutes": ("minutes", "estimated_minutes", "duration", "time", "estimatedMinutes"),
    "status": ("status", "state"),
    "checkpoint": ("checkpoint",),
    "lessons": ("lessons", "units", "chapters"),
    "levels": ("levels", "modules", "parts"),
    "pages": ("pages",),
    "level": ("level", "module", "part"),
    "language": ("language", "lang", "locale"),
}


class _Fields:
    """The fields of an object, by the names that they have here."""

    def __init__(self, value: object, unknown: dict[str, int], *known: str) -> None:
        if not isinstance(value, Mapping):
            raise UsageError("course.json: a level or a lesson is no object")
        self._values: dict[str, Any] = {}
        for key, item in value.items():
            name = next((name for name in known if key in _NAMES[name]), None)
            if name is None or name in self._values:
                unknown[key] = unknown.get(key, 0) + 1
            else:
                self._values[name] = item

    def text(self, name: str) -> str:
        value = self._values.get(name)
        return " ".join(str(value).split()) if isinstance(value, str | int | float) else ""

    def texts(self, name: str) -> tuple[str, ...]:
        value = self._values.get(name) or ()
        items = value if isinstance(value, list) else [value] if isinstance(value, str) else []
        return tuple(str(item).strip() for item in items if str(item).strip())

    def objects(self, name: str) -> Sequence[Any]:
        value = self._values.get(name) or ()
        if isinstance(value, Mapping):  # by their ids
            return [{"id": key, **item} for key, item in value.items() if isinstance(item, Mapping)]
        return value if isinstance(value, list) else ()

    def minutes(self) -> int | None:
        number = re.search(r"\d+", self.text("minutes"))
        return int(number[0]) if number is not None and 1 <= int(number[0]) <= 100_000 else None


_LESSON = (
    *("id", "slug", "title", "summary", "file", "objectives", "prerequisites", "minutes"),
    *("status", "checkpoint", "level"),
)


def read_course_json(path: str, files: Files) -> SourceCourse:
    """The course that a file describes.

    Raises:
        UsageError: it is no JSON, or holds no levels.
    """
    text = read_text(files[path], path)
    try:
        # A number such as 4.10 is the name of a lesson.
        data = json.loads(text, parse_float=str)
    except RecursionError:
        raise UsageError(f"{path} is no JSON: the text is nested too deeply") from None
    except ValueError as error:
        raise UsageError(f"{path} is no JSON: {error}") from None
    unknown: dict[str, int] = {}
    course = data.get("course", data) if isinstance(data, dict) else {"levels": data}
    course = {**data, **course} if isinstance(data, dict) and isinstance(course, dict) else course
    top = _Fields(
        {key: value for key, value in course.items() if key != "course"},
        unknown,
        *("id", "title", "summary", "levels", "lessons", "pages", "language"),
    )
    apart = [_Fields(item, unknown, *_LESSON) for item in top.objects("lessons")]
    levels = tuple(
        _level(
            _Fields(item, unknown, "id", "title", "summary", "lessons", "checkpoint"),
            apart,
            files,
            unknown,
        )
        for item in top.objects("levels")
    )
    if not levels:
        raise UsageError(f"{path} has no `levels`")
    pages = (_Fields(item, unknown, "id", "slug", "title", "file") for item in top.objects("pages"))
    return SourceCourse(
        title=top.text("title") or "Course",
        summary=top.text("summary"),
        language=top.text("language"),
        levels=levels,
        pages=tuple(_lesson(page, files) for page in pages),
        camera_is_position=True,
        left=tuple(
            Leftover(path, "", f"`{key}` ({count} times), which a course map does not have")
            for key, count in unknown.items()
        ),
    )


def _level(
    fields: _Fields, apart: Sequence[_Fields], files: Files, unknown: dict[str, int]
) -> SourceLevel:
    inside = [_Fields(item, unknown, *_LESSON) for item in fields.objects("lessons")]
    inside += [lesson for lesson in apart if lesson.text("level") == fields.text("id")]
    return SourceLevel(
        id=fields.text("id"),
        title=fields.text("title"),
        summary=_with_checkpoint(fields),
        lessons=tuple(_lesson(lesson, files) for lesson in inside),
    )


def _with_checkpoint(fields: _Fields) -> str:
    """The summary, with what a learner is to be able to do at this place."""
    checkpoint = "; ".join(fields.texts("checkpoint")) or fields.text("checkpoint")
    if checkpoint in ("", "True", "False"):
        return fields.text("summary")
    return f"{fields.text('summary')} Checkpoint: {checkpoint}".strip()


def _lesson(fields: _Fields, files: Files) -> SourceLesson:
    name = fields.text("id")
    return SourceLesson(
        id=name,
        path=_file_of(fields, files),
        title=fields.text("title"),
        slug=fields.text("slug"),
        summary=_with_checkpoint(fields),
        status=fields.text("status"),
        objectives=fields.texts("objectives"),
        prerequisites=fields.texts("prerequisites"),
        minutes=fields.minutes(),
    )


def _file_of(fields: _Fields, files: Files) -> str:
    """The Markdown file of a lesson: the one named, or the one whose name begins with its id."""
    named, name, slug = fields.text("file"), fields.text("id"), fields.text("slug")
    texts = [path for path in files if path.endswith((".md", ".qmd", ".ipynb"))]
    for path in texts:
        if named and (path == named.lstrip("./") or path.endswith("/" + named.lstrip("./"))):
            return path
    if not name:
        return ""
    beginning = re.compile(rf"(?:lesson[-_ ]?)?{re.escape(name)}(?![\w.]|$)|{re.escape(name)}$")
    for path in texts:
        stem = posixpath.basename(stem_of(path))
        if stem in (slug, f"{name}-{slug}") or beginning.match(stem):
            return path
    return ""
