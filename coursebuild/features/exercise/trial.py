"""Trials of exercises: every attempt that the author gives is judged as the page judges a reader's.

The attempts run in V8, in the engine of the browser, so that a text which the page would refuse is
refused here. That the solution moves alike in native MuJoCo is proven by the trial of its lab.

The trials are also written in Python, in a file that readers run on their own machines: the script
of the exercise's lab, with what the reader writes as at the start, and with the trials as functions
that `pytest` finds. It is run as a reader would run it, in an empty folder, with the solution,
which has to pass, and with the start, of which it has to say what the page says.
"""

from __future__ import annotations

import json
import re
import time
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import Any

import msgspec
from msgspec import Struct
from msgspec.structs import replace

from coursebuild.api import (
    Diagnostic,
    Inputs,
    Note,
    Source,
    Trial,
    TrialContext,
    TrialOutcome,
    TrialResult,
    diagnose,
)
from coursebuild.core.model.results import TrialLine
from coursebuild.core.run.alone import AloneJob, Runner
from coursebuild.core.run.mjcf import readable_error
from coursebuild.core.run.v8 import LimitError, ScriptError
from coursebuild.core.text.source import key_of
from coursebuild.core.values import fingerprint
from coursebuild.features.exercise.model import (
    CONTROLLER,
    FORMULA,
    MATHS,
    MODEL,
    Exercise,
    ExerciseOutput,
)
from coursebuild.features.lab.compile import LabModule, compile_lab, inputs_of, trial_data
from coursebuild.features.lab.course_models import files_of, find_model, save_model
from coursebuild.features.lab.engines.native import (
    LAB_ENGINE,
    NativeEngine,
    NativeError,
    lab_digest,
)
from coursebuild.features.lab.export.script import (
    Export,
    ExportMetadata,
    LabExport,
    export_metadata,
    export_script,
    kept_export,
)
from coursebuild.features.lab.javascript import parse
from coursebuild.features.lab.model import Test, Writing
from coursebuild.features.lab.trial import Engines
from coursebuild.features.lab.verdict import (
    NameReference,
    code_references,
    name_diagnostics,
    play_text,
)


def exercise_inputs(trial: Trial) -> Inputs | None:
    """What the trial of an exercise depends on besides the files of its model."""
    exercise = trial.block
    if not isinstance(exercise, Exercise):
        return None
    inputs = inputs_of(exercise.lab, compile_lab(exercise.lab, trial.name))
    attempts = (attempt.text.text for attempt in exercise.wrong)
    texts = (exercise.solution.text, exercise.start.text, *attempts, json.dumps(exercise.data()))
    return replace(inputs, path=f"exercise {trial.name}", text=key_of(inputs.text, *texts))


class TrialVerdict(Struct, frozen=True):
    """What a trial says of an attempt."""

    passed: bool
    seen: float | None
    """The value; `None` if there is none."""
    failure: str = ""
    """Why there is none, or why the run ended before its time."""


class Judgement(Struct, frozen=True):
    """What all trials say of an attempt."""

    refused: str = ""
    """Why it cannot be tried; then there are no verdicts."""
    verdicts: tuple[TrialVerdict, ...] = ()
    moved: float | None = None
    """The part of the picture in which something moves by Play, of the start."""
    picture: bytes = b""
    """The start before anything runs, as PNG; empty if there is none."""


class Judgements(Struct, frozen=True):
    """Those of the solution, the start and the wrong attempts, in this order."""

    of_attempts: tuple[Judgement, ...]
    seconds: float
    timestamp: int
    names: tuple[dict[str, Any], ...] = ()
    """What the engine has of each name in the start."""


