"""Course → Results: extract and run the scripts, compare, compile the models.

Entry point: `verify(course, options, progress, lessons)`.

1. Scripts are written to `examples/`; one that was edited there by hand is reported and not run.
2. The scripts of the chosen lessons run, `options.jobs` at a time.
3. Recorded outputs and bound numbers are held against the runs.
4. Models and MJCF blocks are compiled in a child process, which is not started for a course that
   has none.

Documents may be summaries. Formulas are no part of this: see `pipeline.documents`.
"""

from __future__ import annotations

import functools
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, assert_never

from msgspec import Struct, field

from coursebuild.core.checks.compiled import check_compiled, mjcf_texts
from coursebuild.core.features import check_runs
from coursebuild.core.files.errors import OutsideProjectError
from coursebuild.core.files.examples import Blocked, Obstacle, write_examples
from coursebuild.core.files.write import remove_leftovers
from coursebuild.core.model import Course, FeatureBlock, Lab, document_blocks, document_has
from coursebuild.core.model.results import (
    CompileResult,
    LabResult,
    Outcome,
    Results,
    ScriptJob,
    ScriptRun,
    Verdict,
)
from coursebuild.core.run.versions import engine_version, python_version
from coursebuild.core.scripts.binding_memory import BindingMemory
from coursebuild.core.scripts.bindings import document_bindings
from coursebuild.core.scripts.compare import verify as compare_all
from coursebuild.core.scripts.dependencies import Inputs
from coursebuild.core.scripts.divergence import is_lost
from coursebuild.core.scripts.extract import Extraction, extract, jobs
from coursebuild.core.scripts.findings import script_findings
from coursebuild.core.text.diagnostics import Diagnostic, Note, diagnose
from coursebuild.pipeline.memoized import KeptBindings
from coursebuild.pipeline.options import Options
from coursebuild.pipeline.progress import Progress
from coursebuild.pipeline.remember import Memory, longest_first
from coursebuild.report import LabLine, ScriptLine

if TYPE_CHECKING:
    from coursebuild.core.run.prewarm import RunAll
    from coursebuild.core.run.runner import RunEvent
    from coursebuild.pipeline.shards import Shard


class Verified(Struct, frozen=True):
    """What verification found."""

    results: Results
    diagnostics: tuple[Diagnostic, ...]
    scripts: tuple[ScriptLine, ...]
    labs: tuple[LabLine, ...]


def verify(
    course: Course,
    options: Options,
    progress: Progress,
    documents: frozenset[str] | None = None,
    *,
    static: bool = False,
    shard: Shard | None = None,
    run_all: RunAll | None = None,
    held: BindingMemory | None = None,
    known: Mapping[str, ScriptRun] | None = None,
) -> Verified:
    """Verify a course, or only what stands in the documents with these paths.

    `static`: with the static forms of labs, which only a build needs. `shard`: only this part of
    the scripts and labs. `run_all` runs scripts, where it is not `run_scripts`. `held`:
    bound numbers that held before; what the store has, where nothing is said. `known`: what scripts
    do, by path, that need not be looked at.
    """
    options.store.listen(progress.say)
    extracted = extract_scripts(course, options)
    chosen: Sequence[Extraction] = extracted.runnable
    if documents is not None:
        leaned_on = _leaned_on(course, documents)
        chosen = [e for e in chosen if e.document in documents or e.path in leaned_on]
    only = None
    if shard is not None:
        from coursebuild.pipeline.lab_inputs import labs_of

        names = (name for _, name, lab in labs_of(course) if _is_in(lab, documents))
        only = shard.takes([*(e.path for e in chosen), *names])
        chosen = [e for e in chosen if e.path in only]
    models, compiled = compile_models(course, options, progress)
    memory = Memory(options.root, options.store)
    scripts = functools.partial(
        run,
        chosen,
        options,
        progress,
        memory=memory,
        run_all=run_all,
        digests=extracted.digests,
        known=known,
    )
    labs: tuple[LabResult, ...] = ()
    lab_findings: tuple[Diagnostic, ...] = ()
    if _has_labs(course):
        from coursebuild.pipeline.labs import Engines, Tried, run_scripts_and_labs, try_labs

        by_name = dict(models)

        def trials(engines: Engines) -> Tried:
            return try_labs(
                course, by_name, options, engines, documents, compiled, static=static, only=only
            )

        runs, (labs, lab_findings) = run_scripts_and_labs(scripts, trials, options.root, progress)
    else:
        runs = scripts()
    verdicts = compare_all(course, runs)
    found = [*extracted.diagnostics, *compiled, *lab_findings]
    kept = KeptBindings(options.store) if held is None else None
    bindings = held if kept is None else kept
    found += script_findings(course, chosen, runs, verdicts, bindings, extracted.all)
    if kept is not None:
        kept.save()
    if memory.differing:
        from coursebuild.core.scripts.repeat import repeat_findings

        found += repeat_findings(course, chosen, memory.differing)
    found += check_runs(course, runs)
    versions = python_version(), engine_version()
    results = Results(runs, verdicts, (), models, *versions, labs)
    return Verified(results, tuple(found), script_lines(chosen, runs, verdicts), lab_lines(labs))


