"""`coursebuild check`: verify the course, or some lessons of it; publish nothing.

Entry point: `check(options, names)`.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import TYPE_CHECKING

from msgspec.structs import replace

from coursebuild.core.files.locks import project_lock
from coursebuild.core.model import Course, Status
from coursebuild.core.registry import feature_trials, unproven
from coursebuild.core.scripts.extract import extract
from coursebuild.core.text.diagnostics import Diagnostic, Severity, diagnose
from coursebuild.pipeline.documents import Documents
from coursebuild.pipeline.judge import depends_on, judge
from coursebuild.pipeline.load import load
from coursebuild.pipeline.options import Options, Selection, select
from coursebuild.pipeline.progress import Progress
from coursebuild.pipeline.shown_reports import shown_reports
from coursebuild.pipeline.verify import Verified, verify
from coursebuild.report import Report, ScriptLine
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
    it writes how long each took. `sensitivity`: say which printed digits hold when initial states
    are moved a little. `truth`: list what nothing in the course proves.
    """
    progress = Progress(quiet=options.quiet)
    with project_lock(options.root, progress.say):
        return _check(options, names, progress, shard, timings, sensitivity, truth)


def _check(
    options: Options,
    names: tuple[str, ...],
    progress: Progress,
    shard: Shard | None,
    timings: str | None,
    sensitivity: bool,
    truth: bool,
) -> Report:
    began = time.monotonic()
    with Documents(options.store, options.jobs, progress.stage) as documents:
        loaded = load(options.root, documents)
    course = loaded.course
    if course is None:
        return judge(None, loaded.diagnostics, began)
    chosen = select(course, names, options.root)
    verified = verify(course, options, progress, chosen.documents, shard=shard)
    if timings is not None:
        from coursebuild.pipeline.shards import write_timings

        write_timings(timings, _seconds(verified), _names(course))
    found = [*loaded.diagnostics, *verified.diagnostics]
    found += no_lessons(course)
    sensitive = None
    if sensitivity:
        sensitive, warnings = _sensitivity(course, options, progress, verified, chosen)
        found += warnings
    told = unproven(course) if truth else ()
    found += [one for one in told if isinstance(one, Diagnostic)]
    found += shown_reports(options.root, course).diagnostics
    if shard is None or not any(True for _ in extract(course).value):
        found += _no_scripts(course, chosen, verified.scripts, found)
    remarks = [one for one in told if isinstance(one, str)]
    if shard is not None:
        remarks.append(_part(shard, verified))
    report = judge(
        course,
        found,
        began,
        scripts=verified.scripts,
        lessons=len(chosen.lessons),
        documents=chosen.documents,
        labs=verified.labs,
        remarks=tuple(remarks),
    )
    return replace(report, depends=depends_on(course, verified.results), sensitivity=sensitive)


def _sensitivity(
    course: Course, options: Options, progress: Progress, verified: Verified, chosen: Selection
) -> tuple[tuple[Sensitivity, ...], list[Diagnostic]]:
    """Which printed digits hold, and the warnings of those that do not."""
    from coursebuild.core.scripts.sensitivity import noise
    from coursebuild.pipeline.sensitivity import measure

    by_path = {run.path: run for run in verified.results.runs}
    ran = [extraction for extraction in extract(course).value if extraction.path in by_path]
    runs = [by_path[extraction.path] for extraction in ran]
    measured = measure(course, options, progress, ran, runs, chosen.documents)
    return measured, [warning for one in measured for warning in noise(one)]


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


def no_lessons(course: Course) -> list[Diagnostic]:
    """A course with nothing to publish is a mistake, not a success."""
    if any(lesson.status is not Status.PLANNED for lesson in course.lessons):
        return []
    message = "no lesson of the course is written"
    help = "write a file in content/lessons, and give its entry in the map a `status`"
    return [diagnose("no-lessons", course.map.span(0, 0), message, help=help)]


def _no_scripts(
    course: Course, chosen: Selection, scripts: Sequence[ScriptLine], found: Sequence[Diagnostic]
) -> list[Diagnostic]:
    """That nothing was verified, where no other mistake says why."""
    wrong = {d.span.path for d in found if d.severity is Severity.ERROR}
    explained = wrong if chosen.documents is None else wrong & {*chosen.documents, course.map.path}
    if explained or any(line.status not in ("skipped", "norun") for line in scripts):
        return []
    which = "none that can run here" if scripts else "none"
    message = f"no script was run, so that nothing was verified: {_chosen(chosen)} {which}"
    help = "a script is a block that begins with ```` ```python file=examples/….py ````"
    return [diagnose("no-scripts", course.map.span(0, 0), message, help="" if scripts else help)]


def _chosen(chosen: Selection) -> str:
    if chosen.documents is None:
        return "the course has"
    ids = [*(lesson.id for lesson in chosen.lessons), *(page.id for page in chosen.pages)]
    return f"{', '.join(ids)} {'have' if len(ids) > 1 else 'has'}"
