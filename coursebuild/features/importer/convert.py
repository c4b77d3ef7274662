"""The course of another tool → the files of one of coursebuild.

The map of a course without a `course.json` is the table of contents of its tool: `_toc.yml` of
Jupyter Book, `myst.yml` of MyST, `_quarto.yml` of Quarto, `mkdocs.yml` of MkDocs; without one the
files, in the order of their names, a folder for a level.
"""

from __future__ import annotations

import contextlib
import itertools
import os
import posixpath
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.api import EffectError, Store, UsageError
from coursebuild.core.files.errors import reason
from coursebuild.core.files.read import read_bytes
from coursebuild.core.files.write import FileChange, change_files
from coursebuild.core.model.course import CALLOUTS
from coursebuild.core.pages.marks import fence
from coursebuild.core.values import fingerprint
from coursebuild.features.importer.blocks import (
    code_for_readers,
    convert_segment,
    how_shown,
    recorded_output,
    runnable_code,
)
from coursebuild.features.importer.course_map import map_lines, read_course_json, read_texts
from coursebuild.features.importer.jsx import is_mdx
from coursebuild.features.importer.prose import LessonContext, find_anchors, to_anchor
from coursebuild.features.importer.references import complete_texts
from coursebuild.features.importer.source_files import (
    TEXTS,
    ImportedCourse,
    ImportedLevel,
    ImportedText,
    Leftover,
    SourceFiles,
    read_yaml,
    stem_of,
    title_of_file,
)

TRIED = "tried-lessons"
"""The kind of entries that say: a lesson as it was converted became this when it was tried."""
_GITIGNORE = b"public/\nexamples/\n.coursebuild/\n"


class ConvertedCourse(Struct, frozen=True):
    """The files of the new course, by path, and what has no counterpart in it."""

    files: Mapping[str, bytes]
    leftovers: tuple[Leftover, ...]
    notebook_outputs: Mapping[str, str]
    """The texts, by the path of the script, whose recorded outputs stand below it."""


def convert(files: SourceFiles) -> ConvertedCourse:
    """Read a course of another tool; nothing is written.

    Raises:
        UsageError: there is nothing to import, or a file cannot be read.
    """
    maps = [path for path in files if posixpath.basename(path) == "course.json"]
    map_path = min(maps, key=lambda path: (path.count("/"), path), default=None)
    if map_path is None:
        course = read_contents(files)
    else:
        course = read_course_json(map_path, files)
    course = read_texts(course, files)
    lessons = [lesson for level in course.levels for lesson in level.lessons]
    texts = (*lessons, *course.pages)
    ids = {lesson.slug: lesson.id for lesson in lessons}
    ids |= {lesson.id: lesson.id for lesson in lessons}
    ids |= {lesson.old_id: lesson.id for lesson in lessons if lesson.old_id}
    out, context = _convert_texts(course, texts, ids, files)
    leftovers = context.leftovers
    if map_path is not None:
        leftovers += [
            Leftover(map_path, "", f"the prerequisite {name} of {text.id}, which is not a lesson")
            for text in texts
            for name in text.prerequisites
            if name not in ids
        ]
    packages = dict(_own_packages(files, texts))
    unused = {*files} - files.read_paths
    # Models, and what lies beside them, by their new path.
    models: dict[str, str] = {}
    for path in files:
        folders = posixpath.dirname(path).split("/")
        if "models" in folders:
            inner_folders = folders[folders.index("models") + 1 :]
            models["/".join(("models", *inner_folders, posixpath.basename(path)))] = path
        elif path.endswith(".xml") and b"<mujoco" in files.read(path):
            models[f"models/{posixpath.basename(path)}"] = path
    unused -= {*models.values()}
    out |= packages | {path: files.read(source) for path, source in models.items()}
    lines = map_lines(course, ids, context.callouts, ("src",) if packages else ())
    out["content/course.toml"] = _encode("".join(f"{line}\n" for line in lines))
    out[".gitignore"] = _GITIGNORE
    leftovers = [*sorted(files.leftovers), *course.leftovers, *leftovers]
    leftovers += _describe_unused(files, (path for path in files if path in unused))
    return ConvertedCourse(dict(sorted(out.items())), tuple(leftovers), context.notebook_outputs)


