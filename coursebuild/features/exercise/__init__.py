"""Exercises: a reader writes a model, a controller or a formula, and hidden trials judge it.

`schema` declares a fence, `parse` makes an `Exercise` (`model`) of it, with a lab that shows the
solution; `trial` judges the author's attempts in the engine of the browser, `page` shows the task.
"""

from __future__ import annotations

from coursebuild.api import (
    Assets,
    Feature,
    FenceKind,
    OutputFile,
    PagePart,
    PublishedTrials,
    Results,
    Trials,
    on_demand,
)
from coursebuild.core.pages.assets import hashed_name
from coursebuild.features.exercise.model import (
    Exercise,
    ExerciseOutput,
    PublishedExercise,
    exercise_trials,
)
from coursebuild.features.exercise.schema import ExerciseFile


def publish(results: Results, assets: Assets) -> PublishedTrials:
    """Publish files in Python and pictures; a page runs an exercise on the files of its lab."""
    values: dict[str, PublishedExercise] = {}
    files: list[OutputFile] = []
    for trial in results.trials:
        if isinstance(trial.output, ExerciseOutput):
            name, text = trial.output.script or ("", "")
            contents = {name: text.encode(), f"{trial.line.name}.png": trial.output.picture}
            path, picture = (
                hashed_name(f"assets/labs/{file}", data) if data else ""
                for file, data in contents.items()
            )
            pairs = zip((path, picture), contents.values(), strict=True)
            files += [OutputFile(path, data) for path, data in pairs if data]
            values[trial.line.name] = PublishedExercise(name, path, picture)
    return PublishedTrials(values, tuple(files))


FEATURE = Feature(
    name="exercise",
    needs=("lab",),
    fences=(
        FenceKind(
            name="exercise",
            block=Exercise,
            parse=on_demand("coursebuild.features.exercise.parse:parse_fence"),
            draw=on_demand("coursebuild.features.exercise.page:draw_exercise"),
            markdown=on_demand("coursebuild.features.exercise.page:exercise_markdown"),
            index=on_demand("coursebuild.features.exercise.page:index_exercise"),
        ),
    ),
    parts=(PagePart(mark="data-exercise=", texts=("exercise.live.",), evaluates=True),),
    trials=Trials(
        find=exercise_trials,
        start=on_demand("coursebuild.features.exercise.trial:ExerciseTrials"),
        inputs=on_demand("coursebuild.features.exercise.trial:exercise_inputs"),
        publish=publish,
    ),
    schemas={"exercise": (ExerciseFile, "An exercise fence")},
)
