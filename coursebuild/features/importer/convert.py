"""The course of another tool → the files of one of coursebuild.

Entry points: `convert`, `write_course`.
"""

from __future__ import annotations

import posixpath
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from msgspec import Struct

from coursebuild.core.files.errors import UsageError
from coursebuild.core.files.write import write_atomic
from coursebuild.features.importer.contents import read_contents
from coursebuild.features.importer.context import LessonContext
from coursebuild.features.importer.course_json import read_course_json
from coursebuild.features.importer.course_map import map_lines, with_texts
from coursebuild.features.importer.lesson import lesson_text
from coursebuild.features.importer.prose import labels
from coursebuild.features.importer.values import (
    TEXTS,
    Files,
    ImportedCourse,
    ImportedText,
    Leftover,
    files_of,
    stem_of,
)

_IGNORED = b"public/\nexamples/\n.coursebuild/\n"


class Converted(Struct, frozen=True):
    """A course as coursebuild has it."""

    files: Mapping[str, bytes]
    left: tuple[Leftover, ...]


def convert(folder: Path) -> Converted:
    """Read a course of another tool; nothing is written.

    Raises:
        UsageError: there is nothing to import, or a file cannot be read.
    """
    files = files_of(folder)
    maps = [path for path in files if posixpath.basename(path) == "course.json"]
    described = min(maps, key=lambda path: (path.count("/"), path), default=None)
    if described is None:
        course = read_contents(files, folder.resolve().name)
    else:
        course = read_course_json(described, files)
    course = with_texts(course, files)
    lessons = [lesson for level in course.levels for lesson in level.lessons]
    texts, ids = (*lessons, *course.pages), _ids(lessons)
    out, left, callouts = _texts(course, texts, ids, files)
    if described is not None:
        read = {text.file for text in texts}
        lost = (path for path in files if path.endswith(TEXTS) and path not in read)
        left += [Leftover(path, "", "a text that the map does not name") for path in lost]
        left += [
            Leftover(described, "", f"the prerequisite {name} of {text.id}, which is no lesson")
            for text in texts
            for name in text.prerequisites
            if name not in ids
        ]
    packages = dict(_packages(files, texts))
    out |= {**packages, **dict(_models(files))}
    lines = map_lines(course, ids, callouts, ("src",) if packages else ())
    out["content/course.toml"] = "".join(f"{line}\n" for line in lines).encode()
    out[".gitignore"] = _IGNORED
    return Converted(dict(sorted(out.items())), (*course.left, *left))


def write_course(course: Converted, folder: Path, source: Path) -> None:
    """Write the files of a new course.

    Raises:
        UsageError: the folder is the one that is imported, or in it, or has one of the files.
        EffectError: a file cannot be written.
    """
    target = folder.resolve()
    if target.is_relative_to(source.resolve()):
        raise UsageError(f"{folder} is in the folder that is imported, which is only read")
    for path in course.files:
        if (target / path).exists():
            raise UsageError(f"{folder} has {path} already; name an empty folder with --out")
    for path, data in course.files.items():
        (target / path).parent.mkdir(parents=True, exist_ok=True)
        write_atomic(target, path, data, expected=None)


def _ids(lessons: Sequence[ImportedText]) -> dict[str, str]:
    """Ids of lessons, by those that they had and by those that they have."""
    named = {lesson.old_id: lesson.id for lesson in lessons if lesson.old_id}
    slugs = {lesson.slug: lesson.id for lesson in lessons}
    return slugs | {lesson.id: lesson.id for lesson in lessons} | named


def _texts(
    course: ImportedCourse, texts: Sequence[ImportedText], ids: Mapping[str, str], files: Files
) -> tuple[dict[str, bytes], list[Leftover], dict[str, str]]:
    """The files of lessons and pages, what was left, and kinds of callouts of the course's own."""
    written = [text for text in texts if text.path]
    targets = {stem_of(text.file): text.link for text in written}
    anchors = {
        anchor: text.link
        for text in reversed(written)
        for segment in text.segments
        for anchor in labels(segment.text)
    }
    out: dict[str, bytes] = {}
    left: list[Leftover] = []
    callouts: dict[str, str] = {}
    for text in written:
        context = LessonContext(
            text.file,
            targets,
            ids,
            anchors,
            frozenset(files),
            posixpath.dirname(text.path),
            camera_is_position=course.camera_is_position,
        )
        script = _script_path(text)
        out[text.path] = lesson_text(text.segments, text.title, script, context).encode()
        out |= {place: files[path].read_bytes() for path, place in context.copied.items()}
        out |= {place: text.pictures[name] for name, place in context.pictures.items()}
        left += context.left
        callouts |= context.callouts
    return out, left, callouts


def _script_path(text: ImportedText) -> str:
    words = re.findall("[a-z0-9]+", f"{text.id}-{text.slug}".lower())
    return f"examples/{'' if words[0].isalpha() else 'l'}{'_'.join(words)}.py"


def _packages(files: Files, texts: Sequence[ImportedText]) -> Iterator[tuple[str, bytes]]:
    """Packages of the course's own that its lessons import, below `src`."""
    code = "\n".join(segment.text for text in texts for segment in text.segments)
    imported = set(re.findall(r"^[ \t]*(?:from|import)[ \t]+(\w+)", code, re.MULTILINE))
    roots = [posixpath.dirname(path) for path in files if path.endswith("/__init__.py")]
    for root in roots:
        name = posixpath.basename(root)
        if name in imported and posixpath.dirname(root) not in roots:
            for path, file in files.items():
                if path.startswith(f"{root}/"):
                    yield f"src/{name}/{path.removeprefix(f'{root}/')}", file.read_bytes()


def _models(files: Files) -> Iterator[tuple[str, bytes]]:
    """Models, with the meshes and textures beside them."""
    for path, file in files.items():
        folders = posixpath.dirname(path).split("/")
        if "models" in folders:
            at = folders.index("models")
            name = "/".join(("models", *folders[at + 1 :], posixpath.basename(path)))
            yield name, file.read_bytes()
        elif path.endswith(".xml") and b"<mujoco" in (data := file.read_bytes()):
            yield f"models/{posixpath.basename(path)}", data
