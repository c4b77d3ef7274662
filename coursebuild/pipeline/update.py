"""`coursebuild update`: bring recorded outputs up to date, by span.

Entry point: `update(options, names, dry_run=…)`.

1. Every chosen script runs twice. What differs between the two runs cannot be recorded. A
   remembered result counts as the first of them, and where nothing of it is to be recorded as both:
   what is written has always been printed by two runs, the second of them now.
2. The new outputs become edits; each lesson is written whole or not at all, and only if nobody
   changed it meanwhile.
3. The bound numbers of the lessons as they are now are checked, so that prose which a new output
   makes false is told, and what is printed now in place of the number that it had.
4. Scripts whose output was written run again with their initial states moved a little: digits that
   change with them are noise, and should not have been printed.
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
from coursebuild.pipeline.figures import figures_of, write_figures
from coursebuild.pipeline.judge import judge
from coursebuild.pipeline.load import load
from coursebuild.pipeline.options import Options, Selection, select
from coursebuild.pipeline.progress import Progress
from coursebuild.pipeline.recorded_runs import check_recorded_runs, keep_runs
from coursebuild.pipeline.scripts import (
    ExtractedScripts,
    extract_scripts,
    recorded_outputs,
    run,
    script_lines,
)
from coursebuild.report import Report


def update(options: Options, names: tuple[str, ...] = (), *, dry_run: bool = False) -> Report:
    """Record anew what the chosen lessons' scripts print."""
    progress = Progress(quiet=options.quiet)
    with project_lock(options.root, progress.say):
        return _update(options, names, progress, dry_run=dry_run)


def _update(
    options: Options, names: tuple[str, ...], progress: Progress, *, dry_run: bool
) -> Report:
    began = time.monotonic()
    loaded = load(options.root)
    course = loaded.value
    if course is None:
        return judge(None, loaded.diagnostics, began)
    options = options.for_course(course)
    chosen = select(course, names, options.root)
    extracted = extract_scripts(course, options)
    scripts = _with_recordings(course, chosen, extracted.runnable)
    with ScriptServer() as server:  # what scripts import stays imported from one run to the other
        served = replace(options, run_all=server.run)
        first = run(scripts, served, progress)
        again = _again(course, chosen, scripts, first, served, progress)
    edits, refused = _edits(course, chosen, first, again, _repeated(extracted))
    for told in loaded.diagnostics:
        if told.rule == "source-part" and told.span.path in (chosen.documents or [told.span.path]):
            edits.setdefault(told.span.source, []).extend(told.edits)
    for path in {d.span.path for d in loaded.diagnostics if d.rule == "file-encoding"}:
        edits = {source: changes for source, changes in edits.items() if source.path != path}
    remarks, unwritten = _write(options, edits, dry_run=dry_run)
    drawn, unsaved = write_figures(course, chosen.documents, first, options, dry_run=dry_run)
    remarks, unwritten = (*remarks, *drawn), [*unwritten, *unsaved]
    if options.long and not dry_run:
        keep_runs(scripts, first, options)
    now = loaded if dry_run or not remarks else load(options.root)
    found = [*now.diagnostics, *extracted.diagnostics, *refused, *unwritten]
    found += check_recorded_runs(scripts, options)
    found += _afterwards(course, now.value or course, scripts, first, again)
    if edits and not dry_run and now.value is not None:
        changed = {
            r.script
            for r in recorded_outputs(course, chosen.documents)
            if _is_touched(r, edits, ())
        }
        found += _noise(now.value, chosen, changed, first, options, progress)
    if not remarks and all(not d.is_error for d in found):
        remarks = ("every recorded output is up to date",)
    return judge(
        course,
        found,
        began,
        scripts=script_lines(scripts, _as_they_ran(first, again), ()),
        lessons=len(chosen.lessons),
        documents=chosen.documents,
        remarks=remarks,
    )


def _again(
    course: Course,
    chosen: Selection,
    scripts: Sequence[Extraction],
    first: Sequence[ScriptRun],
    options: Options,
    progress: Progress,
) -> tuple[ScriptRun, ...]:
    """The second runs; a remembered first one that is recorded already stands for both."""
    edits, refused = _edits(course, chosen, first, first, frozenset())
    wrong = {
        r.script
        for r in recorded_outputs(course, chosen.documents)
        if _is_touched(r, edits, refused)
    }
    left = [
        extraction
        for extraction, one in zip(scripts, first, strict=True)
        if (not one.cached or one.path in wrong) and not extraction.script.once
    ]
    memory = options.memory(fresh=True)
    second = run(left, options, progress, "running scripts again", memory)
    ran = {r.path: r for r in second}
    return tuple(ran.get(one.path, one) for one in first)


def _as_they_ran(first: Sequence[ScriptRun], again: Sequence[ScriptRun]) -> list[ScriptRun]:
    """The runs as they are told of: one that was remembered, and had to run again, did run."""
    return [
        one if two.cached or not one.cached else replace(one, cached=False, seconds=two.seconds)
        for one, two in zip(first, again, strict=True)
    ]


