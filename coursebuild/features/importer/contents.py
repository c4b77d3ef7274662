"""The map of a course without a `course.json`: the table of contents of its tool, or its files.

Entry point: `read_contents`. Read are `_toc.yml` of Jupyter Book, `myst.yml` of MyST, `_quarto.yml`
of Quarto; without one of these the files, in the order of their names, a folder for a level.
"""

from __future__ import annotations

import itertools
import posixpath
import re
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from msgspec import Struct

from coursebuild.core.files.errors import UsageError
from coursebuild.features.importer.values import (
    TEXTS,
    Files,
    SourceCourse,
    SourceLesson,
    SourceLevel,
    name_of,
    read_text,
    read_yaml,
)

_NOT_LESSONS = ("readme", "license", "licence", "changelog", "contributing", "code_of_conduct")
_FIRST = ("index", "intro", "introduction", "about")


_LISTS = ("parts", "chapters", "sections", "children", "toc", "contents", "entries")
_FILES = ("file", "href", "part")
_TITLES = ("caption", "title", "section", "text", "part")
_TOP = {"toc", "root", "site-url", "author", "authors", "version"}
"""What only the whole course has, whose title is no level's."""


class _Entry(Struct):
    """A line of a table of contents."""

    file: str
    title: str
    inside: list[_Entry]


def read_contents(files: Files, folder: str) -> SourceCourse:
    """The course in a folder of notebooks or Markdown, of this name.

    Raises:
        UsageError: there is nothing to import.
    """
    settings = [_settings(name, files) for name in ("myst.yml", "_quarto.yml", "_config.yml")]
    title = next((t for s in settings for t in [_title(s)] if t), "")
    entries = [
        *_entries(_settings("_toc.yml", files), files),
        *_entries(settings[0].get("project"), files),
        *_entries((settings[1].get("book") or {}).get("chapters"), files),
        *_entries((settings[1].get("website") or {}).get("sidebar"), files),
    ]
    if not entries:
        entries = list(_by_folder(files))
    if not entries:
        raise UsageError(
            "there is nothing to import: no course.json, no notebook and no Markdown file"
        )
    pages = [e for e in entries if not e.inside and _base(e.file) in _FIRST]
    entries = [entry for entry in entries if entry not in pages]
    return SourceCourse(
        title=title or name_of(folder),
        levels=tuple(_levels(entries, title)),
        pages=tuple(_lesson(entry) for entry in pages),
    )


def _settings(name: str, files: Files) -> Mapping[str, Any]:
    path = next((path for path in (name, name.replace(".yml", ".yaml")) if path in files), None)
    if path is None:
        return {}
    value = read_yaml(read_text(files[path], path))
    if value is None:
        raise UsageError(f"{path} is no YAML")
    return value if isinstance(value, dict) else {"chapters": value}


def _title(settings: Mapping[str, Any]) -> str:
    for where in (settings, *(settings.get(key) for key in ("project", "book", "website"))):
        if isinstance(where, Mapping) and isinstance(where.get("title"), str):
            return " ".join(where["title"].split())
    return ""


def _entries(value: object, files: Files) -> Iterator[_Entry]:
    """The lines of a table of contents, whichever tool's."""
    if isinstance(value, str):
        path = _file(value, files)
        if path:
            yield _Entry(path, "", [])
    elif isinstance(value, list):
        for item in value:
            yield from _entries(item, files)
    elif isinstance(value, Mapping):
        yield from _entries(value.get("root"), files)
        inside = [entry for key in _LISTS for entry in _entries(value.get(key), files)]
        path = next((path for key in _FILES if (path := _file(value.get(key), files))), "")
        titled = next((str(value[key]) for key in _TITLES if value.get(key)), "")
        title = "" if _file(titled, files) else titled
        if path or (title and inside and not _TOP & value.keys()):
            yield _Entry(path, title, inside)
        else:
            yield from inside


def _file(name: object, files: Files) -> str:
    """The text that is named, with or without its extension; empty where that is none."""
    if not isinstance(name, str) or not name:
        return ""
    name = posixpath.normpath(name)
    if name in files:
        return name if name.endswith(TEXTS) else ""
    return next((name + end for end in TEXTS if name + end in files), "")


def _natural(path: str) -> list[tuple[int, int | str]]:
    """Names in order, numbers by their values."""
    parts = re.split(r"(\d+)", path)
    return [(0, int(part)) if part.isdigit() else (1, part.lower()) for part in parts if part]


def _by_folder(files: Files) -> Iterator[_Entry]:
    texts = sorted((path for path in files if path.endswith(TEXTS)), key=_natural)
    for folder, paths in itertools.groupby(texts, posixpath.dirname):
        inside = [_Entry(path, "", []) for path in paths if _base(path) not in _NOT_LESSONS]
        if folder and inside:
            yield _Entry("", name_of(folder), inside)
        else:
            yield from inside


def _base(path: str) -> str:
    return posixpath.basename(path).split(".")[0].lower()


def _lesson(entry: _Entry) -> SourceLesson:
    return SourceLesson(id="", path=entry.file, title=entry.title)


def _flat(entries: Iterable[_Entry]) -> Iterator[_Entry]:
    for entry in entries:
        if entry.file:
            yield entry
        yield from _flat(entry.inside)


def _levels(entries: Iterable[_Entry], title: str) -> Iterator[SourceLevel]:
    """A level for each part; lessons that stand in none are one as well."""
    number = itertools.count(1)
    for grouped, run in itertools.groupby(entries, lambda entry: bool(entry.inside)):
        if grouped:
            for entry in run:
                lessons = tuple(_lesson(one) for one in _flat([entry]))
                words = entry.title or name_of(entry.file)
                yield SourceLevel(id=str(next(number)), title=words, lessons=lessons)
        else:
            lessons = tuple(_lesson(entry) for entry in run)
            yield SourceLevel(id=str(next(number)), title=title or "Lessons", lessons=lessons)