def _has_labs(course: Course) -> bool:
    return any(document_has(document, Lab) for document in course.documents)


def _is_in(lab: Lab, documents: Collection[str] | None) -> bool:
    return documents is None or lab.span.path in documents


def _leaned_on(course: Course, documents: Collection[str]) -> set[str]:
    """Scripts, of any lesson, whose output the numbers and questions of these documents quote."""
    paths: set[str] = set()
    for document in course.documents:
        if document.source.path in documents:
            paths |= {b.script for b in document_bindings(document) if b.script is not None}
            for block in document_blocks(document):
                if isinstance(block, FeatureBlock):
                    paths |= {script for script, _ in block.quoted_lines()}
    return paths


# --- scripts


class ExtractedScripts(Struct, frozen=True):
    """The scripts as they are in `examples/` now."""

    all: tuple[Extraction, ...]
    runnable: tuple[Extraction, ...]
    """Those whose file is what the lesson says."""
    diagnostics: tuple[Diagnostic, ...]
    written: tuple[str, ...]
    removed: tuple[str, ...]
    blocked: tuple[Blocked, ...]
    digests: Mapping[str, str] = field(default_factory=dict)
    """The SHA-256 of the file of each, as far as it is known."""


class _Files(Mapping[str, bytes]):
    """The bytes of scripts by path, of which never more than one is held."""

    def __init__(self, extractions: Mapping[str, Extraction]) -> None:
        self._extractions = extractions

    def __getitem__(self, path: str) -> bytes:
        return self._extractions[path].data

    def __iter__(self) -> Iterator[str]:
        return iter(self._extractions)

    def __len__(self) -> int:
        return len(self._extractions)


def extract_scripts(course: Course, options: Options) -> ExtractedScripts:
    """Bring `examples/` up to date, as far as nobody's edits are lost."""
    parsed = extract(course)
    folders = {document.source.path.rpartition("/")[0] for document in course.documents}
    remove_leftovers(options.root / folder for folder in folders)
    try:
        report = write_examples(options.root, _Files({e.path: e for e in parsed.value}))
    except OutsideProjectError as error:
        place = parsed.value[0].script.path_span if parsed.value else course.map.span(0, 0)
        told = diagnose("script-path", place, error.message, help="make it a folder of the course")
        return ExtractedScripts(parsed.value, (), (*parsed.diagnostics, told), (), (), ())
    by_path = {e.path: e for e in parsed.value}
    blocked = {example.path for example in report.blocked}
    found = [*parsed.diagnostics, *(_left(b, by_path.get(b.path), course) for b in report.blocked)]
    runnable = tuple(e for e in parsed.value if e.path not in blocked)
    return ExtractedScripts(
        parsed.value,
        runnable,
        tuple(found),
        report.written,
        report.removed,
        report.blocked,
        report.digests,
    )


