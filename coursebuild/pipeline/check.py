"""`coursebuild check`: verify the course, or some lessons of it; publish nothing.

Entry points: `check(options, names)`; `read_and_verify`, which a build begins with as well.
"""

from __future__ import annotations

import time
from collections.abc import Iterable
from typing import TYPE_CHECKING

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core.files.locks import project_lock
from coursebuild.core.model import Course
from coursebuild.core.registry import feature_trials, unproven
from coursebuild.core.run.script_environment import Interpreter
from coursebuild.core.scripts.extract import extract
from coursebuild.core.text.diagnostics import Diagnostic
from coursebuild.numerics.reports import Reports
from coursebuild.pipeline.documents import Documents
from coursebuild.pipeline.judge import depends_on, judge
from coursebuild.pipeline.load import load
from coursebuild.pipeline.options import Options, Selection, select
from coursebuild.pipeline.progress import Progress
from coursebuild.pipeline.shown_reports import shown_reports
from coursebuild.pipeline.verify import Verified, verify
from coursebuild.report import Report
from coursebuild.report.values import plural

if TYPE_CHECKING:
    from coursebuild.core.model.sensitivity import Sensitivity
    from coursebuild.pipeline.shards import Shard


def check(
    options: Options,
    names: tuple[str, ...] = (),
    *,
    shard: Shard | None = None,
    timings: str | None = None,
    sensitivity: bool = False,
    truth: bool = False,
) -> Report:
    """Verify the lessons that the names mean; all, and the pages, where there are none.

    `shard` is the part of the scripts and labs that this run takes; `timings` the file into which
    it writes how long each took. `sensitivity`: say which printed digits repeat when initial states
    are moved a little. `truth`: list what nothing in the course proves.
    """
    progress = Progress(quiet=options.quiet)
    with project_lock(options.root, progress.say):
        with Documents(options.store, options.jobs, progress.stage) as documents:
            checked = read_and_verify(options, progress, documents, names, shard=shard)
        course, verified = checked.course, checked.verified
        if course is None or verified is None:
            return checked.report()
        if timings is not None:
            from coursebuild.pipeline.shards import write_timings

            write_timings(timings, _seconds(verified), _names(course))
        told = unproven(course) if truth else ()
        sensitive, found = None, [one for one in told if isinstance(one, Diagnostic)]
        if sensitivity:
            sensitive, warnings = _sensitivity(course, options, progress, verified, checked.chosen)
            found += warnings
        remarks = [one for one in told if isinstance(one, str)]
        if shard is not None:
            remarks.append(_part(shard, verified))
        return replace(checked.report(found), remarks=tuple(remarks), sensitivity=sensitive)


class CheckedCourse(Struct, frozen=True):
    """A course, what running it found, and all that is wrong with it."""

    began: float
    """When the command began, by `time.monotonic`."""
    diagnostics: tuple[Diagnostic, ...]
    chosen: Selection
    """What the command is about."""
    course: Course | None = None
    """Nothing where the map cannot be read; likewise the others."""
    verified: Verified | None = None
    reports: Reports = Reports()
    """Those that pages may show."""
    interpreter: Interpreter | None = None
    """Where the scripts ran, if not here."""

    @property
    def is_sound(self) -> bool:
        """Whether nothing is wrong but what warnings say."""
        return self.course is not None and not any(d.is_error for d in self.diagnostics)

    def report(self, more: Iterable[Diagnostic] = ()) -> Report:
        """The report; `more` is what else was found."""
        found = (*self.diagnostics, *more)
        course, verified, chosen = self.course, self.verified, self.chosen
        if course is None or verified is None:
            return judge(None, found, self.began)
        report = judge(
            course,
            found,
            self.began,
            scripts=verified.scripts,
            lessons=len(chosen.lessons),
            documents=chosen.documents,
            labs=verified.labs,
        )
        return replace(report, depends=depends_on(course, verified.results, self.interpreter))


def read_and_verify(
    options: Options,
    progress: Progress,
    documents: Documents,
    names: tuple[str, ...] = (),
    *,
    static: bool = False,
    shard: Shard | None = None,
) -> CheckedCourse:
    """What `check`, `build` and `export` do: read a course, check it, run it.

    The caller holds the course's lock. `static`: with what pages are made of.
    """
    began = time.monotonic()
    loaded = load(options.root, documents, trusted=options.sandbox is None)
    course = loaded.value
    if course is None:
        return CheckedCourse(began, loaded.diagnostics, Selection((), (), None))
    chosen = select(course, names, options.root)
    options = options.for_course(course)
    verified = verify(course, options, progress, chosen.documents, static=static, shard=shard)
    reports = shown_reports(options.root, course)
    found = (*loaded.diagnostics, *verified.diagnostics, *reports.diagnostics)
    return CheckedCourse(began, found, chosen, course, verified, reports.value, options.interpreter)


def _sensitivity(
    course: Course, options: Options, progress: Progress, verified: Verified, chosen: Selection
) -> tuple[tuple[Sensitivity, ...], list[Diagnostic]]:
    """Which printed digits hold, and the warnings of those that do not."""
    from coursebuild.core.scripts.sensitivity import noise_warnings
    from coursebuild.pipeline.sensitivity import measure

    by_path = {run.path: run for run in verified.results.runs}
    ran = [extraction for extraction in extract(course).value if extraction.path in by_path]
    runs = [by_path[extraction.path] for extraction in ran]
    own = options.for_course(course)
    measured = measure(course, own, progress, ran, runs, chosen.documents, halve=True)
    return measured, [warning for one in measured for warning in noise_warnings(one)]


def _part(shard: Shard, verified: Verified) -> str:
    """What a part of the work was, so that its report is not taken for the whole."""
    scripts, labs = plural(len(verified.scripts), "script"), plural(len(verified.labs), "lab")
    return f"this was part {shard} of the work: {scripts} and {labs}"


def _seconds(verified: Verified) -> dict[str, float]:
    """How long scripts and labs took, or took when they were last run."""
    found = {s.path: s.seconds for s in verified.scripts if s.status not in ("skipped", "norun")}
    return found | {lab.name: lab.seconds for lab in verified.labs if lab.tried}


def _names(course: Course) -> list[str]:
    return [*(e.path for e in extract(course).value), *feature_trials(course)]
