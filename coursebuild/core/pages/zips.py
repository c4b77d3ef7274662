"""Scripts as archives that run elsewhere, with models, `mjcourse` and exact requirements.

Entry points: `archives`; `imported_modules` says which packages whoever calls should give the
versions of. What scripts import of `mjcourse` and of the course's own packages lies beside them,
where Python looks first.

The bytes depend on the content alone: entries in order of their paths, one fixed date, one fixed
way to compress.
"""

from __future__ import annotations

import hashlib
import io
import re
import sys
import zipfile
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping

from msgspec import Struct

from coursebuild.core.model import Course, Script, document_scripts
from coursebuild.core.model.results import OutputFile
from coursebuild.core.pages import urls
from coursebuild.core.pages.folding import find_imports
from coursebuild.core.pages.library import Library, course_scripts, models_named
from coursebuild.core.text.source import Excerpt

_NEVER_REQUIRED = sys.stdlib_module_names | {"mjcourse"}
_DATE = (1980, 1, 1, 0, 0, 0)


class Package(Struct, frozen=True):
    """An installed package that scripts import."""

    module: str
    """What a script imports: `yaml`."""
    name: str
    """What an installer calls it: `PyYAML`."""
    version: str


class Surroundings(Struct, frozen=True):
    """What scripts need around them, besides the course itself."""

    packages: tuple[Package, ...] = ()
    library: Callable[[str], tuple[OutputFile, ...]] = lambda _: ()
    """The files of a module of `mjcourse` or of the course's own, by path relative to the folder
    that holds it; none of any other module."""
    model_files: tuple[OutputFile, ...] = ()
    """Files in `models/` that are no MJCF (meshes, height fields), by path relative to the project
    root."""
    style: tuple[OutputFile, ...] = ()
    """The course's `matplotlibrc`, if it has one: the style of all figures."""
    imports: Callable[[str], frozenset[str]] = find_imports
    """What a Python text imports: whoever calls may know it already."""


class Archive(Struct, frozen=True):
    """An archive that is not packed yet."""

    path: str
    """Site path."""
    parts: Mapping[str, bytes | Excerpt]
    """What is in it by path: code, or bytes."""

    @property
    def files(self) -> dict[str, bytes]:
        """What is in it, all as bytes."""
        return {
            path: part if isinstance(part, bytes) else part.text.encode()
            for path, part in self.parts.items()
        }

    @property
    def key(self) -> str:
        """A hash of all that is in it."""
        digest = hashlib.sha256()
        for path in sorted(self.parts):
            part = self.parts[path]
            own = hashlib.sha256(part).digest() if isinstance(part, bytes) else part.digest
            digest.update(f"{path}\0".encode() + own)
        return digest.hexdigest()

    def packed(self) -> bytes:
        """Its bytes."""
        return pack(self.files)


def archives(library: Library, around: Surroundings) -> Iterator[Archive]:
    """That of the course and those of its lessons, as far as they have scripts."""
    by_module = {_module(path): script for path, (script, _) in library.scripts.items()}
    if library.scripts:
        scripts = tuple(script for script, _ in library.scripts.values())
        folder = _slug(library.course.title)
        files = _files(library, around, scripts, folder, by_module)
        yield Archive(urls.EXAMPLES_ZIP, files)
    for lesson in library.order:
        scripts = document_scripts(lesson.document) if lesson.document is not None else ()
        if scripts:
            needed = _with_siblings(by_module, around, scripts)
            files = _files(library, around, needed, f"{lesson.id}-{lesson.slug}", by_module)
            yield Archive(urls.lesson_zip_path(lesson), files)


def imported_modules(course: Course, around: Surroundings) -> tuple[str, ...]:
    """Top-level modules of others that the scripts, and the packages they come with, import."""
    scripts = [script for script, _ in course_scripts(course).values()]
    own = {_module(script.path) for script in scripts}
    return tuple(sorted(_imported(scripts, around, own)[1]))


