"""Trials of exercises: every attempt that the author gives is judged as the page judges a reader's.

The attempts run in V8, in the engine of the browser, so that a text which the page would refuse is
refused here. That the solution moves alike in native MuJoCo is proven by the trial of its lab.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence

import msgspec
from msgspec import Struct

from coursebuild.api import (
    Diagnostic,
    Note,
    Source,
    Trial,
    TrialContext,
    TrialOutcome,
    TrialResult,
    diagnose,
)
from coursebuild.core.model.results import TrialLine
from coursebuild.core.run.mjcf import readable_error
from coursebuild.core.run.v8 import LimitError, ScriptError
from coursebuild.core.values import fingerprint
from coursebuild.features.exercise.model import MODEL, Exercise, ExerciseOutput, exercise_inputs
from coursebuild.features.exercise.python_trials import export_exercise
from coursebuild.features.lab.compile import LabModule, compile_lab, trial_data
from coursebuild.features.lab.engines.native import NativeError
from coursebuild.features.lab.export.script import LabExport
from coursebuild.features.lab.trial import Engines, files_of, find_model, save_model
from coursebuild.features.lab.verdict import play_text


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


class Judgements(Struct, frozen=True):
    """Those of the solution, the start and the wrong attempts, in this order."""

    of_attempts: tuple[Judgement, ...]
    seconds: float
    timestamp: int


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
        inputs, model, mjb = exercise_inputs(trial), _model_of(context, exercise), b""
        if inputs is None or model is None:
            return None  # reported at the name of the model
        try:
            if exercise.subject != MODEL:
                mjb = save_model(context, self._engines.native, model)
        except NativeError:
            return None  # its lab reports it
        key = fingerprint((inputs.text, inputs.conditions, mjb))
        kept_judgements = runs.store.get_value("exercises", key, Judgements)
        judgements = kept_judgements or self._judge_all(trial, exercise, mjb)
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
        output = ExerciseOutput(export.script)
        return TrialResult(exercise.span, line, output), diagnostics

    def _judge_all(self, trial: Trial, exercise: Exercise, mjb: bytes) -> Judgements:
        start, module = time.time(), compile_lab(exercise.lab, trial.name)
        mistakes = (attempt.text.text for attempt in exercise.wrong)
        texts = (exercise.solution.text, exercise.start.text, *mistakes)
        judgements = tuple(
            self._judge(module, exercise, text, mjb, plays=i == 1) for i, text in enumerate(texts)
        )
        return Judgements(judgements, round(time.time() - start, 4), int(start))

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
        return msgspec.convert(reply, Judgement)


_ENDLESS = "it does not end in time"


def _model_of(context: TrialContext, exercise: Exercise) -> Source | None:
    if exercise.lab.xml is not None:
        return Source("models/.lab.xml", exercise.lab.xml.text)
    return find_model(context, exercise.lab.fields.model or "")


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
