"""Where a course names a lesson.

Entry points: `references`, the edits that give it another id; `doubtful_places`, where something
may mean it that is no link: in code, in a comment, in a range such as "Lessons 1.3 to 1.5".
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
    document_inlines,
    resolve,
)
from coursebuild.core.syntax.nodes import ObjectNode, StringNode
from coursebuild.core.syntax.toml_text import parse_toml, toml_string
from coursebuild.core.text.diagnostics import Edit
from coursebuild.core.text.source import Excerpt, Source, Span
from coursebuild.features.authoring.course_map import id_order

_NUMBER = r"(?>[0-9]+(?:\.[0-9]+)+)"
_RANGE = re.compile(rf"(?i)\blessons\s+({_NUMBER})\s?(?:–|-|to\b)\s?({_NUMBER})")


def references(course: Course, lesson: Lesson, new: str) -> list[Edit]:
    """The edits of the map, and of all links and mentions, each once."""
    found = {(one.span.path, one.span.start): one for one in _map_edits(course, lesson, new)}
    name = re.compile(rf"(?<![\w.]){re.escape(lesson.id)}(?!\w|\.\w)")
    for document in course.documents:
        for inline in document_inlines(document):
            if not isinstance(inline, Link):
                continue
            target = resolve(inline.target, course, document.source.path)
            if isinstance(target, LessonTarget) and target.id == lesson.id:
                span = inline.target_span
                written = span.text.partition("#")[0]
                for match in list(name.finditer(written))[-1:]:
                    place = Excerpt.of_span(span).span(*match.span())
                    found[place.path, place.start] = Edit(place, new)
    return list(found.values())


def _map_edits(course: Course, lesson: Lesson, new: str) -> Iterator[Edit]:
    root = _map(course)
    for level in root.objects("level"):
        for node in level.objects("lesson"):
            id = node.get("id")
            if isinstance(id, StringNode) and id.value == lesson.id:
                yield Edit(id.span, toml_string(new))
    for other in course.lessons:
        named = zip(other.prerequisites, other.prerequisite_spans, strict=True)
        yield from (Edit(span, toml_string(new)) for name, span in named if name == lesson.id)
    for path in _silenced(root):
        if path.value == lesson.path:
            yield Edit(path.span, toml_string(replace(lesson, id=new).path))


def doubtful_places(
    course: Course, lesson: Lesson, new: str, edits: Iterable[Edit], others: Iterable[Source]
) -> list[Span]:
    """Places that may mean the lesson, and are none of the edits.

    `others` are further texts of the project, such as its features.
    """
    known = [edit.span for edit in edits]
    id = re.escape(lesson.id)
    names = re.compile(
        rf"lesson:({id})(?!\w|\.\w)|(?<![\w.])({id})-{lesson.slug}(?![\w-])"
        rf"|(?i:\blessons?)\s(?:{_NUMBER}|[\s,–-]|and\b|or\b|to\b)*?(?<![\w.])({id})(?!\w|\.\w)"
    )
    found = []
    for source in (*course.sources, *others):
        for match in names.finditer(source.text):
            place = source.span(*match.span(match.lastindex or 0))
            if not any(span.contains(place) for span in known):
                found.append(place)
        found += [
            source.span(*match.span())
            for match in _RANGE.finditer(source.text)
            if id_order(match[1]) <= id_order(lesson.id) <= id_order(match[2])
        ]
    return [*found, *_globs(course, lesson, new)]


def _globs(course: Course, lesson: Lesson, new: str) -> Iterator[Span]:
    """Patterns of the map that fit the file as it is called, and not as it will be."""
    renamed = replace(lesson, id=new).path
    for path in _silenced(_map(course)):
        fits = [fnmatchcase(name, path.value) for name in (lesson.path, renamed)]
        if path.value != lesson.path and fits == [True, False]:
            yield path.span


def _silenced(root: ObjectNode) -> Iterator[StringNode]:
    """The files in which warnings are silenced."""
    paths = (silence.get("path") for silence in root.objects("silence"))
    return (path for path in paths if isinstance(path, StringNode))


def _map(course: Course) -> ObjectNode:
    root = parse_toml(course.map).value
    assert root is not None  # a course was made of it
    return root