_LEFT = {
    Obstacle.EDITED: "{path} was edited by hand since it was extracted, so it is left as it is",
    Obstacle.FOREIGN: "{path} holds something else than this block, which was not extracted there",
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
    run_all: RunAll | None = None,
    perturbation: int = 0,
    digests: Mapping[str, str] | None = None,
    known: Mapping[str, ScriptRun] | None = None,
) -> tuple[ScriptRun, ...]:
    """The results of the chosen scripts: remembered ones, and those of the others run now.

    What begins and ends is told. `memory` is what is remembered; another one than that of the
    options where everything is to run. `run_all` is what runs them, where it
    is not `run_scripts`.
    `perturbation`: with initial states moved, in the direction that has this number. `digests`:
    of files, by path, as far as they are known. `known`: results, by path, that hold.
    """
    chosen = tuple(chosen)
    memory = Memory(options.root, options.store) if memory is None else memory
    todo = jobs(chosen, perturbation)
    done = dict(known or {})
    inputs = {
        job.path: _inputs(memory, job, extraction, digests or {})
        for job, extraction in zip(todo, chosen, strict=True)
        if not job.norun and job.path not in done
    }
    if inputs:
        done |= memory.recall(tuple(inputs.values()))
    left = [job for job in todo if job.path not in done]
    for finished in _run(left, inputs, options, progress, stage, memory, run_all):
        done[finished.path] = finished
    return tuple(done[job.path] for job in todo)


def _inputs(
    memory: Memory, job: ScriptJob, extraction: Extraction, digests: Mapping[str, str]
) -> Inputs:
    known = digests.get(job.path)
    return memory.inputs(job, extraction.data) if known is None else memory.inputs_by(job, known)


def _run(
    todo: Sequence[ScriptJob],
    inputs: Mapping[str, Inputs],
    options: Options,
    progress: Progress,
    stage: str,
    memory: Memory,
    run_all: RunAll | None,
) -> tuple[ScriptRun, ...]:
    """Run scripts, the longest first, and remember what they did."""
    if not todo:
        return ()
    from coursebuild.core.run.runner import RunFinished, RunStarted, run_scripts

    count = sum(not job.norun for job in todo)
    if not count:
        return run_scripts(options.root, todo, parallel=1)
    lasted = {job.path: memory.last(job.path) for job in todo}
    seconds = {path: None if last is None else last.seconds for path, last in lasted.items()}

    def told(event: RunEvent) -> None:
        match event:
            case RunStarted():
                memory.started(event.path)
                progress.started(event.path)
            case RunFinished():
                done = event.run
                memory.keep(inputs[done.path], done)
                progress.finished(done.path, done.outcome.value, done.seconds)
            case _:
                assert_never(event)

    memory.begin()
    with progress.stage(stage, count):
        ordered = longest_first(todo, seconds)
        if options.executor is not None:
            from coursebuild.core.run.dask_runner import run_on_dask

            runs = run_on_dask(options.executor, options.root, ordered, on_event=told)
        else:
            run_all = run_all or options.run_all or run_scripts
            runs = run_all(options.root, ordered, parallel=options.jobs, on_event=told)
    memory.close()
    return runs


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


def lab_lines(labs: Sequence[LabResult]) -> tuple[LabLine, ...]:
    """How each lab did, as a report lists it."""
    return tuple(
        LabLine(
            lab.name,
            lab.title,
            lab.lesson,
            lab.status,
            lab.seconds,
            lab.steps_per_second,
            len(lab.tried),
            lab.parity,
            lab.cached,
            lab.unexported,
        )
        for lab in labs
    )


# --- models


def compile_models(
    course: Course, options: Options, progress: Progress
) -> tuple[tuple[tuple[str, CompileResult], ...], tuple[Diagnostic, ...]]:
    """Compile the models and MJCF blocks of a course; what is wrong with them."""
    texts = mjcf_texts(course)
    if not course.models and not texts:
        return (), ()
    from coursebuild.core.run import mjcf
    from coursebuild.pipeline.remember_models import compile_all

    stage = functools.partial(progress.stage, "compiling models")
    compiled, parts = compile_all(
        options.root, options.store, course.models, [t.text for t in texts], stage
    )
    models = tuple(
        (model.name, result) for model, result in zip(course.models, compiled, strict=True)
    )
    made = tuple(zip(texts, parts, strict=True))
    found = check_compiled(course, dict(models), made, mjcf.readable_error)
    return models, found