def _imported(
    scripts: Iterable[Script], around: Surroundings, own: Collection[str]
) -> tuple[list[OutputFile], set[str]]:
    """The library's files that scripts import, maybe through each other, and others' modules.

    `own` are the modules that scripts are themselves.
    """
    files: list[OutputFile] = []
    others: set[str] = set()
    seen: set[str] = set()
    waiting = [script.code.text for script in scripts]
    for text in waiting:
        for name in around.imports(text) - seen:
            seen.add(name)
            found = () if name in own else around.library(name)
            files += found
            waiting += [file.data.decode() for file in found if file.path.endswith(".py")]
            if not found and name not in own:
                others.add(name)
    return files, others - _NEVER_REQUIRED


def _module(path: str) -> str:
    return path.removeprefix("examples/").removesuffix(".py").partition("/")[0]


def _with_siblings(
    by_module: Mapping[str, Script], around: Surroundings, scripts: Iterable[Script]
) -> tuple[Script, ...]:
    found: dict[str, Script] = {}
    waiting = list(scripts)
    while waiting:
        script = waiting.pop()
        if script.path not in found:
            found[script.path] = script
            named = around.imports(script.code.text)
            waiting += [by_module[name] for name in named if name in by_module]
    return tuple(found[path] for path in sorted(found))


def _files(
    library: Library,
    around: Surroundings,
    scripts: tuple[Script, ...],
    folder: str,
    own: Mapping[str, Script],
) -> dict[str, bytes | Excerpt]:
    """What is in an archive of one folder; `own` are the modules that scripts are themselves."""
    files: dict[str, bytes | Excerpt] = {script.path: script.code for script in scripts}
    beside, others = _imported(scripts, around, own)
    files |= {f"examples/{file.path}": file.data for file in beside}
    files |= _models(library, around, scripts)
    if "matplotlib" in others:
        files |= {file.path: file.data for file in around.style}
    files["requirements.txt"] = _requirements(library, around.packages, others)
    first = scripts[0].path
    readme = library.words("zip.readme", title=library.course.title, script=first)
    files["README.md"] = f"{readme.strip()}\n".encode()
    return {f"{folder}/{path}": data for path, data in files.items()}


def _models(
    library: Library, around: Surroundings, scripts: tuple[Script, ...]
) -> Mapping[str, bytes]:
    """The models that scripts name, and the files that these pull in."""
    if not library.course.models:
        return {}
    sources = {model.source.path: model.source.text.encode() for model in library.course.models}
    others = {file.path: file.data for file in around.model_files}
    named = {name for script in scripts for name in models_named(script)}
    found: dict[str, bytes] = {}
    for model in library.course.models:
        if model.name in named:
            found[model.source.path] = sources[model.source.path]
            facts = library.facts.get(model.name)
            for path in facts.includes if facts is not None else ():
                if (data := sources.get(path, others.get(path))) is not None:
                    found[path] = data
    return found


def _requirements(library: Library, packages: Iterable[Package], modules: Iterable[str]) -> bytes:
    """One line for each package that is imported, with its exact version where it is known."""
    known = {package.module: f"{package.name}=={package.version}" for package in packages}
    known.setdefault("mujoco", f"mujoco=={library.results.engine}")
    used = (known.get(name, name) for name in modules)
    return "".join(f"{line}\n" for line in sorted(used)).encode()


def _slug(title: str) -> str:
    return re.sub(r"[^a-z0-9]+", "-", title.lower()).strip("-") or "course"


def pack(files: Mapping[str, bytes]) -> bytes:
    """An archive of these files, by path."""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        for path, data in sorted(files.items()):
            entry = zipfile.ZipInfo(path, _DATE)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.create_system = 3
            entry.external_attr = 0o100644 << 16
            archive.writestr(entry, data, compresslevel=9)
    return out.getvalue()
