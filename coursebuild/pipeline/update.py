"""`coursebuild update`: bring recorded outputs up to date, by span.

Entry point: `update(options, names, dry_run=…)`.

1. Every chosen script runs twice. What differs between the two runs cannot be recorded. A
   remembered result counts as the first run, and as both where nothing of it is to be recorded:
   whatever is written was printed by two runs, the second of them now.
2. The new outputs become edits; each lesson is written whole or not at all, and only if nobody
   changed it meanwhile.
3. The bound numbers of the updated lessons are checked: where a new output makes prose false, a
   diagnostic says what is printed now in place of the number.
4. Scripts whose output was written run again with their initial states moved a little: digits that
   change with these are noise, and should not be printed.
"""

from __future__ import annotations

import difflib
import time
from collections.abc import Collection, Mapping, Sequence

from msgspec.structs import replace

from coursebuild.core.files.errors import EffectError
from coursebuild.core.files.locks import project_lock
from coursebuild.core.files.write import check_writable, write_atomic
from coursebuild.core.model import Course, Recording
from coursebuild.core.model.results import Outcome, ScriptRun, Verdict
from coursebuild.core.run.runner import ScriptServer
from coursebuild.core.scripts.compare import verify as compare_all
from coursebuild.core.scripts.edit import apply_edits, update_body
from coursebuild.core.scripts.extract import Extraction, extract
from coursebuild.core.scripts.findings import collect_evidence, script_findings
from coursebuild.core.text.diagnostics import Diagnostic, Edit, diagnose
from coursebuild.core.text.source import Source
from coursebuild.pipeline.figures import find_figures, write_figures
from coursebuild.pipeline.judge import judge
from coursebuild.pipeline.load import load
from coursebuild.pipeline.options import Options, Selection, select
from coursebuild.pipeline.recorded_runs import check_recorded_runs, record_runs
from coursebuild.pipeline.scripts import (
    ExtractedScripts,
    extract_scripts,
    recorded_outputs,
    run,
    script_lines,
)
from coursebuild.report import Report


def update(options: Options, names: tuple[str, ...] = (), *, dry_run: bool = False) -> Report:
    """Record what the scripts of the chosen lessons print now."""
    with project_lock(options.root, options.progress.say):
        return _update(options, names, dry_run=dry_run)


def _update(options: Options, names: tuple[str, ...], *, dry_run: bool) -> Report:
    began = time.monotonic()
    parsed_course = load(options.root)
    course = parsed_course.value
    if course is None:
        return judge(None, parsed_course.diagnostics, began)
    options = options.for_course(course)
    selection = select(course, names, options.root)
    extracted_scripts = extract_scripts(course, options)
    scripts = _recorded_scripts(course, selection, extracted_scripts.runnable)
    with ScriptServer() as server:  # it keeps what scripts import from one run to the next
        server_options = replace(options, run_all=server.run)
        first_runs = run(scripts, server_options)
        second_runs = _run_again(course, selection, scripts, first_runs, server_options)
    edits, refusals = _make_edits(
        course, selection, first_runs, second_runs, _repeated_paths(extracted_scripts)
    )
    for diagnostic in parsed_course.diagnostics:
        if diagnostic.rule == "source-part" and diagnostic.span.path in (
            selection.documents or [diagnostic.span.path]
        ):
            edits.setdefault(diagnostic.span.source, []).extend(diagnostic.edits)
    for path in {d.span.path for d in parsed_course.diagnostics if d.rule == "file-encoding"}:
        edits = {source: changes for source, changes in edits.items() if source.path != path}
    remarks, failures = _write(options, edits, dry_run=dry_run)
    figure_remarks, figure_failures = write_figures(
        course, selection.documents, first_runs, options, dry_run=dry_run
    )
    remarks, failures = (*remarks, *figure_remarks), [*failures, *figure_failures]
    if options.long and not dry_run:
        record_runs(scripts, first_runs, options)
    now = parsed_course if dry_run or not remarks else load(options.root)
    diagnostics = [*now.diagnostics, *extracted_scripts.diagnostics, *refusals, *failures]
    diagnostics += check_recorded_runs(scripts, options)
    diagnostics += _diagnose_updated(course, now.value or course, scripts, first_runs, second_runs)
    if edits and not dry_run and now.value is not None:
        changed_scripts = {
            r.script
            for r in recorded_outputs(course, selection.documents)
            if _is_touched(r, edits, ())
        }
        diagnostics += _find_noise(now.value, selection, changed_scripts, first_runs, options)
    if not remarks and all(not d.is_error for d in diagnostics):
        remarks = ("every recorded output is up to date",)
    return judge(
        course,
        diagnostics,
        began,
        scripts=script_lines(scripts, _as_they_ran(first_runs, second_runs), ()),
        lessons=len(selection.lessons),
        documents=selection.documents,
        remarks=remarks,
    )


