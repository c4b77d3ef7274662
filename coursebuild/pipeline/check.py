"""`coursebuild check`: verify the course, or some lessons of it; publish nothing."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core.files.locks import project_lock
from coursebuild.core.model import Course
from coursebuild.core.model.results import Reports
from coursebuild.core.registry import feature_trials, unproven
from coursebuild.core.scripts.extract import extract
from coursebuild.core.text.diagnostics import Diagnostic
from coursebuild.pipeline.judge import depends_on, judge
from coursebuild.pipeline.load import Code, load
from coursebuild.pipeline.options import Options, select
from coursebuild.pipeline.reader import Reader
from coursebuild.pipeline.scripts import measure_sensitivity
from coursebuild.pipeline.shown_reports import shown_reports
from coursebuild.pipeline.verify import Verification, verify
from coursebuild.report import Report
from coursebuild.report.values import plural

if TYPE_CHECKING:
    from coursebuild.core.scripts.sensitivity import Sensitivity
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
    it writes how long each took. `sensitivity`: run again what was recorded from one run, and say
    which printed digits repeat when initial states are moved a little. `truth`: list what nothing
    in the course proves.
    """
    with project_lock(options.root, options.progress.say):
        with Reader(options) as reader:
            checked_course = read_and_verify(
                options, reader, names, shard=shard, repeat=sensitivity
            )
        if isinstance(checked_course, Report):
            return checked_course
        course, verification = checked_course.course, checked_course.verification
        if timings is not None:
            from coursebuild.pipeline.shards import write_timings

            seconds = {s.path: s.seconds for s in verification.scripts if s.did_run}
            seconds |= {lab.name: lab.seconds for lab in verification.labs if lab.tried}
            names_of_course = [*(e.path for e in extract(course).value), *feature_trials(course)]
            write_timings(timings, seconds, names_of_course)
        claims = unproven(course, verification.results.runs) if truth else ()
        diagnostics: list[Diagnostic] = []
        remarks = [claim for claim in claims if isinstance(claim, str)]
        sensitivities: tuple[Sensitivity, ...] | None = None
        if sensitivity:
            from coursebuild.core.scripts.sensitivity import noise_warnings

            runs, selected = verification.results.runs, checked_course.documents
            sensitivities = measure_sensitivity(
                course, checked_course.options, runs, selected, halve=True
            )
            diagnostics += (warning for s in sensitivities for warning in noise_warnings(s))
        if shard is not None:
            scripts = plural(len(verification.scripts), "script")
            labs = plural(len(verification.labs), "lab")
            # Else a reader of the report could take this for the whole.
            remarks.append(f"this was part {shard} of the work: {scripts} and {labs}")
        inventory = [claim for claim in claims if isinstance(claim, Diagnostic)]
        report = checked_course.report(diagnostics, inventory)
        return replace(report, remarks=tuple(remarks), sensitivity=sensitivities)


class CheckedCourse(Struct, frozen=True):
    """A course with the results of running it and everything that is wrong with it."""

    began: float
    """When the command began, by `time.monotonic`."""
    course: Course
    options: Options
    """With the course's interpreter."""
    documents: frozenset[str] | None
    """The paths of the lessons and pages that the command is about; `None`: all."""
    verification: Verification
    reports: Reports
    """Those that pages may show."""
    diagnostics: tuple[Diagnostic, ...]

    def report(
        self, further: Iterable[Diagnostic] = (), inventory: Sequence[Diagnostic] = ()
    ) -> Report:
        """The report; `further` are diagnostics found since, for `inventory` see `judge`."""
        verification = self.verification
        report = judge(
            self.course,
            (*self.diagnostics, *further),
            self.began,
            scripts=verification.scripts,
            documents=self.documents,
            labs=verification.labs,
            strict=self.options.strict or self.course.strict,
            inventory=inventory,
        )
        if report.summary.unrepeated:  # what repeats them changes no file
            return report
        depends = depends_on(self.course, verification.results, self.options.interpreter)
        return replace(report, depends=depends)


def read_and_verify(
    options: Options,
    reader: Reader,
    names: tuple[str, ...] = (),
    *,
    static: bool = False,
    shard: Shard | None = None,
    repeat: bool = False,
    texts: Mapping[str, str] = {},
) -> CheckedCourse | Report:
    """What `check`, `build` and `export` do: read a course, check it, run it.

    Where the map cannot be read, there is only a report. The caller holds the course's lock.
    `static`: with the static forms of labs, for pages. `repeat`: see `verify`. `texts`: those
    that files are to have, by path, in place of what they hold.
    """
    began = time.monotonic()
    code: Code = "run" if options.sandbox is None else "refuse"
    parsed_course = load(options.root, reader, texts, code=code)
    course = parsed_course.value
    if course is None:
        return judge(None, parsed_course.diagnostics, began, strict=options.strict)
    selected = select(course, names, options.root)
    options = options.for_course(course)
    verification = verify(course, options, selected, static=static, shard=shard, repeat=repeat)
    reports = shown_reports(options.root, course)
    diagnostics = (*parsed_course.diagnostics, *verification.diagnostics, *reports.diagnostics)
    return CheckedCourse(began, course, options, selected, verification, reports.value, diagnostics)
