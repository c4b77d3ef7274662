"""Writes the scripts of a course to `examples/`, and runs those that must run.

A script that was edited by hand in `examples/` is reported and not run. Of the others, those run
that have no remembered result which still holds, the longest first.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from pathlib import Path

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core.files.errors import OutsideProjectError
from coursebuild.core.files.examples import BlockedFile, ExamplesReport, Obstacle, write_examples
from coursebuild.core.files.write import remove_leftovers
from coursebuild.core.model import Course, Mode, Recording, Table, find_blocks
from coursebuild.core.model.addresses import RecordedFigure
from coursebuild.core.model.lesson_record import LessonRecord
from coursebuild.core.model.results import Outcome, ScriptJob, ScriptRun, Verdict
from coursebuild.core.run.dependencies import Inputs
from coursebuild.core.run.run_store import RunStore, longest_first
from coursebuild.core.run.script_environment import Interpreter, find_runner
from coursebuild.core.run.script_server import ScriptServer
from coursebuild.core.scripts.compare import compare
from coursebuild.core.scripts.extract import Extraction, extract, jobs
from coursebuild.core.scripts.failures import is_lost
from coursebuild.core.scripts.figures import compare_figure
from coursebuild.core.scripts.findings import count_unproven
from coursebuild.core.scripts.sensitivity import (
    FINER_RUNS,
    RUNS,
    SHIFTED_RUNS,
    Sensitivity,
    is_worth_moving,
    sensitivity,
)
from coursebuild.core.text.diagnostics import Diagnostic, Note, diagnose
from coursebuild.core.text.source import Span
from coursebuild.pipeline.options import Options
from coursebuild.pipeline.recordings import find_figures, read_recorded, recorded_runs
from coursebuild.pipeline.records import with_provenance
from coursebuild.report import ScriptLine


class ExtractedScripts(Struct, frozen=True):
    """What writing the scripts to `examples/` gave."""

    extractions: tuple[Extraction, ...]
    runnable: tuple[Extraction, ...]
    """Those whose files are as their lessons say; none where their interpreter is missing."""
    diagnostics: tuple[Diagnostic, ...]
    files: ExamplesReport
    """What became of the files."""


def extract_scripts(course: Course, options: Options) -> ExtractedScripts:
    """Bring `examples/` up to date, without overwriting anybody's edits."""
    extraction_result = extract(course)
    extractions, diagnostics = extraction_result.value, list(extraction_result.diagnostics)
    folders = {document.source.path.rpartition("/")[0] for document in course.documents}
    remove_leftovers(options.root / folder for folder in folders)
    try:
        files = write_examples(options.root, {e.path: e.data for e in extractions})
    except OutsideProjectError as error:
        place = extractions[0].script.path_span if extractions else course.map.span(0, 0)
        help = "make it a folder of the course"
        diagnostics.append(diagnose("script-path", place, error.message, help=help))
        files = ExamplesReport((), (), (), ())
        return ExtractedScripts(extractions, (), tuple(diagnostics), files)
    by_path = {e.path: e for e in extractions}
    diagnostics += (_diagnose_blocked(b, by_path.get(b.path), course) for b in files.blocked)
    blocked_paths = {example.path for example in files.blocked}
    can_run = course.python is None or options.interpreter is not None
    runnable = tuple(e for e in extractions if can_run and e.path not in blocked_paths)
    return ExtractedScripts(extractions, runnable, tuple(diagnostics), files)


_OBSTACLES = {
    Obstacle.EDITED: "{path} was edited by hand since it was extracted, so it is left as it is",
    Obstacle.FOREIGN: "{path} does not hold this block, and was not extracted",
    Obstacle.ORPHAN: "{path} was edited by hand, and no lesson has this script any more",
    Obstacle.LINK: "{path} is, or lies behind, a link, and nothing is written through links",
    Obstacle.FOLDER: "{path} cannot be written: a folder and a file would have the same name",
}


def _diagnose_blocked(
    blocked_file: BlockedFile, extraction: Extraction | None, course: Course
) -> Diagnostic:
    message = _OBSTACLES[blocked_file.obstacle].format(path=blocked_file.path)
    if extraction is None:
        help = "move the file away, or bring it back into a lesson"
        return diagnose("example-edited", course.map.span(0, 0), message, help=help)
    if blocked_file.obstacle in (Obstacle.LINK, Obstacle.FOLDER):
        help = "move what is there away, or extract the script to another path"
        return diagnose("script-path", extraction.script.path_span, message, help=help)
    help = (
        "`coursebuild extract --adopt` brings what the file holds into the lesson; "
        "to drop it instead, delete the file"
    )
    if blocked_file.diverged:
        help = (
            "the block was changed as well: copy into it by hand what should stay of the file, "
            "then delete the file"
        )
    notes = (
        [Note("from the block to the file:\n" + blocked_file.diff.rstrip())]
        if blocked_file.diff
        else []
    )
    return diagnose("example-edited", extraction.script.path_span, message, help=help, notes=notes)