def _run_again(
    course: Course,
    selection: Selection,
    scripts: Sequence[Extraction],
    first_runs: Sequence[ScriptRun],
    options: Options,
) -> tuple[ScriptRun, ...]:
    """Run scripts again; a remembered first run that is recorded already stands for both."""
    edits, refusals = _make_edits(course, selection, first_runs, first_runs, frozenset())
    outdated = {
        r.script
        for r in recorded_outputs(course, selection.documents)
        if _is_touched(r, edits, refusals)
    }
    scripts_to_run = [
        extraction
        for extraction, first_run in zip(scripts, first_runs, strict=True)
        if (not first_run.cached or first_run.path in outdated) and not extraction.script.once
    ]
    memory = options.memory(fresh=True)
    runs = run(scripts_to_run, options, "running scripts again", memory)
    runs_by_path = {r.path: r for r in runs}
    return tuple(runs_by_path.get(first_run.path, first_run) for first_run in first_runs)


def _as_they_ran(
    first_runs: Sequence[ScriptRun], second_runs: Sequence[ScriptRun]
) -> list[ScriptRun]:
    """The runs to report: those that were remembered and had to run again count as run."""
    return [
        first_run
        if second_run.cached or not first_run.cached
        else replace(first_run, cached=False, seconds=second_run.seconds)
        for first_run, second_run in zip(first_runs, second_runs, strict=True)
    ]


def _find_noise(
    now: Course,
    selection: Selection,
    changed_scripts: Collection[str | None],
    first_runs: Sequence[ScriptRun],
    options: Options,
) -> list[Diagnostic]:
    """Find recorded digits that are noise, in the outputs that have changed."""
    from coursebuild.core.scripts.sensitivity import noise_warnings
    from coursebuild.pipeline.sensitivity import measure

    runs_by_path = {
        script_run.path: script_run
        for script_run in first_runs
        if script_run.path in changed_scripts
    }
    scripts = [extraction for extraction in extract(now).value if extraction.path in runs_by_path]
    runs = [runs_by_path[extraction.path] for extraction in scripts]
    sensitivities = measure(now, options, scripts, runs, selection.documents)
    return [warning for sensitivity in sensitivities for warning in noise_warnings(sensitivity)]


def _is_touched(
    recording: Recording, edits: Mapping[Source, list[Edit]], refusals: Sequence[Diagnostic]
) -> bool:
    """Whether something is to be written into a recording, or was refused."""
    whole = recording.span
    is_written = any(whole.contains(edit.span) for edit in edits.get(whole.source, ()))
    return is_written or any(whole.contains(d.span) for d in refusals)


def _recorded_scripts(
    course: Course, selection: Selection, runnable: Sequence[Extraction]
) -> tuple[Extraction, ...]:
    """Find the scripts that have an output or a figure to bring up to date."""
    paths = {recording.script for recording in recorded_outputs(course, selection.documents)}
    paths |= {figure.script for figure in find_figures(course, selection.documents)}
    return tuple(e for e in runnable if e.path in paths)