def write_course(course: ConvertedCourse, target: Path, files: SourceFiles, store: Store) -> None:
    """Write all files of a new course, or none.

    Those that an import of the same course wrote before, and nobody has edited since, are made what
    they were at first: an import that was killed is said again, and begins anew.

    Raises:
        UsageError: the folder is the one that is imported, or in it, or has one of the files.
        EffectError: a file cannot be written.
    """
    if target.is_relative_to(files.folder) and not files.is_single:
        raise UsageError(f"{target} is in the folder that is imported, which is only read")
    changes = []
    for path, data in course.files.items():
        old = None
        if os.path.lexists(target / path):
            with contextlib.suppress(EffectError):  # which leaves `None`: it is no file of ours
                old = read_bytes(target, path)
            trial = fingerprint((path, data, old))
            if old != data and (old is None or store.peek(TRIED, trial, bytes) is None):
                raise UsageError(f"{target} already has {path}; name an empty folder with --out")
        if old != data:
            changes.append(FileChange(path, old, data))
    try:
        target.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise EffectError(f"{target} cannot be created: {reason(error)}") from None
    change_files(target, changes)


def change_tried_lessons(target: Path, changes: Sequence[FileChange], store: Store) -> None:
    """Change lessons to what trying their scripts has shown, so that `write_course` knows them."""
    for change in changes:
        store.put(TRIED, fingerprint((change.path, change.old, change.new)), b"")
    change_files(target, changes)


def _encode(text: str) -> bytes:
    """Return UTF-8; JSON may name characters that there are none of, half of a pair."""
    return text.encode("utf-8", "replace")


def _convert_texts(
    course: ImportedCourse,
    texts: Sequence[ImportedText],
    ids: Mapping[str, str],
    files: SourceFiles,
) -> tuple[dict[str, bytes], LessonContext]:
    targets = {stem_of(text.file): text.link for text in texts if text.file}
    texts = [text for text in texts if text.path]
    context = LessonContext(
        targets=targets,
        ids=ids,
        labels={
            anchor: text.link
            for text in reversed(texts)
            for segment in text.segments
            for anchor in find_anchors(segment.text)
        },
        files=files,
        camera_is_position=course.camera_is_position,
    )
    new = {}
    for text in texts:
        try:
            new[text.link] = text.title, _convert_text(text, context)
        except RecursionError:
            raise UsageError(f"{text.file} is nested too deeply") from None
    files_of = {text.link: text.file for text in texts}

    def resolve_label(link: str, anchor: str) -> str:
        text_context = replace(context, path=files_of[link])
        address = text_context.resolve_anchor(to_anchor(anchor))
        if not address:
            text_context.add_leftover(f"a link to `#{anchor}`, which no text sets")
        return address

    callouts = frozenset((*CALLOUTS, *context.callouts))
    completed = complete_texts(new, resolve_label, callouts)
    out = {text.path: _encode(new_text) for text, new_text in zip(texts, completed, strict=True)}
    return {**out, **context.copies}, context


def _convert_text(text: ImportedText, course_context: LessonContext) -> str:
    """Return a lesson or page in Markdown of coursebuild, with its cells as parts of one script."""
    folder = posixpath.dirname(text.path)
    context = replace(course_context, path=text.file, folder=folder, pictures=text.pictures)
    prose = (segment.text for segment in text.segments if segment.kind == "prose")
    context = replace(context, is_mdx=text.file.endswith(".mdx") or any(map(is_mdx, prose)))
    words = re.findall("[a-z0-9]+", f"{text.id}-{text.slug}".lower())
    script_path = f"examples/{'' if words and words[0].isalpha() else 'l'}{'_'.join(words)}.py"
    head = f"python file={script_path}"
    parts: list[str] = []
    for segment in text.segments:
        if segment.kind != "cell":
            parts.append(convert_segment(segment, context))
        elif code := runnable_code(segment, context):
            parts.append(fence(head + how_shown(segment), code))
            head = f"python file={script_path} part"
            if output := recorded_output(segment, code):
                parts.append(fence("output", output))
                context.notebook_outputs[script_path] = text.file
        elif (magic := re.match(r"\s*%%(\w+).*\n", segment.text)) is not None:
            parts.append(fence(magic[1], segment.text[magic.end() :].strip("\n")))
        elif shown_code := code_for_readers(segment):
            parts.append(fence("python", shown_code))
    return "\n\n".join(part.strip("\n") for part in parts if part.strip()) + "\n"


