"""`coursebuild export`: the course as one file, for other programs and for paper.

Entry point: `export(options, name, out)`. Features have the exporters. The course is verified as
for a build, and nothing is written where something is wrong.

A file or an archive is written in one step, without holding the archive in memory. The same files
give the same bytes: entries are sorted by path and have the same date. Files that are compressed
already are stored.
"""

from __future__ import annotations

import contextlib
import functools
import os
import zipfile
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import BinaryIO

from msgspec.structs import replace

from coursebuild.core.engine.manifest import MARKER
from coursebuild.core.features import Exporter
from coursebuild.core.files.course_features import load_course_features
from coursebuild.core.files.errors import EffectError, PublishRefusedError, UsageError, reason
from coursebuild.core.files.locks import project_lock
from coursebuild.core.files.read import read_bytes, read_sources
from coursebuild.core.files.resources import Bundle, prepared_folder, template_texts
from coursebuild.core.model import Course, Document
from coursebuild.core.model.results import Reports, Results, SiteFile
from coursebuild.core.pages.added_files import ExportContext
from coursebuild.core.pages.assets import Assets
from coursebuild.core.pages.context import PageContext
from coursebuild.core.pages.library import Library
from coursebuild.core.pages.page_list import page_list
from coursebuild.core.registry import find_exporter
from coursebuild.core.text.diagnostics import Diagnostic
from coursebuild.pipeline.build import prepare
from coursebuild.pipeline.documents import Documents
from coursebuild.pipeline.load import MAP
from coursebuild.pipeline.options import Options
from coursebuild.pipeline.site import Site, SiteMaker
from coursebuild.report import Report


def export(options: Options, name: str, out: Path | None) -> Report:
    """Write the file to `out` (relative to the course's folder), or nothing.

    Raises:
        UsageError: no feature has an exporter of this name.
    """
    exporter = _find_exporter(options.root, name)
    out = out or Path(exporter.file)
    place = options.root / out
    _check_target(options.root, place, exporter.mark, archive=exporter.archive)
    make = functools.partial(_make_files, exporter)
    with (
        project_lock(options.root, options.progress.say),
        prepare(options, make) as (report, exported_site),
    ):
        if exported_site is None:
            return replace(report, remarks=("nothing was written",))
        if not exported_site.files:
            raise EffectError(f"the course has nothing that `export {name}` could write")
        with options.progress.stage("packing"):
            size = _write_export(place, exported_site.files, archive=exporter.archive)
    count = len(exported_site.files)
    remark = f"wrote {f'{count} files to ' if exporter.archive else ''}{out}, {_format_size(size)}"
    return replace(report, remarks=(remark,), depends=None)


def _format_size(count: int) -> str:
    """Format a number of bytes."""
    return f"{count / 1e6:.1f} MB" if count >= 100_000 else f"{count / 1e3:.1f} kB"


def _find_exporter(root: Path, name: str) -> Exporter:
    """Find an exporter by its name, also among the features of the course itself."""
    exporter = find_exporter(name)
    feature_diagnostics: tuple[Diagnostic, ...] = ()
    if isinstance(exporter, str):
        from coursebuild.core.syntax.coursemap import parse_course_map

        for source in read_sources(root, [MAP]).value:
            course = parse_course_map(source).value
            feature_diagnostics = () if course is None else load_course_features(root, course)
        exporter = find_exporter(name)
    if isinstance(exporter, str):
        raise UsageError(
            "; ".join((exporter, *(diagnostic.message for diagnostic in feature_diagnostics)))
        )
    return exporter


