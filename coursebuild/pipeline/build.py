"""`coursebuild build`: verify the course, make its site, and publish it when nothing is wrong.

Entry points: `build(options, out)`; `prepare(options)`, what it would publish.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from msgspec.structs import replace

from coursebuild.core.engine.publish import check_output_folder, publish
from coursebuild.core.files.locks import project_lock
from coursebuild.core.model.results import Results
from coursebuild.pipeline.check import read_and_verify
from coursebuild.pipeline.documents import Documents
from coursebuild.pipeline.options import Options
from coursebuild.report import Report

if TYPE_CHECKING:
    from coursebuild.core.model import Course
    from coursebuild.core.model.results import Reports
    from coursebuild.core.text.diagnostics import Diagnostic
    from coursebuild.pipeline.site import Site

MakeSite: TypeAlias = "Callable[[Course, Results, Documents, Options, Reports], Site]"
"""Makes the files of a course in which nothing is wrong."""


def build(options: Options, out: Path) -> Report:
    """Publish the course into `out` (relative to the course's folder), or nothing."""
    place = options.root / out
    check_output_folder(options.root, place)
    with project_lock(options.root, options.progress.say), prepare(options) as (report, site):
        if site is None:
            stays = f"; {out} stays as it is" if place.exists() else ""
            return replace(report, remarks=(f"nothing was published{stays}",))
        stage = functools.partial(options.progress.stage, "publishing")
        publish(options.root, place, site.files, site.file_list, jobs=options.jobs, stage=stage)
    count = len(site.files) + (site.file_list is not None)
    return replace(report, remarks=(f"published {count} files in {out}",))


@contextmanager
def prepare(options: Options, make: MakeSite | None = None) -> Iterator[tuple[Report, Site | None]]:
    """The report on a course, and its site where nothing is wrong.

    The caller holds the course's lock, and makes the files before the context ends. `make` makes
    other files than those of the site.
    """
    with Documents(options) as documents:
        checked_course = read_and_verify(options, documents, static=True)
        if isinstance(checked_course, Report):
            yield checked_course, None
            return
        report = checked_course.report()
        if not report.ok:
            yield report, None
            return
        from coursebuild.core.pages.renderer import TemplateFailure
        from coursebuild.pipeline.site import site_files

        course, results = checked_course.course, checked_course.verification.results
        diagnostics: tuple[Diagnostic, ...] = ()
        try:
            reports = checked_course.reports
            site = (make or site_files)(course, results, documents, options, reports)
            diagnostics = site.diagnostics
            if course.theme.templates:  # these may fail on any page
                for file in site.files:
                    if file.path.endswith(".html"):
                        file.make()
        except TemplateFailure as failure:
            from coursebuild.pipeline.theme import template_diagnostic

            diagnostics = (template_diagnostic(course, failure),)
        report = checked_course.report(diagnostics)
        yield report, site if report.ok else None
