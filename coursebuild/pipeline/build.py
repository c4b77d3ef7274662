"""`coursebuild build`: verify everything, render the site, and publish it when nothing is wrong.

Entry points: `build(options, out)`; `prepare(options, progress)`, what it would publish.
"""

from __future__ import annotations

import functools
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core.engine.publish import check_out, publish
from coursebuild.core.files.locks import project_lock
from coursebuild.core.model.results import FileList, Results, SiteFile
from coursebuild.core.text.diagnostics import Severity
from coursebuild.pipeline.check import no_lessons
from coursebuild.pipeline.documents import Documents
from coursebuild.pipeline.judge import depends_on, judge
from coursebuild.pipeline.load import load
from coursebuild.pipeline.options import Options
from coursebuild.pipeline.progress import Progress
from coursebuild.pipeline.shown_reports import shown_reports
from coursebuild.pipeline.verify import verify
from coursebuild.report import Report

if TYPE_CHECKING:
    from coursebuild.core.model import Course
    from coursebuild.numerics.reports import Reports
    from coursebuild.pipeline.site import Site


class Prepared(Struct, frozen=True):
    """A verdict on the course, and its site; the site is empty where something is wrong."""

    report: Report
    files: tuple[SiteFile, ...]
    drawn: tuple[str, ...] = ()
    """The pages that were drawn, and not known from before; site paths."""
    listed: FileList | None = None
    """The list of all files."""


def build(options: Options, out: Path) -> Report:
    """Publish the course into `out` (relative to the course's folder), or nothing."""
    progress = Progress(quiet=options.quiet)
    check_out(options.root, options.root / out)
    with project_lock(options.root, progress.say), prepare(options, progress) as prepared:
        if not prepared.report.ok:
            return replace(prepared.report, remarks=(_unpublished(options.root, out),))
        publish(
            options.root,
            options.root / out,
            prepared.files,
            prepared.listed,
            jobs=options.jobs,
            stage=functools.partial(progress.stage, "publishing"),
        )
    count = len(prepared.files) + (prepared.listed is not None)
    return replace(prepared.report, remarks=(f"published {count} files in {out}",))


def _unpublished(root: Path, out: Path) -> str:
    there = (root / out).exists()
    return "nothing was published" + (f"; {out} stays as it is" if there else "")


Make: TypeAlias = "Callable[[Course, Results, Documents, Options, Reports], Site]"
"""Puts files together from a course in which nothing is wrong."""


@contextmanager
def prepare(options: Options, progress: Progress, make: Make | None = None) -> Iterator[Prepared]:
    """Verify and render. The caller holds the course's lock, and has the files made meanwhile.

    `make` puts other files together than those of the site.
    """
    with Documents(options.store, options.jobs, progress.stage) as documents:
        yield _prepared(options, progress, documents, make)


def _prepared(
    options: Options, progress: Progress, documents: Documents, make: Make | None
) -> Prepared:
    began = time.monotonic()
    loaded = load(options.root, documents)
    if loaded.course is None:
        return Prepared(judge(None, loaded.diagnostics, began), ())
    verified = verify(loaded.course, options, progress, static=True)
    reports = shown_reports(options.root, loaded.course)
    found = [*loaded.diagnostics, *verified.diagnostics, *no_lessons(loaded.course)]
    found += reports.diagnostics
    files: tuple[SiteFile, ...] = ()
    drawn: tuple[str, ...] = ()
    listed: FileList | None = None
    if all(d.severity is not Severity.ERROR for d in found):
        from coursebuild.pipeline.site import site_files

        results = verified.results
        site = (make or site_files)(loaded.course, results, documents, options, reports.value)
        files, drawn, listed = site.files, site.drawn, site.listed
        found += site.diagnostics
    report = judge(loaded.course, found, began, scripts=verified.scripts, labs=verified.labs)
    report = replace(report, depends=depends_on(loaded.course, verified.results))
    return Prepared(report, files if report.ok else (), drawn, listed if report.ok else None)
