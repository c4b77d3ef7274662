"""The places where a course names a lesson.

Entry points: `rename_references`, the edits that give it another id; `doubtful_places`, which may
mean the lesson but are no links: in code, in a comment, in a range such as "Lessons 1.3 to 1.5".
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from fnmatch import fnmatchcase

from msgspec.structs import replace

from coursebuild.core.model import (
    Course,
    Lesson,
    LessonTarget,
    Link,
    find_inlines,
    resolve,
)
from coursebuild.core.syntax.nodes import ObjectNode, StringNode
from coursebuild.core.syntax.toml_text import parse_toml, toml_string
from coursebuild.core.text.diagnostics import Edit
from coursebuild.core.text.source import Excerpt, Source, Span
from coursebuild.features.authoring.course_map import id_order

_NUMBER = r"(?>[0-9]+(?:\.[0-9]+)+)"
_RANGE = re.compile(rf"(?i)\blessons\s+({_NUMBER})\s?(?:–|-|to\b)\s?({_NUMBER})")


def rename_references(course: Course, lesson: Lesson, new: str) -> list[Edit]:
    """Return the edits of the map, and of all links and mentions, each once."""
    edits = {(e.span.path, e.span.start): e for e in _map_edits(course, lesson, new)}
    name = re.compile(rf"(?<![\w.]){re.escape(lesson.id)}(?!\w|\.\w)")
    for document in course.documents:
        for inline in find_inlines(document, Link):
            target = resolve(inline.target, course, document.source.path)
            if isinstance(target, LessonTarget) and target.id == lesson.id:
                span = inline.target_span
                address = span.text.partition("#")[0]
                for match in list(name.finditer(address))[-1:]:
                    place = Excerpt.of_span(span).span(*match.span())
                    edits[place.path, place.start] = Edit(place, new)
    return list(edits.values())


def _map_edits(course: Course, lesson: Lesson, new: str) -> Iterator[Edit]:
    root = _map(course)
    for level in root.objects("level"):
        for node in level.objects("lesson"):
            id = node.get("id")
            if isinstance(id, StringNode) and id.value == lesson.id:
                yield Edit(id.span, toml_string(new))
    for dependent in course.lessons:
        ids = zip(dependent.prerequisites, dependent.prerequisite_spans, strict=True)
        yield from (Edit(span, toml_string(new)) for id, span in ids if id == lesson.id)
    for path in _silenced_paths(root):
        if path.value == lesson.path:
            yield Edit(path.span, toml_string(replace(lesson, id=new).path))


def doubtful_places(
    course: Course, lesson: Lesson, new: str, edits: Iterable[Edit], code: Iterable[Source]
) -> list[Span]:
    """Return the places that may mean the lesson, and are not among the edits.

    `code` are further texts of the project, such as its features.
    """
    edited_spans = [edit.span for edit in edits]
    id = re.escape(lesson.id)
    names = re.compile(
        rf"lesson:({id})(?!\w|\.\w)|(?<![\w.])({id})-{lesson.slug}(?![\w-])"
        rf"|(?i:\blessons?)\s(?:{_NUMBER}|[\s,–-]|and\b|or\b|to\b)*?(?<![\w.])({id})(?!\w|\.\w)"
    )
    places = []
    for source in (*course.sources, *code):
        for match in names.finditer(source.text):
            place = source.span(*match.span(match.lastindex or 0))
            if not any(span.contains(place) for span in edited_spans):
                places.append(place)
        places += [
            source.span(*match.span())
            for match in _RANGE.finditer(source.text)
            if id_order(match[1]) <= id_order(lesson.id) <= id_order(match[2])
        ]
    return [*places, *_outdated_globs(course, lesson, new)]


def _outdated_globs(course: Course, lesson: Lesson, new: str) -> Iterator[Span]:
    """Yield the patterns of the map that match the lesson's old path, and not the new one."""
    new_path = replace(lesson, id=new).path
    for path in _silenced_paths(_map(course)):
        fits = [fnmatchcase(name, path.value) for name in (lesson.path, new_path)]
        if path.value != lesson.path and fits == [True, False]:
            yield path.span


def _silenced_paths(root: ObjectNode) -> Iterator[StringNode]:
    """Yield the paths and patterns of the map's entries that silence warnings."""
    paths = (silence.get("path") for silence in root.objects("silence"))
    return (path for path in paths if isinstance(path, StringNode))


def _map(course: Course) -> ObjectNode:
    root = parse_toml(course.map).value
    assert root is not None  # the course was read from it
    return root
