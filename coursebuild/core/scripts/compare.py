"""Is a recorded output what the script prints, and does it print that a second time?

Where both are the same, character by character, the recording is verified. Else both sides are
filtered and split into lines; if these match, it is verified too. Else the lines are aligned, each
step that differs becomes changes, and every change is traced back through the filters to its place
in the lesson. An output that its lesson calls volatile may differ.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby

from coursebuild.core import model
from coursebuild.core.model.lesson_record import Addresses
from coursebuild.core.model.results import Change, DriftKind, Outcome, ScriptRun, Verdict
from coursebuild.core.scripts.align import StepKind, align, same_lines
from coursebuild.core.scripts.diff import find_differences, number_change, text_diff
from coursebuild.core.scripts.extract import Extraction
from coursebuild.core.scripts.lines import LineMatcher, Side
from coursebuild.core.scripts.table_cells import cell_matches, elides_rows, row_text, row_values
from coursebuild.core.scripts.tables import RowAddresses, TableMatcher
from coursebuild.core.text.diagnostics import Diagnostic, Note, diagnose
from coursebuild.core.text.source import Excerpt, Span


def verify(
    course: model.Course,
    runs: Iterable[ScriptRun],
    addresses: Addresses | None = None,
    documents: Iterable[model.Document] | None = None,
) -> tuple[Verdict, ...]:
    """A verdict for every recording of the course, or of some documents, that has a script.

    `addresses` holds those where rows of tables held before.

    Where two blocks have the same path, only the first is run; what is recorded below the second
    is not compared with its output. Nor is an output whose fence has mistakes in its options.
    """
    by_path = {run.path: run for run in runs if run.outcome is Outcome.OK}
    paths: set[str] = set()
    verdicts: list[Verdict] = []
    for document in course.documents if documents is None else documents:
        is_repeated = False
        for block in model.document_blocks(document):
            if isinstance(block, model.Script):
                is_repeated = block.path in paths
                paths.add(block.path)
            elif isinstance(block, model.Recording) and block.script is not None:
                comparison, run = course.comparison_of(block), by_path.get(block.script)
                printed = "" if run is None else run.output_of(block.part)
                if not printed.strip() or is_repeated or not block.readable:
                    verdicts.append(Verdict(block, comparison, "unchecked"))
                else:
                    rows = row_values(document, block, comparison.filters)
                    at = tuple((addresses or {}).get(value, ()) for value in rows)
                    verdicts.append(compare(block, comparison, printed, at))
    return tuple(verdicts)


def compare(
    recording: model.Recording,
    comparison: model.Comparison,
    stdout: str,
    addresses: RowAddresses = (),
) -> Verdict:
    """The verdict on one recording, given what its script printed; see `verify`."""
    body = recording.body
    if comparison.mode is model.Mode.VOLATILE:
        return Verdict(recording, comparison, "volatile")
    if isinstance(body, model.Table):
        return _compare_table(recording, body, comparison, stdout, addresses)
    if stdout in (body.text, f"{body.text}\n"):  # as it nearly always is
        return Verdict(recording, comparison, "verified")
    recorded, printed = (Side.of(text, comparison.filters) for text in (body.text, stdout))
    if same_lines(recorded, printed, comparison):
        return Verdict(recording, comparison, "verified")
    drift = tuple(_find_changes(recording, recorded, printed, LineMatcher(comparison)))
    return Verdict(recording, comparison, "drift" if drift else "verified", drift)


def _find_changes(
    recording: model.Recording, recorded: Side, printed: Side, matcher: LineMatcher
) -> Iterator[Change]:
    """A change for each difference in a line, and for each run of missing or extra lines."""

    def locate(start: int, end: int) -> Span:
        if isinstance(recording.body, Excerpt) and recording.body.text:
            return recording.body.span(start, end)
        span = recording.body_span
        return Span(span.source, span.start, span.start)

    def end_of(line: int) -> int:
        """Where a recorded line ends; 0 where none is recorded."""
        return recorded.origin(line, 0, len(recorded.lines[line]))[1] if line >= 0 else 0

    for kind, group in groupby(align(recorded, printed, matcher), key=lambda step: step.kind):
        steps = list(group)
        first, last = steps[0].recorded, steps[-1].recorded
        match kind:
            case StepKind.DIFFERS:
                for step in steps:
                    lines = recorded.lines[step.recorded], printed.lines[step.printed]
                    for d in find_differences(*lines, matcher):
                        start, end = recorded.origin(step.recorded, d.start, d.end)
                        place = printed.origin(step.printed, d.printed_start, d.printed_end)
                        span = locate(start, end)
                        texts = recorded.raw[start:end], printed.raw[slice(*place)]
                        if d.numbers is not None:
                            yield number_change(span, *texts, d.numbers)
                        else:
                            yield Change(DriftKind.TEXT, span, *texts)
            case StepKind.MISSING:
                span = locate(recorded.origin(first, 0, 0)[0], end_of(last))
                text = "\n".join(recorded.lines[first : last + 1])
                yield Change(DriftKind.MISSING, span, text, "")
            case StepKind.EXTRA:
                text = "\n".join(printed.lines[step.printed] for step in steps)
                count = len(recorded.lines)
                start = recorded.origin(first, 0, 0)[0] if first < count else end_of(count - 1)
                yield Change(DriftKind.EXTRA, locate(start, start), "", text)
            case _:
                pass


def repeat_findings(
    course: model.Course,
    extractions: Iterable[Extraction],
    differing_runs: Sequence[tuple[ScriptRun, ScriptRun]],
) -> tuple[Diagnostic, ...]:
    """A warning for each script; `differing_runs` are pairs of a remembered run and a new one."""
    by_path = {extraction.path: extraction for extraction in extractions}
    diagnostics: list[Diagnostic] = []
    for before, now in differing_runs:
        recordings = [
            recording
            for document in course.documents
            for recording in model.find_blocks(document, model.Recording)
            if recording.script == now.path and recording.readable
        ]
        may_differ = {before.outcome, now.outcome} == {Outcome.OK} and all(
            compare(r, course.comparison_of(r), run.output_of(r.part)).status != "drift"
            for r in recordings
            for run in (before, now)
        )
        if now.path not in by_path or (recordings and may_differ):
            continue
        notes = []
        if (before.outcome, before.status) != (now.outcome, now.status):
            ends = f"before {_describe_end(before)}, now {_describe_end(now)}"
            notes.append(Note(f"it ended otherwise: {ends}"))
        if diff := text_diff(before.stdout, now.stdout):
            notes.append(Note("its output:\n" + diff))
        message = f"`{now.path}` behaves differently than before, though nothing that it is known "
        message += "to depend on has changed"
        help = "make it do the same each time (a fixed seed, no clock, files that it opens itself)"
        help += ", or put `volatile` on its output"
        place = by_path[now.path].script.span.first_line()
        diagnostics.append(diagnose("script-unrepeatable", place, message, help=help, notes=notes))
    return tuple(diagnostics)


def _describe_end(run: ScriptRun) -> str:
    return f"{run.outcome.value} ({run.status})" if run.status else run.outcome.value


REPEAT_HELP = "make the script print the same each time (a fixed seed, no clock)"


def _compare_table(
    recording: model.Recording,
    table: model.Table,
    comparison: model.Comparison,
    stdout: str,
    addresses: RowAddresses = (),
) -> Verdict:
    """The verdict on a recorded table."""
    matcher = TableMatcher(table, comparison, stdout, addresses)
    if not matcher.rows:
        return Verdict(recording, comparison, "drift")
    match = matcher.match()
    changes: list[Change] = []
    for row in match.rows:
        if row.line < 0:
            first, last = row.row[0].cell.span, row.row[-1].cell.span
            changes.append(Change(DriftKind.MISSING, first.to(last), row_text(row.row), ""))
        for cell, old, new in row.pairs:
            if not cell_matches(old, new, comparison):
                span = cell.span(old)
                changes.append(number_change(span, span.text, new.text, (old, new)))
        changes += matcher.unit_changes(row)
    if all(row.line >= 0 and row.certain for row in match.rows):
        # Below a title of another column, or unit, numbers differ for that reason.
        changes = [*matcher.header_changes(match)] or changes
    counts = (len(match.rows), 0 if elides_rows(table) else match.printed)
    return Verdict(
        recording,
        comparison,
        "drift" if changes else "verified",
        tuple(changes),
        addresses if changes else matcher.addresses(match),
        match.rivals
        or tuple(text for _, text, is_sure in matcher.misplaced_titles(match) if not is_sure),
        counts,
    )
