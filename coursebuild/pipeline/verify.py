"""Course → Results: run the scripts, compare, compile the models, try the labs; or a part of them.

Models and MJCF blocks are compiled in a child process, and features' trials, such as those of labs,
are run while the scripts run. Documents may be summaries. Formulas are checked by the reader.
"""

from __future__ import annotations

import contextlib
import functools
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import groupby
from operator import itemgetter

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core.checks.compiled import check_compiled, mjcf_texts
from coursebuild.core.features import Trial, TrialContext, TrialOutcome, Trials
from coursebuild.core.files.locks import project_lock
from coursebuild.core.model import Course, Document, FeatureBlock, find_blocks
from coursebuild.core.model.lesson_record import Addresses, known_addresses
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
from coursebuild.core.run import mjcf
from coursebuild.core.run.run_store import RunStore
from coursebuild.core.run.script_environment import engine_version
from coursebuild.core.scripts.bound_places import document_bindings
from coursebuild.core.scripts.compare import repeat_findings
from coursebuild.core.scripts.compare import verify as compare_all
from coursebuild.core.scripts.extract import Extraction, extract
from coursebuild.core.scripts.figures import figure_findings
from coursebuild.core.scripts.findings import script_findings
from coursebuild.core.scripts.printed_outputs import PrintedOutputs
from coursebuild.core.text.diagnostics import Diagnostic, diagnose
from coursebuild.pipeline.held import HeldDocuments
from coursebuild.pipeline.options import Options, Progress
from coursebuild.pipeline.recordings import (
    check_drawings,
    check_recorded_runs,
    keep_prepared,
    read_recorded,
)
from coursebuild.pipeline.scripts import (
    ExtractedScripts,
    extract_scripts,
    find_module,
    run,
    script_lines,
)
from coursebuild.pipeline.shards import Shard
from coursebuild.report import ScriptLine

_QUICK = 20.0
"""Seconds: a faster script runs again where its output has drifted."""


class Verification(Struct, frozen=True):
    """The results of a verification."""

    results: Results
    course_diagnostics: tuple[Diagnostic, ...]
    """Those of the whole course, whatever was chosen."""
    run_diagnostics: tuple[Diagnostic, ...]
    """Those of the scripts and labs that were chosen, in any file."""
    scripts: tuple[ScriptLine, ...]
    """A line for each script that was chosen, also for one that was left out."""
    labs: tuple[TrialLine, ...]
    """Likewise."""
    addresses: Addresses
    """Where the shown values of the course were printed when they last held."""

    @property
    def diagnostics(self) -> tuple[Diagnostic, ...]:
        return (*self.course_diagnostics, *self.run_diagnostics)


