"""The scripts of a course: written to `examples/`, remembered or run.

Entry points: `extract_scripts`, `run`, `recorded_outputs`, `script_lines`.

One that was edited in `examples/` by hand is reported and not run. Of the others those run, the
longest first, of which no result is remembered that still holds.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence

from msgspec import Struct

from coursebuild.core.files.errors import OutsideProjectError
from coursebuild.core.files.examples import Blocked, Obstacle, write_examples
from coursebuild.core.files.write import remove_leftovers
from coursebuild.core.model import Course, Recording, document_blocks
from coursebuild.core.model.results import Outcome, ScriptJob, ScriptRun, Verdict
from coursebuild.core.run.dependencies import Inputs
from coursebuild.core.run.memory import Memory, longest_first
from coursebuild.core.scripts.extract import Extraction, extract, jobs
from coursebuild.core.scripts.failures import is_lost
from coursebuild.core.text.diagnostics import Diagnostic, Note, diagnose
from coursebuild.pipeline.options import Options
from coursebuild.pipeline.progress import Progress
from coursebuild.pipeline.recorded_runs import recorded_runs
from coursebuild.report import ScriptLine


class ExtractedScripts(Struct, frozen=True):
    """The scripts as they are in `examples/` now."""

    all: tuple[Extraction, ...]
    runnable: tuple[Extraction, ...]
    """Those whose file is what the lesson says; none where their interpreter is missing."""
    diagnostics: tuple[Diagnostic, ...]
    written: tuple[str, ...]
    removed: tuple[str, ...]
    blocked: tuple[Blocked, ...]


def extract_scripts(course: Course, options: Options) -> ExtractedScripts:
    """Bring `examples/` up to date, as far as nobody's edits are lost."""
    parsed = extract(course)
    folders = {document.source.path.rpartition("/")[0] for document in course.documents}
    remove_leftovers(options.root / folder for folder in folders)
    try:
        report = write_examples(options.root, {e.path: e.data for e in parsed.value})
    except OutsideProjectError as error:
        place = parsed.value[0].script.path_span if parsed.value else course.map.span(0, 0)
        diagnostic = diagnose(
            "script-path", place, error.message, help="make it a folder of the course"
        )
        return ExtractedScripts(parsed.value, (), (*parsed.diagnostics, diagnostic), (), (), ())
    by_path = {e.path: e for e in parsed.value}
    blocked = {example.path for example in report.blocked}
    found = [*parsed.diagnostics, *(_left(b, by_path.get(b.path), course) for b in report.blocked)]
    can_run = course.python is None or options.interpreter is not None
    runnable = tuple(e for e in parsed.value if can_run and e.path not in blocked)
    return ExtractedScripts(
        parsed.value,
        runnable,
        tuple(found),
        report.written,
        report.removed,
        report.blocked,
    )


_LEFT = {
    Obstacle.EDITED: "{path} was edited by hand since it was extracted, so it is left as it is",
    Obstacle.FOREIGN: "{path} does not hold this block, and was not extracted",
    Obstacle.ORPHAN: "{path} was edited by hand, and no lesson has this script any more",
    Obstacle.LINK: "{path} is, or lies behind, a link, and nothing is written through links",
    Obstacle.FOLDER: "{path} cannot be written: a folder and a file would have the same name",
}


def _left(blocked: Blocked, extraction: Extraction | None, course: Course) -> Diagnostic:
    """Why a file in `examples/` was left alone, and how to go on."""
    message = _LEFT[blocked.obstacle].format(path=blocked.path)
    if extraction is None:
        help = "move the file away, or bring it back into a lesson"
        return diagnose("example-edited", course.map.span(0, 0), message, help=help)
    if blocked.obstacle in (Obstacle.LINK, Obstacle.FOLDER):
        help = "move what is there away, or extract the script to another path"
        return diagnose("script-path", extraction.script.path_span, message, help=help)
    help = (
        "`coursebuild extract --adopt` brings what the file holds into the lesson; "
        "to drop it instead, delete the file"
    )
    if blocked.diverged:
        help = (
            "the block was changed as well: bring what is to stay of the file into it by hand, "
            "then delete the file"
        )
    notes = [Note("from the block to the file:\n" + blocked.diff.rstrip())] if blocked.diff else []
    return diagnose("example-edited", extraction.script.path_span, message, help=help, notes=notes)


