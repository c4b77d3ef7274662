"""The files that can be downloaded: scripts, models, files of the course, archives of scripts."""

from __future__ import annotations

import functools
import hashlib
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core.engine.digests import file_state
from coursebuild.core.engine.store import Store
from coursebuild.core.engine.tool import step_key
from coursebuild.core.files.read import read_bytes
from coursebuild.core.model.addresses import recorded_figures
from coursebuild.core.model.results import CachedFile, OutputFile, SiteFile
from coursebuild.core.model.script_download import ScriptDownload
from coursebuild.core.pages import urls, zips
from coursebuild.core.pages.assets import Assets
from coursebuild.core.pages.library import Library
from coursebuild.core.pages.listings import find_imports
from coursebuild.core.pages.theme import dark_colours, dark_drawing
from coursebuild.core.run.packages import distributions, module_files
from coursebuild.core.run.script_environment import course_environment
from coursebuild.core.scripts.figure_data import without_data
from coursebuild.pipeline.reader import Reader

_DIGEST = hashlib.sha256().digest_size * 2


class Downloads(Struct, frozen=True):
    """The files, and what features make others from."""

    files: tuple[SiteFile, ...]
    archives: Mapping[str, zips.Archive]
    """Archives of scripts by site path."""
    imports: Callable[[str], frozenset[str]]
    """Returns the modules that a Python text imports."""

    @classmethod
    def of(
        cls, library: Library, assets: Assets, reader: Reader, root: Path, store: Store
    ) -> Downloads:
        """The downloads of a course whose documents were read."""
        imports = _make_imports(library, reader)
        surroundings = _find_surroundings(library, root, store, imports)
        archives = {archive.path: archive for archive in zips.make_archives(library, surroundings)}
        archive_files = (
            CachedFile(archive.path, step_key("archive", archive.key), archive.pack)
            for archive in archives.values()
        )
        handed_over = {d.path: _handed_over(d) for d in library.results.downloads}
        scripts = (
            CachedFile(path, script.code.digest.hex(), script.code.text.encode)
            for path, (script, _) in library.scripts.items()
            if path not in handed_over
        )
        models = (
            OutputFile(urls.model_file_path(model.name), model.source.text.encode())
            for model in library.course.models
        )
        files = (
            *handed_over.values(),
            *scripts,
            *models,
            *_files(library, assets, root),
            *archive_files,
        )
        return cls(files, archives, imports)


def _handed_over(download: ScriptDownload) -> OutputFile:
    """The file of a script that readers get."""
    if not download.archive:
        return OutputFile(download.path, download.files[0][1])
    folder = download.path.rpartition("/")[2].removesuffix(".zip")
    files = {f"{folder}/{path}": data for path, data in download.files}
    return OutputFile(download.path, zips.pack_files(files))


def _files(library: Library, assets: Assets, root: Path) -> Iterator[SiteFile]:
    """Files of the course that pages show or link to, and dark versions of its drawings."""

    def read_drawing(path: str) -> bytes:
        return without_data(read_bytes(root, path))

    def make_dark_drawing(read: Callable[[], bytes]) -> bytes:
        colours = dark_colours(assets.file("css/site.css").decode())
        return dark_drawing(read().decode(), colours).encode()

    figures = [figure for d in library.course.documents for figure in recorded_figures(d)]
    drawings = frozenset(f.path for f in figures if not f.path.endswith(".csv"))
    dark = frozenset(figure.path for figure in figures if figure.has_dark)
    for path in library.course.files:
        digest = file_state(f"{root}/{path}")
        read = functools.partial(read_bytes, root, path)
        if len(digest) != _DIGEST:  # it is gone or cannot be read: `read` raises the right error
            digest = hashlib.sha256(read()).hexdigest()
        if path in drawings:
            read = functools.partial(read_drawing, path)
            digest = step_key("drawing without data", digest)
        yield CachedFile(urls.file_path(path), digest, read)
        if path in dark:
            make = functools.partial(make_dark_drawing, read)
            yield CachedFile(urls.dark_path(path), step_key("dark drawing", digest), make)


def _find_surroundings(
    library: Library, root: Path, store: Store, imports: Callable[[str], frozenset[str]]
) -> zips.Surroundings:
    """What scripts need to run elsewhere: packages, modules, models' files and a style."""
    if not library.scripts:
        return zips.Surroundings()
    folders = [root / package.path for package in library.course.packages]
    ours = functools.cache(functools.partial(module_files, folders=folders))
    meshes = tuple(
        OutputFile(path, read_bytes(root, path))
        for path in library.course.files
        if path.startswith("models/")
    )
    styles = (path.name for path in root.glob("matplotlibrc"))
    style = tuple(OutputFile(name, read_bytes(root, name)) for name in styles)
    surroundings = zips.Surroundings((), ours, meshes, style, imports)
    modules = zips.foreign_modules(library, surroundings)
    interpreter = course_environment(root, library.course).value
    installed_packages = distributions(
        store, modules, None if interpreter is None else interpreter.packages
    )
    packages = tuple(zips.Package(*package) for package in installed_packages)
    return replace(surroundings, packages=packages)


def _make_imports(library: Library, reader: Reader) -> Callable[[str], frozenset[str]]:
    """Make the function that returns a text's imports; those of scripts are known already."""
    scripts, imports_by_path = library.scripts, reader.imports
    imports_by_text = {
        scripts[path][0].code.text: imports_by_path[path]
        for path in scripts.keys() & imports_by_path
    }

    def imports(text: str) -> frozenset[str]:
        if text not in imports_by_text:
            imports_by_text[text] = find_imports(text)
        return imports_by_text[text]

    return imports
