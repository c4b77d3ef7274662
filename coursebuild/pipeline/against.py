"""`coursebuild check --against VERSION`: what the scripts do with another version of MuJoCo.

Entry point: `against(options, names, version)`.

1. The scripts run here, or ran.
2. They run in an environment with the other version and otherwise the same packages (see
   `core.run.environments`). Results are remembered by the versions, like those of here.
3. Those that do something else run once more there, and in a fresh environment with the version of
   here: what this shows is told (see `scripts.against`).
4. The models and MJCF blocks are compiled there.
"""

from __future__ import annotations

from collections.abc import Sequence

from msgspec import Struct, field
from msgspec.structs import replace

from coursebuild.core.checks.compiled import mjcf_texts
from coursebuild.core.files.errors import EffectError, UsageError
from coursebuild.core.files.locks import project_lock
from coursebuild.core.model import Course
from coursebuild.core.model.results import ScriptRun
from coursebuild.core.run.environments import (
    check_other_version,
    latest_version,
    prepare_environment,
)
from coursebuild.core.run.script_environment import Interpreter
from coursebuild.core.run.versions import engine_version, python_version
from coursebuild.core.scripts.against import (
    RunStanding,
    judge,
    judge_comparability,
    run_standings,
)
from coursebuild.core.scripts.extract import Extraction, extract
from coursebuild.core.scripts.failures import failure_diagnostic
from coursebuild.pipeline.load import load
from coursebuild.pipeline.options import Options, select
from coursebuild.pipeline.progress import Progress
from coursebuild.pipeline.scripts import extract_scripts, run
from coursebuild.pipeline.verify import compile_models
from coursebuild.report.against import AgainstReport, ModelLine, ScriptAgainst


def against(options: Options, names: tuple[str, ...], version: str) -> AgainstReport:
    """What the scripts of the lessons that the names mean do with this version of MuJoCo.

    `latest` is the newest; where that is installed here, nothing is run.

    Raises:
        UsageError: it is no other version, or a name means nothing.
        EffectError: the version cannot be had, or the course cannot be read.
    """
    if version == "latest":
        version = latest_version()
        if version == engine_version():
            return AgainstReport(version, version, python_version(), (), ())
    other = check_other_version(version)
    progress = Progress(quiet=options.quiet)
    options.store.listen(progress.say)
    with project_lock(options.root, progress.say):
        loaded = load(options.root)
        course = loaded.value
        if course is not None and course.python is not None:
            raise UsageError(
                f"--against: scripts of this course run with {course.python.path}; to try another "
                "version, install it in a second environment and name that in the map"
            )
        if course is None:
            wrong = next(d for d in loaded.diagnostics if d.is_error)
            raise EffectError(
                f"the course cannot be read: {wrong.span.path}:{wrong.span.line}: {wrong.message}",
                help="`coursebuild check` tells all that is wrong",
            )
        documents = select(course, names, options.root).documents
        extracted = extract_scripts(course, options)
        chosen = tuple(
            e
            for e in extracted.runnable
            if (documents is None or e.document in documents) and not e.script.once
        )
        work = _Work(course, options, progress, chosen, other)
        blocked = tuple(
            ScriptAgainst(b.path, "", "uncompared", "the file there is not what its lesson says")
            for b in extracted.blocked
        )
        return work.report(blocked if documents is None else ())


class _Work(Struct):
    """The comparison of some scripts."""

    course: Course
    options: Options
    progress: Progress
    chosen: tuple[Extraction, ...]
    other: str
    here: dict[str, ScriptRun] = field(default_factory=dict)

    def report(self, blocked: tuple[ScriptAgainst, ...]) -> AgainstReport:
        """Everything that there is to tell."""
        runs = run(self.chosen, self.options, self.progress)
        self.here = {one.path: one for one in runs}
        interpreter = prepare_environment(self.options.root, self.other, self.progress.say)
        here = run_standings(self.course, self.here, runs)
        kept = {path: judge_comparability(standing) for path, standing in here.items()}
        compared = [e for e in self.chosen if kept[e.path] is None]
        there = self._run(compared, interpreter, f"running scripts with MuJoCo {self.other}")
        differing = [e for e in compared if not there[e.path].holds]
        again = self._run(differing, interpreter, "running scripts there again", fresh=True)
        control, trouble = self._control(differing)
        lines = []
        for extraction in self.chosen:
            path, reason = extraction.path, kept[extraction.path]
            if reason is not None:
                lines.append(ScriptAgainst(path, extraction.owner, reason.status, reason.reason))
            elif there[path].holds:
                lines.append(ScriptAgainst(path, extraction.owner, "same"))
            else:
                found = judge(there[path], control.get(path), again[path], engine_version())
                why = found.reason + (f": {trouble}" if trouble and path not in control else "")
                lines.append(self._line(extraction, there[path], found.status, why))
        return AgainstReport(
            engine_version(),
            self.other,
            python_version(),
            (*lines, *blocked),
            self._models(interpreter),
        )

    def _line(
        self, extraction: Extraction, there: RunStanding, status: str, why: str
    ) -> ScriptAgainst:
        everything = extract(self.course).value
        return ScriptAgainst(
            extraction.path,
            extraction.owner,
            status,
            why,
            there.changes,
            there.diff,
            failure_diagnostic(extraction, there.run, everything),
        )

    def _control(self, scripts: Sequence[Extraction]) -> tuple[dict[str, RunStanding], str]:
        """What they do in a fresh environment with the version of here; why there is none."""
        if not scripts:
            return {}, ""
        try:
            interpreter = prepare_environment(
                self.options.root, engine_version(), self.progress.say
            )
        except EffectError as error:
            return {}, error.message
        stage = f"running scripts in a fresh environment with MuJoCo {engine_version()}"
        return self._run(scripts, interpreter, stage), ""

    def _run(
        self,
        scripts: Sequence[Extraction],
        interpreter: Interpreter,
        stage: str,
        *,
        fresh: bool = False,
    ) -> dict[str, RunStanding]:
        """How the scripts do there, by path."""
        from coursebuild.core.run.runner import ScriptServer

        there = replace(self.options, interpreter=interpreter)
        memory = there.memory(fresh=fresh)
        with ScriptServer() as server:
            served = replace(there, run_all=server.run)
            runs = run(scripts, served, self.progress, stage, memory)
        return run_standings(self.course, self.here, runs)

    def _models(self, interpreter: Interpreter) -> tuple[ModelLine, ...]:
        """Of each model and MJCF block that compiles here, whether it does there."""
        from coursebuild.core.run import mjcf

        texts = mjcf_texts(self.course)
        if not self.course.models and not texts:
            return ()
        compiled, _ = compile_models(self.course, self.options, self.progress)
        here = dict(compiled)
        models = [model for model in self.course.models if not here[model.name].error]
        root = self.options.root
        texts_here = mjcf.compile_all(root, [(mjcf.TEXT_PATH, text.text) for text in texts])
        good = [t for t, result in zip(texts, texts_here, strict=True) if not result.error]
        compared = [(model.source.path, model.source.text) for model in models]
        compared += [(mjcf.TEXT_PATH, text.text) for text in good]
        with self.progress.stage(f"compiling models with MuJoCo {self.other}"):
            there = mjcf.compile_all(root, compared, python=interpreter.python)
        places = [(model.source.path, 1) for model in models]
        places += [(text.block.span.path, text.block.span.line) for text in good]
        return tuple(
            ModelLine(path, line, mjcf.readable_error(result.error))
            for (path, line), result in zip(places, there, strict=True)
        )
