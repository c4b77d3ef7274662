"""`coursebuild build`: verify everything, render the site, and publish it when nothing is wrong.

Entry points: `build(options, out)`; `prepare(options, progress)`, the same without publishing.
"""

from __future__ import annotations

import functools
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from coursebuild.diagnostics import Diagnostic, Severity, diagnose
from coursebuild.effects.locks import project_lock
from coursebuild.effects.packages import distributions, library_files
from coursebuild.effects.read import read_bytes
from coursebuild.effects.resources import bundled_files, template_texts
from coursebuild.effects.site_swap import check_out, publish
from coursebuild.effects.store import kept
from coursebuild.model import Course
from coursebuild.pipeline.check import no_lessons
from coursebuild.pipeline.depends import depends_on
from coursebuild.pipeline.judge import judge
from coursebuild.pipeline.load import Loaded, load
from coursebuild.pipeline.options import Options
from coursebuild.pipeline.progress import Progress
from coursebuild.pipeline.verify import Verified, verify
from coursebuild.report import Report
from coursebuild.results import OutputFile
from coursebuild.source import Source


@dataclass(frozen=True, slots=True)
class Prepared:
    """A verdict on the course, and its site; the site is empty where something is wrong."""

    report: Report
    files: tuple[OutputFile, ...]


def build(options: Options, out: Path) -> Report:
    """Publish the course into `out` (relative to the course's folder), or nothing."""
    progress = Progress(quiet=options.quiet)
    check_out(options.root, options.root / out)
    from coursebuild.render.compressed import compressed_files

    with project_lock(options.root, progress.say):
        prepared = prepare(options, progress)
        if not prepared.report.ok:
            return replace(prepared.report, remarks=(_unpublished(options.root, out),))
        with progress.stage("compressing"):
            copies = compressed_files(prepared.files, functools.partial(_kept_copy, options.root))
        with progress.stage("publishing"):
            publish(options.root, options.root / out, (*prepared.files, *copies))
    return replace(prepared.report, remarks=(f"published {len(prepared.files)} files in {out}",))


def _kept_copy(root: Path, key: str, make: Callable[[], bytes]) -> bytes:
    return kept(root, "compressed", key, make)


def _unpublished(root: Path, out: Path) -> str:
    there = (root / out).exists()
    return "nothing was published" + (f"; {out} stays as it is" if there else "")


def prepare(options: Options, progress: Progress) -> Prepared:
    """Verify and render. The caller holds the course's lock."""
    began = time.monotonic()
    loaded = load(options.root)
    if loaded.course is None:
        report = judge(None, loaded.diagnostics, (), time.monotonic() - began, lessons=0)
        return Prepared(report, ())
    verified = verify(loaded.course, options, progress, static=True)
    found = [*loaded.diagnostics, *verified.diagnostics, *no_lessons(loaded.course)]
    files: tuple[OutputFile, ...] = ()
    if all(d.severity is not Severity.ERROR for d in found):
        with progress.stage("rendering"):
            files = _render(loaded.course, verified, options)
            found += _broken_links(files, loaded.course)
    report = _report(loaded, verified, found, time.monotonic() - began)
    report = replace(report, depends=depends_on(loaded.course, verified.results))
    return Prepared(report, files if report.ok else ())


def _report(loaded: Loaded, verified: Verified, found: list[Diagnostic], seconds: float) -> Report:
    course = loaded.course
    written = [] if course is None else [x for x in course.lessons if x.document is not None]
    return judge(course, found, verified.scripts, seconds, lessons=len(written), labs=verified.labs)


def _render(course: Course, verified: Verified, options: Options) -> tuple[OutputFile, ...]:
    from coursebuild.render.assets import Assets
    from coursebuild.render.fonts import FontJob, subset_font
    from coursebuild.render.site import SiteOptions, render_site
    from coursebuild.render.zips import Package, Surroundings, imported_modules

    def subset(job: FontJob) -> bytes:
        return kept(options.root, "fonts", job.key, lambda: subset_font(job))

    files = tuple(OutputFile(path, read_bytes(options.root, path)) for path in course.files)
    library = library_files()
    packages = tuple(Package(*p) for p in distributions(imported_modules(course, library)))
    meshes = tuple(file for file in files if file.path.startswith("models/"))
    around = Surroundings(packages, library, meshes)
    site = SiteOptions(files, around, subset)
    return render_site(course, verified.results, Assets(template_texts(), bundled_files()), site)


def _broken_links(files: tuple[OutputFile, ...], course: Course) -> list[Diagnostic]:
    """Links of the built pages that lead nowhere; most are found in the sources already."""
    from coursebuild.render.links import check_links

    texts = {file.path: file.data for file in files}
    found = []
    for broken in check_links(files, course.base_url):
        page = Source(f"public/{broken.page}", texts[broken.page].decode())
        start = page.line_starts[broken.line - 1]
        at = page.text.find(broken.url, start)
        span = page.span(at, at + len(broken.url)) if at >= 0 else page.span(start, start)
        help = f"did you mean `{broken.near}`?" if broken.near else ""
        message = f"`{broken.url}` leads nowhere: {broken.reason}"
        found.append(diagnose("link-broken", span, message, help=help))
    return found
