"""Which files the verdict on a course depends on, beside those in its own folders.

Entry point: `depends_on(course, results)`.
"""

from __future__ import annotations

from coursebuild.core.model import Course
from coursebuild.core.model.results import Outcome, Results

_NOT_RUN = (Outcome.NORUN, Outcome.SKIPPED)
"""What is installed is looked at in any case."""


def depends_on(course: Course, results: Results) -> tuple[str, ...] | None:
    """The files; `None` where nobody can know them all, as where a script starts other programs."""
    files: set[str] = {page.path for page in course.pages}
    for run in results.runs:
        if run.outcome in _NOT_RUN:
            continue
        if run.trace is None or run.trace.opaque or "." in run.trace.folders:
            return None
        files |= {*run.trace.files, *run.trace.folders, *run.trace.outside}
    for _, compiled in results.models:
        if compiled.facts is not None:
            files |= {*compiled.facts.includes}
    return tuple(sorted(files))
