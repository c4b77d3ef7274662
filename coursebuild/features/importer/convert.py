"""The course of another tool → the files of one of coursebuild."""

from __future__ import annotations

import contextlib
import os
import posixpath
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence, Set
from pathlib import Path

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.api import EffectError, Store, UsageError, model, regex
from coursebuild.core.files.errors import reason
from coursebuild.core.files.read import read_bytes
from coursebuild.core.files.write import FileChange, change_files
from coursebuild.core.run.mjcf import existing_files
from coursebuild.core.values import fingerprint
from coursebuild.features.importer.absent_labs import lab_files
from coursebuild.features.importer.account import Account
from coursebuild.features.importer.anchors import find_anchors
from coursebuild.features.importer.blocks import convert_segment
from coursebuild.features.importer.cells import print_values
from coursebuild.features.importer.contents import read_contents
from coursebuild.features.importer.context import (
    LessonContext,
    script_path_of,
    to_anchor,
    without_order,
)
from coursebuild.features.importer.course_map import map_lines, read_course_json, read_texts
from coursebuild.features.importer.jsx import is_mdx
from coursebuild.features.importer.lost_words import find_lost_words
from coursebuild.features.importer.other_cells import languages_of_single_cells, write_joined_cells
from coursebuild.features.importer.references import complete_texts
from coursebuild.features.importer.roles import address_of_label
from coursebuild.features.importer.source_files import (
    PAIR,
    TEXTS,
    ImportedCourse,
    ImportedText,
    SourceFiles,
    stem_of,
)

TRIED = "tried-lessons"
"""The kind of entries that say of what proving made of a file: what it was made from at first."""
_LOST_WORDS = """
## Words that are nowhere in the new course

Names by which the other tool is told how a page looks are of no use here. Is there anything else?

"""
_GITIGNORE = b"public/\nexamples/\n.coursebuild/\n"


class ConvertedCourse(Struct, frozen=True):
    """The files of the new course, by path, and what has no counterpart in it."""

    files: Mapping[str, bytes]
    account: Account
    notebook_outputs: Sequence[tuple[str, str]]
    """The outputs that are recorded in notebooks, each with the path of its script."""


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
    models = _find_models(files)
    out, context = _convert_texts(course, texts, ids, models, files)
    course = _plan_empty_lessons(course, out, files)
    if map_path is not None:
        for text in texts:
            for name in text.prerequisites:
                if name not in ids:
                    message = f"the prerequisite {name} of {text.id}, which is not a lesson"
                    files.leave(map_path, message, "prerequisite")
    packages = dict(_own_packages(files, texts))
    if context.cited:
        out[model.BIBLIOGRAPHY] = _encode(_cited_works(files, context.cited))
    unused = {*files} - files.read_paths - {*models}
    out |= packages | {path: files.read(source) for source, path in models.items()}
    texts_and_models = (data for path, data in out.items() if path.endswith((".md", ".xml")))
    longest = max(map(len, texts_and_models), default=0)
    out |= {path: _encode(text) for path, text in lab_files(context.labs)}
    lines = map_lines(course, ids, context, ("src",) if packages else (), longest)
    out["content/course.toml"] = _encode("".join(f"{line}\n" for line in lines))
    out[".gitignore"] = _GITIGNORE
    copies = {"model": models, "file of the scripts": packages, "file": context.copies}
    for kind, paths in copies.items():
        files.account.taken[kind] += len(paths)
    _leave_unused(files, (path for path in files if path in unused))
    account = files.account.text(files.name)
    if lost := [*find_lost_words(files, out, account)]:
        account += _LOST_WORDS + "".join(f"{line}\n" for line in lost)
    out["IMPORT.md"] = _encode(account)
    return ConvertedCourse(dict(sorted(out.items())), files.account, context.notebook_outputs)


_READABLE = regex(r"^(?![ ]{0,3}#{1,6}[ \t])[^\n]*\S", re.MULTILINE)
"""A line that is no heading."""
_COMMENT = regex(r"<!--.*?-->", re.DOTALL)
_HEADING = regex(r"^[ ]{0,3}#{1,6}[ \t]+(\S.*?)[ \t]*(?:#+|\{[^{}\n]*\})?[ \t]*$", re.MULTILINE)