class ExerciseTrials:
    """Trials of exercises; one that has diagnostics already is left out."""

    def __init__(self, context: TrialContext) -> None:
        limits = context.course.limits
        self._context = context
        self._engines = Engines(context.root, limits, context.say, context.sandbox)

    def run(self, trials: Sequence[Trial]) -> TrialOutcome:
        """Run the trials in turn, and end the engines."""
        results: list[TrialResult] = []
        diagnostics: list[Diagnostic] = []
        with self._engines:
            for trial in trials:
                exercise = trial.block
                assert isinstance(exercise, Exercise)
                if any(exercise.span.contains(d.span) for d in self._context.diagnostics):
                    continue
                outcome = self._try_exercise(trial, exercise)
                if outcome is not None:
                    results.append(outcome[0])
                    diagnostics += outcome[1]
        return tuple(results), tuple(diagnostics)

    def stop(self) -> None:
        """End what runs, and let nothing begin; called from another thread."""
        self._engines.stop()

    def _try_exercise(
        self, trial: Trial, exercise: Exercise
    ) -> tuple[TrialResult, list[Diagnostic]] | None:
        context, runs = self._context, self._context.run_store
        inputs, lab, mjb = exercise_inputs(trial), exercise.lab, b""
        model = find_model(context, lab.fields.model or "")
        if lab.xml is not None:
            model = Source("models/.lab.xml", lab.xml.text)
        if inputs is None or model is None:
            return None  # reported at the name of the model
        try:
            if exercise.subject != MODEL:
                mjb = save_model(context, self._engines.native, model)
        except NativeError:
            return None  # its lab reports it
        names = _names(exercise)
        paths = [name.path for name in names]
        key = fingerprint((inputs.text, inputs.conditions, mjb, paths, lab_digest("picture")))
        kept_judgements = runs.store.get_value("exercises", key, Judgements)
        judgements = kept_judgements or self._judge_all(trial, exercise, mjb, paths)
        diagnostics = list(_diagnose(exercise, judgements.of_attempts))
        lasting = all(judgement.refused != _ENDLESS for judgement in judgements.of_attempts)
        if kept_judgements is None and lasting:
            runs.store.put_value("exercises", key, judgements)
        runs.note_trial(
            inputs,
            () if exercise.subject == MODEL else (model.path,),
            ok=not diagnostics,
            lasting=lasting,
            seconds=judgements.seconds,
            timestamp=judgements.timestamp,
        )
        files = {model.path: b""} if exercise.subject == MODEL else files_of(context.root, model)
        export, start = LabExport(None), judgements.of_attempts[1]
        if not diagnostics:
            verdicts = [v.passed for v in start.verdicts] or [False] * len(exercise.trials)
            native = self._engines.native
            export = export_exercise(context, native, trial, exercise, files, verdicts)
        line = TrialLine(
            name=trial.name,
            title=exercise.title,
            lesson=trial.owner,
            status="failed" if diagnostics else "ok",
            seconds=judgements.seconds,
            tried=len(judgements.of_attempts),
            play=play_text(start.moved, exercise.lab.fields.still),
            cached=kept_judgements is not None,
            unexported=export.reason,
        )
        output = ExerciseOutput(export.script, start.picture)
        unknown_names = name_diagnostics(names, judgements.names)
        warnings = (replace(diagnostic, rule="exercise-name") for diagnostic in unknown_names)
        return TrialResult(exercise.span, line, output), [*diagnostics, *warnings]

    def _judge_all(
        self, trial: Trial, exercise: Exercise, mjb: bytes, paths: Sequence[tuple[str, ...]]
    ) -> Judgements:
        start, module = time.time(), compile_lab(exercise.lab, trial.name)
        mistakes = (attempt.text.text for attempt in exercise.wrong)
        texts = (exercise.solution.text, exercise.start.text, *mistakes)
        judgements = tuple(
            self._judge(module, exercise, text, mjb, plays=i == 1) for i, text in enumerate(texts)
        )
        seconds = self._context.course.limits.lab
        names = tuple(self._engines.browser.look_up(paths, mjb, seconds)) if paths else ()
        return Judgements(judgements, round(time.time() - start, 4), int(start), names)

    def _judge(
        self, module: LabModule, exercise: Exercise, text: str, mjb: bytes, *, plays: bool
    ) -> Judgement:
        config = {**trial_data(module), "exercise": exercise.data(), "attempt": text}
        request = {"config": config, "code": module.literal, "plays": plays}
        try:
            reply = self._engines.browser.judge(request, mjb, self._context.course.limits.lab)
        except LimitError:
            return Judgement(_ENDLESS)
        except ScriptError as error:
            return Judgement(str(error).splitlines()[0])
        picture = b""
        if begin := reply.pop("begin", None):
            from coursebuild.features.lab.picture.static import draw_picture

            picture = draw_picture(exercise.lab, begin)
        return msgspec.convert({**reply, "picture": picture}, Judgement)


def _names(exercise: Exercise) -> list[NameReference]:
    """What a controller to begin with names of the model and the engine; nothing of half a text."""
    if exercise.subject != CONTROLLER or parse(exercise.start.text).has_error:
        return []
    return [n for n in code_references(exercise.start) if n.path[0] in ("model", "data", "mj")]


_ENDLESS = "it does not end in time"


def _diagnose(exercise: Exercise, judgements: Sequence[Judgement]) -> Iterator[Diagnostic]:
    """Report a solution that fails, a start that is solved, and wrong attempts that pass."""
    solution, start, *mistakes = judgements
    trials = list(zip(exercise.trials, exercise.trial_places, strict=True))
    solution_place = exercise.solution.span().first_line()
    if solution.refused:
        message = f"the solution cannot be tried: {_one_line(solution.refused)}"
        yield diagnose("exercise-solution", solution_place, message)
    for (trial, place), verdict in zip(trials, solution.verdicts, strict=False):
        if not verdict.passed:
            message = f"the solution fails the trial `{trial.name}`: {_describe(verdict)}"
            notes = [Note("the solution begins here", solution_place)]
            yield diagnose("exercise-solution", place, message, notes=notes)
    if not start.refused and all(verdict.passed for verdict in start.verdicts):
        message = "the start passes all trials, so there is nothing to do"
        yield diagnose("exercise-start", exercise.start.span().first_line(), message)
    names = [trial.name for trial in exercise.trials]
    for attempt, judgement in zip(exercise.wrong, mistakes, strict=True):
        if judgement.refused:
            message = f"this attempt cannot be tried: {_one_line(judgement.refused)}"
            yield diagnose("exercise-wrong", attempt.text.span().first_line(), message)
        elif (verdict := judgement.verdicts[names.index(attempt.fails)]).passed:
            message = f"this attempt passes the trial `{attempt.fails}`: {_describe(verdict)}"
            help = "name the trial that it fails, or make the bounds narrower"
            yield diagnose("exercise-wrong", attempt.place, message, help=help)


