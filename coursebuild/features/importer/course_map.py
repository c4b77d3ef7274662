"""The map of the new course.

People write `course.json` by hand in many dialects, so a field can have several names; unknown
fields are reported once, with their number.
"""

from __future__ import annotations

import itertools
import json
import posixpath
import re
from collections.abc import Iterator, Mapping
from fnmatch import fnmatchcase
from typing import Any

from markdown_it import MarkdownIt
from msgspec.structs import replace

from coursebuild.api import UsageError, model, regex
from coursebuild.core.syntax.course_schema import slug_of
from coursebuild.core.syntax.coursemap import RESERVED_IDS
from coursebuild.core.syntax.toml_text import toml_string
from coursebuild.features.importer.account import shorten_value
from coursebuild.features.importer.bookdown import read_bookdown
from coursebuild.features.importer.context import LessonContext
from coursebuild.features.importer.includes import (
    append_texts,
    expand_includes,
    without_hidden_lines,
)
from coursebuild.features.importer.pandoc_tables import number_examples
from coursebuild.features.importer.segments import RST, read_segments
from coursebuild.features.importer.source_files import (
    TEXTS,
    ImportedCourse,
    ImportedLevel,
    ImportedText,
    Segment,
    SourceFiles,
    read_yaml,
    stem_of,
    title_of_file,
)

_FIELD_NAMES: dict[str, str] = {
    "number": "id",
    "name": "title",
    **dict.fromkeys(("description", "subtitle", "tagline", "goal"), "summary"),
    **dict.fromkeys(("path", "source", "markdown"), "file"),
    **dict.fromkeys(("outcomes", "goals", "learning_objectives"), "objectives"),
    **dict.fromkeys(("prereqs", "requires", "depends_on", "dependencies"), "prerequisites"),
    **dict.fromkeys(("estimated_minutes", "estimatedMinutes", "duration", "time"), "minutes"),
    "state": "status",
    **dict.fromkeys(("units", "chapters"), "lessons"),
    **dict.fromkeys(("modules", "parts"), "levels"),
    **dict.fromkeys(("lang", "locale"), "language"),
}
"""The names of fields here, by the names they have in other dialects."""
_COURSE_FIELDS = ("id", "title", "summary", "levels", "pages", "language")
_GROUPS = ("levels", "lessons", "pages")
"""Fields that hold further objects."""
_LEVEL_FIELDS = ("id", "title", "summary", "lessons", "checkpoint")
_LESSON_FIELDS = tuple(
    "id slug title summary file objectives prerequisites minutes status checkpoint".split()
)


def read_course_json(path: str, files: SourceFiles) -> ImportedCourse:
    """Read the course that a file describes.

    Raises:
        UsageError: it is no JSON, or holds no levels.
    """
    text = files.read_text(path)
    files.change("map", "content/course.toml")
    try:
        # A number such as 4.10 is the name of a lesson.
        data = json.loads(text, parse_float=str, parse_int=str)
    except RecursionError:
        raise UsageError(f"{path} is not JSON: the text is nested too deeply") from None
    except ValueError as error:
        raise UsageError(f"{path} is not JSON: {error}") from None
    reader = _Reader(path, files)
    course = reader.fields(data, _COURSE_FIELDS)
    levels = tuple(map(reader.level, _read_items(course, "levels")))
    if not levels:
        raise UsageError(f"{path} has no `levels`")
    return ImportedCourse(
        title=_read_text(course, "title") or "Course",
        summary=_read_text(course, "summary"),
        language=_read_text(course, "language"),
        levels=levels,
        pages=tuple(map(reader.lesson, _read_items(course, "pages"))),
        camera_is_position=True,
    )


