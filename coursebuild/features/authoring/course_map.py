"""Edits of the course map: what is added, a lesson that is renamed; and of what names it.

An entry is inserted or moved as a whole, with the comments directly above it, and with the line
ends and the indentation of the map. The rest stays as its author wrote it. The new text is parsed,
and refused where it is no valid map, as where all lessons are on one line.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from fnmatch import fnmatchcase

from msgspec.structs import replace

from coursebuild.api import (
    Course,
    Edit,
    Excerpt,
    Lesson,
    Source,
    Span,
    UsageError,
    did_you_mean,
    parse_toml,
    regex,
)
from coursebuild.core.model import LessonTarget, Link, find_inlines, resolve
from coursebuild.core.scripts.edit import apply_edits
from coursebuild.core.syntax.coursemap import parse_course_map
from coursebuild.core.syntax.nodes import ArrayNode, ObjectNode, StringNode
from coursebuild.core.syntax.toml_text import toml_string

_COMMENTS_ABOVE = regex(r"(?:^[ \t]*#[^\n]*\n)*[ \t]*\Z", re.MULTILINE)
_LINE_END = regex(r"\r?\n|\Z")
_BLANK_LINES = regex(r"(?:[ \t]*\r?\n)*")


def with_lesson(course: Course, id: str, slug: str, title: str) -> str:
    """Return the map with a draft added to its level.

    Raises:
        UsageError: the map cannot have it.
    """
    _check_free(course, id)
    lines = _table("level.lesson", id=id, slug=slug, title=title, status="draft")
    return _require_valid(course, _insert(course, id, lines), id)


def with_level(course: Course, id: str, title: str) -> str:
    """Return the map with a level added, before those whose ids come later.

    Raises:
        UsageError: the map cannot have it.
    """
    later = [level.span for level in course.levels if id_order(level.id) > id_order(id)]
    text = _insert_table(course.map.text, _table("level", id=id, title=title), later)
    return _require_valid(course, text, id, "level")


def with_page(course: Course, id: str, title: str, path: str) -> str:
    """Return the map with a page added, behind the others if these stand before the levels.

    Raises:
        UsageError: the map cannot have it.
    """
    spans = [level.span for level in course.levels]
    is_last = bool(course.pages and spans and course.pages[-1].span.start > spans[-1].start)
    later = [] if is_last else spans
    text = _insert_table(course.map.text, _table("page", id=id, title=title, file=path), later)
    return _require_valid(course, text, id, "page")


def _table(kind: str, **fields: str) -> list[str]:
    return [f"[[{kind}]]", *(f"{name} = {toml_string(value)}" for name, value in fields.items())]


def _insert_table(text: str, lines: Sequence[str], later: Sequence[Span]) -> str:
    """Return the map with a table inserted before the first of others, or at its end."""
    line_end = _line_end(text)
    if not later:
        return line_end.join([text.rstrip(), "", *lines, ""])
    comments = _COMMENTS_ABOVE.search(text, 0, later[0].start)
    assert comments is not None
    start = comments.start()
    return text[:start] + line_end.join([*lines, "", ""]) + text[start:]


def with_lesson_renamed(course: Course, old: Lesson, new: str, edits: Sequence[Edit]) -> str:
    """Return the map after edits that give a lesson another id.

    The lesson moves to the level of that id, and to its place in the order of ids if the lessons
    of the level were in that order before.

    Raises:
        UsageError: the map cannot have it.
    """
    _check_free(course, new)
    text = apply_edits(course.map.text, edits)
    new_course = parse_course_map(Source(course.map.path, text)).value
    lessons = () if new_course is None else new_course.lessons
    lesson = next((lesson for lesson in lessons if lesson.id == new), None)
    if new_course is None or lesson is None:
        return _require_valid(course, text, new)
    ids = [sibling.id for sibling in new_course.lessons if sibling.level == lesson.level]
    old_ids = [old.id if id == new else id for id in ids]
    in_order = ids == sorted(ids, key=id_order) or old_ids != sorted(old_ids, key=id_order)
    if lesson.level != _level_id(new) or not in_order:
        start, end = _entry_range(text, lesson)
        entry = re.split(r"\r?\n", text[start:end])
        blank_lines = _BLANK_LINES.match(text, end)
        assert blank_lines is not None
        left, right = text[:start], text[blank_lines.end() :]
        text = left + right if right else left.rstrip() + _line_end(text)
        shortened = parse_course_map(Source(course.map.path, text)).value
        if shortened is not None:
            text = _insert(shortened, new, entry)
    return _require_valid(course, text, new)


def with_feature(course: Course, path: str) -> str:
    """Return the map with a file added to `features`.

    Raises:
        UsageError: the map cannot have it.
    """
    source = course.map
    root = parse_toml(source).value
    table = None if root is None else root.get("course")
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
    return _require_valid(course, apply_edits(source.text, [edit]), path, "feature")


def _check_free(course: Course, id: str) -> None:
    levels = [level.id for level in course.levels]
    if _level_id(id) not in levels:
        help = did_you_mean("", levels)
        if re.fullmatch(r"[\w-]+", _level_id(id)):
            command = f"`coursebuild new level {_level_id(id)} TITLE`"
            help = f"{command} adds it; {help}".rstrip("; ")
        raise UsageError(f"the map has no level for `{id}`", help=help)
    for lesson in course.lessons:
        if lesson.id.casefold() == id.casefold():
            raise UsageError(f"there is already a lesson {lesson.id}: {lesson.title}")


def _insert(course: Course, id: str, lines: Sequence[str]) -> str:
    text = course.map.text
    level = next(level for level in course.levels if level.id == _level_id(id))
    preceding = [lesson for lesson in level.lessons if id_order(lesson.id) < id_order(id)]
    line_end = _line_end(text)
    if preceding or not level.lessons:
        last = preceding[-1].span if preceding else level.span
        start, end = _start_of_line(text, last.start), _end_of_line(text, last.end)
        entry = line_end.join(["", "", *_indent(lines, text[start : last.start])])
        if any(line.strip() for line in text[end:].splitlines()[1:2]):
            entry += line_end
        return text[:end] + entry + text[end:]
    first = level.lessons[0].span.start
    start, _ = _entry_range(text, level.lessons[0])
    entry = line_end.join([*_indent(lines, text[_start_of_line(text, first) : first]), "", ""])
    return text[:start] + entry + text[start:]


def _require_valid(course: Course, text: str, id: str, kind: str = "lesson") -> str:
    """Return the text of a map if it has what was added, and no more mistakes than before."""
    old_mistakes = {(d.rule, d.message) for d in parse_course_map(course.map).diagnostics}
    new_map = parse_course_map(Source(course.map.path, text))
    mistakes = [d for d in new_map.diagnostics if (d.rule, d.message) not in old_mistakes]
    new_course = new_map.value or course
    ids = {
        "lesson": [lesson.id for lesson in new_course.lessons if lesson.level == _level_id(id)],
        "level": [level.id for level in new_course.levels],
        "page": [page.id for page in new_course.pages],
        "feature": [feature.path for feature in new_course.features],
    }
    if mistakes or id not in ids[kind]:
        reason = f": {mistakes[0].message}" if mistakes else ""
        raise UsageError(f"{course.map.path} cannot have a {kind} {id}{reason}")
    return text


def _level_id(id: str) -> str:
    return id.partition(".")[0]


def id_order(id: str) -> list[tuple[bool, int, str]]:
    """Return a key that sorts ids, numbers by size and before words: 1.9, 1.10, 1.A."""
    parts = id.split(".")
    return [(not part.isdecimal(), int(part) if part.isdecimal() else 0, part) for part in parts]


def _entry_range(text: str, lesson: Lesson) -> tuple[int, int]:
    """Return where the lines of an entry begin and end, with the comments directly above it."""
    comments = _COMMENTS_ABOVE.search(text, 0, lesson.span.start)
    assert comments is not None
    return comments.start(), _end_of_line(text, lesson.span.end)


def _line_end(text: str) -> str:
    return "\r\n" if "\r\n" in text else "\n"


def _start_of_line(text: str, offset: int) -> int:
    return text.rfind("\n", 0, offset) + 1


def _end_of_line(text: str, offset: int) -> int:
    line_end = _LINE_END.search(text, min(offset, len(text)))
    assert line_end is not None
    return line_end.start()


def _indent(lines: Sequence[str], indent: str) -> list[str]:
    return [indent + line.removeprefix(indent) for line in lines] if indent.isspace() else [*lines]


_NUMBER = r"(?>[0-9]+(?:\.[0-9]+)+)"


def rename_references(course: Course, lesson: Lesson, new: str) -> list[Edit]:
    """Return the edits of the map, and of all links and mentions, each once."""
    root, new_id = _map(course), toml_string(new)
    ids = [node.get("id") for level in root.objects("level") for node in level.objects("lesson")]
    spans = [id.span for id in ids if isinstance(id, StringNode) and id.value == lesson.id]
    for dependent in course.lessons:
        pairs = zip(dependent.prerequisites, dependent.prerequisite_spans, strict=True)
        spans += [span for id, span in pairs if id == lesson.id]
    map_edits = [Edit(span, new_id) for span in spans]
    new_path = toml_string(replace(lesson, id=new).path)
    paths = (path for path in _silenced_paths(root) if path.value == lesson.path)
    map_edits += [Edit(path.span, new_path) for path in paths]
    edits = {(edit.span.path, edit.span.start): edit for edit in map_edits}
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


def doubtful_places(
    course: Course, lesson: Lesson, new: str, edits: Iterable[Edit], code: Iterable[Source]
) -> list[Span]:
    """Return the places that may mean the lesson, and are not among the edits.

    `code` are further texts of the project, such as its features.
    """
    edited_spans = [edit.span for edit in edits]
    id = re.escape(lesson.id)
    words = [words for _, words in sorted(course.words.items())]
    singular, plural, conjunctions, ranges = (
        "|".join(
            dict.fromkeys(
                re.escape(name) for vocabulary in words for name in getattr(vocabulary, field)
            )
        )
        for field in ("lesson", "lessons", "conjunctions", "range")
    )
    names = re.compile(
        rf"lesson:({id})(?!\w|\.\w)|(?<![\w.])({id})-{lesson.slug}(?![\w-])"
        rf"|(?i:\b(?:{plural}|{singular}))\s(?:{_NUMBER}|[\s,،–-]|(?:{conjunctions})(?![A-Za-z]))*?"
        rf"(?<![\w.])({id})(?!\w|\.\w)"
    )
    series = re.compile(
        rf"(?i)\b(?:{plural})\s+({_NUMBER})\s?(?:–|-|(?:{ranges})(?![A-Za-z]))\s?({_NUMBER})"
    )
    places = []
    for source in (*course.sources, *code):
        for match in names.finditer(source.text):
            place = source.span(*match.span(match.lastindex or 0))
            if not any(span.contains(place) for span in edited_spans):
                places.append(place)
        places += [
            source.span(*match.span())
            for match in series.finditer(source.text)
            if id_order(match[1]) <= id_order(lesson.id) <= id_order(match[2])
        ]
    # Patterns that match the lesson's old path, and not the new one
    new_path = replace(lesson, id=new).path
    for path in _silenced_paths(_map(course)):
        fits = [fnmatchcase(name, path.value) for name in (lesson.path, new_path)]
        if path.value != lesson.path and fits == [True, False]:
            places.append(path.span)
    return places


def _silenced_paths(root: ObjectNode) -> Iterator[StringNode]:
    paths = (silence.get("path") for silence in root.objects("silence"))
    return (path for path in paths if isinstance(path, StringNode))


def _map(course: Course) -> ObjectNode:
    root = parse_toml(course.map).value
    assert root is not None  # the course was read from it
    return root
