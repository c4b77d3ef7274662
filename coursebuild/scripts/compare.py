"""Is a recorded output what the script prints?

Entry points: `verify` (all recordings of a course), `compare` (one recording).

1. Where both are the same, character by character, the recording is verified.
2. Else both sides are filtered and split into lines (`traced`); matching sides are verified too.
3. Otherwise the lines are aligned (`align`), and each step that differs becomes changes: numbers
   and texts inside lines (`changes`), runs of missing or extra lines.
4. Every change is traced back through the filters to its place in the lesson.

All but the first step is done in `closely`, which most runs do not need.

A recorded table has its own way of matching: see `tables`.
"""

from __future__ import annotations

from collections.abc import Iterable

from coursebuild.model import (
    Comparison,
    Course,
    Filter,
    Mode,
    Recording,
    Script,
    Table,
    document_blocks,
)
from coursebuild.results import Outcome, ScriptRun, Verdict


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
    from coursebuild.scripts.closely import compare_closely

    return compare_closely(recording, comparison, filters, stdout)