def _describe(verdict: TrialVerdict) -> str:
    value = "" if verdict.seen is None else f"it sees {verdict.seen:.6g}"
    return ", ".join(filter(None, (value, verdict.failure)))


def _one_line(message: str) -> str:
    return " ".join(readable_error(message).split()).rstrip(".")


_SUBJECTS = {MODEL: "XML", CONTROLLER: "control", FORMULA: "answer"}
"""What a reader writes, as it is called in the file."""


def export_exercise(
    context: TrialContext,
    native: NativeEngine,
    trial: Trial,
    exercise: Exercise,
    files: Mapping[str, bytes],
    start: Sequence[bool],
) -> LabExport:
    """Write and try the file of an exercise, or take it from the store.

    `files` are those of the model by path, that of the model itself first; `start` says which
    trials the start passes in the page.
    """
    slug = re.sub(r"[^a-z0-9]+", "_", exercise.id.lower()).strip("_")
    metadata = export_metadata(context, trial, "an exercise", f"test_{slug}.py", 0)
    code = lab_digest(".", "export/script.jinja")
    texts = (exercise.solution.text, exercise.lab.config, exercise.lab.fields)
    key = fingerprint((code, exercise.data(), texts, metadata, {**files}, tuple(start)))
    write = partial(_try, context, native, exercise, metadata, files, start)
    return kept_export(context.run_store.store, key, write)


def _try(
    context: TrialContext,
    native: NativeEngine,
    exercise: Exercise,
    metadata: ExportMetadata,
    files: Mapping[str, bytes],
    start: Sequence[bool],
) -> LabExport:
    limits, count = context.course.limits, len(exercise.trials)
    jobs: list[AloneJob] = []
    for text in (exercise.solution.text, exercise.start.text):
        export = _write(native, exercise, metadata, files, text)
        if isinstance(export, str):
            return LabExport(None, export)
        job = AloneJob(
            files=((export.name, export.text.encode()),),
            path=export.name,
            arguments=(),
            figures=(),
            modules=("mujoco", "numpy"),
            packages=(f"mujoco=={LAB_ENGINE}",),
            environment=(),
            timeout=limits.lab * count,
            memory=limits.scripts,
        )
        jobs.append(job)
    store = context.run_store.store
    runner = Runner(context.root, store, native.interpreter, context.sandbox, 1)
    for run, verdicts in zip(runner.run(jobs), ([True] * count, list(start)), strict=True):
        lines = re.findall(r"^(passed|failed): (.*)", run.stdout, re.MULTILINE)
        if len(lines) != count:
            return LabExport(None, f"its file fails in an empty folder: {run.failure}")
        for (verdict, line), expected in zip(lines, verdicts, strict=True):
            if (verdict == "passed") is not expected:
                reason = f"its file judges otherwise than the page: {verdict}: {line}"
                return LabExport(None, reason)
    ((name, data),) = jobs[1].files
    return LabExport((name, data.decode()))


def _write(
    native: NativeEngine,
    exercise: Exercise,
    metadata: ExportMetadata,
    files: Mapping[str, bytes],
    text: str,
) -> Export | str:
    """The file with a text in the place of what the reader writes; or why there is none."""
    lab = exercise.lab
    formula: tuple[str, ...] = ("",)
    if exercise.subject == MODEL:
        files = {path: text.encode() for path in files}
    elif exercise.subject == CONTROLLER:
        lab = replace(lab, fields=replace(lab.fields, controller=text))
    else:
        lab = replace(lab, fields=replace(lab.fields, setup=exercise.setup))
        formula = (*exercise.names, _with_maths(text, exercise.names))
    tests = msgspec.convert(exercise.trials, tuple[Test, ...], from_attributes=True)
    writing = Writing(_SUBJECTS[exercise.subject], tests, formula)
    return export_script(lab, metadata, native.description, files, writing)


def _with_maths(formula: str, variables: Sequence[str]) -> str:
    """A formula as the code of labs has it, in which functions belong to `Math`."""
    names = [name for name in MATHS.split() if name not in variables]
    text = re.sub(rf"(?<![\w.])({'|'.join(names)})\b", r"Math.\1", formula.replace("^", "**"))
    return text if "pi" in variables else re.sub(r"(?<![\w.])pi\b", "Math.PI", text)
