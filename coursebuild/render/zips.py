"""Scripts as archives that run elsewhere, with models, `mjcourse` and exact requirements.

Entry points: `course_zip`, `lesson_zip`; `imported_modules` says which packages whoever calls
should give the versions of.

The bytes depend on the content alone: entries in order of their paths, one fixed date, one fixed
way to compress.
"""

from __future__ import annotations

import ast
import io
import re
import sys
import zipfile
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from coursebuild.model import Course, Lesson, Script
from coursebuild.render import urls
from coursebuild.render.library import Library, document_scripts, models_named, owners
from coursebuild.results import OutputFile

_DATE = (1980, 1, 1, 0, 0, 0)


@dataclass(frozen=True, slots=True)
class Package:
    """An installed package that scripts import."""

    module: str
    """What a script imports: `yaml`."""
    name: str
    """What an installer calls it: `PyYAML`."""
    version: str


@dataclass(frozen=True, slots=True)
class Surroundings:
    """What scripts need around them, besides the course itself."""

    packages: tuple[Package, ...] = ()
    library: tuple[OutputFile, ...] = ()
    """Files of the package `mjcourse`, by path relative to the folder that holds it."""
    model_files: tuple[OutputFile, ...] = ()
    """Files in `models/` that are no MJCF (meshes, height fields), by path relative to the project
    root."""


def course_zip(library: Library, around: Surroundings) -> OutputFile:
    """All scripts of the course."""
    scripts = tuple(script for script, _ in library.scripts.values())
    return OutputFile(
        urls.EXAMPLES_ZIP, _archive(library, around, scripts, _slug(library.course.title))
    )


def lesson_zip(library: Library, around: Surroundings, lesson: Lesson) -> OutputFile | None:
    """The scripts of a lesson and those that they import; `None` where it has none."""
    scripts = document_scripts(lesson.document) if lesson.document is not None else ()
    if not scripts:
        return None
    needed = _with_siblings(library, scripts)
    return OutputFile(
        urls.lesson_zip_path(lesson),
        _archive(library, around, needed, f"{lesson.id}-{lesson.slug}"),
    )


def imported_modules(course: Course, library: Iterable[OutputFile] = ()) -> tuple[str, ...]:
    """Top-level modules of others that the scripts, and the package they come with, import."""
    documents = (owner.document for owner in owners(course))
    scripts = [
        script
        for document in documents
        if document is not None
        for script in document_scripts(document)
    ]
    own = {_module(script.path) for script in scripts} | {"mjcourse"}
    texts = [script.code.text for script in scripts]
    texts += [file.data.decode() for file in library if file.path.endswith(".py")]
    found = {name for text in texts for name in imports(text)}
    return tuple(sorted(found - own - sys.stdlib_module_names))


def imports(text: str) -> frozenset[str]:
    """Top-level modules that a Python text imports by name; none where it does not parse."""
    try:
        tree = ast.parse(text)
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return frozenset()
    found: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found.update(alias.name.partition(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            found.add(node.module.partition(".")[0])
    return frozenset(found)


def _module(path: str) -> str:
    return path.removeprefix("examples/").removesuffix(".py").partition("/")[0]


def _with_siblings(library: Library, scripts: Iterable[Script]) -> tuple[Script, ...]:
    by_module = {_module(path): script for path, (script, _) in library.scripts.items()}
    found: dict[str, Script] = {}
    waiting = list(scripts)
    while waiting:
        script = waiting.pop()
        if script.path not in found:
            found[script.path] = script
            waiting += [by_module[name] for name in imports(script.code.text) if name in by_module]
    return tuple(found[path] for path in sorted(found))


def _archive(
    library: Library, around: Surroundings, scripts: tuple[Script, ...], folder: str
) -> bytes:
    """An archive of one folder. `mjcourse` lies beside the scripts, where Python looks first."""
    files: dict[str, bytes] = {script.path: script.code.text.encode() for script in scripts}
    texts = [script.code.text for script in scripts]
    if any("mjcourse" in imports(text) for text in texts):
        files |= {f"examples/{file.path}": file.data for file in around.library}
        texts += [file.data.decode() for file in around.library if file.path.endswith(".py")]
    files |= _models(library, around, scripts)
    files["requirements.txt"] = _requirements(library, around.packages, texts)
    first = scripts[0].path
    readme = library.words("zip.readme", title=library.course.title, script=first)
    files["README.md"] = f"{readme.strip()}\n".encode()
    return _zip({f"{folder}/{path}": data for path, data in files.items()})


def _models(
    library: Library, around: Surroundings, scripts: tuple[Script, ...]
) -> Mapping[str, bytes]:
    """The models that scripts name, and the files that these pull in."""
    sources = {model.source.path: model.source.text.encode() for model in library.course.models}
    others = {file.path: file.data for file in around.model_files}
    named = {name for script in scripts for name in models_named(script)}
    found: dict[str, bytes] = {}
    for model in library.course.models:
        if model.name in named:
            found[model.source.path] = sources[model.source.path]
            compiled = library.models.get(model.name)
            facts = compiled.facts if compiled is not None else None
            for path in facts.includes if facts is not None else ():
                if (data := sources.get(path, others.get(path))) is not None:
                    found[path] = data
    return found


def _requirements(library: Library, packages: Iterable[Package], texts: Iterable[str]) -> bytes:
    """One line for each package that the texts import, with its exact version where it is known."""
    known = {package.module: f"{package.name}=={package.version}" for package in packages}
    known.setdefault("mujoco", f"mujoco=={library.results.engine}")
    own = {_module(path) for path in library.scripts} | {"mjcourse"}
    used = {name for text in texts for name in imports(text)} - own - sys.stdlib_module_names
    return "".join(f"{line}\n" for line in sorted(known.get(name, name) for name in used)).encode()


def _slug(title: str) -> str:
    return re.sub(r"[^a-z0-9]+", "-", title.lower()).strip("-") or "course"


def _zip(files: Mapping[str, bytes]) -> bytes:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        for path in sorted(files):
            entry = zipfile.ZipInfo(path, _DATE)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.create_system = 3
            entry.external_attr = 0o100644 << 16
            archive.writestr(entry, files[path], compresslevel=9)
    return out.getvalue()
