"""The map of a course without a `course.json`: the table of contents of its tool, or its files.

Entry point: `read_contents`. Read are `_toc.yml` of Jupyter Book, `myst.yml` of MyST, `_quarto.yml`
of Quarto, `mkdocs.yml` of MkDocs; without a table of contents the files, in the order of their
names, a folder for a level.
"""

from __future__ import annotations

import itertools
import posixpath
import re
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from coursebuild.core.files.errors import UsageError
from coursebuild.features.importer.values import (
    TEXTS,
    Files,
    ImportedCourse,
    ImportedLevel,
    ImportedText,
    name_of,
    read_text,
    read_yaml,
)

_NOT_LESSONS = ("readme", "license", "licence", "changelog", "contributing", "code_of_conduct")
_FIRST = ("index", "intro", "introduction", "about")
_TITLED = ((), ("project",), ("book",), ("website",))
"""Where settings have the title of the course."""
_LISTS = ("parts", "chapters", "sections", "children", "toc", "contents", "entries")
_FILES = ("file", "href", "part")
_TITLES = ("caption", "title", "section", "text", "part")
_TOP = {"toc", "root", "site-url", "author", "authors", "version"}
"""What only the whole course has, whose title is no level's."""


def read_contents(files: Files, folder: str) -> ImportedCourse:
    """The course in a folder of notebooks or Markdown, of this name.

    Raises:
        UsageError: there is nothing to import.
    """
    names = ("myst.yml", "_quarto.yml", "_config.yml", "mkdocs.yml")
    myst, quarto, _, mkdocs = settings = [_settings(name, files) for name in names]
    titles = [_at(one, *path, "title") for one in settings for path in _TITLED]
    titles.append(_at(mkdocs, "site_name"))
    title = next((" ".join(one.split()) for one in titles if isinstance(one, str)), "")
    found = [
        *_parts(_settings("_toc.yml", files), files),
        *_parts(_at(myst, "project"), files),
        *_parts(_at(quarto, "book", "chapters"), files),
        *_parts(_at(quarto, "website", "sidebar"), files),
        *_nav(_at(mkdocs, "nav"), str(_at(mkdocs, "docs_dir") or "docs"), files),
    ] or [*_by_folder(files)]
    if not found:
        raise UsageError(
            "there is nothing to import: no course.json, no notebook and no Markdown file"
        )
    pages = [one for one in found if isinstance(one, ImportedText) and _base(one.file) in _FIRST]
    parts = [one for one in found if one not in pages]
    return ImportedCourse(
        title=title or name_of(folder), levels=tuple(_levels(parts, title)), pages=tuple(pages)
    )


def _settings(name: str, files: Files) -> Mapping[str, Any]:
    path = next((path for path in (name, name.replace(".yml", ".yaml")) if path in files), None)
    if path is None:
        return {}
    value = read_yaml(read_text(files[path], path))
    if value is None:
        raise UsageError(f"{path} is no YAML")
    return value if isinstance(value, dict) else {"chapters": value}


def _at(settings: object, *path: str) -> object:
    """What stands under a key of what stands under another; `None` where nothing does."""
    for key in path:
        settings = settings.get(key) if isinstance(settings, Mapping) else None
    return settings


def _parts(value: object, files: Files) -> Iterator[ImportedText | ImportedLevel]:
    """The lessons and groups of lessons of a table of contents, whichever tool's."""
    if isinstance(value, str):
        if path := _file(value, files):
            yield ImportedText(file=path)
    elif isinstance(value, list):
        for item in value:
            yield from _parts(item, files)
    elif isinstance(value, Mapping):
        yield from _parts(value.get("root"), files)
        inside = [part for key in _LISTS for part in _parts(value.get(key), files)]
        path = next((path for key in _FILES if (path := _file(value.get(key), files))), "")
        titled = next((str(value[key]) for key in _TITLES if value.get(key)), "")
        title = "" if _file(titled, files) else titled
        own = [ImportedText(file=path, title=title)] if path else []
        if inside and (path or (title and not _TOP & value.keys())):
            lessons = tuple(_lessons([*own, *inside]))
            yield ImportedLevel(title=title or name_of(path), lessons=lessons)
        else:
            yield from (*own, *inside)


def _lessons(parts: Iterable[ImportedText | ImportedLevel]) -> Iterator[ImportedText]:
    for part in parts:
        yield from (part,) if isinstance(part, ImportedText) else part.lessons


def _nav(lines: object, folder: str, files: Files) -> Iterator[ImportedText | ImportedLevel]:
    """The lines of MkDocs' `nav`: a file, or a title with a file or with further lines."""
    for line in lines if isinstance(lines, list) else ():
        for title, value in line.items() if isinstance(line, Mapping) else [("", line)]:
            if isinstance(value, list):
                if inside := tuple(_lessons(_nav(value, folder, files))):
                    yield ImportedLevel(title=str(title), lessons=inside)
            elif path := _file(posixpath.join(folder, str(value)), files):
                yield ImportedText(file=path, title=str(title))


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


def _by_folder(files: Files) -> Iterator[ImportedText | ImportedLevel]:
    texts = sorted((path for path in files if path.endswith(TEXTS)), key=_natural)
    for folder, paths in itertools.groupby(texts, posixpath.dirname):
        lessons = [ImportedText(file=path) for path in paths if _base(path) not in _NOT_LESSONS]
        if folder and lessons:
            yield ImportedLevel(title=name_of(folder), lessons=tuple(lessons))
        else:
            yield from lessons


def _base(path: str) -> str:
    return posixpath.basename(path).split(".")[0].lower()


def _levels(parts: Iterable[ImportedText | ImportedLevel], title: str) -> Iterator[ImportedLevel]:
    """A level for each group; lessons that stand in none are one as well."""
    for kind, run in itertools.groupby(parts, type):
        if kind is ImportedText:
            yield ImportedLevel(title=title or "Lessons", lessons=tuple(_lessons(run)))
        else:
            yield from (part for part in run if isinstance(part, ImportedLevel))