def _own_packages(files: SourceFiles, texts: Sequence[ImportedText]) -> Iterator[tuple[str, bytes]]:
    """Yield the files of the course's own packages that its lessons import, below `src`."""
    code = "\n".join(segment.text for text in texts for segment in text.segments)
    imported = set(re.findall(r"^[ \t]*(?:from|import)[ \t]+(\w+)", code, re.MULTILINE))
    roots = [posixpath.dirname(path) for path in files if path.endswith("/__init__.py")]
    for root in roots:
        name = posixpath.basename(root)
        if name in imported and posixpath.dirname(root) not in roots:
            for path in files:
                if path.startswith(f"{root}/"):
                    yield f"src/{name}/{path.removeprefix(f'{root}/')}", files.read(path)


_OTHER_TEXTS = tuple(".adoc .docx .htm .html .markdown .org .pdf .rmd .rst .tex .txt".split())
_MOST_NAMES = 20


def _describe_unused(files: SourceFiles, paths: Iterable[str]) -> Iterator[Leftover]:
    """Yield what is said of files that are in no file of the new course."""
    groups: dict[str, list[str]] = {}
    for path in paths:
        message = "used by no text"
        if path.endswith(TEXTS):
            message = "not taken for a lesson"
        elif path.lower().endswith(_OTHER_TEXTS):
            message = "a kind of text that is not read"
        elif path.endswith(".py") and re.search(rb"(?m)^# ?%%", files.read(path)):
            message = "a script of cells, which `jupytext --to ipynb` makes a notebook of"
        groups.setdefault(message, []).append(path)
    for message, names in groups.items():
        rest = f" and {len(names) - _MOST_NAMES} more" if len(names) > _MOST_NAMES else ""
        yield Leftover(", ".join(names[:_MOST_NAMES]) + rest, "", message)


_NOT_LESSONS = ("readme", "license", "licence", "changelog", "contributing", "code_of_conduct")
_PAGES = ("index", "intro", "introduction", "about")
_TITLE_PATHS = ((), ("project",), ("book",), ("website",))
"""Keys below which settings have the title of the course."""
_LIST_KEYS = ("parts", "chapters", "sections", "children", "toc", "contents", "entries")
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
    myst, quarto, _, mkdocs = settings = [_read_settings(name, files) for name in names]
    titles = [_get(mapping, *path, "title") for mapping in settings for path in _TITLE_PATHS]
    titles.append(_get(mkdocs, "site_name"))
    title = next((" ".join(text.split()) for text in titles if isinstance(text, str)), "")
    parts = [
        *_read_parts(_read_settings("_toc.yml", files), files),
        *_read_parts(_get(myst, "project"), files),
        *_read_parts(_get(quarto, "book", "chapters"), files),
        *_read_parts(_get(quarto, "website", "sidebar"), files),
        *_read_nav(_get(mkdocs, "nav"), str(_get(mkdocs, "docs_dir") or "docs"), files),
    ] or [*_group_by_folder(files)]
    if not parts:
        left = [f"{leftover.path}: {leftover.message}" for leftover in sorted(files.leftovers)[:3]]
        message = "there is nothing to import: no course.json, no notebook and no Markdown file"
        raise UsageError(message, help="; ".join(left))
    for name, mapping in zip(names, settings, strict=True):
        if lost := ", ".join(f"`{key}`" for key in _lost_keys(mapping)):
            files.leave(name, f"settings without a counterpart: {lost}")
    texts = [] if files.is_single else [part for part in parts if isinstance(part, ImportedText)]
    pages = [text for text in texts if _base_name(text.file) in _PAGES]
    # A level for each group, and one for each run of lessons outside groups
    levels: list[ImportedLevel] = []
    for kind, run in itertools.groupby((part for part in parts if part not in pages), type):
        if kind is ImportedText:
            levels.append(ImportedLevel(title=title or "Lessons", lessons=tuple(_flatten(run))))
        else:
            levels += (part for part in run if isinstance(part, ImportedLevel))
    return ImportedCourse(
        title=title or title_of_file(files.name), levels=tuple(levels), pages=tuple(pages)
    )


