"""Course → Results: run the scripts, compare, compile the models, try the labs.

Entry point: `verify(course, options, progress, documents)`.

1. Scripts are written to `examples/`, and those of the chosen documents run (`scripts`).
2. Recorded outputs and bound numbers are held against the runs.
3. Models and MJCF blocks are compiled in a child process, which is not started for a course that
   has none.
4. Labs are tried beside the scripts.

Documents may be summaries. Formulas are no part of this: see `pipeline.documents`.
"""

from __future__ import annotations

import functools
from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

from msgspec import Struct

from coursebuild.core.checks.compiled import check_compiled, mjcf_texts
from coursebuild.core.features import Trial, TrialContext, Trials
from coursebuild.core.model import Course, FeatureBlock, document_blocks
from coursebuild.core.model.results import (
    CompileResult,
    Outcome,
    Results,
    ScriptRun,
    TrialLine,
    TrialResult,
    Verdict,
)
from coursebuild.core.registry import check_runs, feature_trials
from coursebuild.core.run.memory import Memory
from coursebuild.core.run.versions import engine_version, python_version
from coursebuild.core.scripts.bindings import BindingEvidence, document_bindings
from coursebuild.core.scripts.compare import verify as compare_all
from coursebuild.core.scripts.extract import Extraction
from coursebuild.core.scripts.figures import figure_findings
from coursebuild.core.scripts.findings import script_findings
from coursebuild.core.text.diagnostics import Diagnostic, diagnose
from coursebuild.pipeline.figures import read_recorded
from coursebuild.pipeline.options import Options
from coursebuild.pipeline.progress import Progress
from coursebuild.pipeline.recorded_runs import check_recorded_runs
from coursebuild.pipeline.scripts import extract_scripts, run, script_lines
from coursebuild.pipeline.trials import run_with_trials
from coursebuild.report import ScriptLine

if TYPE_CHECKING:
    from coursebuild.pipeline.shards import Shard


_QUICK = 20.0
"""Seconds that a script may take to be run again where its output has drifted."""


class Verified(Struct, frozen=True):
    """What verification found."""

    results: Results
    diagnostics: tuple[Diagnostic, ...]
    scripts: tuple[ScriptLine, ...]
    labs: tuple[TrialLine, ...]


def verify(
    course: Course,
    options: Options,
    progress: Progress,
    documents: frozenset[str] | None = None,
    *,
    static: bool = False,
    shard: Shard | None = None,
    held: BindingEvidence | None = None,
    known: Mapping[str, ScriptRun] | None = None,
) -> Verified:
    """Verify a course, or only what stands in the documents with these paths.

    `static`: with the static forms of labs, which only a build needs. `shard`: only this part of
    the scripts and labs. `held`: the lines by which bound numbers held before. `known`: what
    scripts do, by path, that need not be looked at.
    """
    options.store.listen(progress.say)
    options = options.for_course(course)
    extracted = extract_scripts(course, options)
    chosen, trials = _chosen(course, extracted.runnable, documents, shard)
    models, compiled = compile_models(course, options, progress)
    memory = options.memory()
    scripts = functools.partial(run, chosen, options, progress, memory=memory, known=known)
    tried: tuple[TrialResult, ...] = ()
    found = [*extracted.diagnostics, *compiled]
    if trials:
        beside = Memory(options.root, options.store)  # for another thread
        context = TrialContext(options.root, course, dict(models), beside, compiled, static)
        runs, (tried, wrong) = run_with_trials(scripts, trials, context, progress)
        found += wrong
    else:
        runs = scripts()
    found += check_recorded_runs(chosen, options)
    verdicts = compare_all(course, runs)
    again = _again(chosen, runs, verdicts, options, progress) if known is None else {}
    broken = [f"models/{name}.xml" for name, model in models if model.error]
    everything = extracted.all
    found += script_findings(course, chosen, runs, verdicts, held, everything, again, broken)
    if memory.differing_runs:
        from coursebuild.core.scripts.repeat import repeat_findings

        found += repeat_findings(course, chosen, memory.differing_runs)
    found += check_runs(course, runs)
    found += _nothing(course, () if shard is not None else runs)
    found += figure_findings(course, runs, functools.partial(read_recorded, options.root))
    interpreter = options.interpreter
    python = python_version() if interpreter is None else interpreter.version
    engine = engine_version() if interpreter is None else interpreter.engine
    results = Results(runs, verdicts, (), models, python, engine, tried)
    scripts_ran = script_lines(chosen, runs, verdicts)
    labs = tuple(trial.line for trial in tried)
    return Verified(results, tuple(found), scripts_ran, labs)


