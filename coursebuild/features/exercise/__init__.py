"""Exercises: a reader writes a model, a controller or a formula, and hidden trials judge it.

`schema` declares a fence, `parse` makes an `Exercise` (`model`) of it, with a lab that shows the
solution; `trial` judges the author's attempts in the engine of the browser, `page` shows the task.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from coursebuild.api import (
    Assets,
    Course,
    Diagnostic,
    Document,
    Feature,
    FenceKind,
    Note,
    PagePart,
    PublishedTrials,
    Results,
    TrialContext,
    TrialRun,
    Trials,
    diagnose,
    find_blocks,
)
from coursebuild.features.exercise.model import Exercise, exercise_inputs, exercise_trials
from coursebuild.features.exercise.page import draw_exercise, exercise_markdown, index_exercise
from coursebuild.features.exercise.parse import parse_fence
from coursebuild.features.exercise.schema import ExerciseFile


def check_exercises(course: Course, documents: Iterable[Document]) -> Iterator[Diagnostic]:
    """Report repeated ids in some documents; they are compared with those of the whole course."""
    first: dict[str, Exercise] = {}
    for document in course.documents:
        for exercise in find_blocks(document, Exercise):
            first.setdefault(exercise.id, exercise)
    for exercise in (e for document in documents for e in find_blocks(document, Exercise)):
        if first[exercise.id].id_span != exercise.id_span:
            message = f"the exercise id `{exercise.id}` is used twice"
            help = "a learner's progress is kept under the id; give each exercise its own"
            notes = [Note("the first one is here", first[exercise.id].id_span)]
            place = exercise.id_span
            yield diagnose("exercise-id-repeated", place, message, help=help, notes=notes)


def start(context: TrialContext) -> TrialRun:
    """Start the trials of exercises; their engines are imported only here."""
    from coursebuild.features.exercise.trial import ExerciseTrials

    return ExerciseTrials(context)


def publish(results: Results, assets: Assets) -> PublishedTrials:
    """Publish nothing: an exercise runs on the files of its lab."""
    return PublishedTrials()


FEATURE = Feature(
    name="exercise",
    needs=("lab",),
    fences=(
        FenceKind(
            name="exercise",
            block=Exercise,
            parse=parse_fence,
            draw=draw_exercise,
            markdown=exercise_markdown,
            index=index_exercise,
        ),
    ),
    check=check_exercises,
    parts=(PagePart(mark="data-exercise=", texts=("exercise.live.",)),),
    trials=Trials(find=exercise_trials, start=start, inputs=exercise_inputs, publish=publish),
    schemas={"exercise": (ExerciseFile, "An exercise fence")},
)
