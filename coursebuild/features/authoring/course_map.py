"""The course map with a lesson added or renamed, or a feature, and all else as its author wrote it.

Entry points: `with_lesson`, `with_lesson_renamed`, `with_feature`.

An entry is put in, or cut out and put in, as a whole, with the comments directly above it, and with
the line ends and the indentation of the map. What comes of it is parsed and refused where it is no
map, as where all lessons stand in one line.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from coursebuild.core.files.errors import UsageError
from coursebuild.core.model import Course, Lesson
from coursebuild.core.scripts.edit import apply_edits
from coursebuild.core.syntax.coursemap import parse_course_map
from coursebuild.core.syntax.nodes import ArrayNode, ObjectNode
from coursebuild.core.syntax.toml_text import parse_toml, toml_string
from coursebuild.core.text.diagnostics import Edit, did_you_mean
from coursebuild.core.text.source import Source

_COMMENTS_ABOVE = re.compile(r"(?:^[ \t]*#[^\n]*\n)*[ \t]*\Z", re.MULTILINE)
_LINE_END = re.compile(r"\r?\n|\Z")
_BLANK_LINES = re.compile(r"(?:[ \t]*\r?\n)*")


def with_lesson(course: Course, id: str, slug: str, title: str) -> str:
    """The map with a draft among the lessons of its level.

    Raises:
        UsageError: the map cannot have it.
    """
    _check_free(course, id)
    fields = {"id": id, "slug": slug, "title": title, "status": "draft"}
    rows = (f"{name} = {toml_string(value)}" for name, value in fields.items())
    lines = ["[[level.lesson]]", *rows]
    return _checked(course, _inserted(course, id, lines), id)


def with_lesson_renamed(course: Course, old: Lesson, new: str, edits: Sequence[Edit]) -> str:
    """The map after edits that give a lesson another id.

    It stands in the level of that id, and in the order of ids where that was the order before.

    Raises:
        UsageError: the map cannot have it.
    """
    _check_free(course, new)
    text = apply_edits(course.map.text, edits)
    renamed = parse_course_map(Source(course.map.path, text)).value
    lesson = None if renamed is None else _lesson(renamed, new)
    if renamed is None or lesson is None:
        return _checked(course, text, new)
    ids = [one.id for one in renamed.lessons if one.level == lesson.level]
    before = [old.id if id == new else id for id in ids]
    in_order = ids == sorted(ids, key=id_order) or before != sorted(before, key=id_order)
    if lesson.level != _level_id(new) or not in_order:
        start, end = _entry(text, lesson)
        entry = re.split(r"\r?\n", text[start:end])
        rest = _BLANK_LINES.match(text, end)
        assert rest is not None
        left, right = text[:start], text[rest.end() :]
        text = left + right if right else left.rstrip() + _line_end(text)
        without = parse_course_map(Source(course.map.path, text)).value
        if without is not None:
            text = _inserted(without, new, entry)
    return _checked(course, text, new)


def with_feature(course: Course, path: str) -> str:
    """The map with a further file of `features`.

    Raises:
        UsageError: the map cannot have it.
    """
    source = course.map
    table = getattr(parse_toml(source).value, "get", lambda name: None)("course")
    if not isinstance(table, ObjectNode):
        raise UsageError(f"{source.path} cannot be read")
    array = table.get("features")
    if isinstance(array, ArrayNode) and array.items:
        edit = Edit(array.items[-1].span, f"{array.items[-1].raw}, {toml_string(path)}")
    elif array is not None:
        edit = Edit(array.span, f"[{toml_string(path)}]")
    else:
        title = table.place("title")
        line = f"{_line_end(source.text)}features = [{toml_string(path)}]"
        end = _end_of_line(source.text, title.end)
        edit = Edit(source.span(end, end), line)
    text = apply_edits(source.text, [edit])
    changed = parse_course_map(Source(source.path, text)).value
    if changed is None or path not in [feature.path for feature in changed.features]:
        raise UsageError(
            f"{source.path} cannot have a feature: add `{path}` to `features` yourself"
        )
    return text


def _check_free(course: Course, id: str) -> None:
    levels = [level.id for level in course.levels]
    if _level_id(id) not in levels:
        help = did_you_mean("", levels)
        raise UsageError(f"the map has no level for `{id}`", help=help)
    for lesson in course.lessons:
        if lesson.id.casefold() == id.casefold():
            raise UsageError(f"there is a lesson {lesson.id} already: {lesson.title}")


def _inserted(course: Course, id: str, lines: Sequence[str]) -> str:
    """The map with the lines of an entry behind the last lesson of the level that is to precede."""
    text = course.map.text
    level = next(level for level in course.levels if level.id == _level_id(id))
    above = [lesson for lesson in level.lessons if id_order(lesson.id) < id_order(id)]
    line_end = _line_end(text)
    if above or not level.lessons:
        last = above[-1].span if above else level.span
        at, end = _start_of_line(text, last.start), _end_of_line(text, last.end)
        entry = line_end.join(["", "", *_indented(lines, text[at : last.start])])
        if any(line.strip() for line in text[end:].splitlines()[1:2]):
            entry += line_end
        return text[:end] + entry + text[end:]
    first = level.lessons[0].span.start
    at, _ = _entry(text, level.lessons[0])
    entry = line_end.join([*_indented(lines, text[_start_of_line(text, first) : first]), "", ""])
    return text[:at] + entry + text[at:]


def _checked(course: Course, text: str, id: str) -> str:
    """The text, if it is a map in which nothing is wrong that was not before, with a lesson."""
    known = {(d.rule, d.message) for d in parse_course_map(course.map).diagnostics}
    parsed = parse_course_map(Source(course.map.path, text))
    wrong = [d for d in parsed.diagnostics if (d.rule, d.message) not in known]
    lesson = None if parsed.value is None else _lesson(parsed.value, id)
    if wrong or lesson is None or lesson.level != _level_id(id):
        why = f": {wrong[0].message}" if wrong else ""
        raise UsageError(f"{course.map.path} cannot have a lesson {id}{why}")
    return text


def _lesson(course: Course, id: str) -> Lesson | None:
    return next((lesson for lesson in course.lessons if lesson.id == id), None)


def _level_id(id: str) -> str:
    return id.partition(".")[0]


def id_order(id: str) -> list[tuple[bool, int, str]]:
    """Of ids, numbers by their size and before words: 1.9, 1.10, 1.A."""
    parts = id.split(".")
    return [(not part.isdecimal(), int(part) if part.isdecimal() else 0, part) for part in parts]


def _entry(text: str, lesson: Lesson) -> tuple[int, int]:
    """Where the lines of an entry begin, with the comments directly above it, and end."""
    above = _COMMENTS_ABOVE.search(text, 0, lesson.span.start)
    assert above is not None
    return above.start(), _end_of_line(text, lesson.span.end)


def _line_end(text: str) -> str:
    return "\r\n" if "\r\n" in text else "\n"


def _start_of_line(text: str, at: int) -> int:
    return text.rfind("\n", 0, at) + 1


def _end_of_line(text: str, at: int) -> int:
    found = _LINE_END.search(text, min(at, len(text)))
    assert found is not None
    return found.start()


def _indented(lines: Sequence[str], indent: str) -> list[str]:
    """Lines as far in as the entries around them, if these are."""
    return [indent + line.removeprefix(indent) for line in lines] if indent.isspace() else [*lines]