class _Reader:
    """Reads the objects of the file, and notes the fields that a course map does not have."""

    def __init__(self, path: str, files: SourceFiles) -> None:
        self.path, self.files = path, files

    def fields(self, value: Any, names: tuple[str, ...]) -> dict[str, Any]:
        """Return the fields of an object, by their names here; of these, `names` are expected."""
        if not isinstance(value, dict):
            raise UsageError("course.json: a level or a lesson is not an object")
        fields = {_FIELD_NAMES.get(key) or key: item for key, item in value.items()}
        owner = _read_text(fields, "id") or _read_text(fields, "title")
        for key, item in value.items():
            name = _FIELD_NAMES.get(key) or key
            items = item if isinstance(item, list) else [item]
            is_text = all(isinstance(part, str) for part in items)
            if name in names and (is_text or name in _GROUPS):
                self.files.account.taken[f"field `{name}` of the map"] += 1
            else:
                whole = json.dumps(item, ensure_ascii=False)
                message = f"`{key}` of the map ({whole}), which has no field for it"
                self.files.leave(self.path, message, f"field `{name}` of the map", owner)
        return fields

    def level(self, value: object) -> ImportedLevel:
        level = self.fields(value, _LEVEL_FIELDS)
        return ImportedLevel(
            id=_read_text(level, "id"),
            title=_read_text(level, "title"),
            summary=_read_summary(level),
            lessons=tuple(map(self.lesson, _read_items(level, "lessons"))),
        )

    def lesson(self, value: object) -> ImportedText:
        lesson = self.fields(value, _LESSON_FIELDS)
        minutes = re.search(r"\d+", _read_text(lesson, "minutes"))
        return ImportedText(
            old_id=_read_text(lesson, "id"),
            file=self.find_file(lesson),
            title=_read_text(lesson, "title"),
            slug=_read_text(lesson, "slug"),
            summary=_read_summary(lesson),
            status=_read_text(lesson, "status"),
            objectives=_read_texts(lesson, "objectives"),
            prerequisites=_read_texts(lesson, "prerequisites"),
            minutes=int(minutes[0]) if minutes and 1 <= int(minutes[0]) <= 100_000 else None,
        )

    def find_file(self, lesson: dict[str, Any]) -> str:
        """Return the file of a lesson: the one it names, or one whose name begins with its id."""
        file, id, slug = (_read_text(lesson, key) for key in ("file", "id", "slug"))
        paths = [path for path in self.files if path.endswith(TEXTS)]
        suffix = "/" + file.lstrip("./")
        exact = self.files.find(posixpath.normpath(file))
        matches = [
            path for path in paths if file and (path == exact or f"/{path}".endswith(suffix))
        ]
        pattern = re.compile(rf"(?:lesson[-_ ]?)?{re.escape(id)}(?![\w.])|{re.escape(slug)}$")
        own_paths = (path for path in paths if pattern.match(posixpath.basename(stem_of(path))))
        return next(itertools.chain(matches, own_paths if id else ()), "")


def _read_texts(fields: dict[str, Any], name: str) -> tuple[str, ...]:
    """Return the texts of a field, each on one line: the items of a list, or its value."""
    value = fields.get(name)
    items = value if isinstance(value, list) else [value]
    texts = (" ".join(item.split()) for item in items if isinstance(item, str))
    return tuple(text for text in texts if text)


def _read_text(fields: dict[str, Any], name: str) -> str:
    return "; ".join(_read_texts(fields, name))


def _read_items(fields: dict[str, Any], name: str) -> list[Any]:
    value = fields.get(name)
    return value if isinstance(value, list) else []


def _read_summary(fields: dict[str, Any]) -> str:
    """Return the summary, with what a learner should be able to do by then."""
    summary, checkpoint = (_read_text(fields, name) for name in ("summary", "checkpoint"))
    if not checkpoint:
        return summary
    return f"{re.sub(r'(?<=[^.!?])$', '.', summary)} Checkpoint: {checkpoint}".strip()


_COMPLETE = ("", "complete", "completed", "done", "published", "final", "ready")
"""Statuses of a lesson that is finished; with any other it is a draft."""


def read_texts(course: ImportedCourse, files: SourceFiles) -> ImportedCourse:
    """Return the course with its texts read, and with their new ids and paths.

    A lesson whose file cannot be read is only planned, and a page is left out.

    Raises:
        UsageError: no file can be read.
    """
    levels, errors = [], list[UsageError]()

    def read(text: ImportedText, id: str, used_ids: set[str] | None = None) -> ImportedText:
        try:
            return _read_file(text, id, files, course, used_ids)
        except UsageError as error:
            errors.append(error)
            message = f"it {str(error).removeprefix(f'{text.file} ')}: a lesson without a text"
            files.leave(text.file, message, "text")
            planned = replace(text, file="", title=text.title or title_of_file(text.file))
            return _read_file(planned, id, files, course)

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
            lessons.append(read(lesson, lesson_id))
        first = lessons[0].title if lessons and course.has_own_titles else ""
        title = _plain_text(level.title) or first or f"Level {id}"
        levels.append(replace(level, id=id, title=title, lessons=tuple(lessons)))
    used_ids = {*RESERVED_IDS}
    for page in course.pages:
        if not page.file:
            message = f"the page {page.title or page.old_id} of the map, whose file is not there"
            files.leave(page.old_id or page.title, message, "page")
    pages = [read(page, "", used_ids) for page in course.pages if page.file]
    if errors and not any(
        t.path for t in (*pages, *(t for level in levels for t in level.lessons))
    ):
        raise errors[0]
    pages = [page for page in pages if page.path]
    return replace(course, levels=tuple(levels), pages=tuple(pages))


