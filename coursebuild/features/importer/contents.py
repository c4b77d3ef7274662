"""The map of a course as its tool has it: its order, its parts, and the titles that it gives.

It is `_toc.yml` of Jupyter Book, `myst.yml` of MyST, `_quarto.yml` of Quarto, `mkdocs.yml` of
MkDocs, `SUMMARY.md` of mdBook and GitBook, or the sidebars of Docusaurus; without one the files, in
the order of their names, a folder for a level.
"""

from __future__ import annotations

import itertools
import posixpath
import re
from collections.abc import Iterator, Mapping, Sequence
from fnmatch import fnmatchcase
from typing import Any

from coursebuild.api import UsageError
from coursebuild.features.importer.bookdown import read_book
from coursebuild.features.importer.displays import find_macros, read_macros
from coursebuild.features.importer.outlines import (
    Outline,
    find_text,
    flatten,
    group,
    leave_entry,
    leave_setting,
    make_level,
    read_folder,
    read_nav,
    read_outline,
)
from coursebuild.features.importer.segments import read_front_matter
from coursebuild.features.importer.source_files import (
    PAIR,
    TEXTS,
    ImportedCourse,
    ImportedLevel,
    ImportedText,
    SourceFiles,
    read_yaml,
    stem_of,
    title_of_file,
    value_at,
)

_NOT_LESSONS = ("readme", "license", "licence", "changelog", "contributing", "code_of_conduct")
_PAGES = ("index", "intro", "introduction", "about")
_TITLE_PATHS = ((), ("project",), ("book",), ("website",))
"""Keys below which settings have the title of the course."""
_LIST_KEYS = "parts chapters sections subtrees children toc contents entries".split()
_FILE_KEYS = ("file", "href", "part")
_TITLE_KEYS = ("caption", "title", "section", "text", "part")
_COURSE_KEYS = {"toc", "root", "site-url", "author", "authors", "version"}
"""Keys that only the whole course has: a title next to them is not the title of a level."""


def read_contents(files: SourceFiles) -> ImportedCourse:
    """Read the course in a folder of notebooks or Markdown, or that of a single text.

    Raises:
        UsageError: there is nothing to import.
    """
    names = ("myst.yml", "_quarto.yml", "_config.yml", "mkdocs.yml")
    settings = [_read_settings(name, files) for name in names]
    settings[-1] = settings[-1] or files.settings("zensical.toml").get("project", {})
    myst, quarto, _, mkdocs = settings

    def find_setting(*keys: str) -> str:
        places = (
            (mapping, path, key) for mapping in settings for path in _TITLE_PATHS for key in keys
        )
        texts = (value_at(mapping, *path, key) for mapping, path, key in places)
        return next((" ".join(text.split()) for text in texts if isinstance(text, str)), "")

    title = find_setting("title", "site_name")
    if not title and "_bookdown.yml" in files and "index.Rmd" in files:
        front_matter, _ = read_front_matter(files.read_text("index.Rmd"))
        title = str(front_matter.get("title") or "")
    maps = [
        _read_settings("_toc.yml", files),
        value_at(myst, "project"),
        value_at(quarto, "book", "chapters"),
        value_at(quarto, "website", "sidebar"),
        value_at(quarto, "book", "appendices"),
    ]
    parts = [*_read_parts(maps, files), *read_book(files)]
    if files.mkdocs:
        folder = posixpath.normpath(str(value_at(mkdocs, "docs_dir") or "docs"))
        nav = value_at(mkdocs, "nav")
        parts += read_nav(nav, folder, files, "mkdocs.yml") if nav else read_folder(folder, files)
    own_outline = None if parts else read_outline(files)
    outline = own_outline or Outline(title="", parts=tuple(parts))
    title, parts = outline.title or title, [*outline.parts]
    parts = parts or [*_group_by_folder(files)]
    if not parts:
        left = [f"{left.path}: {left.message}" for left in files.account.leftovers[:3]]
        message = "there is nothing to import: no course.json, no notebook and no Markdown file"
        raise UsageError(message, help="; ".join(left))
    for name, mapping in zip(names, settings, strict=True):
        for key in _lost_keys(mapping):
            leave_setting(name, key, value_at(mapping, *key.split(".")), files)
    texts = [] if files.is_single else [part for part in parts if isinstance(part, ImportedText)]
    pages = [text for text in texts if _base_name(text.file) in _PAGES]
    if len(pages) == len(parts):  # a course has a lesson
        pages = []
    if own_outline:
        pages = [*outline.pages]
    # A level for each group, and one for each run of lessons outside groups
    levels: list[ImportedLevel] = []
    for kind, run in itertools.groupby((part for part in parts if part not in pages), type):
        if kind is ImportedText:
            levels.append(ImportedLevel(title=title or "Lessons", lessons=tuple(flatten(run))))
        else:
            levels += (part for part in run if isinstance(part, ImportedLevel))
    return ImportedCourse(
        title=title or title_of_file(files.name),
        summary=outline.summary or find_setting("description", "site_description", "subtitle"),
        language=outline.language,
        has_own_titles=True,
        substitutions=_read_substitutions(settings, files),
        macros="".join([*map(read_macros, settings), *_read_programs(mkdocs, files)]),
        levels=tuple(levels),
        pages=tuple(pages),
    )