def _make_files(
    exporter: Exporter,
    course: Course,
    results: Results,
    documents: Documents,
    options: Options,
    reports: Reports,
) -> Site:
    """Make the files of an export, in the place of those of a site."""
    assets = Assets(template_texts(), Bundle(), prepared_folder())
    library = Library(course, results, assets, reports)
    entries = {
        document.source.path: entry
        for entry in page_list(library)
        if (document := entry.document(library)) is not None
    }
    diagnostics: list[Diagnostic] = []

    @functools.cache
    def site() -> Mapping[str, SiteFile]:
        whole_site = SiteMaker(library, assets, documents, options).make_site()
        diagnostics.extend(whole_site.diagnostics)
        return {file.path: file for file in whole_site.files}

    def page(document: Document) -> PageContext:
        path = document.source.path
        return documents.page_context(path, entries[path].inputs(library), course)

    context = ExportContext(
        library, assets, site, page, functools.partial(read_bytes, options.root)
    )
    files: list[SiteFile] = []
    for file in exporter.make(context):
        if isinstance(file, Diagnostic):
            diagnostics.append(file)
        else:
            files.append(file)
    return Site(tuple(files), None, tuple(diagnostics), ())


# --- the file


_DATE = (1980, 1, 1, 0, 0, 0)
_MIMETYPE = "mimetype"
"""The file that an e-book must begin with, uncompressed."""
_UNCOMPRESSED_SUFFIXES = (".gz", ".jpeg", ".jpg", ".png", ".webp", ".woff2", ".zip", _MIMETYPE)
_AUTHOR_FOLDERS = ("features", "models", "examples", ".coursebuild", ".git")


def _check_target(root: Path, out: Path, mark: str, *, archive: bool) -> None:
    """Check that an export may be written to `out`: nothing is there, or only an earlier export.

    An earlier archive holds a file called `mark`; any other export has `mark` near its beginning.

    Raises:
        PublishRefusedError: the file must not go there.
    """
    place = Path(os.path.realpath(out))
    for name in _AUTHOR_FOLDERS:
        if place.is_relative_to(os.path.realpath(root / name)):
            raise PublishRefusedError(f"{out} lies in {name}/ of the project, where no export goes")
    if any((folder / MARKER).is_file() for folder in place.parents):
        raise PublishRefusedError(
            f"{out} lies in a published site, which the next build replaces",
            help="write the file beside it",
        )
    if place.is_dir():
        raise PublishRefusedError(f"{out} is a folder", help="name a file, such as `course.zip`")
    is_export = False
    with contextlib.suppress(OSError, zipfile.BadZipFile, ValueError):
        if archive:
            with zipfile.ZipFile(place) as earlier:
                is_export = mark in earlier.namelist()
        else:
            with place.open("rb") as file:
                is_export = mark.encode() in file.read(1000)
    if os.path.lexists(place) and not is_export:
        raise PublishRefusedError(
            f"{out} exists and is not such an export", help="move it away, or name another file"
        )


def _write_export(out: Path, files: Iterable[SiteFile], *, archive: bool) -> int:
    """Write files into an archive, or a single file as it is; return the size in bytes.

    Raises:
        EffectError: it cannot be written; what was there stays.
    """
    place = Path(os.path.realpath(out))
    # Always the same name, so that the next command overwrites what a killed one left.
    temporary = place.with_name(f".{place.name}.part")
    try:
        try:
            place.parent.mkdir(parents=True, exist_ok=True)
            with temporary.open("wb") as target:
                if archive:
                    _pack(target, files)
                else:
                    (file,) = files
                    target.write(file.make())
            size = temporary.stat().st_size
            temporary.replace(place)
        finally:
            with contextlib.suppress(OSError):
                temporary.unlink()
    except OSError as error:
        raise EffectError(f"{out} cannot be written: {reason(error)}") from None
    return size


def _pack(target: BinaryIO, files: Iterable[SiteFile]) -> None:
    with zipfile.ZipFile(target, "w") as archive:
        for file in sorted(files, key=lambda file: (file.path != _MIMETYPE, file.path)):
            entry = zipfile.ZipInfo(file.path, _DATE)
            is_stored = file.path.lower().endswith(_UNCOMPRESSED_SUFFIXES)
            entry.compress_type = zipfile.ZIP_STORED if is_stored else zipfile.ZIP_DEFLATED
            entry.create_system = 3
            entry.external_attr = 0o100644 << 16
            archive.writestr(entry, file.make(), compresslevel=6)