def _free_id(id: str, other_ids: Iterator[str], used_ids: set[str]) -> str:
    """Return an id that nothing has yet, whatever the case of its letters; it is taken then."""
    free = next(new for new in itertools.chain([id], other_ids) if new.casefold() not in used_ids)
    used_ids.add(free.casefold())
    return free


def _read_file(
    text: ImportedText,
    id: str,
    files: SourceFiles,
    course: ImportedCourse,
    used_ids: set[str] | None = None,
) -> ImportedText:
    """Read the file of a lesson with this id, or of a page, whose id is made from its title.

    `used_ids` are the ids that a page cannot have.
    """
    title, slug = text.title, text.slug
    if not text.file:
        title = title or id
        return replace(text, id=id, slug=slug_of(slug or title), title=title)
    try:
        source = files.read_text(text.file)
        if not text.file.endswith(".ipynb"):
            source = append_texts(expand_includes(source, text.file, files), text.file, files)
        if text.file.endswith(".Rmd"):
            source = read_bookdown(source)
        if text.file.endswith((".qmd", ".Rmd")):
            source = number_examples(source)
        if text.file.endswith(".qmd"):  # there a tag need not be apart from a block
            source = _TAG_BESIDE_BLOCK.sub(r"\g<0>\n", source)
        word = "[a-z]+" if files.docusaurus else "highlight"  # its settings name others
        comment = re.compile(_COLOURING.format(word), re.MULTILINE)
        source = files.account.replace(
            source, comment, "", "comment in code", "dropped: its tool colours the lines beside it"
        )
        visible_text = without_hidden_lines(source, files.hidden_marks)
        if visible_text != source:
            files.change("hidden lines of code", "dropped: readers did not see them")
            source = visible_text
        raw_formats = RST | {""} if "conf.py" in files else RST  # as Sphinx reads them
        read, lost = read_segments(source, text, raw_formats)
        listing = lost.get("listing", [])
        listing = {"contents": "*"} if isinstance(listing, str) else listing  # its type alone
        lines = "\n".join(_listing_lines(listing, text.file, files))
        if lines:
            files.change("list of other texts", "its entries, as links")
            last = Segment(kind="prose", place=f"line {source.count(chr(10)) + 1}", text=lines)
            read = replace(read, segments=(*read.segments, last))
            lost = {key: value for key, value in lost.items() if key != "listing"}
    except RecursionError:
        raise UsageError(f"{text.file} is nested too deeply") from None
    if read.summary and not id:
        lost = {**lost, "description": read.summary}
    for name, value in lost.items():
        kind = "lesson" if id else "page"
        message = f"`{name}` of its metadata ({shorten_value(value)}), which a {kind} does not have"
        files.leave(text.file, message, "metadata of a text")
    files.change("text", "a lesson" if id else "a page")
    if course.has_own_titles and title and read.title and title.casefold() != read.title.casefold():
        words = f"“{title}” is “{read.title}”"
        files.account.change("title in the map", "the title of the text itself", words)
        title = read.title
    title = _plain_text(title or read.title) or title_of_file(text.file)
    slug = slug_of(slug or title_of_file(text.file))
    if not re.search("[a-z]", slug) or (slug == "index" and not text.slug):
        slug = slug_of(title)
    page = slug_of(text.old_id or title)
    if used_ids is not None:
        page = _free_id(page, (f"{page}-{n}" for n in itertools.count(2)), used_ids)
    path = f"content/lessons/{id}-{slug}.md" if id else f"content/pages/{page}.md"
    return replace(
        read,
        id=id or page,
        slug=slug,
        title=title,
        path=path,
        summary=text.summary or _plain_text(read.summary),
        substitutions={"page.title": title, **read.substitutions},
    )


def _listing_lines(value: object, path: str, files: SourceFiles) -> Iterator[str]:
    """Yield what Quarto lists in a text as Markdown: entries with an address, below their titles.

    They stand in the settings of the text, in files of YAML, or are the texts of a pattern.
    """
    parts = value if isinstance(value, list) else [value]
    for part in parts:
        if isinstance(part, str):
            folder = "" if part.startswith("/") else posixpath.dirname(path)
            pattern = posixpath.normpath(posixpath.join(folder, part.lstrip("/")))
            if part.endswith((".yml", ".yaml")):
                entries = read_yaml(files.read_text(pattern)) if pattern in files else None
                yield from _entry_lines(entries, path, files)
            for name in files:
                is_listed = fnmatchcase(name, pattern) or name.startswith(f"{pattern}/")
                if name != path and name.endswith(TEXTS) and is_listed:
                    yield f"- [](</{name}>)"
        else:
            yield from _entry_lines(part, path, files)