def verify(
    course: Course,
    options: Options,
    documents: frozenset[str] | None = None,
    *,
    static: bool = False,
    shard: Shard | None = None,
    repeat: bool = False,
    addresses: Addresses | None = None,
    known_runs: Mapping[str, ScriptRun] | None = None,
    other_runs: Mapping[str, ScriptRun] | None = None,
    imports: Mapping[str, frozenset[str]] = {},
) -> Verification:
    """Verify a course, or only what stands in the documents with these paths.

    `static`: with the static forms of labs, which only a build needs. `repeat`: what is recorded
    from a script's only run must be borne out by another, now. `addresses`: where shown values
    held before, besides what is remembered. A preview has
    `known_runs`, by path, that are known to hold, and `other_runs` of the same scripts, and repeats
    nothing here. `imports`: the modules that scripts import, by path, as far as they are known.
    """
    options.store.listen(options.progress.say)
    options = options.for_course(course)
    addresses = known_addresses(course.records) | (addresses or {})
    is_preview = known_runs is not None
    # A preview holds the lock for no longer, so that other commands need not wait for its scripts.
    with project_lock(options.root) if is_preview else contextlib.nullcontext():
        extracted_scripts = extract_scripts(course, options)
    scripts, trials = _select(course, extracted_scripts.extractions, documents, shard)
    models, model_diagnostics = compile_models(course, options)
    say, trial_store = options.progress.say, RunStore(options.root, options.store)
    context = TrialContext(
        options.root,
        course,
        dict(models),
        trial_store,
        model_diagnostics,
        static,
        say,
        options.sandbox,
    )
    runner = _ScriptRunner(course, options, extracted_scripts, scripts, known_runs, addresses)
    runs, (trial_results, trial_diagnostics) = _run_with_trials(
        lambda: runner.run(imports), trials, context, options.progress
    )
    verdicts, figure_diagnostics, lines = runner.judge(runs)
    if not is_preview:
        doubtful_paths = runner.find_doubtful(lines, repeat=repeat)
        other_runs = {run.path: run for run in runs if run.path in doubtful_paths}
        again = runner.run_again(doubtful_paths)
        if again:
            runs = tuple({run.path: run for run in (*runs, *again)}.values())
            verdicts, figure_diagnostics, lines = runner.judge(runs)
    course_diagnostics = (
        *extracted_scripts.diagnostics,
        *model_diagnostics,
        *check_runs(course, runs),
        *_diagnose_nothing(course, () if shard is not None else runs),
        *check_drawings(course, options),
    )
    broken_paths = [d.span.path for d in model_diagnostics if d.is_error]
    chosen_places = {e.script.path_span for e in scripts}
    shown_texts = course.shown_texts
    if documents is not None:  # some may quote scripts of other lessons
        chosen_paths = documents | {e.document for e in scripts}
        shown_texts = tuple(pair for pair in shown_texts if pair[1].source.path in chosen_paths)
    run_diagnostics = (
        *(d for d in extracted_scripts.diagnostics if d.span in chosen_places),
        *trial_diagnostics,
        *runner.find_mistakes(shown_texts, runs, verdicts, other_runs, broken_paths),
        *figure_diagnostics,
    )
    interpreter = options.interpreter
    engine = engine_version() if interpreter is None else interpreter.engine
    results = Results(runs, verdicts, (), models, engine, trial_results)
    labs = _lab_lines(course, trials, trial_results)
    return Verification(results, course_diagnostics, run_diagnostics, lines, labs, addresses)


def with_downloads(
    course: Course,
    results: Results,
    options: Options,
    imports: Mapping[str, frozenset[str]],
    *,
    only_known: bool = False,
) -> tuple[Results, tuple[Diagnostic, ...]]:
    """The results with what is handed over of scripts, after its trial; see `try_downloads`.

    `imports`: see `verify`.
    """
    from coursebuild.pipeline.script_downloads import find_downloads, try_downloads  # for a site

    scripts, runs = extract(course).value, results.runs
    downloads = find_downloads(course, scripts, runs, results.models, options, imports)
    downloads, diagnostics = try_downloads(
        course, scripts, runs, results.verdicts, downloads, options, only_known=only_known
    )
    return replace(results, downloads=downloads), diagnostics


def _lab_lines(
    course: Course, trials: Iterable[tuple[Trials, Trial]], results: Iterable[TrialResult]
) -> tuple[TrialLine, ...]:
    """A line for each trial; one that came to no result was not tried.

    Outside of lessons and pages, such as in the list of models, labs claim nothing.
    """
    lines = {result.line.name: result.line for result in results}
    paths = {document.source.path for document in course.documents}
    for _, trial in trials:
        if trial.name not in lines and trial.block.span.path in paths:
            lines[trial.name] = TrialLine(
                trial.name, "", trial.owner, "untried", untried="other mistakes"
            )
    return tuple(lines[trial.name] for _, trial in trials if trial.name in lines)