def _read_programs(mkdocs: Mapping[str, Any], files: SourceFiles) -> Iterator[str]:
    """Yield the definitions of macros in programs: settings, and scripts that MkDocs loads."""
    scripts = value_at(mkdocs, "extra_javascript")
    names = [name for name in scripts if isinstance(name, str)] if isinstance(scripts, list) else []
    folder = str(value_at(mkdocs, "docs_dir") or "docs")
    paths = (files.find(posixpath.normpath(f"{folder}/{name}")) for name in names)
    for path in ("conf.py", files.docusaurus, *paths):
        if path and path in files:
            yield find_macros(files.read_text(path))


def _read_substitutions(
    settings: Sequence[Mapping[str, Any]], files: SourceFiles
) -> Mapping[str, str]:
    """Return what names between braces stand for, as the settings of MyST, Quarto, MkDocs say."""
    places = (("parse", "myst_substitutions"), ("extra",), ("project", "substitutions"), ("book",))
    values = [value_at(mapping, *path) for mapping in settings for path in places]
    values.append({"config": settings[-1]})  # as macros of MkDocs call its settings
    values.append(files.settings("_variables.yml"))
    if (name := "conf.py") in files:
        text = re.search(r"(?ms)^myst_substitutions\s*=\s*(\{.*?\})$", files.read_text(name))
        values.append(read_yaml(text[1]) if text else None)  # a literal is a value of YAML
    return {key: value for mapping in values for key, value in _named_values(mapping)}


def _named_values(value: object, name: str = "") -> Iterator[tuple[str, str]]:
    """Yield what stands below names, of which inner ones follow a dot."""
    if isinstance(value, Mapping):
        for key, inner in value.items():
            yield from _named_values(inner, f"{name}.{key}".lstrip("."))
    elif name and isinstance(value, str | int | float):
        yield name, str(value)


def _read_settings(name: str, files: SourceFiles) -> Mapping[str, Any]:
    path = files.find_settings(name)
    if not path:
        return {}
    value = read_yaml(files.read_text(path))
    files.change("map", "content/course.toml")
    if value is None:
        raise UsageError(f"{path} is not YAML, or too large")
    names = value_at(value, "metadata-files")
    for further in names if isinstance(names, list) else ():
        value = _join(value, files.settings(str(further)))
    return value if isinstance(value, dict) else {"chapters": value}


def _join(first: Any, second: Any) -> Any:
    """Return settings of two files as Quarto does: a list goes on, another value stays."""
    if isinstance(first, dict) and isinstance(second, dict):
        return {**second, **{key: _join(value, second.get(key)) for key, value in first.items()}}
    return first + second if isinstance(first, list) and isinstance(second, list) else first


_SETTINGS = frozenset(
    "appendices bibliography bibtex_bibfiles chapters description docs_dir math metadata-files nav "
    "root sidebar site_description site_name subtitle title toc".split()
)
"""Keys of settings that are read."""


def _lost_keys(settings: Mapping[str, Any]) -> Iterator[str]:
    for key, value in settings.items():
        if key in ("project", "book", "website") and isinstance(value, Mapping):
            yield from (f"{key}.{inner}" for inner in _lost_keys(value))
        elif key not in _SETTINGS:
            yield key


def _read_parts(value: object, files: SourceFiles) -> Iterator[ImportedText | ImportedLevel]:
    if isinstance(value, str):
        if path := find_text(value, files):
            yield ImportedText(file=path)
        elif "*" not in value and value != "auto":
            leave_entry("the map", value, files)
    elif isinstance(value, list):
        for item in value:
            yield from _read_parts(item, files)
    elif isinstance(value, Mapping):
        yield from _read_parts(value.get("root"), files)
        inside = [part for key in _LIST_KEYS for part in _read_parts(value.get(key), files)]
        path = next((path for key in _FILE_KEYS if (path := find_text(value.get(key), files))), "")
        label = next((str(value[key]) for key in _TITLE_KEYS if value.get(key)), "")
        title = "" if find_text(label, files) else label
        if url := value.get("url"):
            leave_entry("the map", f"{title}: {url}", files)
        if pattern := value.get("pattern"):
            names = (name for name in files if fnmatchcase(name, str(pattern)))
            inside += [ImportedText(file=name) for name in names if name.endswith(TEXTS)]
        heads = [ImportedText(file=path, title=title)] if path else []
        if inside and (path or (title and not _COURSE_KEYS & value.keys())):
            title = title or title_of_file(path)
            yield from make_level(title, (*heads, *inside), "the map", files)
        else:
            yield from (*heads, *inside)


def _group_by_folder(files: SourceFiles) -> Iterator[ImportedText | ImportedLevel]:
    def natural_order(path: str) -> list[int | str]:  # every second is a number
        return [int(p) if p.isdecimal() else p.lower() for p in re.split(r"(\d+)", path)]

    def is_pair(path: str) -> bool:
        """Whether a text is a notebook once more, as Jupytext has it."""
        if path.endswith(".ipynb") or f"{stem_of(path)}.ipynb" not in files:
            return False
        metadata, _ = read_front_matter(files.read_text(path))
        is_same = "jupytext" in metadata or value_at(metadata, "jupyter", "jupytext") is not None
        if is_same:
            files.leave(path, PAIR, "text")
        return is_same

    texts = sorted((path for path in files if path.endswith(TEXTS)), key=natural_order)
    texts = [path for path in texts if not is_pair(path)]
    for folder, paths in itertools.groupby(texts, posixpath.dirname):
        lessons = [
            ImportedText(file=path)
            for path in paths
            if files.is_single or _base_name(path) not in _NOT_LESSONS
        ]
        yield from group(folder and title_of_file(folder), lessons)


def _base_name(path: str) -> str:
    return posixpath.basename(path).split(".")[0].lower()