def _again(
    chosen: Sequence[Extraction],
    runs: Sequence[ScriptRun],
    verdicts: Sequence[Verdict],
    options: Options,
    progress: Progress,
) -> dict[str, ScriptRun]:
    """Second runs, by path, of quick scripts whose output has drifted: does it vary by itself?"""
    drifted = {verdict.recording.script for verdict in verdicts if verdict.status == "drift"}
    quick = {one.path for one in runs if one.seconds < _QUICK}
    scripts = [e for e in chosen if e.path in drifted & quick and not e.script.once]
    if not scripts:
        return {}
    memory = options.memory(fresh=True)
    again = run(scripts, options, progress, "running again what differs", memory)
    return {one.path: one for one in again}


def _nothing(course: Course, runs: Sequence[ScriptRun]) -> Iterator[Diagnostic]:
    """That there is nothing to publish, or that nothing of it was verified."""
    place = course.map.span(0, 0)
    if all(lesson.status == "planned" for lesson in course.lessons):
        message = "no lesson of the course is written"
        help = "write a file in content/lessons, and give its entry in the map a `status`"
        yield diagnose("no-lessons", place, message, help=help)
    skipped = [run for run in runs if run.outcome is Outcome.SKIPPED]
    if skipped and all(run.outcome in (Outcome.SKIPPED, Outcome.NORUN) for run in runs):
        missing = sorted({name for run in skipped for name in run.missing})
        message = "no script can run here, so that nothing was verified"
        yield diagnose("no-scripts", place, message, help=f"install {', '.join(missing)}")


def _chosen(
    course: Course,
    runnable: Sequence[Extraction],
    documents: Collection[str] | None,
    shard: Shard | None,
) -> tuple[Sequence[Extraction], tuple[tuple[Trials, Trial], ...]]:
    """The scripts to run, and the trials."""
    chosen, trials = runnable, feature_trials(course)
    if documents is not None:
        quoted = _quoted_scripts(course, documents)
        chosen = [e for e in chosen if e.document in documents or e.path in quoted]
        paths = {name: trial.block.span.path for name, (_, trial) in trials.items()}
        trials = {name: known for name, known in trials.items() if paths[name] in documents}
    if shard is not None:
        only = shard.takes([*(e.path for e in chosen), *trials])
        chosen = [e for e in chosen if e.path in only]
        trials = {name: known for name, known in trials.items() if name in only}
    return chosen, tuple(trials.values())


def _quoted_scripts(course: Course, documents: Collection[str]) -> set[str]:
    """Scripts, of any lesson, whose output the numbers and questions of these documents quote."""
    paths: set[str] = set()
    for document in course.documents:
        if document.source.path in documents:
            paths |= {b.script for b in document_bindings(document) if b.script is not None}
            for block in document_blocks(document):
                if isinstance(block, FeatureBlock):
                    paths |= {script for script, _ in block.quoted_lines()}
    return paths


# --- models


def compile_models(
    course: Course, options: Options, progress: Progress
) -> tuple[tuple[tuple[str, CompileResult], ...], tuple[Diagnostic, ...]]:
    """Compile the models and MJCF blocks of a course; what is wrong with them."""
    texts = mjcf_texts(course)
    if not course.models and not texts:
        return (), ()
    from coursebuild.core.run import mjcf
    from coursebuild.core.run.model_memory import compile_or_recall

    stage = functools.partial(progress.stage, "compiling models")
    everything = [(model.source.path, model.source.text) for model in course.models]
    everything += [(mjcf.TEXT_PATH, text.text) for text in texts]
    results = compile_or_recall(
        options.root, options.store, everything, stage, course.limits.memory
    )
    models = tuple(zip((model.name for model in course.models), results, strict=False))
    made = tuple(zip(texts, results[len(models) :], strict=True))
    found = check_compiled(course, dict(models), made, mjcf.readable_error)
    return models, found