def _read_settings(name: str, files: SourceFiles) -> Mapping[str, Any]:
    path = next((path for path in (name, name.replace(".yml", ".yaml")) if path in files), None)
    if path is None:
        return {}
    value = read_yaml(files.read_text(path))
    if value is None:
        raise UsageError(f"{path} is not YAML, or too large")
    return value if isinstance(value, dict) else {"chapters": value}


_SETTINGS = ("title", "site_name", "nav", "docs_dir", "toc", "chapters", "sidebar", "root")
"""Keys of settings that are read."""


def _lost_keys(settings: Mapping[str, Any]) -> Iterator[str]:
    for key, value in settings.items():
        if key in ("project", "book", "website") and isinstance(value, Mapping):
            yield from (f"{key}.{inner}" for inner in _lost_keys(value))
        elif key not in _SETTINGS:
            yield key


def _get(settings: object, *path: str) -> object:
    """Return the value at a path of nested keys; `None` where there is none."""
    for key in path:
        settings = settings.get(key) if isinstance(settings, Mapping) else None
    return settings


def _read_parts(value: object, files: SourceFiles) -> Iterator[ImportedText | ImportedLevel]:
    if isinstance(value, str):
        if path := _find_text(value, files):
            yield ImportedText(file=path)
    elif isinstance(value, list):
        for item in value:
            yield from _read_parts(item, files)
    elif isinstance(value, Mapping):
        yield from _read_parts(value.get("root"), files)
        inside = [part for key in _LIST_KEYS for part in _read_parts(value.get(key), files)]
        path = next((path for key in _FILE_KEYS if (path := _find_text(value.get(key), files))), "")
        label = next((str(value[key]) for key in _TITLE_KEYS if value.get(key)), "")
        title = "" if _find_text(label, files) else label
        heads = [ImportedText(file=path, title=title)] if path else []
        if inside and (path or (title and not _COURSE_KEYS & value.keys())):
            lessons = tuple(_flatten([*heads, *inside]))
            yield ImportedLevel(title=title or title_of_file(path), lessons=lessons)
        else:
            yield from (*heads, *inside)


def _flatten(parts: Iterable[ImportedText | ImportedLevel]) -> Iterator[ImportedText]:
    for part in parts:
        yield from (part,) if isinstance(part, ImportedText) else part.lessons


def _read_nav(
    entries: object, folder: str, files: SourceFiles
) -> Iterator[ImportedText | ImportedLevel]:
    """Yield the entries of MkDocs' `nav`: a file, or a title with a file or further entries."""
    for entry in entries if isinstance(entries, list) else ():
        for title, value in entry.items() if isinstance(entry, Mapping) else [("", entry)]:
            if isinstance(value, list):
                if inside := tuple(_flatten(_read_nav(value, folder, files))):
                    yield ImportedLevel(title=str(title), lessons=inside)
            elif path := _find_text(posixpath.join(folder, str(value)), files):
                yield ImportedText(file=path, title=str(title))


def _find_text(name: object, files: SourceFiles) -> str:
    """Return a text's path, given with or without its extension; empty where there is none."""
    if not isinstance(name, str) or not name:
        return ""
    name = posixpath.normpath(name)
    if path := files.find(name):
        return path if path.endswith(TEXTS) else ""
    return next((path for end in TEXTS if (path := files.find(name + end))), "")


def _group_by_folder(files: SourceFiles) -> Iterator[ImportedText | ImportedLevel]:
    def natural_order(path: str) -> list[tuple[int, int | str]]:
        parts = re.split(r"(\d+)", path)
        return [(0, int(part)) if part.isdigit() else (1, part.lower()) for part in parts if part]

    texts = sorted((path for path in files if path.endswith(TEXTS)), key=natural_order)
    for folder, paths in itertools.groupby(texts, posixpath.dirname):
        lessons = [
            ImportedText(file=path)
            for path in paths
            if files.is_single or _base_name(path) not in _NOT_LESSONS
        ]
        if folder and lessons:
            yield ImportedLevel(title=title_of_file(folder), lessons=tuple(lessons))
        else:
            yield from lessons


def _base_name(path: str) -> str:
    return posixpath.basename(path).split(".")[0].lower()
