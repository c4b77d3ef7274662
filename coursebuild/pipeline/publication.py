"""`coursebuild build` and `export`: verify the course, and write its site or a file of it.

Nothing is written where something is wrong. An export is written in one step, without holding an
archive in memory, and the same files give the same bytes.
"""

from __future__ import annotations

import contextlib
import functools
import os
import zipfile
from collections.abc import Callable, Iterable, Mapping
from itertools import chain
from pathlib import Path
from typing import TypeVar

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core.engine.manifest import MARKER
from coursebuild.core.engine.publish import check_output_folder, publish
from coursebuild.core.features import Exporter
from coursebuild.core.files.course_features import load_course_features
from coursebuild.core.files.course_root import read_regular
from coursebuild.core.files.errors import EffectError, PublishRefusedError, UsageError, reason
from coursebuild.core.files.locks import project_lock
from coursebuild.core.files.read import read_bytes, read_sources
from coursebuild.core.files.resources import Bundle, prepared_folder, template_texts
from coursebuild.core.model import Document, Lesson
from coursebuild.core.model.results import SiteFile
from coursebuild.core.pages.assets import Assets
from coursebuild.core.pages.context import ExportContext, PageContext
from coursebuild.core.pages.library import Library
from coursebuild.core.pages.materials import make_library
from coursebuild.core.pages.page_list import page_list
from coursebuild.core.pages.renderer import TemplateFailure
from coursebuild.core.pages.zips import write_archive
from coursebuild.core.registry import find_exporter
from coursebuild.core.syntax.coursemap import parse_course_map
from coursebuild.core.text.diagnostics import Diagnostic
from coursebuild.pipeline.check import read_and_verify
from coursebuild.pipeline.load import MAP
from coursebuild.pipeline.options import Options, find_owner
from coursebuild.pipeline.reader import Reader
from coursebuild.pipeline.site import Site, page_request
from coursebuild.pipeline.theme_files import template_diagnostic
from coursebuild.pipeline.verify import with_downloads
from coursebuild.report import Report


class _Export(Struct, frozen=True):
    files: tuple[SiteFile, ...]
    diagnostics: tuple[Diagnostic, ...]


Outputs = TypeVar("Outputs", Site, _Export)


def build(options: Options, out: Path) -> Report:
    """Publish the course into `out` (relative to the course's folder), or nothing."""
    place = options.root / out
    check_output_folder(options.root, place)
    with project_lock(options.root, options.progress.say), Reader(options) as reader:
        report, site = make_files(options, reader, lambda library: Site(library, reader, options))
        if site is None:
            stays = f"; {out} stays as it is" if place.exists() else ""
            return replace(report, remarks=(f"nothing was published{stays}",))
        stage = functools.partial(options.progress.stage, "publishing")
        publish(options.root, place, site.files, site.file_list, jobs=options.jobs, stage=stage)
    count = len(site.files) + (site.file_list is not None)
    return replace(report, remarks=(f"published {count} files in {out}",))


def export(options: Options, name: str, lesson: str, out: Path | None) -> Report:
    """Write the file to `out` (relative to the course's folder), or nothing.

    Raises:
        UsageError: no feature has an exporter of this name, or there is no such `lesson`; it is
            empty for exporters of the whole course.
    """
    exporter = _find_exporter(options, name)
    if exporter.of_lesson and not lesson:
        raise UsageError(
            f"`export {name}` writes one lesson, but none was named",
            help=f"name it, as in `coursebuild export {name} 1.1`",
        )
    if lesson and not exporter.of_lesson:
        raise UsageError(f"`export {name}` writes the whole course, and takes no lesson")
    stem = Path(lesson).name.removesuffix(".md")
    out = out or Path(f"{stem}-{exporter.file}" if stem else exporter.file)
    place = options.root / out
    check_target(options.root, place, exporter.mark, archive=exporter.archive)
    with project_lock(options.root, options.progress.say), Reader(options) as reader:
        make = functools.partial(_make_export, exporter, reader, options, lesson)
        report, outputs = make_files(options, reader, make)
        if outputs is None:
            return replace(report, remarks=("nothing was written",))
        if not outputs.files:
            raise EffectError(f"the course has nothing that `export {name}` could write")
        with options.progress.stage("packing"):
            size = write_export(place, outputs.files, archive=exporter.archive)
    count = len(outputs.files)
    shown_size = f"{size / 1e6:.1f} MB" if size >= 100_000 else f"{size / 1e3:.1f} kB"
    remark = f"wrote {f'{count} files to ' if exporter.archive else ''}{out}, {shown_size}"
    return replace(report, remarks=(remark,), depends=None)