def _plan_empty_lessons(
    course: ImportedCourse, out: dict[str, bytes], files: SourceFiles
) -> ImportedCourse:
    """Return the course with lessons planned of whose texts nothing is left; their files go.

    Those of which only headings and comments are left are drafts.
    """

    def plan(text: ImportedText) -> ImportedText:
        if not text.path or _READABLE.search(_COMMENT.sub("", out[text.path].decode())):
            return text
        if out[text.path].strip():
            return replace(text, status="draft")
        del out[text.path]
        files.leave(text.file, "a text of which nothing is left: a lesson that is planned", "text")
        return replace(text, path="")

    levels = (replace(level, lessons=tuple(map(plan, level.lessons))) for level in course.levels)
    return replace(course, levels=tuple(levels))


_FRAGMENT = regex(
    r"<mujocoinclude\b|\A(?!.*<(?:worldbody|include)\b)"
    r".*<(?:actuator|contact|equality|keyframe|sensor|tendon)\b",
    re.DOTALL,
)
"""What is about bodies, and has none."""
_PART = regex(r"<(?:include|mesh|hfield|texture|skin)\s[^<>]*?\bfile\s*=\s*[\"']([^\"'<>]+)")


def _find_models(files: SourceFiles) -> Mapping[str, str]:
    """Return the new paths of models, and of the files that they are made of, by their paths."""
    models, texts, lacks = dict[str, str](), dict[str, str](), dict[str, str]()
    for path in files:
        if path.endswith(".xml") and b"<mujoco" in (data := files.read(path)):
            texts[path] = data.decode("utf-8", "replace")
    bodies = (path for path in files if path in texts or path.endswith(".urdf"))
    homes = {f"/{path}".partition("/models/")[0] for path in bodies}  # not those of other models
    for path in files:
        home, mark, name = f"/{path}".partition("/models/")
        if mark and home in homes:
            models[path] = f"models/{name}"
    parts = {
        path: [part for part in existing_files(files.folder, path, text) if part in files]
        for path, text in texts.items()
    }
    for path, names in parts.items():
        whole = _COMMENT.sub("", "".join(texts.get(name, "") for name in (path, *names)))
        part_names = {*map(posixpath.basename, names)}
        needs = (n for n in _PART.findall(whole) if posixpath.basename(n) not in part_names)
        if name := next(needs, ""):
            lacks[path] = name
    pieces = {part for path in lacks for part in parts.pop(path)}
    _place_models(parts, models)
    included = {part for names in parts.values() for part in names if part in texts}
    for path in texts:
        lack = lacks.get(path)
        if path in included:
            files.change("fragment of a model", "beside the models that include it")
        elif lack or path in pieces or _FRAGMENT.search(texts[path]):
            message = "a fragment of a model, which no whole one includes: it is compiled with none"
            if lack:
                message = f"a model that needs `{lack}`, which the folder does not hold"
            files.leave(path, message, "fragment of a model")
            models.pop(path, None)
    return models


def _place_models(parts: Mapping[str, Sequence[str]], models: dict[str, str]) -> None:
    """Give models and their parts new paths, which lie to each other as they did.

    They are below `models`; what needs a file of a folder of that name lies to it as it did.
    """
    rest, root = set[str](), "/"
    for path, names in (*parts.items(), *parts.items()):  # the second time for what shares parts
        whole = {path, *names}
        if home := min(whole & models.keys(), default=""):
            source, target = posixpath.dirname(f"/{home}"), posixpath.dirname(models[home])
            paths = {n: posixpath.join(target, posixpath.relpath(f"/{n}", source)) for n in whole}
            news = {name: posixpath.normpath(new) for name, new in paths.items()}
            models |= {n: new for n, new in news.items() if not new.startswith("../")}
        else:
            rest |= whole
    if rest and not models:  # else the names of folders keep them apart
        root = posixpath.commonpath([posixpath.dirname(f"/{name}") for name in rest])
    models |= {n: f"models/{posixpath.relpath(f'/{n}', root)}" for n in rest - models.keys()}


_BEGIN = r"(?:^|(?<=\}))[ \t]*@"
_WORK = regex(
    rf"{_BEGIN}(?!comment|preamble)(\w+)[ \t]*\{{[ \t]*([^,\s{{}}=]+).*?"
    rf"(?={_BEGIN}\w+[ \t]*\{{|\Z)",
    re.MULTILINE | re.DOTALL | re.IGNORECASE,
)


