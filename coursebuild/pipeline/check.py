"""`coursebuild check`: verify the course, or some lessons of it; publish nothing.

Entry point: `check(options, names)`.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace

from coursebuild.diagnostics import Diagnostic, Severity, diagnose
from coursebuild.effects.locks import project_lock
from coursebuild.model import Course, Status
from coursebuild.pipeline.depends import depends_on
from coursebuild.pipeline.judge import judge
from coursebuild.pipeline.load import load
from coursebuild.pipeline.options import Options, Selection, select
from coursebuild.pipeline.progress import Progress
from coursebuild.pipeline.verify import verify
from coursebuild.report import Report, ScriptLine


def check(options: Options, names: tuple[str, ...] = ()) -> Report:
    """Verify the lessons that the names mean; all, and the pages, where there are none."""
    progress = Progress(quiet=options.quiet)
    with project_lock(options.root, progress.say):
        return _check(options, names, progress)


def _check(options: Options, names: tuple[str, ...], progress: Progress) -> Report:
    began = time.monotonic()
    loaded = load(options.root)
    course = loaded.course
    if course is None:
        return judge(None, loaded.diagnostics, (), time.monotonic() - began, lessons=0)
    chosen = select(course, names, options.root)
    verified = verify(course, options, progress, chosen.documents)
    found = [*loaded.diagnostics, *verified.diagnostics]
    found += no_lessons(course)
    found += _no_scripts(course, chosen, verified.scripts, found)
    report = judge(
        course,
        found,
        verified.scripts,
        time.monotonic() - began,
        lessons=len(chosen.lessons),
        documents=chosen.documents,
        labs=verified.labs,
    )
    return replace(report, depends=depends_on(course, verified.results))


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
    told = wrong if chosen.documents is None else wrong & {*chosen.documents, course.map.path}
    if told or any(line.status not in ("skipped", "norun") for line in scripts):
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