def run(
    chosen: Iterable[Extraction],
    options: Options,
    progress: Progress,
    stage: str = "running scripts",
    memory: Memory | None = None,
    perturbation: int = 0,
    known: Mapping[str, ScriptRun] | None = None,
) -> tuple[ScriptRun, ...]:
    """The results of the chosen scripts: remembered ones, and those of the others run now.

    What begins and ends is told. `memory` is what is remembered, where it is not that of the
    options. `perturbation`: with initial states moved, in the direction that has this number.
    `known`: results, by path, that hold.
    """
    chosen = tuple(chosen)
    memory = options.memory() if memory is None else memory
    todo = jobs(chosen, perturbation)
    norun = (script.path for script in chosen if script.script.norun)
    done = {path: ScriptRun(path, Outcome.NORUN, 0, "", "", 0.0) for path in norun}
    done |= {**(known or {}), **recorded_runs(chosen, options)}
    inputs = {
        job.path: memory.inputs(job, extraction.data)
        for job, extraction in zip(todo, chosen, strict=True)
        if job.path not in done
    }
    if inputs:
        done |= memory.recall(tuple(inputs.values()))
    left = [job for job in todo if job.path not in done]
    for finished in _run(left, inputs, options, progress, stage, memory):
        done[finished.path] = finished
    return tuple(done[job.path] for job in todo)


def _run(
    todo: Sequence[ScriptJob],
    inputs: Mapping[str, Inputs],
    options: Options,
    progress: Progress,
    stage: str,
    memory: Memory,
) -> tuple[ScriptRun, ...]:
    """Run scripts, the longest first, and remember what they did."""
    if not todo:
        return ()
    from coursebuild.core.run.runner import ScriptServer

    lasted = (memory.last_record(job.path) for job in todo)
    seconds = {last.inputs.path: last.stored_run.seconds for last in lasted if last is not None}

    def on_start(path: str) -> None:
        memory.note_start(path)
        progress.started(path)

    def on_finish(done: ScriptRun) -> None:
        memory.keep(inputs[done.path], done)
        progress.finished(done.path, done.outcome.value, done.seconds)

    if options.verbose:
        for job in todo:
            progress.say(f"{job.path}: {'; '.join(memory.reasons(inputs[job.path]))}")
    memory.begin()
    with ScriptServer(sandbox=options.sandbox) as server, progress.stage(stage, len(todo)):
        run_all = options.run_all or server.run
        return run_all(
            options.root,
            longest_first(todo, seconds),
            parallel=options.jobs,
            on_start=on_start,
            on_finish=on_finish,
            interpreter=options.interpreter,
        )


def recorded_outputs(course: Course, documents: Collection[str] | None = None) -> list[Recording]:
    """The outputs of scripts in these documents, or in all, that can be compared."""
    return [
        block
        for document in course.documents
        if documents is None or document.source.path in documents
        for block in document_blocks(document)
        if isinstance(block, Recording) and block.script is not None and block.readable
    ]


def script_lines(
    chosen: Sequence[Extraction], runs: Sequence[ScriptRun], verdicts: Sequence[Verdict]
) -> tuple[ScriptLine, ...]:
    """How each script did, as a report lists it."""
    drifted = {v.recording.script for v in verdicts if v.status == "drift"}
    lines = []
    for extraction, done in zip(chosen, runs, strict=True):
        drift = done.outcome is Outcome.OK and done.path in drifted
        status = "drift" if drift else done.outcome.value
        if done.outcome is Outcome.OK and is_lost(extraction, done):
            status = "diverged"
        lines.append(
            ScriptLine(done.path, extraction.owner, status, done.seconds, done.cached, done.missing)
        )
    return tuple(lines)