def _works(files: SourceFiles) -> Iterator[tuple[str, str]]:
    """Yield the keys of the BibTeX files, each with its entry; definitions have an empty key."""
    for path in files:
        if path.endswith(".bib"):
            text = files.read(path).decode("utf-8", "replace").replace("\r\n", "\n")
            for work in _WORK.finditer(text):
                yield "" if work[1].lower() == "string" else work[2], work[0].strip()


_AUTHOR = regex(r"\bauthor\s*=\s*(?:\{((?:[^{}]|\{[^{}]*\})*)\}|\"([^\"]*)\")", re.IGNORECASE)


def _authors(work: str) -> str:
    """Return the surnames of the authors of a work, as a sentence has them; empty for none."""
    authors = _AUTHOR.search(work)
    if authors is None or "\\" in authors[0]:  # accents of LaTeX
        return ""
    names = re.split(r"\s+and\s+", " ".join((authors[1] or authors[2] or "").split()))
    surnames = [
        n.partition(",")[0] if "," in n or "{" in n else n.rpartition(" ")[2] for n in names
    ]
    words = f"{surnames[0]} et al." if len(names) > 2 else " and ".join(surnames)
    return words.replace("{", "").replace("}", "")


def _cited_works(files: SourceFiles, cited: Set[str]) -> str:
    """Return the BibTeX of the sources that texts cite."""
    works, selection = [*_works(files)], dict[str, str]()
    for key, text in works:
        if key in cited or not key:
            selection.setdefault(key or text, text)
    uncited = {key for key, _ in works if key} - cited
    files.change("source", "left out: no text cites it", len(uncited))
    files.account.taken["source"] += len(cited)
    return "".join(f"{text}\n\n" for text in selection.values())


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
            is_ours = old is not None and _origin(path, old, store) == fingerprint((path, data))
            if old != data and not is_ours:
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
        origin = _origin(change.path, change.old or b"", store)
        store.put(TRIED, fingerprint((change.path, change.new)), origin.encode())
    change_files(target, changes)


def _origin(path: str, data: bytes, store: Store) -> str:
    """The fingerprint of what a file was before proving changed it; else that of what it is."""
    key = fingerprint((path, data))
    return store.peek(TRIED, key, bytes.decode) or key


def _encode(text: str) -> bytes:
    """Return UTF-8; JSON may name characters that there are none of, half of a pair."""
    return text.encode("utf-8", "replace")


def _convert_texts(
    course: ImportedCourse,
    texts: Sequence[ImportedText],
    ids: Mapping[str, str],
    models: Mapping[str, str],
    files: SourceFiles,
) -> tuple[dict[str, bytes], LessonContext]:
    routes = ((text.substitutions.get("slug", "").strip("/"), text.link) for text in texts)
    targets = {route: link for route, link in routes if route}
    stems = {stem_of(text.file): text.link for text in texts if text.file}
    bare_stems = Counter(map(without_order, stems))
    bare_targets = ((without_order(stem), link) for stem, link in stems.items())
    targets |= {stem: link for stem, link in bare_targets if bare_stems[stem] == 1} | stems
    texts = [text for text in texts if text.path]
    context = LessonContext(
        targets=targets,
        ids=ids,
        labels={
            anchor: text.link
            for text in reversed(texts)
            for segment in text.segments
            for anchor in find_anchors(segment)
        }
        | {to_anchor(text.label): text.link for text in texts if text.label},
        files=files,
        models=models,
        sources={key: _authors(work) for key, work in _works(files) if key},
        camera_is_position=course.camera_is_position,
        substitutions=course.substitutions,
    )
    # Of R Markdown, all files of a book are one text
    book_macros = course.macros + "".join(t.macros for t in texts if t.file == "index.Rmd")
    new = {}
    for text in texts:
        macros = f"{book_macros}{text.macros}"
        try:
            head = f'<a id="{to_anchor(text.label)}"></a>\n\n' if text.label else ""
            if macros:
                head += f"$${macros}$$\n\n"
            new[text.link] = text.title, head + _convert_text(text, context)
        except RecursionError:
            raise UsageError(f"{text.file} is nested too deeply") from None
    files_of = {text.link: text.file for text in texts}

    def resolve_label(link: str, anchor: str) -> str:
        text_context = replace(context, path=files_of[link])
        address = address_of_label(anchor, text_context)
        if not address:
            text_context.leave("link", f"a link to `#{anchor}`, which no text sets")
        return address

    def leave(link: str, kind: str, message: str) -> None:
        files.leave(files_of[link], message, kind)

    callouts = frozenset((*model.CALLOUTS, *context.callouts))
    completed, common_macros = complete_texts(
        new, resolve_label, leave, callouts, has_mentions=not course.has_own_titles
    )
    context.macros.update(common_macros)
    if common_macros:
        files.change("macro of formulas", "`[macros]` of the map", len(common_macros))
    out = {text.path: _encode(new_text) for text, new_text in zip(texts, completed, strict=True)}
    return {**out, **context.copies}, context


