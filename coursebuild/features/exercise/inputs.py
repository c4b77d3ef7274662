"""The trials of exercises in a course, what each depends on, and what is published of it."""

from __future__ import annotations

import json
from collections.abc import Iterator

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.api import (
    Assets,
    Course,
    Inputs,
    OutputFile,
    PublishedTrials,
    Results,
    Trial,
    find_blocks,
)
from coursebuild.core.pages.assets import hashed_name
from coursebuild.core.text.source import key_of
from coursebuild.features.exercise.model import Exercise
from coursebuild.features.lab.compile import compile_lab, inputs_of


class ExerciseOutput(Struct, frozen=True):
    """Stands for an exercise that was tried."""

    name: str


class PublishedExercise(Struct, frozen=True):
    """An exercise that readers can do on its page."""

    script: str
    """Site path of the script that runs on the page, the same for all exercises."""


def exercise_trials(course: Course) -> Iterator[Trial]:
    """Yield every exercise of a course, in order."""
    for owner, document in course.owned_documents:
        for number, exercise in enumerate(find_blocks(document, Exercise), 1):
            yield Trial(f"{owner.id}-exercise-{number}", owner.id, exercise)


def exercise_inputs(trial: Trial) -> Inputs | None:
    """What the trial of an exercise depends on besides the files of its model."""
    exercise = trial.block
    if not isinstance(exercise, Exercise):
        return None
    inputs = inputs_of(exercise.lab, compile_lab(exercise.lab, trial.name))
    attempts = (attempt.text.text for attempt in exercise.wrong)
    texts = (exercise.solution.text, exercise.start.text, *attempts, json.dumps(exercise.data()))
    return replace(inputs, path=f"exercise {trial.name}", text=key_of(inputs.text, *texts))


def publish_exercises(results: Results, assets: Assets) -> PublishedTrials:
    """Publish the script of exercises, if there are any; their labs publish all the rest."""
    names = [t.output.name for t in results.trials if isinstance(t.output, ExerciseOutput)]
    if not names:
        return PublishedTrials()
    data = assets.file("js/exercise.js")
    path = hashed_name("assets/labs/exercise.js", data)
    exercises = {name: PublishedExercise(path) for name in names}
    return PublishedTrials(exercises, (OutputFile(path, data),))
