"""`coursebuild check --against VERSION`: what the scripts do with another version of MuJoCo.

The scripts run here and in an environment with the other version and otherwise the same packages.
Those that do something else run once more there, and in a fresh environment with the version of
here, to find the cause. Models and MJCF blocks are compiled there.

MuJoCo is the cause only if nothing else can be: the script prints here what is recorded; so does a
control run in a fresh environment that differs from the other one in nothing but MuJoCo; and two
runs in the other one agree.
"""

from __future__ import annotations

import functools
from collections.abc import Iterable, Mapping, Sequence
from typing import Literal, TypeAlias

from msgspec import Struct, field
from msgspec.structs import replace

from coursebuild.core.checks.compiled import mjcf_texts
from coursebuild.core.files.errors import EffectError, UsageError
from coursebuild.core.files.locks import project_lock
from coursebuild.core.model import Course
from coursebuild.core.model.results import Change, Outcome, ScriptRun, Verdict
from coursebuild.core.registry import losses_against
from coursebuild.core.run import mjcf
from coursebuild.core.run.environments import (
    check_other_version,
    latest_version,
    prepare_environment,
)
from coursebuild.core.run.script_environment import Interpreter, engine_version, python_version
from coursebuild.core.run.script_server import ScriptServer
from coursebuild.core.scripts.align import same_lines
from coursebuild.core.scripts.compare import verify
from coursebuild.core.scripts.diff import text_diff
from coursebuild.core.scripts.extract import Extraction, extract
from coursebuild.core.scripts.failures import failure_diagnostic
from coursebuild.core.scripts.lines import Side
from coursebuild.pipeline.load import load
from coursebuild.pipeline.options import Options, Progress, select
from coursebuild.pipeline.reader import Reader
from coursebuild.pipeline.scripts import extract_scripts, run
from coursebuild.pipeline.verify import compile_models
from coursebuild.report.against import ComparisonReport, ModelLine, ScriptComparison


def compare_with_version(
    options: Options, names: tuple[str, ...], version: str
) -> ComparisonReport:
    """Compare what scripts do here with what they do with this version of MuJoCo.

    The scripts are those of the lessons that the names mean. `latest` is the newest version; where
    that is installed here, nothing is run.

    Raises:
        UsageError: it is no other version, or a name means nothing.
        EffectError: the version cannot be had, or the course cannot be read.
    """
    if version == "latest":
        version = latest_version()
        if version == engine_version():
            return ComparisonReport(version, version, python_version(), (), ())
    version = check_other_version(version)
    options.store.listen(options.progress.say)
    with project_lock(options.root, options.progress.say):
        with Reader(replace(options, progress=Progress(quiet=True))) as reader:
            parsed_course = load(options.root, reader)
        course = parsed_course.value
        if course is not None and course.python is not None:
            raise UsageError(
                f"--against: scripts of this course run with {course.python.path}; to try another "
                "version, install it in a second environment and name that in the map"
            )
        if course is None:
            error = next(d for d in parsed_course.diagnostics if d.is_error)
            raise EffectError(
                f"the course cannot be read: {error.span.path}:{error.span.line}: {error.message}",
                help="`coursebuild check` tells all that is wrong",
            )
        documents = select(course, names, options.root)
        extracted_scripts = extract_scripts(course, options)
        scripts = tuple(
            e
            for e in extracted_scripts.runnable
            if (documents is None or e.document in documents) and not e.script.once
        )
        work = _Comparison(course, options, scripts, version)
        blocked = tuple(
            ScriptComparison(b.path, "", "uncompared", "the file there is not what its lesson says")
            for b in extracted_scripts.files.blocked
        )
        return work.report(blocked if documents is None else ())


