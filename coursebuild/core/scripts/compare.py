"""Is a recorded output what the script prints?

Entry points: `verify` (all recordings of a course), `compare` (one recording).

1. Where both are the same, character by character, the recording is verified.
2. Else both sides are filtered and split into lines; matching sides are verified too.
3. Otherwise the lines are aligned (`align`), and each step that differs becomes changes: numbers
   and texts inside lines (`changes`), runs of missing or extra lines.
4. Every change is traced back through the filters to its place in the lesson.

A recorded table has its own way of matching: see `tables`.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable, Sequence

from msgspec import Struct

from coursebuild.core.model import (
    Comparison,
    Course,
    Filter,
    Mode,
    Recording,
    Script,
    Table,
    document_blocks,
)
from coursebuild.core.model.results import Change, DriftKind, Outcome, ScriptRun, Verdict
from coursebuild.core.scripts.align import Step, StepKind, align, same_lines
from coursebuild.core.scripts.changes import differences, number_change
from coursebuild.core.scripts.diff import diff_text
from coursebuild.core.scripts.lines import LineMatcher
from coursebuild.core.scripts.mapped_text import Side
from coursebuild.core.scripts.tables import compare_table
from coursebuild.core.text.source import Excerpt, Span


def verify(course: Course, runs: Iterable[ScriptRun]) -> tuple[Verdict, ...]:
    """A verdict for every recording of the course that has a script, in order.

    Where two blocks have the same path only the first is run; what is recorded below the other is
    not compared with its output. Nor is an output whose fence says in a wrong way how to compare.
    """
    by_path = {run.path: run for run in runs}
    first: dict[str, Script] = {}
    verdicts: list[Verdict] = []
    for document in course.documents:
        nearest: Script | None = None
        for block in document_blocks(document):
            if isinstance(block, Script):
                nearest = block
                first.setdefault(block.path, block)
            elif isinstance(block, Recording) and block.script is not None:
                same = nearest is not None and nearest.path == block.script
                kept = not same or first[block.script] is nearest
                run = by_path.get(block.script) if kept and block.readable else None
                verdicts.append(_verdict(block, course.comparison, course.filters, run))
    return tuple(verdicts)


def _verdict(
    recording: Recording,
    default: Comparison,
    filters: tuple[Filter, ...],
    run: ScriptRun | None,
) -> Verdict:
    comparison = recording.comparison or default
    if run is None or run.outcome is not Outcome.OK or is_silent(run.stdout):
        return Verdict(recording, comparison, "unchecked")
    return compare(recording, comparison, filters, run.stdout)


def is_silent(stdout: str) -> bool:
    """Whether an output has no line to record."""
    return not stdout.strip()


def compare(
    recording: Recording, comparison: Comparison, filters: tuple[Filter, ...], stdout: str
) -> Verdict:
    """The verdict on one recording, given what its script printed."""
    if comparison.mode is Mode.VOLATILE:
        return Verdict(recording, comparison, "volatile")
    if not isinstance(recording.body, Table):
        body = recording.body.text
        if stdout in (body, f"{body}\n"):  # as it nearly always is
            return Verdict(recording, comparison, "verified")
    return compare_closely(recording, comparison, filters, stdout)


def compare_closely(
    recording: Recording, comparison: Comparison, filters: tuple[Filter, ...], stdout: str
) -> Verdict:
    """The verdict on an output that its lesson does not call volatile."""
    ran = Side.of(stdout, filters)
    if isinstance(recording.body, Table):
        return compare_table(recording, recording.body, comparison, filters, ran)
    recorded = Side.of(recording.body.text, filters)
    if same_lines(recorded, ran, comparison):
        return Verdict(recording, comparison, "verified")
    matcher = LineMatcher(comparison)
    steps = align(recorded, ran, matcher)
    changes = _Changes(recording, recording.body, recorded, ran, matcher).of(steps)
    if not changes:
        return Verdict(recording, comparison, "verified")
    return Verdict(recording, comparison, "drift", changes, diff_text(steps, recorded, ran))


class _Changes(Struct, frozen=True):
    """Turns steps into changes with their places in the lesson."""

    recording: Recording
    body: Excerpt
    recorded: Side
    ran: Side
    matcher: LineMatcher

    def of(self, steps: Sequence[Step]) -> tuple[Change, ...]:
        line_starts = self.ran.line_starts()
        changes: list[Change] = []
        index = 0
        while index < len(steps):
            step = steps[index]
            stop = index + 1
            if step.kind is StepKind.DIFFERS:
                changes += self._line(step, line_starts)
            elif step.kind in (StepKind.MISSING, StepKind.EXTRA):
                while stop < len(steps) and steps[stop].kind is step.kind:
                    stop += 1
                changes.append(self._lines(steps[index:stop], line_starts))
            index = stop
        return tuple(changes)

    def _line(self, step: Step, line_starts: Sequence[int]) -> list[Change]:
        """The changes inside one line."""
        changes: list[Change] = []
        recorded, ran = self.recorded.lines[step.recorded].text, self.ran.lines[step.ran].text
        for d in differences(recorded, ran, self.matcher):
            start, end = self.recorded.origin(step.recorded, d.start, d.end)
            ran_start, ran_end = self.ran.origin(step.ran, d.ran_start, d.ran_end)
            span = self._span(start, end)
            texts = self.recorded.raw[start:end], self.ran.raw[ran_start:ran_end]
            ran_line = bisect_right(line_starts, ran_start)
            if d.numbers is not None:
                changes.append(number_change(span, *texts, ran_line, d.numbers))
            else:
                changes.append(Change(DriftKind.TEXT, span, *texts, ran_line))
        return changes

    def _lines(self, steps: Sequence[Step], line_starts: Sequence[int]) -> Change:
        """A run of missing or of extra lines."""
        first, last = steps[0], steps[-1]
        if first.kind is StepKind.MISSING:
            start, _ = self.recorded.origin(first.recorded, 0, 0)
            _, end = self.recorded.origin(
                last.recorded, 0, len(self.recorded.lines[last.recorded].text)
            )
            texts = [self.recorded.lines[step.recorded].text for step in steps]
            span = self._span(start, end)
            return Change(DriftKind.MISSING, span, "\n".join(texts), "", 0)
        texts = [self.ran.lines[step.ran].text for step in steps]
        ran_start, _ = self.ran.origin(first.ran, 0, 0)
        ran_line = bisect_right(line_starts, ran_start)
        return Change(DriftKind.EXTRA, self._before(first.recorded), "", "\n".join(texts), ran_line)

    def _before(self, line: int) -> Span:
        """The place before a recorded line, or after the last one."""
        if line < len(self.recorded.lines):
            start, _ = self.recorded.origin(line, 0, 0)
        elif self.recorded.lines:
            last = len(self.recorded.lines) - 1
            _, start = self.recorded.origin(last, 0, len(self.recorded.lines[last].text))
        else:
            start = 0
        return self._span(start, start)

    def _span(self, start: int, end: int) -> Span:
        if not self.body.text:
            span = self.recording.body_span
            return Span(span.source, span.start, span.start)
        return self.body.span(start, end)