def run(
    course: Course,
    scripts: Iterable[Extraction],
    options: Options,
    stage: str = "running scripts",
    run_store: RunStore | None = None,
    perturbation: int = 0,
    known_runs: Mapping[str, ScriptRun] | None = None,
    *,
    only_recorded: bool = False,
    keeps_going: bool = False,
    imports: Mapping[str, frozenset[str]] = {},
) -> tuple[ScriptRun, ...]:
    """Return the results of scripts: remembered ones, and those of the others, which run now.

    `run_store` replaces that of the options. `perturbation`: with initial states moved, in the
    direction of this number. `known_runs`: results, by path, that are known to hold.
    `only_recorded`: none runs of which nothing is recorded yet. `keeps_going`: see `ScriptJob`.
    `imports`: the modules that scripts import, by path, as far as they are known.
    """
    extractions, tell = tuple(scripts), options.on_result

    def complete(run: ScriptRun) -> ScriptRun:
        return with_provenance({run.path: run}, extractions, options, imports)[run.path]

    if tell is not None:
        options = replace(options, on_result=lambda run: tell(complete(run)))
    run_store = options.run_store() if run_store is None else run_store
    all_jobs = jobs(extractions, perturbation, keeps_going=keeps_going)
    runs = dict(_unrun(extractions, options.interpreter))
    runs |= {**(known_runs or {}), **recorded_runs(extractions, options)}
    inputs = {
        job.path: run_store.inputs(job, extraction.data)
        for job, extraction in zip(all_jobs, extractions, strict=True)
        if job.path not in runs
    }
    if inputs:
        runs |= run_store.get_runs(tuple(inputs.values()))
    jobs_to_run = [job for job in all_jobs if job.path not in runs]
    if jobs_to_run:
        records = _Records(course, options.root, complete)
        if only_recorded:
            blank = {job.path for job in jobs_to_run if records.is_blank(job.path)}
            runs |= {path: ScriptRun(path, Outcome.UNRECORDED, 0, "", "", 0.0) for path in blank}
            jobs_to_run = [job for job in jobs_to_run if job.path not in blank]
        runs |= _run(jobs_to_run, inputs, options, stage, run_store, records)
    runs = with_provenance(runs, extractions, options, imports)
    return tuple(runs[job.path] for job in all_jobs)


def _unrun(
    extractions: Iterable[Extraction], interpreter: Interpreter | None
) -> Iterator[tuple[str, ScriptRun]]:
    """The scripts that are not to be run, or whose runner is not installed, by their paths."""
    for extraction in extractions:
        path, first = extraction.path, next(iter(extraction.commands), ("",))[0]
        if not extraction.is_run:
            yield path, ScriptRun(path, Outcome.NORUN, 0, "", "", 0.0)
        elif first and "/" not in first and find_runner(first, interpreter) is None:
            yield path, ScriptRun(path, Outcome.SKIPPED, 0, "", "", 0.0, missing=(first,))


class _Records:
    """What is recorded of the scripts of a course."""

    def __init__(
        self, course: Course, root: Path, complete: Callable[[ScriptRun], ScriptRun]
    ) -> None:
        """`complete` adds to a run what it ran with, which decides how figures are compared."""
        self._course, self._read = course, functools.partial(read_recorded, root)
        self._complete = complete
        self._outputs: dict[str, list[Recording]] = {}
        for recording in recorded_outputs(course):
            self._outputs.setdefault(recording.script or "", []).append(recording)
        self._figures: dict[str, list[tuple[RecordedFigure, LessonRecord]]] = {}
        for figure in find_figures(course, None):
            record = course.records.get(figure.span.path, LessonRecord())
            self._figures.setdefault(figure.script, []).append((figure, record))

    def is_blank(self, path: str) -> bool:
        """Whether there is a place for what a script gives, and nothing in any such place."""
        outputs, figures = self._outputs.get(path, ()), self._figures.get(path, ())
        return bool(outputs or figures) and not (
            any(
                isinstance(recording.body, Table)
                or recording.body.text.strip()
                or self._course.comparison_of(recording).mode is Mode.VOLATILE
                for recording in outputs
            )
            or any(self._read(figure.path) is not None for figure, _ in figures)
        )

    def compare(self, script_run: ScriptRun) -> ScriptRun:
        """The run, with whether it bears out what is recorded now."""
        outputs = self._outputs.get(script_run.path, ())
        figures = self._figures.get(script_run.path, ())
        comparison_of, output_of = self._course.comparison_of, script_run.output_of
        complete_run = self._complete(script_run) if figures else script_run
        holds = all(
            compare(r, comparison_of(r), output_of(r.part)).status != "drift" for r in outputs
        ) and not any(
            finding
            for figure, record in figures
            for finding in compare_figure(figure, complete_run, self._read(figure.path), record)
        )
        return replace(script_run, unrepeated=not (holds and (outputs or figures)))