class _Comparison(Struct):
    """What some scripts do with another version of MuJoCo."""

    course: Course
    options: Options
    scripts: tuple[Extraction, ...]
    version: str
    """The other version."""
    runs_here: dict[str, ScriptRun] = field(default_factory=dict)

    def report(self, blocked: tuple[ScriptComparison, ...]) -> ComparisonReport:
        runs = run(self.course, self.scripts, self.options)
        self.runs_here = {r.path: r for r in runs}
        interpreter = self._prepare(self.version)
        standings_here = run_standings(self.course, self.runs_here, runs)
        judgements = {p: judge_comparability(standing) for p, standing in standings_here.items()}
        comparable_scripts = [e for e in self.scripts if judgements[e.path] is None]
        standings_there = self._run(
            comparable_scripts, interpreter, f"running scripts with MuJoCo {self.version}"
        )
        differing_scripts = [e for e in comparable_scripts if not standings_there[e.path].holds]
        again = self._run(differing_scripts, interpreter, "running scripts there again", fresh=True)
        control, trouble = self._run_control(differing_scripts)
        all_scripts = {e.path: e for e in extract(self.course).value}
        lines = []
        for extraction in self.scripts:
            path, owner = extraction.path, extraction.owner
            if (judgement := judgements[path]) is not None:
                lines.append(ScriptComparison(path, owner, *judgement))
                continue
            standing = standings_there[path]
            status, reason = "same", ""
            if not standing.holds:
                engine = engine_version()
                status, reason = judge(standing, control.get(path), again[path], engine)
                reason += f": {trouble}" if trouble and path not in control else ""
            failure = failure_diagnostic(extraction, standing.run, all_scripts)
            difference = standing.changes, standing.diff, failure
            lines.append(ScriptComparison(path, owner, status, reason, *difference))
        return ComparisonReport(
            engine_version(),
            self.version,
            python_version(),
            (*lines, *blocked),
            self._compare_models(interpreter),
            losses_against(self.course, interpreter.python),
        )

    def _run_control(self, scripts: Sequence[Extraction]) -> tuple[dict[str, RunStanding], str]:
        """How they do in a fresh environment with the version of here, and why there is none."""
        if not scripts:
            return {}, ""
        try:
            interpreter = self._prepare(engine_version())
        except EffectError as error:
            return {}, error.message
        stage = f"running scripts in a fresh environment with MuJoCo {engine_version()}"
        return self._run(scripts, interpreter, stage), ""

    def _prepare(self, version: str) -> Interpreter:
        return prepare_environment(self.options.root, version, self.options.progress.say)

    def _run(
        self,
        scripts: Sequence[Extraction],
        interpreter: Interpreter,
        stage: str,
        *,
        fresh: bool = False,
    ) -> dict[str, RunStanding]:
        options_there = replace(self.options, interpreter=interpreter)
        run_store = options_there.run_store(fresh=fresh)
        with ScriptServer() as server:
            server_options = replace(options_there, run_all=server.run)
            runs = run(self.course, scripts, server_options, stage, run_store)
        return run_standings(self.course, self.runs_here, runs)

    def _compare_models(self, interpreter: Interpreter) -> tuple[ModelLine, ...]:
        texts = mjcf_texts(self.course)
        if not self.course.models and not texts:
            return ()
        results, _ = compile_models(self.course, self.options)
        results_here = dict(results)
        models = [model for model in self.course.models if not results_here[model.name].error]
        root = self.options.root
        compile_all = functools.partial(mjcf.compile_all, root, limits=self.course.limits)
        texts_here = compile_all([(mjcf.TEXT_PATH, text.text) for text in texts])
        good = [t for t, result in zip(texts, texts_here, strict=True) if not result.error]
        texts_to_compile = [(model.source.path, model.source.text) for model in models]
        texts_to_compile += [(mjcf.TEXT_PATH, text.text) for text in good]
        with self.options.progress.stage(f"compiling models with MuJoCo {self.version}"):
            results_there = compile_all(texts_to_compile, python=interpreter.python)
        places = [(model.source.path, 1) for model in models]
        places += [(text.place.path, text.place.line) for text in good]
        return tuple(
            ModelLine(path, line, mjcf.readable_error(result.error))
            for (path, line), result in zip(places, results_there, strict=True)
        )


# --- what became of a script

Status: TypeAlias = Literal["same", "changed", "fails", "unclear", "drifted", "uncompared"]
"""`changed` and `fails` are caused by MuJoCo; of `unclear` that cannot be said."""

Judgement: TypeAlias = tuple[Status, str]
"""What became of a script with another version of MuJoCo; why, as a clause, if need be."""


class RunStanding(Struct, frozen=True):
    """A run compared with what is recorded, or else with what the script prints here."""

    run: ScriptRun
    is_compared: bool
    changes: tuple[Change, ...] = ()
    diff: str = ""
    """The difference between the outputs, where nothing is recorded."""

    @property
    def holds(self) -> bool:
        """Whether it ran to its end and printed what it should."""
        return self.run.outcome is Outcome.OK and not (self.changes or self.diff)


def run_standings(
    course: Course, current_runs: Mapping[str, ScriptRun], runs: Iterable[ScriptRun]
) -> dict[str, RunStanding]:
    """The standing of each run, by path; `current_runs` are those of this environment."""
    runs = tuple(runs)
    verdicts: dict[str, list[Verdict]] = {}
    for verdict in verify(course, runs):
        verdicts.setdefault(verdict.recording.script or "", []).append(verdict)
    standings: dict[str, RunStanding] = {}
    for new_run in runs:
        if new_run.path in verdicts:
            compared = [v for v in verdicts[new_run.path] if v.status != "volatile"]
            changes = tuple(change for verdict in compared for change in verdict.changes)
            standings[new_run.path] = RunStanding(new_run, bool(compared), changes)
        else:
            old, new = current_runs[new_run.path].stdout, new_run.stdout
            current_side, new_side = (Side.of(text, course.filters) for text in (old, new))
            is_same = same_lines(current_side, new_side, course.comparison)
            diff = "" if is_same else text_diff(old, new)
            standings[new_run.path] = RunStanding(new_run, True, diff=diff)
    return standings


def judge_comparability(standing: RunStanding) -> Judgement | None:
    """Why a script, as it runs here, cannot be compared; `None` where it can."""
    match standing.run.outcome:
        case Outcome.NORUN:
            return "uncompared", "its lesson says `norun`"
        case Outcome.SKIPPED:
            return "uncompared", f"it needs {', '.join(standing.run.missing)}"
        case Outcome.OK if not standing.is_compared:
            return "uncompared", "its output is volatile"
        case Outcome.OK if not standing.holds:
            return "drifted", "what is recorded is not what it prints here"
        case Outcome.OK:
            return None
        case _:
            return "uncompared", "it does not run to its end here"


def judge(
    standing: RunStanding, control: RunStanding | None, repeated: RunStanding, engine: str
) -> Judgement:
    """Judge a script that prints what is recorded here, but not with the other MuJoCo.

    `control` is its run with this version, `engine`, in a fresh environment, if there is one;
    `standing` and `repeated` are those with the other version.
    """
    if (standing.run.outcome, standing.run.stdout) != (repeated.run.outcome, repeated.run.stdout):
        return "unclear", "two runs of it there differed"
    if control is None:
        return "unclear", f"no fresh environment with MuJoCo {engine} could be made"
    if not control.holds:
        fresh = f"a fresh environment with MuJoCo {engine}"
        return "unclear", f"it does not do in {fresh} what it does here either"
    return ("changed" if standing.run.outcome is Outcome.OK else "fails"), ""
