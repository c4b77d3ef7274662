"""Two runs of a script, with nothing changed that it depends on, that do not do the same.

Entry points: `repeat_findings`, about what is remembered and a later run; `unstable`, about two
runs of which the output is to be recorded.

An output that its lesson calls volatile may differ, and so may one that matches what is recorded
both times.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from coursebuild.core.model import Comparison, Course, Recording, Table, document_blocks
from coursebuild.core.model.results import Outcome, ScriptRun
from coursebuild.core.scripts.align import Step, StepKind, align
from coursebuild.core.scripts.compare import compare
from coursebuild.core.scripts.diff import quoted, text_diff
from coursebuild.core.scripts.extract import Extraction
from coursebuild.core.scripts.lines import LineMatcher
from coursebuild.core.scripts.mapped_text import Side
from coursebuild.core.text.diagnostics import Diagnostic, Note, diagnose

_NAMED, _QUOTED = 10, 80


def repeat_findings(
    course: Course,
    extractions: Iterable[Extraction],
    differing: Sequence[tuple[ScriptRun, ScriptRun]],
) -> tuple[Diagnostic, ...]:
    """A warning for each script; `differing` holds what is remembered and what was done now."""
    by_path = {extraction.path: extraction for extraction in extractions}
    return tuple(
        _unrepeatable(by_path[now.path], before, now)
        for before, now in differing
        if now.path in by_path and not _may_differ(course, before, now)
    )


def _may_differ(course: Course, before: ScriptRun, now: ScriptRun) -> bool:
    if before.outcome is not Outcome.OK or now.outcome is not Outcome.OK:
        return False
    recordings = [
        block
        for document in course.documents
        for block in document_blocks(document)
        if isinstance(block, Recording) and block.script == now.path and block.readable
    ]
    return bool(recordings) and all(
        compare(r, r.comparison or course.comparison, course.filters, run.stdout).status != "drift"
        for r in recordings
        for run in (before, now)
    )


def _unrepeatable(extraction: Extraction, before: ScriptRun, now: ScriptRun) -> Diagnostic:
    notes = []
    if (before.outcome, before.status) != (now.outcome, now.status):
        notes.append(Note(f"it ended otherwise: before {_end(before)}, now {_end(now)}"))
    diff = text_diff(before.stdout, now.stdout)
    if diff:
        notes.append(Note("its output:\n" + diff))
    return diagnose(
        "script-unrepeatable",
        extraction.script.span.first_line(),
        f"`{extraction.path}` behaves differently than before, with nothing changed "
        "that is known to count",
        help="make it do the same each time (a fixed seed, no clock, files that it opens itself), "
        "or put `volatile` on its output",
        notes=notes,
    )


def _end(run: ScriptRun) -> str:
    return f"{run.outcome.value} ({run.status})" if run.status else run.outcome.value


def unstable(recording: Recording, first: Side, second: Side, comparison: Comparison) -> Diagnostic:
    """Names the lines that differ between two runs.

    `first` is what would be recorded, or is, and matches the first run.
    """
    steps = align(first, second, LineMatcher(comparison))
    differ = [step for step in steps if step.kind in _DIFFERENT]
    notes = [Note(_difference(step, first, second)) for step in differ[:_NAMED]]
    if (more := len(differ) - _NAMED) > 0:
        notes.append(Note(f"and {more} more {'line' if more == 1 else 'lines'}"))
    return diagnose(
        "output-unstable",
        recording.caption_span,
        "two runs of the script printed different lines",
        help=_TABLE_HELP if isinstance(recording.body, Table) else _HELP,
        notes=notes,
    )


_REPEATABLE = "make the script print the same each time (a fixed seed, no clock)"
_HELP = (
    f'{_REPEATABLE}, or say what varies by `volatile="…"` on the fence, or by `ellipsis` and `...`'
)
_TABLE_HELP = f"{_REPEATABLE}, or record the output in a `text` fence with `volatile`"


_DIFFERENT = (StepKind.DIFFERS, StepKind.MISSING, StepKind.EXTRA)


def _difference(step: Step, first: Side, second: Side) -> str:
    if step.kind is StepKind.MISSING:
        return f"{quoted(first.lines[step.recorded], _QUOTED)} was printed in the first run only"
    if step.kind is StepKind.EXTRA:
        return f"{quoted(second.lines[step.ran], _QUOTED)} was printed in the second run only"
    a, b = first.lines[step.recorded], second.lines[step.ran]
    number = second.raw_line(step.ran)
    return f"line {number}: {quoted(a, _QUOTED)} in one run, {quoted(b, _QUOTED)} in the next"