def make_files(
    options: Options, reader: Reader, make: Callable[[Library], Outputs]
) -> tuple[Report, Outputs | None]:
    """The report on a course, and what `make` makes of it where nothing is wrong.

    What readers would download of a script and does not run is wrong, and is not handed over.

    The caller holds the course's lock, and closes the reader once the files are written.
    """
    checked_course = read_and_verify(options, reader, static=True)
    if isinstance(checked_course, Report):
        return checked_course, None
    report = checked_course.report()
    if not report.ok:
        return report, None
    course, results = checked_course.course, checked_course.verification.results
    results, failures = with_downloads(course, results, checked_course.options, reader.imports)
    assets = Assets(template_texts(), Bundle(), prepared_folder())
    try:
        outputs = make(make_library(course, results, assets, checked_course.reports))
        if course.theme.templates:  # these may fail on any page
            for file in outputs.files:
                if file.path.endswith(".html"):
                    file.make()
        report = checked_course.report(outputs.diagnostics)
        whole_report = checked_course.report(chain(outputs.diagnostics, failures))
    except TemplateFailure as failure:
        return checked_course.report((template_diagnostic(course, failure),)), None
    return whole_report, outputs if report.ok else None  # of what failed the buttons are hidden


def _find_exporter(options: Options, name: str) -> Exporter:
    """Find an exporter by its name, also among features of the course, where they may run."""
    exporter = find_exporter(name)
    feature_diagnostics: tuple[Diagnostic, ...] = ()
    if isinstance(exporter, str) and options.sandbox is None:
        for source in read_sources(options.root, [MAP]).value:
            course = parse_course_map(source).value
            if course is not None:
                feature_diagnostics = load_course_features(options.root, course)
        exporter = find_exporter(name)
    if isinstance(exporter, str):
        raise UsageError(
            "; ".join((exporter, *(diagnostic.message for diagnostic in feature_diagnostics)))
        )
    return exporter


def _make_export(
    exporter: Exporter, reader: Reader, options: Options, lesson: str, library: Library
) -> _Export:
    owner = find_owner(library.course, lesson, options.root) if lesson else None
    if owner is not None and not isinstance(owner, Lesson):
        raise UsageError(f"`{lesson}` is a page, and `export {exporter.name}` writes a lesson")
    pages = {
        document.source.path: page
        for page in page_list(library)
        if (document := page.document(library)) is not None
    }
    diagnostics: list[Diagnostic] = []

    @functools.cache
    def site() -> Mapping[str, SiteFile]:
        whole_site = Site(library, reader, options)
        diagnostics.extend(whole_site.diagnostics)
        return {file.path: file for file in whole_site.files}

    def page(document: Document) -> PageContext:
        return reader.page_context(page_request(pages[document.source.path], library))

    context = ExportContext(
        library, library.assets, site, page, functools.partial(read_bytes, options.root), owner
    )
    files: list[SiteFile] = []
    for file in exporter.make(context):
        if isinstance(file, Diagnostic):
            diagnostics.append(file)
        else:
            files.append(file)
    return _Export(tuple(files), tuple(diagnostics))


_AUTHOR_FOLDERS = ("features", "models", "examples", ".coursebuild", ".git")


def check_target(root: Path, out: Path, mark: str, *, archive: bool) -> None:
    """Check that an export may be written to `out`: nothing is there, or only an earlier export.

    An earlier archive holds a file called `mark`; any other export has `mark` near its beginning.

    Raises:
        PublishRefusedError: the file must not go there.
    """
    place = Path(os.path.realpath(out))
    for name in _AUTHOR_FOLDERS:
        if place.is_relative_to(os.path.realpath(root / name)):
            raise PublishRefusedError(
                f"{out} lies in {name}/ of the project, which cannot hold an export"
            )
    if any((folder / MARKER).is_file() for folder in place.parents):
        raise PublishRefusedError(
            f"{out} lies in a published site, which the next build replaces",
            help="write the file beside it",
        )
    if place.is_dir():
        raise PublishRefusedError(f"{out} is a folder", help="name a file, such as `course.zip`")
    if not os.path.lexists(place):
        return
    with contextlib.suppress(OSError, zipfile.BadZipFile, ValueError):
        if archive:
            with zipfile.ZipFile(place) as entries:
                if mark in entries.namelist():
                    return
        elif mark.encode() in read_regular(place)[:1000]:
            return
    raise PublishRefusedError(
        f"{out} exists and is not such an export", help="move it away, or name another file"
    )


def write_export(out: Path, files: Iterable[SiteFile], *, archive: bool) -> int:
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
                    write_archive(target, files)
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
