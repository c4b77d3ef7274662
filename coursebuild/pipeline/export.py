"""`coursebuild export`: the course as one file, for other programs and for paper.

Entry point: `export(options, name, out)`. What can be written, and how, features say. The course is
verified as for a build, and nothing is written where something is wrong.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping
from pathlib import Path

from msgspec.structs import replace

from coursebuild.core.engine.archives import check_target, write_export
from coursebuild.core.engine.prepared import prepared_folder
from coursebuild.core.features import Exporter
from coursebuild.core.files.course_features import load_course_features
from coursebuild.core.files.errors import EffectError, UsageError
from coursebuild.core.files.locks import project_lock
from coursebuild.core.files.read import read_bytes, read_sources
from coursebuild.core.files.resources import Bundle, template_texts
from coursebuild.core.model import Course, Document
from coursebuild.core.model.results import Results, SiteFile
from coursebuild.core.pages.added_files import ExportContext
from coursebuild.core.pages.assets import Assets
from coursebuild.core.pages.context import PageContext
from coursebuild.core.pages.library import Library
from coursebuild.core.pages.page_list import page_list
from coursebuild.core.registry import find_exporter
from coursebuild.core.text.diagnostics import Diagnostic
from coursebuild.numerics.reports import Reports
from coursebuild.pipeline.build import prepare
from coursebuild.pipeline.documents import Documents
from coursebuild.pipeline.load import MAP
from coursebuild.pipeline.options import Options
from coursebuild.pipeline.progress import Progress
from coursebuild.pipeline.site import Site, SiteMaker
from coursebuild.report import Report


def export(options: Options, name: str, out: Path | None) -> Report:
    """Write the file to `out` (relative to the course's folder), or nothing.

    Raises:
        UsageError: no feature has an exporter of this name.
    """
    exporter = _find(options.root, name)
    out = out or Path(exporter.file)
    place = options.root / out
    check_target(options.root, place, exporter.mark, archive=exporter.archive)
    progress = Progress(quiet=options.quiet)
    make = functools.partial(_exported, exporter)
    with (
        project_lock(options.root, progress.say),
        prepare(options, progress, make) as (report, made),
    ):
        if made is None:
            return replace(report, remarks=("nothing was written",))
        if not made.files:
            raise EffectError(f"the course has nothing that `export {name}` could write")
        with progress.stage("packing"):
            size = write_export(place, made.files, archive=exporter.archive)
    count = len(made.files)
    said = f"wrote {f'{count} files to ' if exporter.archive else ''}{out}, {_size(size)}"
    return replace(report, remarks=(said,), depends=None)


def _size(count: int) -> str:
    """A number of bytes as people say it."""
    return f"{count / 1e6:.1f} MB" if count >= 100_000 else f"{count / 1e3:.1f} kB"


def _find(root: Path, name: str) -> Exporter:
    """The exporter of a name, which a feature of the course itself may have."""
    found = find_exporter(name)
    broken: tuple[Diagnostic, ...] = ()
    if isinstance(found, str):
        from coursebuild.core.syntax.coursemap import parse_course_map

        for source in read_sources(root, [MAP]).value:
            course = parse_course_map(source).value
            broken = () if course is None else load_course_features(root, course)
        found = find_exporter(name)
    if isinstance(found, str):
        raise UsageError("; ".join((found, *(diagnostic.message for diagnostic in broken))))
    return found


def _exported(
    exporter: Exporter,
    course: Course,
    results: Results,
    documents: Documents,
    options: Options,
    reports: Reports,
) -> Site:
    """The files of an export, in the place of those of a site."""
    assets = Assets(template_texts(), Bundle(), prepared_folder())
    library = Library.of(course, results, assets, reports)
    entries = {
        document.source.path: entry
        for entry in page_list(library)
        if (document := entry.document(library)) is not None
    }
    found: list[Diagnostic] = []

    @functools.cache
    def site() -> Mapping[str, SiteFile]:
        made = SiteMaker(library, assets, documents, options).made()
        found.extend(made.diagnostics)
        return {file.path: file for file in made.files}

    def page(document: Document) -> PageContext:
        path = document.source.path
        return documents.context(path, entries[path].inputs(library), course)

    context = ExportContext(
        library, assets, site, page, functools.partial(read_bytes, options.root)
    )
    files: list[SiteFile] = []
    for made in exporter.make(context):
        if isinstance(made, Diagnostic):
            found.append(made)
        else:
            files.append(made)
    return Site(tuple(files), None, tuple(found), ())
