"""The files that can be downloaded: scripts, models, files of the course, archives of scripts."""

from __future__ import annotations

import functools
import hashlib
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

from coursebuild.core.engine.digests import file_state
from coursebuild.core.engine.tool import step_key
from coursebuild.core.files.read import read_bytes
from coursebuild.core.model.addresses import recorded_figures
from coursebuild.core.model.results import CachedFile, OutputFile, SiteFile
from coursebuild.core.model.script_download import ScriptDownload
from coursebuild.core.pages import urls, zips
from coursebuild.core.pages.library import Library
from coursebuild.core.pages.theme import dark_colours, dark_drawing
from coursebuild.core.scripts.figure_data import without_data

_DIGEST = hashlib.sha256().digest_size * 2


def download_files(
    library: Library, archives: Iterable[zips.Archive], root: Path
) -> Iterator[SiteFile]:
    """The files that can be downloaded; `archives` are those of scripts."""
    handed_over = {d.path: _handed_over(d) for d in library.results.downloads}
    yield from handed_over.values()
    for path, (script, _) in library.scripts.items():
        if path not in handed_over:
            yield CachedFile(path, script.code.digest.hex(), script.code.text.encode)
    for model in library.course.models:
        yield OutputFile(urls.model_file_path(model.name), model.source.text.encode())
    for archive in archives:
        yield CachedFile(archive.path, step_key("archive", archive.key), archive.pack)
    yield from _files(library, root)


def _handed_over(download: ScriptDownload) -> OutputFile:
    """The file of a script that readers get."""
    if not download.archive:
        return OutputFile(download.path, download.files[0][1])
    folder = download.path.rpartition("/")[2].removesuffix(".zip")
    files = {f"{folder}/{path}": data for path, data in download.files}
    return OutputFile(download.path, zips.pack_files(files))


def _files(library: Library, root: Path) -> Iterator[SiteFile]:
    """Files of the course that pages show or link to, and dark versions of its drawings."""

    def read_drawing(path: str) -> bytes:
        return without_data(read_bytes(root, path))

    def make_dark_drawing(read: Callable[[], bytes]) -> bytes:
        colours = dark_colours(library.assets.file("css/site.css").decode())
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
