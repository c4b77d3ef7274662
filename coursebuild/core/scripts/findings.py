"""Everything that running the scripts of a course shows to be wrong."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from decimal import Decimal

from msgspec.structs import replace

from coursebuild.core.model import (
    Course,
    Document,
    Filter,
    Mode,
    Table,
    document_scripts,
)
from coursebuild.core.model.addresses import recorded_figures
from coursebuild.core.model.lesson_record import (
    Addresses,
    LessonRecord,
    describe_comparison,
    recording_digest,
)
from coursebuild.core.model.results import Change, DriftKind, Outcome, ScriptRun, Verdict
from coursebuild.core.scripts import bindings, failures
from coursebuild.core.scripts.bound_numbers import BoundText, shows
from coursebuild.core.scripts.bound_places import BoundNumber, document_bindings
from coursebuild.core.scripts.compare import REPEAT_HELP, compare
from coursebuild.core.scripts.diff import limit_notes, quote, shorten, text_diff
from coursebuild.core.scripts.extract import Extraction, extract
from coursebuild.core.scripts.lines import ELLIPSIS, Side
from coursebuild.core.scripts.printed_outputs import PrintedOutputs
from coursebuild.core.scripts.table_cells import HEADER_HELP, ROW_HELP, cell_text, table_rows
from coursebuild.core.scripts.tables import TableMatcher
from coursebuild.core.text.diagnostics import Diagnostic, Note, diagnose
from coursebuild.core.text.numbers import only_number, scan, within_tolerance
from coursebuild.core.text.source import Excerpt, Span

_MAX_NOTES = 3
_WIDTH = 60


def script_findings(
    course: Course,
    documents: Iterable[tuple[str, Document]],
    extractions: Sequence[Extraction],
    runs: Sequence[ScriptRun],
    verdicts: Sequence[Verdict],
    addresses: Addresses | None = None,
    all_extractions: Sequence[Extraction] | None = None,
    other_runs: Mapping[str, ScriptRun] | None = None,
    broken: Collection[str] = (),
    find_module: failures.FindModule = lambda _: "",
) -> tuple[Diagnostic, ...]:
    """The diagnostics of the scripts that were run, and of all that depends on them.

    Args:
        course: the course.
        documents: those whose outputs and bound numbers are looked at, with their ids.
        extractions: the scripts that were run, perhaps not all of the course.
        runs: what they did.
        verdicts: their output compared with the recorded one.
        addresses: see `check_bindings`.
        all_extractions: all scripts of the course, if known.
        other_runs: earlier runs of the same scripts, by path, where there are any.
        broken: files of models that do not compile; no script that reads one is reported.
        find_module: see `failure_diagnostic`.
    """
    by_path = {run.path: run for run in runs}
    scripts = {e.path: e for e in all_extractions or extract(course).value}
    diagnostics: list[Diagnostic] = []
    for extraction in extractions:
        run = by_path.get(extraction.path)
        if run is not None and not (run.trace and {*run.trace.files}.intersection(broken)):
            diagnostic = failures.failure_diagnostic(extraction, run, scripts, find_module)
            diagnostics += [] if diagnostic is None else [diagnostic]
            diagnostics += failures.divergence_diagnostics(extraction, run, scripts)
            diagnostics += failures.effect_diagnostics(extraction, run, scripts)
    outputs = PrintedOutputs(verdicts, runs, scripts)
    return (
        *diagnostics,
        *output_findings(course, documents, outputs, addresses, other_runs),
    )


def output_findings(
    course: Course,
    documents: Iterable[tuple[str, Document]],
    outputs: PrintedOutputs,
    addresses: Addresses | None = None,
    other_runs: Mapping[str, ScriptRun] | None = None,
) -> Iterator[Diagnostic]:
    """What is wrong with the recorded outputs and bound numbers of some documents."""
    for id, document in documents:
        record = course.records.get(document.source.path, LessonRecord())
        for verdict in outputs.of_document(document):
            recording = verdict.recording
            yield from _find_loose(verdict)
            yield from _judge_table(verdict)
            run = outputs.runs.get(recording.script or "")
            ran_well = run is not None and run.outcome is Outcome.OK
            if run is not None and ran_well and not run.output_of(recording.part).strip():
                subject = f"this part of `{run.path}`" if run.part_starts else f"`{run.path}`"
                message = f"an output is recorded here, but {subject} printed nothing"
                help = "print what is recorded, or remove the recorded output"
                yield diagnose("script-silent", recording.caption_span, message, help=help)
            elif run is not None and run.outcome is Outcome.UNRECORDED:
                yield drift_diagnostic(verdict, id)
            elif unstable_output := find_instability(verdict, run, other_runs or {}):
                yield unstable_output
            elif verdict.status == "drift":
                dependents = bindings.dependent_bindings(
                    verdict, course.documents, outputs, addresses or {}
                )
                made_with = record.find(recording.script or "", recording_digest(recording))
                change = ""
                if made_with is not None and run is not None and run.provenance is not None:
                    comparison = describe_comparison(verdict.comparison)
                    change = made_with.change(run.provenance, comparison)
                yield drift_diagnostic(verdict, id, dependents, change)
        yield from bindings.check_bindings(document, outputs, addresses)
        yield from _find_unmarked(course, document, outputs.runs)


_RESIDUE = Decimal("1e-9")
"""A number below it is taken for what rounding has left of 0."""


def _find_loose(verdict: Verdict) -> Iterator[Diagnostic]:
    """Report an output that is compared so loosely that nearly any other would do."""
    body, comparison = verdict.recording.body, verdict.comparison
    if comparison.mode is Mode.VOLATILE or not verdict.recording.readable:
        return
    elides = comparison.ellipsis and isinstance(body, Excerpt)

    def texts(filters: Iterable[Filter]) -> list[str]:
        if isinstance(body, Table):
            return [cell.mapped.text for row in table_rows(body, filters) for cell in row]
        lines = Side.of(body.text, filters).lines
        return [part for line in lines for part in (line.split(ELLIPSIS) if elides else [line])]

    recorded = body.text if isinstance(body, Excerpt) else "".join(texts(()))
    # What a filter keeps by its groups is compared.
    filters = (
        f if "\\" in f.replacement else replace(f, replacement="") for f in comparison.filters
    )
    compared, place = texts(tuple(filters)), verdict.recording.caption_span
    if not any(map(str.isalnum, "".join(compared))):
        if any(map(str.isalnum, recorded)) or (elides and ELLIPSIS in recorded):
            message = "nothing of this recorded output is compared"
            help = "`...`, filters and `volatile` leave nothing of it: record a line that has to "
            help += "hold, or say `volatile` alone, of which the page tells readers"
            yield diagnose("recording-body", place, message, help=help)
    elif comparison.mode is Mode.TOLERANCE:
        numbers = [n.value for text in compared for n in scan(text) if n.is_finite]
        numbers = [value for value in numbers if abs(value) >= _RESIDUE]
        rtol, atol = comparison.rtol, comparison.atol
        if numbers and all(within_tolerance(n, Decimal(0), rtol, atol) for n in numbers):
            message = f"with `atol` = {float(atol):g}, 0 would do for each number of this output"
            help = "lower it, or print what has to hold, as in `error < 1e-6`"
            yield diagnose("recording-loose", place, message, help=help)


def _judge_table(verdict: Verdict) -> Iterator[Diagnostic]:
    """Report empty cells of a recorded table, and rows that may be any of several lines."""
    table = verdict.recording.body
    if not isinstance(table, Table):
        return
    empty_cells = (cell for row in table.rows for cell in row if not cell_text(cell, ()).text)
    if table_rows(table) and (cell := next(empty_cells, None)) is not None:
        message = "an empty cell of a recorded table shows nothing that was printed"
        help = "write what is printed, or `\u2026` for what is left out"
        yield diagnose("recording-body", cell.span, message, help=help)
    if verdict.rivals:
        message = f"this table may show several things that `{verdict.recording.script}` printed"
        notes = [Note(f"`{line}`") for line in verdict.rivals[:_MAX_NOTES]]
        help = "write the words and units that are printed with the numbers into the header; where "
        help += 'a word is not of the number behind it, mark it: `` `error`{given="…"} ``'
        place = verdict.recording.caption_span
        yield diagnose("output-ambiguous", place, message, help=help, notes=notes)


def _find_unmarked(
    course: Course, document: Document, runs: Mapping[str, ScriptRun]
) -> Iterator[Diagnostic]:
    """Report the texts of a document that are what a script above them printed."""
    for block in document.unclaimed:
        text = Side.of(block.code.text, course.filters)
        for script in document_scripts(document):
            run = runs.get(script.path)
            if script.span.start > block.span.start or run is None or run.outcome is not Outcome.OK:
                continue
            printed = Side.of(run.stdout, course.filters).lines
            if text.lines != printed or len(block.code.text.strip()) <= 3:
                continue
            message = f"this is what `{script.path}` printed, and nothing compares the two"
            help = "an output is of kind `output`; if it is none, write `text illustration`"
            yield diagnose("output-unmarked", block.span.first_line(), message, help=help)
            break


def find_instability(
    verdict: Verdict, run: ScriptRun | None, other_runs: Mapping[str, ScriptRun]
) -> Diagnostic | None:
    """A diagnostic if an earlier run is known to have printed another output."""
    recording, comparison = verdict.recording, verdict.comparison
    earlier_run = other_runs.get(recording.script or "")
    if run is None or earlier_run is None or {run.outcome, earlier_run.outcome} != {Outcome.OK}:
        return None
    at, earlier_output = verdict.row_addresses, earlier_run.output_of(recording.part)
    changes = compare(recording, comparison, earlier_output, at).changes
    if [(c.span, c.printed) for c in changes] == [(c.span, c.printed) for c in verdict.changes]:
        return None
    outputs = (r.output_of(recording.part) for r in (earlier_run, run))
    before, now = ("\n".join(Side.of(text, comparison.filters).lines) for text in outputs)
    help = 'or say what varies by `volatile="…"` on the fence, or by `ellipsis` and `...`'
    if isinstance(recording.body, Table):
        help = "or record the output in a `text` fence with `volatile`"
    note = f"printed by the first run (-) and by the second (+):\n{text_diff(before, now)}"
    return diagnose(
        "output-unstable",
        recording.caption_span,
        "two runs of the script printed different lines",
        help=f"{REPEAT_HELP}, {help}",
        notes=[Note(note)],
    )


def count_unproven(
    course: Course, runs: Iterable[ScriptRun], verdicts: Iterable[Verdict]
) -> dict[str, tuple[int, int]]:
    """Count what nothing proves, by the scripts that were not run: outputs, and numbers bound."""
    unrun = {run.path for run in runs if not run.did_run}
    if not unrun:
        return {}
    outputs = PrintedOutputs(verdicts, ())
    recorded: list[str | None] = []
    bound: list[str | None] = []
    for document in course.documents:
        recorded += (verdict.recording.script for verdict in outputs.of_document(document))
        figures = recorded_figures(document)
        recorded += (figure.script for figure in figures if not figure.path.endswith(".csv"))
        for binding in document_bindings(document):
            bound.append(outputs.script_of(binding))
    return {path: (recorded.count(path), bound.count(path)) for path in unrun}


def unproven_units(
    course: Course, runs: Iterable[ScriptRun], verdicts: Iterable[Verdict]
) -> Iterator[Diagnostic]:
    """List the units of bound numbers and recorded columns that no script printed."""
    outputs = PrintedOutputs(verdicts, runs)
    for document in course.documents:
        for verdict in outputs.of_document(document):
            table, run = verdict.recording.body, outputs.runs.get(verdict.recording.script or "")
            if isinstance(table, Table) and run is not None and run.did_run:
                printed = run.output_of(verdict.recording.part)
                matcher = TableMatcher(table, verdict.comparison, printed, verdict.row_addresses)
                for span, unit in matcher.unprinted_units():
                    yield _unproven_unit(span, unit)
        for binding in document_bindings(document):
            if unit := bindings.unprinted_unit(BoundNumber(binding, outputs)):
                yield _unproven_unit(binding.text_span, unit)


def _unproven_unit(span: Span, unit: str) -> Diagnostic:
    message = f"no script prints the unit `{unit}` with this number"
    help = "print it behind the number, in its label or above its column"
    return diagnose("unit-unproven", span, message, help=help)


# --- drift


def drift_diagnostic(
    verdict: Verdict,
    owner: str,
    dependents: Sequence[bindings.DependentBinding] = (),
    change: str = "",
) -> Diagnostic:
    """A recorded output of a lesson or page, `owner`, that differs from this run.

    `change`: what is another now than when it was recorded.
    """
    recording, update = verdict.recording, f"`coursebuild update {owner}`"
    is_empty = isinstance(recording.body, Excerpt) and not recording.body.text.strip()
    if is_empty or not verdict.changes:
        message = f"no output of `{recording.script}` is recorded yet"
        return diagnose("output-drift", recording.caption_span, message, help=f"run {update}")
    changes = verdict.changes
    first, *rest = sorted(changes, key=lambda change: change.span.start)
    noun = "more difference" if len(rest) == _MAX_NOTES + 1 else "more differences"
    differences = [Note(describe_difference(change), change.span) for change in rest]
    notes = limit_notes(differences, _MAX_NOTES, noun)
    notes += (Note(_describe_dependence(d), d.binding.text_span) for d in dependents)
    help = f"if the change is intended, run {update}"
    if isinstance(body := recording.body, Table) and first.span.start < body.rows[0][0].span.start:
        help = HEADER_HELP
    elif isinstance(body, Table) and first.kind is DriftKind.MISSING:
        help = f"{help}; {ROW_HELP}"
    message = f"recorded output differs from this run ({classes(changes)})"
    message = f"{change}: {message}" if change else message
    return diagnose(
        "output-drift", first.span, message, label=_label(first), help=help, notes=notes
    )


def classes(changes: Sequence[Change]) -> str:
    """How many differences of each class: `rounding: 2, numeric: 1`; lines are counted each."""
    counts = dict.fromkeys(DriftKind, 0)
    for change in changes:
        text = change.recorded if change.kind is DriftKind.MISSING else change.printed
        lines = change.kind in (DriftKind.MISSING, DriftKind.EXTRA)
        counts[change.kind] += text.count("\n") + 1 if lines else 1
    return ", ".join(f"{kind.value}: {count}" for kind, count in counts.items() if count)


def _label(change: Change, subject: str = "this run") -> str:
    match change.kind:
        case DriftKind.ROUNDING | DriftKind.NUMERIC:
            printed = f"{subject} printed {shorten(change.printed, _WIDTH)}"
            if change.relative_error is None:
                return printed
            agree = {None: "", 0: ", no digit agrees", 1: ", 1 digit agrees"}
            digits = agree.get(change.digits, f", {change.digits} digits agree")
            return f"{printed} (relative error {change.relative_error:.1e}{digits})"
        case DriftKind.TEXT if not (change.recorded.strip() or change.printed.strip()):
            return f"{subject} printed white space of another width here"
        case DriftKind.TEXT if not change.printed.strip():
            return f"{subject} printed nothing here"
        case DriftKind.TEXT if _is_same_value(change):
            number = shorten(change.printed, _WIDTH)
            return f"{subject} printed {number} (the same value, written in another way)"
        case DriftKind.TEXT:
            return f"{subject} printed {quote(change.printed, _WIDTH)}"
        case DriftKind.MISSING:
            count = change.recorded.count("\n") + 1
            lines = "this line" if count == 1 else f"these {count} lines"
            return f"{subject} did not print {lines}"
        case DriftKind.EXTRA:
            first, *rest = change.printed.split("\n")
            rest_text = f" and {len(rest)} more line{'s' if len(rest) > 1 else ''}" if rest else ""
            return f"{subject} printed {quote(first, _WIDTH)}{rest_text} here"


def _is_same_value(change: Change) -> bool:
    recorded, printed = only_number(change.recorded), only_number(change.printed)
    return recorded is not None and printed is not None and recorded.value == printed.value


def describe_difference(change: Change, subject: str = "this run") -> str:
    """A difference with what is recorded; `subject` has printed the other text."""
    if change.kind is DriftKind.MISSING:
        first = change.recorded.split("\n")[0]
        return f"recorded {quote(first, _WIDTH)}; {_label(change, subject)}"
    if change.kind is DriftKind.EXTRA or not change.recorded.strip():
        return _label(change, subject)
    numeric = change.kind is not DriftKind.TEXT or _is_same_value(change)
    recorded = shorten(change.recorded, _WIDTH) if numeric else quote(change.recorded, _WIDTH)
    return f"recorded {recorded}; {_label(change, subject)}"


def _describe_dependence(dependent: bindings.DependentBinding) -> str:
    binding, change = dependent.binding, dependent.change
    lead = f"`{binding.text}` depends on "
    recorded, printed = only_number(change.recorded), only_number(change.printed)
    if recorded is None or printed is None or change.kind is DriftKind.MISSING:
        return lead + "a line that changed"
    text = BoundText.of(binding.text, binding.comma, may_join=True)
    numbers = [n for n in text.numbers if shows(n, recorded)]
    holds = ", and still holds" if any(shows(n, printed) for n in numbers) else ""
    return f"{lead}{recorded.text}, which this run printed as {printed.text}{holds}"
