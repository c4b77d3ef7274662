"""Is a recorded output what the script prints?

Entry points: `verify` (all recordings of a course), `compare` (one recording).

1. Where both are the same, character by character, the recording is verified.
2. Else both sides are filtered and split into lines; if these match, it is verified too.
3. Else the lines are aligned (`align`), and each step that differs becomes changes: numbers
   and texts inside lines (`changes`), runs of missing or extra lines.
4. Every change is traced back through the filters to its place in the lesson.

A recorded table has its own way of matching: see `tables`.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby

from msgspec import Struct

from coursebuild.core.model import (
    Comparison,
    Course,
    Mode,
    Recording,
    Script,
    Table,
    document_blocks,
)
from coursebuild.core.model.results import Change, DriftKind, Outcome, ScriptRun, Verdict
from coursebuild.core.scripts.align import Step, StepKind, align, same_lines
from coursebuild.core.scripts.changes import find_differences, number_change
from coursebuild.core.scripts.lines import LineMatcher
from coursebuild.core.scripts.mapped_text import Side
from coursebuild.core.scripts.tables import compare_table
from coursebuild.core.text.source import Excerpt, Span


def verify(course: Course, runs: Iterable[ScriptRun]) -> tuple[Verdict, ...]:
    """A verdict for every recording of the course that has a script, in order.

    Where two blocks have the same path, only the first is run; what is recorded below the second
    is not compared with its output. Nor is an output whose fence has mistakes in its options.
    """
    by_path = {run.path: run for run in runs if run.outcome is Outcome.OK and run.stdout.strip()}
    paths: set[str] = set()
    verdicts: list[Verdict] = []
    for document in course.documents:
        is_repeated = False
        for block in document_blocks(document):
            if isinstance(block, Script):
                is_repeated = block.path in paths
                paths.add(block.path)
            elif isinstance(block, Recording) and block.script is not None:
                comparison, run = course.comparison_of(block), by_path.get(block.script)
                if run is None or is_repeated or not block.readable:
                    verdicts.append(Verdict(block, comparison, "unchecked"))
                else:
                    verdicts.append(compare(block, comparison, run.stdout))
    return tuple(verdicts)


def compare(recording: Recording, comparison: Comparison, stdout: str) -> Verdict:
    """The verdict on one recording, given what its script printed."""
    body = recording.body
    if comparison.mode is Mode.VOLATILE:
        return Verdict(recording, comparison, "volatile")
    if isinstance(body, Table):
        return compare_table(recording, body, comparison, stdout)
    if stdout in (body.text, f"{body.text}\n"):  # as it nearly always is
        return Verdict(recording, comparison, "verified")
    recorded, printed = (Side.of(text, comparison.filters) for text in (body.text, stdout))
    if same_lines(recorded, printed, comparison):
        return Verdict(recording, comparison, "verified")
    matcher = LineMatcher(comparison)
    finder = _ChangeFinder(recording, body, recorded, printed, matcher)
    drift = tuple(finder.find(align(recorded, printed, matcher)))
    return Verdict(recording, comparison, "drift" if drift else "verified", drift)


class _ChangeFinder(Struct, frozen=True):
    """Turns steps into changes with their places in the lesson."""

    recording: Recording
    body: Excerpt
    recorded: Side
    printed: Side
    matcher: LineMatcher

    def find(self, steps: Sequence[Step]) -> Iterator[Change]:
        """A change for each difference in a line, and for each run of missing or extra lines."""
        for kind, group in groupby(steps, key=lambda step: step.kind):
            match kind:
                case StepKind.DIFFERS:
                    for step in group:
                        yield from self._line(step)
                case StepKind.MISSING:
                    yield self._missing(list(group))
                case StepKind.EXTRA:
                    yield self._extra(list(group))
                case _:
                    pass

    def _line(self, step: Step) -> Iterator[Change]:
        """The changes inside one line."""
        recorded, printed = self.recorded.lines[step.recorded], self.printed.lines[step.printed]
        for d in find_differences(recorded, printed, self.matcher):
            start, end = self.recorded.origin(step.recorded, d.start, d.end)
            printed_start, printed_end = self.printed.origin(
                step.printed, d.printed_start, d.printed_end
            )
            span = self._span(start, end)
            texts = self.recorded.raw[start:end], self.printed.raw[printed_start:printed_end]
            if d.numbers is not None:
                yield number_change(span, *texts, d.numbers)
            else:
                yield Change(DriftKind.TEXT, span, *texts)

    def _missing(self, steps: Sequence[Step]) -> Change:
        start, _ = self.recorded.origin(steps[0].recorded, 0, 0)
        text = "\n".join(self.recorded.lines[step.recorded] for step in steps)
        span = self._span(start, self._end_of(steps[-1].recorded))
        return Change(DriftKind.MISSING, span, text, "")

    def _extra(self, steps: Sequence[Step]) -> Change:
        text = "\n".join(self.printed.lines[step.printed] for step in steps)
        before, lines = steps[0].recorded, len(self.recorded.lines)
        place = self.recorded.origin(before, 0, 0)[0] if before < lines else self._end_of(lines - 1)
        return Change(DriftKind.EXTRA, self._span(place, place), "", text)

    def _end_of(self, line: int) -> int:
        """Where a recorded line ends; 0 where none is recorded."""
        if line < 0:
            return 0
        return self.recorded.origin(line, 0, len(self.recorded.lines[line]))[1]

    def _span(self, start: int, end: int) -> Span:
        if not self.body.text:
            span = self.recording.body_span
            return Span(span.source, span.start, span.start)
        return self.body.span(start, end)