def _entry_lines(value: object, path: str, files: SourceFiles) -> Iterator[str]:
    if isinstance(value, list):
        for part in value:
            yield from _entry_lines(part, path, files)
    elif isinstance(value, Mapping):
        title, words, address = (
            next((" ".join(t.split()) for t in map(value.get, names) if isinstance(t, str)), "")
            for names in _ENTRY_KEYS
        )
        if address or title:
            start = f"- [{title}](<{address}>)" if address else f"\n**{title}**\n"
            yield f"{start}: {words}" if address and words else f"{start}{words}"
        yield from _listing_lines(value.get("contents") or [], path, files)
        for key, part in value.items():
            if key != "contents" and isinstance(part, list):
                yield from _entry_lines(part, path, files)


_ENTRY_KEYS = (("title", "category"), ("subtitle", "description"), ("path", "href"))
"""Of an entry in a list of texts: what it is called, what it is about, its address."""
_COLOURING = (
    r"^[ \t]*(?:#|//|--|%|/\*|<!--|\{{/\*)[ \t]*{}-(?:next-line|start|end)\b[^\w\n]*(?:\n|\Z)"
)
"""A comment by which Docusaurus colours lines, with a word that tells how."""
_TAG_BESIDE_BLOCK = regex(
    r"^[ \t]*</?[a-z][^<>\n]*>[ \t]*\n(?=[ \t]*`{3})|^[ \t]*`{3,}[ \t]*\n(?=[ \t]*</)"
    r"|^<div\b[^<>\n]*>[ \t]*\n(?=[^\s<])",
    re.MULTILINE,
)
_ROLE = regex(r"\{[a-z][\w:-]*\}`([^`]*?)(?:\s*<[^`<>]*>)?`")
"""A role of MyST, of which the map, where titles are plain, keeps the words."""


def _plain_text(title: str) -> str:
    """The words of a title without Markdown, for the map."""
    title = re.sub(r"\{[ ]*[.#][^{}]*\}", "", _ROLE.sub(r"\1", title))
    (inline,) = MarkdownIt("commonmark").parseInline(title)
    words = (
        " " if part.type.endswith("break") or part.content.startswith("<br") else part.content
        for part in inline.children or ()
        if part.type != "html_inline" or part.content.startswith("<br")
    )
    return " ".join("".join(words).split())


def map_lines(
    course: ImportedCourse,
    ids: Mapping[str, str],
    context: LessonContext,
    packages: tuple[str, ...],
    longest: int,
) -> Iterator[str]:
    """Yield the lines of `course.toml`.

    `ids` are the new ids of lessons, by the old ones; `longest` is the size of the longest text.
    """
    yield "[course]"
    yield from _field_lines(
        title=course.title, summary=course.summary, language=course.language, packages=packages
    )
    yield from ("", "[verify]", 'compare = "digits"')
    usual = model.Limits().text
    if longest > usual:
        yield from ("", "[limits]", f"text = {(longest // usual + 1) * usual:_}")
    for table, values in (("callouts", context.callouts), ("macros", context.macros)):
        if values:
            yield from ("", f"[{table}]", *_field_lines(**values))
    for level in course.levels:
        yield from ("", "[[level]]")
        yield from _field_lines(id=level.id, title=level.title, summary=level.summary)
        for lesson in level.lessons:
            status = "complete" if lesson.status.lower() in _COMPLETE else "draft"
            yield from ("", "[[level.lesson]]")
            yield from _field_lines(
                id=lesson.id,
                slug=lesson.slug,
                title=lesson.title,
                status=status if lesson.path else "planned",
                summary=lesson.summary,
                objectives=lesson.objectives,
                prerequisites=tuple(ids[p] for p in lesson.prerequisites if p in ids),
                minutes=lesson.minutes,
            )
    for page in course.pages:
        yield from ("", "[[page]]")
        yield from _field_lines(id=page.id, title=page.title, file=page.path)


def _field_lines(**values: str | tuple[str, ...] | int | None) -> Iterator[str]:
    for name, value in values.items():
        if isinstance(value, tuple) and value:
            yield f"{name} = [{', '.join(map(toml_string, value))}]"
        elif isinstance(value, str) and value:
            is_tex = "\\" in value and value.isprintable() and "'" not in value
            yield f"{name} = " + (f"'{value}'" if is_tex else toml_string(value))
        elif isinstance(value, int):
            yield f"{name} = {value}"