def _run(
    jobs_to_run: Sequence[ScriptJob],
    inputs: Mapping[str, Inputs],
    options: Options,
    stage: str,
    run_store: RunStore,
    records: _Records,
) -> dict[str, ScriptRun]:
    if not jobs_to_run:
        return {}
    progress = options.progress
    last_runs = (run_store.last_record(job.path) for job in jobs_to_run)
    seconds = {last.inputs.path: last.stored_run.seconds for last in last_runs if last is not None}

    def on_start(path: str) -> None:
        run_store.note_start(path)
        progress.start(path, seconds.get(path))
        if options.on_start is not None:
            options.on_start(path, seconds.get(path))

    runs: dict[str, ScriptRun] = {}
    claimed_paths: set[str] = set()

    def on_finish(script_run: ScriptRun) -> None:
        if script_run.outcome is Outcome.OK:
            script_run = records.compare(script_run)
        run_store.put_run(inputs[script_run.path], script_run)
        runs[script_run.path] = script_run
        run_store.unclaim(inputs[script_run.path])
        claimed_paths.discard(script_run.path)
        progress.finish(script_run.path, script_run.outcome.value, script_run.seconds)
        if options.on_result is not None:
            options.on_result(script_run)

    if options.verbose:
        for job in jobs_to_run:
            progress.say(f"{job.path}: {'; '.join(run_store.reasons(inputs[job.path]))}")
    busy_elsewhere: set[str] = set()

    def claim(job: ScriptJob) -> ScriptRun | bool:
        answer = run_store.claim(inputs[job.path])
        if answer is False and job.path not in busy_elsewhere:
            busy_elsewhere.add(job.path)
            progress.say(f"another coursebuild is running {job.path}; waiting for its result")
        elif answer is True:
            claimed_paths.add(job.path)
        elif answer is not False:
            runs[job.path] = answer
            progress.skip()
            if options.on_result is not None:
                options.on_result(answer)
        return answer

    run_store.begin()
    with ScriptServer(sandbox=options.sandbox) as server, progress.stage(stage, len(jobs_to_run)):
        run_all = options.run_all or server.run
        try:
            run_all(
                options.root,
                longest_first(jobs_to_run, seconds),
                parallel=options.jobs,
                on_start=on_start,
                on_finish=on_finish,
                interpreter=options.interpreter,
                claim=claim,
            )
        finally:
            for path in claimed_paths:
                run_store.unclaim(inputs[path])
    return runs


def find_module(root: Path, name: str) -> str:
    """Find the file of a module in the course, two folders deep at most; empty if there is none."""
    excluded = {"examples", "public", "node_modules"}
    for folder in (root, *sorted(root.glob("*/")), *sorted(root.glob("*/*/"))):
        parts = folder.relative_to(root).parts
        if excluded.intersection(parts) or any(part.startswith(".") for part in parts):
            continue
        for file in (folder / f"{name}.py", folder / name / "__init__.py"):
            if file.is_file() and not any((p / "pyvenv.cfg").exists() for p in folder.parents):
                return file.relative_to(root).as_posix()
    return ""


def recorded_outputs(course: Course, documents: Collection[str] | None = None) -> list[Recording]:
    """Find the recorded outputs in these documents, or in all, that can be compared."""
    return [
        block
        for document in course.documents
        if documents is None or document.source.path in documents
        for block in find_blocks(document, Recording)
        if block.script is not None and block.readable
    ]


