"""Everything that running the scripts of a course shows to be wrong.

Entry points: `script_findings`: each script that failed, and `output_findings`: each recorded
output that is not what was printed, each bound number that no output bears out; `held_lines`, by
which those hold that do; `drift_diagnostic`.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence

from coursebuild.core.model import Course, Document, Owner
from coursebuild.core.model.results import Change, DriftKind, Outcome, ScriptRun, Verdict
from coursebuild.core.scripts.bindings import (
    HeldLines,
    Leaning,
    Printed,
    check_bindings,
    leaning_on,
)
from coursebuild.core.scripts.bound_numbers import Shown, shows
from coursebuild.core.scripts.compare import compare
from coursebuild.core.scripts.diff import quoted, shortened
from coursebuild.core.scripts.extract import Extraction, extract
from coursebuild.core.scripts.failures import divergence, effects, failure, silence
from coursebuild.core.scripts.mapped_text import Side
from coursebuild.core.scripts.numbers import scan
from coursebuild.core.scripts.repeat import unstable
from coursebuild.core.text.diagnostics import Diagnostic, Note, diagnose
from coursebuild.core.text.source import Excerpt

_NAMED = 3
_WIDTH = 60


def script_findings(
    course: Course,
    extractions: Sequence[Extraction],
    runs: Sequence[ScriptRun],
    verdicts: Sequence[Verdict],
    held: HeldLines | None = None,
    everything: Sequence[Extraction] | None = None,
    again: Mapping[str, ScriptRun] | None = None,
    broken: Collection[str] = (),
) -> tuple[Diagnostic, ...]:
    """The diagnostics of the scripts that were run, and of all that depends on them.

    `extractions` are those that were run, maybe not all of the course; `everything` is what
    `extract` gives for it, where that is known. `held`: see `check_bindings`. `again`: second runs,
    by path, of scripts whose output has drifted. `broken`: files of models that do not compile, of
    which scripts that read them and fail say nothing new.
    """
    by_path = {run.path: run for run in runs}
    everything = extract(course).value if everything is None else everything
    found: list[Diagnostic] = []
    for extraction in extractions:
        run = by_path.get(extraction.path)
        if run is not None and not (run.trace and {*run.trace.files}.intersection(broken)):
            failed = failure(extraction, run, everything)
            found += [] if failed is None else [failed]
            found += divergence(extraction, run, everything)
            found += effects(extraction, run, everything)
    printed = Printed(verdicts, runs, [extraction.path for extraction in everything])
    return (*found, *output_findings(course, course.owned_documents, printed, held, again))


def output_findings(
    course: Course,
    documents: Iterable[tuple[Owner, Document]],
    printed: Printed,
    held: HeldLines | None = None,
    again: Mapping[str, ScriptRun] | None = None,
) -> Iterator[Diagnostic]:
    """What is wrong with what some documents of a course record and bind.

    For the rest see `script_findings`.
    """
    for owner, document in documents:
        for verdict in printed.outputs(document):
            recording = verdict.recording
            run = printed.runs.get(recording.script or "")
            if run is not None and run.outcome is Outcome.OK and not run.stdout.strip():
                yield silence(recording, run.path)
            elif verdict.status == "drift":
                leaning = leaning_on(verdict, course.documents, printed)
                unstable_output = _instability(course, verdict, run, again or {})
                yield unstable_output or drift_diagnostic(verdict, owner.id, leaning)
        yield from check_bindings(document, printed, held)


def _instability(
    course: Course, verdict: Verdict, first: ScriptRun | None, again: Mapping[str, ScriptRun]
) -> Diagnostic | None:
    """That an output differs from run to run, as far as that is known."""
    recording, how = verdict.recording, verdict.comparison
    second = again.get(recording.script or "")
    if first is None or second is None or second.outcome is not Outcome.OK:
        return None
    changes = compare(recording, how, course.filters, second.stdout).changes
    if [(c.span, c.ran) for c in changes] == [(c.span, c.ran) for c in verdict.changes]:
        return None
    filters = (*course.filters, *how.filters)
    one, other = Side.of(first.stdout, filters), Side.of(second.stdout, filters)
    return unstable(recording, one, other, how)


def held_lines(course: Course, runs: Sequence[ScriptRun], verdicts: Sequence[Verdict]) -> HeldLines:
    """By which lines the bindings of a course hold."""
    held: HeldLines = {}
    printed = Printed(verdicts, runs)
    for document in course.documents:
        check_bindings(document, printed, held)
    return held


# --- drift


def drift_diagnostic(verdict: Verdict, owner: str, leaning: Sequence[Leaning] = ()) -> Diagnostic:
    """A recorded output that differs from this run; `owner` is the id of the lesson or page.

    The first differing place is pointed at; notes name the next ones, and every bound number in the
    prose that depends on a value that changed.
    """
    recording, update = verdict.recording, f"`coursebuild update {owner}`"
    if isinstance(recording.body, Excerpt) and not recording.body.text.strip():
        return diagnose(
            "output-drift",
            recording.caption_span,
            f"nothing is recorded yet of what `{recording.script}` prints",
            help=f"run {update}",
        )
    first, *others = sorted(verdict.changes, key=lambda change: change.span.start)
    notes = [Note(_next_difference(change), change.span) for change in others[:_NAMED]]
    if len(others) > _NAMED:
        more = len(others) - _NAMED
        notes.append(Note(f"and {more} more {'difference' if more == 1 else 'differences'}"))
    notes += (Note(_dependence(one), one.binding.text_span) for one in leaning)
    return diagnose(
        "output-drift",
        first.span,
        f"recorded output differs from this run ({classes(verdict.changes)})",
        label=_label(first),
        help=f"if the change is intended, run {update}",
        notes=notes,
    )


def classes(changes: Sequence[Change]) -> str:
    """How many differences of each class: `rounding: 2, numeric: 1`; lines are counted each."""
    counts = dict.fromkeys(DriftKind, 0)
    for change in changes:
        text = change.recorded if change.kind is DriftKind.MISSING else change.ran
        lines = change.kind in (DriftKind.MISSING, DriftKind.EXTRA)
        counts[change.kind] += text.count("\n") + 1 if lines else 1
    return ", ".join(f"{kind.value}: {count}" for kind, count in counts.items() if count)


def _label(change: Change) -> str:
    """What is written beside the place of a change."""
    match change.kind:
        case DriftKind.ROUNDING | DriftKind.NUMERIC:
            told = closeness(change)
            return f"this run printed {_number(change.ran)}{f' ({told})' if told else ''}"
        case DriftKind.TEXT if not (change.recorded.strip() or change.ran.strip()):
            return "this run printed white space of another width here"
        case DriftKind.TEXT if not change.ran.strip():
            return "this run printed nothing here"
        case DriftKind.TEXT if _same_value(change):
            number = _number(change.ran)
            return f"this run printed {number} (the same value, written in another way)"
        case DriftKind.TEXT:
            return f"this run printed {quoted(change.ran, _WIDTH)}"
        case DriftKind.MISSING:
            count = change.recorded.count("\n") + 1
            what = "this line" if count == 1 else f"these {count} lines"
            return f"this run did not print {what}"
        case DriftKind.EXTRA:
            first, *rest = change.ran.split("\n")
            more = f" and {len(rest)} more line{'s' if len(rest) > 1 else ''}" if rest else ""
            return f"this run printed {quoted(first, _WIDTH)}{more} here"


def _same_value(change: Change) -> bool:
    recorded, ran = scan(change.recorded), scan(change.ran)
    if len(recorded) != 1 or len(ran) != 1:
        return False
    whole = recorded[0].text == change.recorded and ran[0].text == change.ran
    return whole and recorded[0].value == ran[0].value


def closeness(change: Change) -> str:
    """How near a printed number is to the recorded one, in words; empty where that has no sense."""
    if change.relative_error is None:
        return ""
    error = f"relative error {change.relative_error:.1e}"
    if change.digits is None:
        return error
    agree = {0: "no digit agrees", 1: "1 digit agrees"}
    return f"{error}, {agree.get(change.digits, f'{change.digits} digits agree')}"


def _next_difference(change: Change) -> str:
    """A difference after the first, where no text stands beside its place."""
    if change.kind is DriftKind.MISSING:
        first = change.recorded.split("\n")[0]
        return f"recorded {quoted(first, _WIDTH)}; {_label(change)}"
    if change.kind is DriftKind.EXTRA or not change.recorded.strip():
        return _label(change)
    numeric = change.kind is not DriftKind.TEXT or _same_value(change)
    recorded = _number(change.recorded) if numeric else quoted(change.recorded, _WIDTH)
    return f"recorded {recorded}; {_label(change)}"


def _number(text: str) -> str:
    return shortened(text, _WIDTH)


def _dependence(leaning: Leaning) -> str:
    """What a change means for a bound number of the prose."""
    change = leaning.change
    lead = f"`{leaning.binding.text}` depends on "
    recorded, ran = scan(change.recorded), scan(change.ran)
    if len(recorded) != 1 or len(ran) != 1 or change.kind is DriftKind.MISSING:
        return lead + "a line that changed"
    shown = [n for n in Shown.of(leaning.binding.text).numbers if shows(n, recorded[0])]
    holds = ", and still holds" if any(shows(n, ran[0]) for n in shown) else ""
    return f"{lead}{recorded[0].text}, which this run printed as {ran[0].text}{holds}"
