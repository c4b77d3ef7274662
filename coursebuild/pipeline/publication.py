"""`coursebuild build` and `export`: verify the course, and write its site or a file of it.

Entry points: `build(options, out)`; `export(options, name, out)`, where features have the
exporters; `make_files`, what they share. Nothing is written where something is wrong.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TypeVar

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core.engine.archives import check_target, write_export
from coursebuild.core.engine.publish import check_output_folder, publish
from coursebuild.core.features import Exporter
from coursebuild.core.files.course_features import load_course_features
from coursebuild.core.files.errors import EffectError, UsageError
from coursebuild.core.files.locks import project_lock
from coursebuild.core.files.read import read_bytes, read_sources
from coursebuild.core.files.resources import Bundle, prepared_folder, template_texts
from coursebuild.core.model import Document
from coursebuild.core.model.results import SiteFile
from coursebuild.core.pages.added_files import ExportContext
from coursebuild.core.pages.assets import Assets
from coursebuild.core.pages.context import PageContext
from coursebuild.core.pages.library import Library
from coursebuild.core.pages.materials import make_library
from coursebuild.core.pages.page_list import page_list
from coursebuild.core.pages.renderer import TemplateFailure
from coursebuild.core.registry import find_exporter
from coursebuild.core.text.diagnostics import Diagnostic
from coursebuild.pipeline.check import read_and_verify
from coursebuild.pipeline.load import MAP
from coursebuild.pipeline.options import Options
from coursebuild.pipeline.reader import Reader
from coursebuild.pipeline.site import Site, page_request
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


def export(options: Options, name: str, out: Path | None) -> Report:
    """Write the file to `out` (relative to the course's folder), or nothing.

    Raises:
        UsageError: no feature has an exporter of this name.
    """
    exporter = _find_exporter(options.root, name)
    out = out or Path(exporter.file)
    place = options.root / out
    check_target(options.root, place, exporter.mark, archive=exporter.archive)
    with project_lock(options.root, options.progress.say), Reader(options) as reader:
        make = functools.partial(_make_export, exporter, reader, options)
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

    The caller holds the course's lock, and closes the reader once the files are written.
    """
    checked_course = read_and_verify(options, reader, static=True)
    if isinstance(checked_course, Report):
        return checked_course, None
    report = checked_course.report()
    if not report.ok:
        return report, None
    course, results = checked_course.course, checked_course.verification.results
    assets = Assets(template_texts(), Bundle(), prepared_folder())
    try:
        outputs = make(make_library(course, results, assets, checked_course.reports))
        if course.theme.templates:  # these may fail on any page
            for file in outputs.files:
                if file.path.endswith(".html"):
                    file.make()
        report = checked_course.report(outputs.diagnostics)
    except TemplateFailure as failure:
        from coursebuild.pipeline.theme_files import template_diagnostic

        return checked_course.report((template_diagnostic(course, failure),)), None
    return report, outputs if report.ok else None


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


def _make_export(exporter: Exporter, reader: Reader, options: Options, library: Library) -> _Export:
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
        library, library.assets, site, page, functools.partial(read_bytes, options.root)
    )
    files: list[SiteFile] = []
    for file in exporter.make(context):
        if isinstance(file, Diagnostic):
            diagnostics.append(file)
        else:
            files.append(file)
    return _Export(tuple(files), tuple(diagnostics))