def script_lines(
    extractions: Sequence[Extraction],
    runs: Sequence[ScriptRun],
    verdicts: Sequence[Verdict],
    course: Course,
    drifted_figures: Collection[Span] = (),
    left_out: Iterable[Extraction] = (),
) -> tuple[ScriptLine, ...]:
    """Make the lines of a report about scripts.

    Some figures are not as they are recorded. Scripts that are `left_out` could not be extracted,
    or have no interpreter. A file without a runner that a script has read is data, and no script.
    """
    read_paths = {file for run in runs if run.trace is not None for file in run.trace.files}
    unproven = count_unproven(course, runs, verdicts)
    drifted_paths = {v.recording.script for v in verdicts if v.status == "drift"}
    recorded_paths = {v.recording.script for v in verdicts if v.status == "verified"}
    figures = find_figures(course, None)
    recorded_paths |= {figure.script for figure in figures if figure.span not in drifted_figures}
    lines = []
    for extraction, script_run in zip(extractions, runs, strict=True):
        is_data = not (extraction.is_run or extraction.script.norun or extraction.script.is_python)
        if is_data and extraction.path in read_paths:
            continue
        drift = script_run.outcome is Outcome.OK and script_run.path in drifted_paths
        status = "drift" if drift else script_run.outcome.value
        if script_run.outcome is Outcome.OK and is_lost(extraction, script_run):
            status = "diverged"
        lines.append(
            ScriptLine(
                script_run.path,
                extraction.owner,
                status,
                script_run.seconds,
                script_run.cached,
                script_run.missing,
                *unproven.get(script_run.path, (0, 0)),
                script_run.unrepeated and script_run.path in recorded_paths,
                ()
                if script_run.did_run
                else script_run.missing or (_unrun_reason(extraction, status),),
            )
        )
    lines += [
        ScriptLine(e.path, e.owner, "blocked", 0.0, False, reasons=("blocked",)) for e in left_out
    ]
    return tuple(lines)


def _unrun_reason(extraction: Extraction, status: str) -> str:
    if status == Outcome.UNRECORDED.value:
        return "nothing recorded"
    if extraction.script.once:
        return "record=once"
    has_none = not (extraction.is_run or extraction.script.norun)
    return f"no runner for `{extraction.script.language}`" if has_none else "norun"


def measure_sensitivity(
    course: Course,
    options: Options,
    runs: Iterable[ScriptRun],
    documents: Collection[str] | None = None,
    *,
    halve: bool = False,
) -> tuple[Sensitivity, ...]:
    """Measure which printed digits repeat when initial states move, of scripts that were run.

    Scripts that use MuJoCo and print what is recorded run four times with their initial states
    moved (`core.run.perturbation`), each with three times the time limit; if `halve`, twice more
    with a half and a quarter of the timestep, and with shifted steps. All runs are remembered
    like others.
    `documents`: only recorded outputs in documents with these paths count.
    """
    recordings: dict[str, list[Recording]] = {}
    for recording in recorded_outputs(course, documents):
        assert recording.script is not None
        recordings.setdefault(recording.script, []).append(recording)
    bases = {run.path: run for run in runs if run.did_run}
    pairs = [(e, bases[e.path]) for e in extract(course).value if e.path in bases]
    moved_scripts = [
        script
        for script, base in pairs
        if is_worth_moving(course, recordings.get(script.path, ()), base)
    ]
    numbers = (*range(1, RUNS + 1), *((*FINER_RUNS, *SHIFTED_RUNS) if halve else ()))
    perturbed_runs = _run_perturbed(course, moved_scripts, options, numbers)
    return tuple(
        sensitivity(
            course,
            script.path,
            script.owner,
            recordings.get(script.path, ()),
            base,
            perturbed_runs.get(script.path, ())[:RUNS],
            perturbed_runs.get(script.path, ())[RUNS : RUNS + len(FINER_RUNS)],
            perturbed_runs.get(script.path, ())[RUNS + len(FINER_RUNS) :],
        )
        for script, base in pairs
    )


def _run_perturbed(
    course: Course, scripts: Sequence[Extraction], options: Options, numbers: Sequence[int]
) -> dict[str, list[ScriptRun]]:
    runs: dict[str, list[ScriptRun]] = {script.path: [] for script in scripts}
    if not scripts:
        return runs
    run_store = options.run_store()
    with ScriptServer(sandbox=options.sandbox) as server:
        server_options = replace(options, run_all=options.run_all or server.run)
        for number in numbers:
            stage = f"moving initial states, {number} of {RUNS}"
            if number in FINER_RUNS:
                stage = "halving timesteps" + (" twice" if number == FINER_RUNS[1] else "")
            elif number in SHIFTED_RUNS:
                stage = f"shifting steps, {SHIFTED_RUNS.index(number) + 1} of {len(SHIFTED_RUNS)}"
            for script_run in run(
                course, scripts, server_options, stage, run_store, perturbation=number
            ):
                runs[script_run.path].append(script_run)
    return runs