class _ScriptRunner:
    """Runs the chosen scripts, and compares what they do with what is recorded."""

    def __init__(
        self,
        course: Course,
        options: Options,
        extracted_scripts: ExtractedScripts,
        scripts: Sequence[Extraction],
        known_runs: Mapping[str, ScriptRun] | None,
        addresses: Addresses,
    ) -> None:
        self.course, self.options = course, options
        self.scripts = [e for e in scripts if e in extracted_scripts.runnable]
        self.left_out = [e for e in scripts if e not in extracted_scripts.runnable]
        self.extracted_scripts, self.known_runs = extracted_scripts, known_runs
        self.addresses = addresses
        self.store = options.run_store()

    def run(self, imports: Mapping[str, frozenset[str]]) -> tuple[ScriptRun, ...]:
        return run(
            self.course,
            self.scripts,
            self.options,
            run_store=self.store,
            known_runs=self.known_runs,
            only_recorded=self.known_runs is None,
            imports=imports,
        )

    def find_doubtful(self, lines: Iterable[ScriptLine], *, repeat: bool) -> set[str]:
        """The scripts of which one run does not say enough, so that they should run once more.

        An output that has drifted though nobody edited its script may vary by itself: that is tried
        where it is quick, and was not tried before; with `repeat`, in any case. With this or
        `strict`, what was recorded from the only run must be borne out.
        """
        doubtful_paths = set[str]()
        bears_out = repeat or self.options.strict or self.course.strict
        for line in lines:
            is_new = not line.cached and line.path not in self.store.edited_paths
            is_quick = is_new and line.seconds < _QUICK
            varies = line.status == "drift" and (repeat or is_quick)
            if varies or (bears_out and line.unrepeated):
                doubtful_paths.add(line.path)
        return doubtful_paths

    def run_again(self, paths: Collection[str]) -> tuple[ScriptRun, ...]:
        """Run some of the scripts anew, but none that is to run once only."""
        scripts = [e for e in self.scripts if e.path in paths and not e.script.once]
        if not scripts:
            return ()
        store = self.options.run_store(fresh=True)
        return run(self.course, scripts, self.options, "running scripts again", store)

    def judge(
        self, runs: Sequence[ScriptRun]
    ) -> tuple[tuple[Verdict, ...], list[Diagnostic], tuple[ScriptLine, ...]]:
        """Return verdicts on recorded outputs, diagnostics of figures, and lines of a report."""
        verdicts = compare_all(self.course, runs, self.addresses)
        read = functools.partial(read_recorded, self.options.root)
        prepare = functools.partial(keep_prepared, self.options.store)
        figure_diagnostics = list(figure_findings(self.course, runs, read, prepare))
        drifted_figures = [diagnostic.span for diagnostic in figure_diagnostics]
        lines = script_lines(
            self.scripts, runs, verdicts, self.course, drifted_figures, self.left_out
        )
        return verdicts, figure_diagnostics, lines

    def find_mistakes(
        self,
        documents: Iterable[tuple[str, Document]],
        runs: Sequence[ScriptRun],
        verdicts: Sequence[Verdict],
        other_runs: Mapping[str, ScriptRun] | None,
        broken_paths: Collection[str],
    ) -> Iterator[Diagnostic]:
        yield from check_recorded_runs(self.scripts, self.options)
        extractions = self.extracted_scripts.extractions
        outputs = PrintedOutputs(verdicts, runs, (e.path for e in extractions))
        store, addresses = self.options.store, self.addresses
        held_documents = HeldDocuments(self.course, store, outputs, other_runs or {}, addresses)
        changed_documents = held_documents.leave_out(documents)
        findings = script_findings(
            self.course,
            changed_documents,
            self.scripts,
            runs,
            verdicts,
            addresses,
            extractions,
            other_runs,
            broken_paths,
            functools.partial(find_module, self.options.root),
        )
        held_documents.keep(changed_documents, findings)
        yield from findings
        yield from repeat_findings(self.course, self.scripts, self.store.differing_runs)


