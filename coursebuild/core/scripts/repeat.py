"""Two runs of a script that differ although nothing that it depends on has changed.

Entry points: `repeat_findings`, for a remembered run and a later one; `instability_diagnostic`, for
two runs whose output is to be recorded.

An output that its lesson calls volatile may differ, and so may one that matches the recorded output
both times.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from coursebuild.core.model import Comparison, Course, Recording, Table, find_blocks
from coursebuild.core.model.results import Outcome, ScriptRun
from coursebuild.core.scripts.align import Step, StepKind, align
from coursebuild.core.scripts.compare import compare
from coursebuild.core.scripts.diff import quote, text_diff
from coursebuild.core.scripts.extract import Extraction
from coursebuild.core.scripts.lines import LineMatcher
from coursebuild.core.scripts.mapped_text import Side
from coursebuild.core.text.diagnostics import Diagnostic, Note, diagnose

_MAX_NOTES, _WIDTH = 10, 80


def repeat_findings(
    course: Course,
    extractions: Iterable[Extraction],
    differing_runs: Sequence[tuple[ScriptRun, ScriptRun]],
) -> tuple[Diagnostic, ...]:
    """A warning for each script; `differing_runs` are pairs of a remembered run and a new one."""
    by_path = {extraction.path: extraction for extraction in extractions}
    return tuple(
        _unrepeatable(by_path[now.path], before, now)
        for before, now in differing_runs
        if now.path in by_path and not _may_differ(course, before, now)
    )


def _may_differ(course: Course, before: ScriptRun, now: ScriptRun) -> bool:
    if before.outcome is not Outcome.OK or now.outcome is not Outcome.OK:
        return False
    recordings = [
        recording
        for document in course.documents
        for recording in find_blocks(document, Recording)
        if recording.script == now.path and recording.readable
    ]
    return bool(recordings) and all(
        compare(r, course.comparison_of(r), run.stdout).status != "drift"
        for r in recordings
        for run in (before, now)
    )


def _unrepeatable(extraction: Extraction, before: ScriptRun, now: ScriptRun) -> Diagnostic:
    notes = []
    if (before.outcome, before.status) != (now.outcome, now.status):
        notes.append(
            Note(f"it ended otherwise: before {_describe_end(before)}, now {_describe_end(now)}")
        )
    diff = text_diff(before.stdout, now.stdout)
    if diff:
        notes.append(Note("its output:\n" + diff))
    return diagnose(
        "script-unrepeatable",
        extraction.script.span.first_line(),
        f"`{extraction.path}` behaves differently than before, though nothing that "
        "it is known to depend on has changed",
        help="make it do the same each time (a fixed seed, no clock, files that it opens itself), "
        "or put `volatile` on its output",
        notes=notes,
    )


def _describe_end(run: ScriptRun) -> str:
    return f"{run.outcome.value} ({run.status})" if run.status else run.outcome.value


def instability_diagnostic(
    recording: Recording, first: Side, second: Side, comparison: Comparison
) -> Diagnostic:
    """Say which lines differ between two runs.

    `first` is the recorded or new text that matches the first run.
    """
    steps = align(first, second, LineMatcher(comparison))
    different_steps = [step for step in steps if step.kind in _DIFFERENT]
    notes = [
        Note(_describe_difference(step, first, second)) for step in different_steps[:_MAX_NOTES]
    ]
    if (rest := len(different_steps) - _MAX_NOTES) > 0:
        notes.append(Note(f"and {rest} more {'line' if rest == 1 else 'lines'}"))
    return diagnose(
        "output-unstable",
        recording.caption_span,
        "two runs of the script printed different lines",
        help=_TABLE_HELP if isinstance(recording.body, Table) else _HELP,
        notes=notes,
    )


_REPEAT_HELP = "make the script print the same each time (a fixed seed, no clock)"
_HELP = (
    f'{_REPEAT_HELP}, or say what varies by `volatile="…"` on the fence, or by `ellipsis` and `...`'
)
_TABLE_HELP = f"{_REPEAT_HELP}, or record the output in a `text` fence with `volatile`"


_DIFFERENT = (StepKind.DIFFERS, StepKind.MISSING, StepKind.EXTRA)


def _describe_difference(step: Step, first: Side, second: Side) -> str:
    if step.kind is StepKind.MISSING:
        return f"{quote(first.lines[step.recorded], _WIDTH)} was printed in the first run only"
    if step.kind is StepKind.EXTRA:
        return f"{quote(second.lines[step.printed], _WIDTH)} was printed in the second run only"
    a, b = first.lines[step.recorded], second.lines[step.printed]
    number = second.raw_line(step.printed)
    return f"line {number}: {quote(a, _WIDTH)} in one run, {quote(b, _WIDTH)} in the next"
