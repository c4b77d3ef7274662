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
    PublishedTrials,
    Results,
    Trial,
    find_blocks,
)
from coursebuild.core.text.source import key_of
from coursebuild.features.exercise.model import Exercise
from coursebuild.features.lab.compile import compile_lab, inputs_of


class ExerciseOutput(Struct, frozen=True):
    """Stands for an exercise that was tried."""

    name: str


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
    """Publish nothing: an exercise runs on the files of its lab."""
    return PublishedTrials()
