"""From findings to a report: silenced warnings are left out, the rest is sorted and counted.

Entry point: `judge`.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from fnmatch import fnmatchcase

from coursebuild.core.model import Course, Silence
from coursebuild.core.text.diagnostics import Diagnostic, Severity, sort_diagnostics
from coursebuild.report import LabLine, Report, ScriptLine, Summary

_NOT_RUN = ("skipped", "norun")
_OF_RUNS = (
    "script-failed",
    "script-timeout",
    "script-killed",
    "script-output-limit",
    "script-encoding",
    "script-silent",
    "script-diverged",
    "script-penetration",
)
"""Only scripts that were to be run have these; they may point at a line of another lesson."""


def judge(
    course: Course | None,
    diagnostics: Iterable[Diagnostic],
    scripts: Sequence[ScriptLine],
    seconds: float,
    *,
    lessons: int,
    documents: Collection[str] | None = None,
    remarks: tuple[str, ...] = (),
    labs: tuple[LabLine, ...] = (),
) -> Report:
    """The report of a command.

    `documents` limits it to mistakes in these files and in the map, and of the scripts that ran.
    """
    told = sort_diagnostics(diagnostics)
    if documents is not None and course is not None:
        wanted = {*documents, course.map.path}
        told = tuple(d for d in told if d.span.path in wanted or d.rule in _OF_RUNS)
    silences = course.silences if course is not None else ()
    kept = tuple(d for d in told if not _silenced(d, silences))
    errors = sum(d.severity is Severity.ERROR for d in kept)
    summary = Summary(
        lessons=lessons,
        scripts=len(scripts),
        ran=sum(line.status not in _NOT_RUN for line in scripts),
        skipped=sum(line.status == "skipped" for line in scripts),
        errors=errors,
        warnings=len(kept) - errors,
        silenced=len(told) - len(kept),
        seconds=seconds,
        cached=sum(line.cached for line in scripts),
    )
    return Report(kept, tuple(scripts), summary, remarks, labs)


def _silenced(diagnostic: Diagnostic, silences: Sequence[Silence]) -> bool:
    """Errors cannot be silenced."""
    return diagnostic.severity is Severity.WARNING and any(
        silence.rule == diagnostic.rule
        and (silence.path is None or fnmatchcase(diagnostic.span.path, silence.path))
        for silence in silences
    )
