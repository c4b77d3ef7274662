"""Archives of scripts that run elsewhere, with models, `mjcourse` and exact requirements.

What scripts import of `mjcourse` and of the course's own packages is put beside them, where Python
looks first. The bytes depend on the content only: entries are sorted by path, with one fixed date
and one fixed compression.
"""

from __future__ import annotations

import hashlib
import io
import re
import sys
import zipfile
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping

from msgspec import Struct

from coursebuild.core.model import Script, document_scripts
from coursebuild.core.model.results import OutputFile
from coursebuild.core.pages import urls
from coursebuild.core.pages.library import Library, models_named
from coursebuild.core.pages.listings import find_imports
from coursebuild.core.text.source import Excerpt

_NEVER_REQUIRED = sys.stdlib_module_names | {"mjcourse"}
_DATE = (1980, 1, 1, 0, 0, 0)


class Package(Struct, frozen=True):
    """An installed package that scripts import."""

    module: str
    """Its name in imports, such as `yaml`."""
    name: str
    """Its name for installers, such as `PyYAML`."""
    version: str


class Surroundings(Struct, frozen=True):
    """What scripts need to run, besides the course itself."""

    packages: tuple[Package, ...] = ()
    library: Callable[[str], tuple[OutputFile, ...]] = lambda _: ()
    """Returns the files of a module of `mjcourse` or of the course's own, by path relative to the
    module's parent folder; none for other modules."""
    model_files: tuple[OutputFile, ...] = ()
    """Other files than MJCF in `models/` (meshes, height fields), by path relative to the project
    root."""
    style: tuple[OutputFile, ...] = ()
    """The course's `matplotlibrc`, if it has one: the style of all figures."""
    imports: Callable[[str], frozenset[str]] = find_imports


class Archive(Struct, frozen=True):
    """An archive before it is packed."""

    path: str
    parts: Mapping[str, bytes | Excerpt]
    """Its content by path: code or bytes."""

    @property
    def files(self) -> dict[str, bytes]:
        """Its content by path, as bytes."""
        return {
            path: part if isinstance(part, bytes) else part.text.encode()
            for path, part in self.parts.items()
        }

    @property
    def key(self) -> str:
        digest = hashlib.sha256()
        for path in sorted(self.parts):
            part = self.parts[path]
            part_digest = hashlib.sha256(part).digest() if isinstance(part, bytes) else part.digest
            digest.update(f"{path}\0".encode() + part_digest)
        return digest.hexdigest()

    def pack(self) -> bytes:
        """The bytes of the archive."""
        return pack_files(self.files)


def make_archives(library: Library, surroundings: Surroundings) -> Iterator[Archive]:
    """The archives of the course and of each lesson with scripts."""
    by_module = {_module(path): script for path, (script, _) in library.scripts.items()}
    if library.scripts:
        scripts = tuple(script for script, _ in library.scripts.values())
        folder = re.sub(r"[^a-z0-9]+", "-", library.course.title.lower()).strip("-") or "course"
        files = _files(library, surroundings, scripts, folder, by_module)
        yield Archive(urls.EXAMPLES_ZIP, files)
    for lesson in library.order:
        scripts = document_scripts(lesson.document) if lesson.document is not None else ()
        if scripts:
            scripts_by_path: dict[str, Script] = {}
            stack = list(scripts)
            while stack:
                script = stack.pop()
                if script.path not in scripts_by_path:
                    scripts_by_path[script.path] = script
                    names = surroundings.imports(script.code.text)
                    stack += [by_module[name] for name in names if name in by_module]
            lesson_scripts = tuple(scripts_by_path[path] for path in sorted(scripts_by_path))
            files = _files(
                library, surroundings, lesson_scripts, f"{lesson.id}-{lesson.slug}", by_module
            )
            yield Archive(urls.lesson_zip_path(lesson), files)


def foreign_modules(library: Library, surroundings: Surroundings) -> tuple[str, ...]:
    """The top-level modules of other packages that scripts import, directly or not."""
    scripts = [script for script, _ in library.scripts.values()]
    script_modules = {_module(script.path) for script in scripts}
    return tuple(sorted(_follow_imports(scripts, surroundings, script_modules)[1]))


def _follow_imports(
    scripts: Iterable[Script], surroundings: Surroundings, script_modules: Collection[str]
) -> tuple[list[OutputFile], set[str]]:
    """The files of the course's modules that scripts import, and the names of foreign modules."""
    files: list[OutputFile] = []
    foreign: set[str] = set()
    modules: set[str] = set()
    texts = [script.code.text for script in scripts]
    for text in texts:
        for name in surroundings.imports(text) - modules:
            modules.add(name)
            module_files = () if name in script_modules else surroundings.library(name)
            files += module_files
            texts += [file.data.decode() for file in module_files if file.path.endswith(".py")]
            if not module_files and name not in script_modules:
                foreign.add(name)
    return files, foreign - _NEVER_REQUIRED


def _module(path: str) -> str:
    return path.removeprefix("examples/").removesuffix(".py").partition("/")[0]


def _files(
    library: Library,
    surroundings: Surroundings,
    scripts: tuple[Script, ...],
    folder: str,
    script_modules: Mapping[str, Script],
) -> dict[str, bytes | Excerpt]:
    """The content of an archive in one folder; `script_modules` are those of scripts themselves."""
    files: dict[str, bytes | Excerpt] = {script.path: script.code for script in scripts}
    library_files, foreign = _follow_imports(scripts, surroundings, script_modules)
    files |= {f"examples/{file.path}": file.data for file in library_files}
    sources = {model.source.path: model.source.text.encode() for model in library.course.models}
    model_files = {file.path: file.data for file in surroundings.model_files} | sources
    names = {name for script in scripts for name in models_named(script)}
    for model in library.course.models:
        if model.name in names:
            facts = library.facts.get(model.name)
            paths = (model.source.path, *(facts.includes if facts is not None else ()))
            files |= {path: model_files[path] for path in paths if path in model_files}
    if "matplotlib" in foreign:
        files |= {file.path: file.data for file in surroundings.style}
    lines_by_module = {
        package.module: f"{package.name}=={package.version}" for package in surroundings.packages
    }
    lines_by_module.setdefault("mujoco", f"mujoco=={library.results.engine}")
    lines = (lines_by_module.get(name, name) for name in foreign)
    files["requirements.txt"] = "".join(f"{line}\n" for line in sorted(lines)).encode()
    first = scripts[0].path
    readme = library.words("zip.readme", title=library.course.title, script=first)
    files["README.md"] = f"{readme.strip()}\n".encode()
    return {f"{folder}/{path}": data for path, data in files.items()}


def pack_files(files: Mapping[str, bytes]) -> bytes:
    """Pack files, given by path, into an archive."""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        for path, data in sorted(files.items()):
            entry = zipfile.ZipInfo(path, _DATE)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.create_system = 3
            entry.external_attr = 0o100644 << 16
            archive.writestr(entry, data, compresslevel=9)
    return out.getvalue()