def _repeated_paths(extracted_scripts: ExtractedScripts) -> frozenset[str]:
    """The paths that several scripts have: nobody knows whose output is recorded."""
    repetitions = (d for d in extracted_scripts.diagnostics if d.rule == "script-repeated")
    return frozenset(diagnostic.span.text.strip("\"'") for diagnostic in repetitions)


def _make_edits(
    course: Course,
    selection: Selection,
    first_runs: Sequence[ScriptRun],
    second_runs: Sequence[ScriptRun],
    doubtful_paths: frozenset[str],
) -> tuple[dict[Source, list[Edit]], list[Diagnostic]]:
    """Make the edits, by lesson; a diagnostic for each output that cannot be written."""
    good = {
        first_run.path: (first_run.stdout, second_run.stdout)
        for first_run, second_run in zip(first_runs, second_runs, strict=True)
        if first_run.outcome is Outcome.OK and second_run.outcome is Outcome.OK
    }
    edits: dict[Source, list[Edit]] = {}
    refusals: list[Diagnostic] = []
    for recording in recorded_outputs(course, selection.documents):
        if recording.script not in good or recording.script in doubtful_paths:
            continue
        comparison = recording.comparison or course.comparison
        edit = update_body(recording, comparison, course.filters, *good[recording.script])
        if isinstance(edit, Edit):
            edits.setdefault(recording.span.source, []).append(edit)
        elif edit is not None:
            refusals.append(edit)
    return edits, refusals


def _write(
    options: Options, edits: Mapping[Source, list[Edit]], *, dry_run: bool
) -> tuple[tuple[str, ...], list[Diagnostic]]:
    """Write the lessons; a remark for each, and a diagnostic for each that was not written."""
    remarks: list[str] = []
    failures: list[Diagnostic] = []
    for source, changes in edits.items():
        new = apply_edits(source.text, changes)
        try:
            if dry_run:
                check_writable(options.root, source.path)
            else:
                write_atomic(options.root, source.path, new.encode(), expected=source.text.encode())
        except EffectError as error:
            span = min((edit.span for edit in changes), key=lambda span: span.start)
            failures.append(diagnose("output-not-updatable", span, error.message, help=error.help))
        else:
            remarks.append(changed_text("would update" if dry_run else "updated", source, new))
    return tuple(remarks), failures


def changed_text(verb: str, source: Source, new: str) -> str:
    """Make a remark that says which file was changed, and how."""
    diff = difflib.unified_diff(
        source.text.splitlines(), new.splitlines(), source.path, source.path, n=1, lineterm=""
    )
    return "\n".join([f"{verb} {source.path}", *diff])


def _diagnose_updated(
    before: Course,
    now: Course,
    scripts: Sequence[Extraction],
    first_runs: Sequence[ScriptRun],
    second_runs: Sequence[ScriptRun],
) -> list[Diagnostic]:
    """Find what is wrong with the scripts of the lessons as they are now."""
    runs = [
        second_run
        if first_run.outcome is Outcome.OK and second_run.outcome is not Outcome.OK
        else first_run
        for first_run, second_run in zip(first_runs, second_runs, strict=True)
    ]
    paths = {extraction.path for extraction in scripts}

    def verdicts(course: Course) -> list[Verdict]:
        return [v for v in compare_all(course, runs) if v.recording.script in paths]

    # What was written above a script has moved it.
    extractions = [extraction for extraction in extract(now).value if extraction.path in paths]
    evidence = collect_evidence(before, runs, verdicts(before)) if now is not before else None
    diagnostics = script_findings(now, extractions, runs, verdicts(now), evidence)
    # A drift that was not updated has its own diagnostic; a dry run leaves all drifts.
    return [d for d in diagnostics if d.rule != "output-drift"]