def _noise(
    now: Course,
    chosen: Selection,
    changed: Collection[str | None],
    first: Sequence[ScriptRun],
    options: Options,
    progress: Progress,
) -> list[Diagnostic]:
    """Warnings of digits that were recorded and are noise, of the scripts whose output changed."""
    from coursebuild.core.scripts.sensitivity import noise_warnings
    from coursebuild.pipeline.sensitivity import measure

    ran = {one.path: one for one in first if one.path in changed}
    scripts = [extraction for extraction in extract(now).value if extraction.path in ran]
    runs = [ran[extraction.path] for extraction in scripts]
    measured = measure(now, options, progress, scripts, runs, chosen.documents)
    return [warning for one in measured for warning in noise_warnings(one)]


def _is_touched(
    recording: Recording, edits: Mapping[Source, list[Edit]], refused: Sequence[Diagnostic]
) -> bool:
    """Whether something is to be written into a recording, or cannot be."""
    whole = recording.span
    written = any(whole.contains(edit.span) for edit in edits.get(whole.source, ()))
    return written or any(whole.contains(d.span) for d in refused)


def _with_recordings(
    course: Course, chosen: Selection, runnable: Sequence[Extraction]
) -> tuple[Extraction, ...]:
    """The scripts that have an output or a figure to bring up to date."""
    wanted = {recording.script for recording in recorded_outputs(course, chosen.documents)}
    wanted |= {figure.script for figure in figures_of(course, chosen.documents)}
    return tuple(e for e in runnable if e.path in wanted)


def _repeated(extracted: ExtractedScripts) -> frozenset[str]:
    """Paths that several blocks have: whose output stands below them cannot be told."""
    twice = (d for d in extracted.diagnostics if d.rule == "script-repeated")
    return frozenset(diagnostic.span.text.strip("\"'") for diagnostic in twice)


def _edits(
    course: Course,
    chosen: Selection,
    first: Sequence[ScriptRun],
    again: Sequence[ScriptRun],
    doubtful: frozenset[str],
) -> tuple[dict[Source, list[Edit]], list[Diagnostic]]:
    """What to write, by lesson, and what cannot be written."""
    good = {
        one.path: (one.stdout, two.stdout)
        for one, two in zip(first, again, strict=True)
        if one.outcome is Outcome.OK and two.outcome is Outcome.OK
    }
    edits: dict[Source, list[Edit]] = {}
    refused: list[Diagnostic] = []
    for recording in recorded_outputs(course, chosen.documents):
        if recording.script not in good or recording.script in doubtful:
            continue
        comparison = recording.comparison or course.comparison
        made = update_body(recording, comparison, course.filters, *good[recording.script])
        if isinstance(made, Edit):
            edits.setdefault(recording.span.source, []).append(made)
        elif made is not None:
            refused.append(made)
    return edits, refused


def _write(
    options: Options, edits: Mapping[Source, list[Edit]], *, dry_run: bool
) -> tuple[tuple[str, ...], list[Diagnostic]]:
    """Write the lessons; a remark for each, and what was not written."""
    remarks: list[str] = []
    unwritten: list[Diagnostic] = []
    for source, changes in edits.items():
        new = apply_edits(source.text, changes)
        try:
            if dry_run:
                check_writable(options.root, source.path)
            else:
                write_atomic(options.root, source.path, new.encode(), expected=source.text.encode())
        except EffectError as error:
            span = min((edit.span for edit in changes), key=lambda span: span.start)
            unwritten.append(diagnose("output-not-updatable", span, error.message, help=error.help))
        else:
            remarks.append(changed_text("would update" if dry_run else "updated", source, new))
    return tuple(remarks), unwritten


def changed_text(what: str, source: Source, new: str) -> str:
    """A remark that says which file was changed, and how."""
    diff = difflib.unified_diff(
        source.text.splitlines(), new.splitlines(), source.path, source.path, n=1, lineterm=""
    )
    return "\n".join([f"{what} {source.path}", *diff])


def _afterwards(
    before: Course,
    now: Course,
    scripts: Sequence[Extraction],
    first: Sequence[ScriptRun],
    again: Sequence[ScriptRun],
) -> list[Diagnostic]:
    """What is wrong with the lessons as they are now."""
    runs = [
        two if one.outcome is Outcome.OK and two.outcome is not Outcome.OK else one
        for one, two in zip(first, again, strict=True)
    ]
    ran = {extraction.path for extraction in scripts}

    def verdicts(course: Course) -> list[Verdict]:
        return [v for v in compare_all(course, runs) if v.recording.script in ran]

    # What was written above a script moved it, so that its place is another than before.
    placed = [extraction for extraction in extract(now).value if extraction.path in ran]
    held = collect_evidence(before, runs, verdicts(before)) if now is not before else None
    found = script_findings(now, placed, runs, verdicts(now), held)
    # What update just refused is told by the refusal; a dry run leaves the drift as it is.
    return [d for d in found if d.rule != "output-drift"]