def _convert_text(text: ImportedText, course_context: LessonContext) -> str:
    """Return a lesson or page in Markdown of coursebuild, with its cells as parts of one script."""
    folder = posixpath.dirname(text.path)
    context = replace(
        course_context,
        path=text.file,
        folder=folder,
        is_mdx=is_mdx(text.file, text.segments),
        references=frozenset(
            label.casefold()
            for segment in text.segments
            for label in re.findall(r"^[ >]*\[(?!\^)([^\[\]\n]+)\]:", segment.text, re.MULTILINE)
        ),
        script_path=script_path_of(text.path),
        substitutions={**course_context.substitutions, **text.substitutions},
        title=text.title,
        parts=[],
        drawing={},
        scripts=[],
        joined={},
        prints={},
        values={},
        single_languages=languages_of_single_cells(text.segments),
        figures=[],
        notes=[],
    )
    parts = []
    for segment in text.segments:
        parts.append(convert_segment(segment, context))
        if segment.kind == "prose" and (headings := _HEADING.findall(segment.text)):
            context = replace(context, title=headings[-1])
    parts += write_joined_cells(context)
    new = "\n\n".join(part.strip("\n") for part in parts if part.strip()) + "\n"
    new = print_values(new, context)
    if context.figures:  # the first part has the keys of the script
        head = f"python file={context.script_path}"
        new = new.replace(head, f"{head} figure={','.join(context.figures)}", 1)
    notes = (f"[^note-{number}]: {note}\n" for number, note in enumerate(context.notes, 1))
    return "\n".join((new, *notes)) if context.notes else new


def _own_packages(files: SourceFiles, texts: Sequence[ImportedText]) -> Iterator[tuple[str, bytes]]:
    """Yield the files of the course's own packages that its lessons import, below `src`."""
    code = "\n".join(segment.text for text in texts for segment in text.segments)
    imported = set(re.findall(r"^[ \t]*(?:from|import)[ \t]+(\w+)", code, re.MULTILINE))
    roots = [posixpath.dirname(path) for path in files if path.endswith("/__init__.py")]
    tops = (root for root in roots if posixpath.dirname(root) not in roots)
    packages = [root for root in tops if posixpath.basename(root) in imported]
    for path in files:
        root = next((root for root in packages if path.startswith(f"{root}/")), "")
        module, _, end = posixpath.basename(path).rpartition(".")
        is_module = end == "py" and module in imported and posixpath.dirname(path) not in roots
        if root or is_module:
            folder = posixpath.dirname(root or path)
            yield f"src/{path.removeprefix(folder).lstrip('/')}", files.read(path)


_MAPS = ("_quarto.yml", "_toc.yml", "book.toml", "mkdocs.yml", "myst.yml")
_OTHER_TEXTS = tuple(".adoc .docx .htm .html .org .pdf .rst .tex .txt".split())


def _leave_unused(files: SourceFiles, paths: Iterable[str]) -> None:
    """Note the files that are in no file of the new course."""
    for path in paths:
        message = "used by no text"
        if path.endswith(TEXTS):
            message = "not taken for a lesson: add it to the map of the course, and import again"
        elif path.lower().endswith(_OTHER_TEXTS):
            message = "a kind of text that is not read: convert it to Markdown, as by Pandoc"
        elif path.endswith(".py") and f"{stem_of(path)}.ipynb" in files:
            message = PAIR
        elif posixpath.basename(path) in _MAPS or (
            path.endswith("/conf.py") and path.replace("conf.py", "index.md") in files
        ):
            folder = posixpath.join(files.name, posixpath.dirname(path))
            message = f"a map of its own folder: `coursebuild import {folder}` follows it"
        elif path.endswith(".py") and re.search(rb"(?m)^# ?%%", files.read(path)):
            message = "a script of cells, which `jupytext --to ipynb` makes a notebook of"
        files.leave(path, message)