def _run_with_trials(
    run_scripts: Callable[[], tuple[ScriptRun, ...]],
    trials: Sequence[tuple[Trials, Trial]],
    context: TrialContext,
    progress: Progress,
) -> tuple[tuple[ScriptRun, ...], TrialOutcome]:
    if not trials:
        return run_scripts(), ((), ())
    groups = groupby(trials, key=itemgetter(0))
    trial_runs = [(kind.start(context), [trial for _, trial in group]) for kind, group in groups]

    def try_all() -> TrialOutcome:
        outcomes = [run.run(trials_of_kind) for run, trials_of_kind in trial_runs]
        results = tuple(result for results, _ in outcomes for result in results)
        return results, tuple(d for _, diagnostics in outcomes for d in diagnostics)

    with ThreadPoolExecutor(1, "trials") as thread:
        future = thread.submit(try_all)
        try:
            runs = run_scripts()
            with progress.stage("trying labs"):
                return runs, future.result()
        except BaseException:  # Ctrl-C does not wait for a lab
            for trial_run, _ in trial_runs:
                trial_run.stop()
            raise


def _diagnose_nothing(course: Course, runs: Sequence[ScriptRun]) -> Iterator[Diagnostic]:
    place = course.map.span(0, 0)
    if not course.is_manual and all(lesson.status == "planned" for lesson in course.lessons):
        message = "the course has no written lesson"
        help = "write a file in content/lessons, and give its entry in the map a `status`"
        yield diagnose("no-lessons", place, message, help=help)
    allowed_paths = {entry.path for entry in course.unproven}
    skipped_runs = [
        run for run in runs if run.outcome is Outcome.SKIPPED and run.path not in allowed_paths
    ]
    if skipped_runs and not any(run.did_run for run in runs):
        missing = sorted({name for run in skipped_runs for name in run.missing})
        message = "no script can run here, so nothing was verified"
        yield diagnose("no-scripts", place, message, help=f"install {', '.join(missing)}")


def _select(
    course: Course,
    extractions: Sequence[Extraction],
    documents: Collection[str] | None,
    shard: Shard | None,
) -> tuple[Sequence[Extraction], tuple[tuple[Trials, Trial], ...]]:
    trials = feature_trials(course)
    if documents is not None:
        quoted_scripts: set[str] = set()
        for document in course.documents:
            if document.source.path in documents:
                quoted_scripts |= {
                    b.script for b in document_bindings(document) if b.script is not None
                }
                for block in find_blocks(document, FeatureBlock):
                    quoted_scripts |= {script for script, _ in block.quoted_lines()}
        extractions = [
            e for e in extractions if e.document in documents or e.path in quoted_scripts
        ]
        paths = {name: trial.block.span.path for name, (_, trial) in trials.items()}
        trials = {name: pair for name, pair in trials.items() if paths[name] in documents}
    if shard is not None:
        only = shard.takes([*(e.path for e in extractions), *trials])
        extractions = [e for e in extractions if e.path in only]
        trials = {name: pair for name, pair in trials.items() if name in only}
    return extractions, tuple(trials.values())


# --- models


def compile_models(
    course: Course, options: Options
) -> tuple[tuple[tuple[str, CompileResult], ...], tuple[Diagnostic, ...]]:
    """Compile the models and MJCF blocks of a course; diagnose what is wrong with them."""
    texts = mjcf_texts(course)
    if not course.models and not texts:
        return (), ()
    stage = functools.partial(options.progress.stage, "compiling models")
    texts_to_compile = [(model.source.path, model.source.text) for model in course.models]
    texts_to_compile += [(mjcf.TEXT_PATH, text.text) for text in texts]
    results = mjcf.compile_or_recall(
        options.root, options.store, texts_to_compile, stage, course.limits
    )
    models = tuple(zip((model.name for model in course.models), results, strict=False))
    compiled_blocks = tuple(zip(texts, results[len(models) :], strict=True))
    diagnostics = check_compiled(course, dict(models), compiled_blocks, mjcf.readable_error)
    return models, diagnostics
