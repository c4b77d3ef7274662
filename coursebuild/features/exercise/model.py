"""An exercise as a value, and what its trial depends on."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Literal, TypeAlias

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.api import Block, Course, Excerpt, FeatureBlock, Span, Trial, find_blocks
from coursebuild.features.exercise.schema import HiddenTrial
from coursebuild.features.lab.model import Lab, LabCode

Subject: TypeAlias = Literal["model", "controller", "formula"]
"""What the reader writes."""
MODEL: Subject = "model"
CONTROLLER: Subject = "controller"
FORMULA: Subject = "formula"
SUBJECTS = (MODEL, CONTROLLER, FORMULA)
LANGUAGES = {MODEL: "xml", CONTROLLER: "javascript", FORMULA: "javascript"}

MATHS = (
    "abs acos acosh asin asinh atan atan2 atanh cbrt ceil cos cosh exp floor hypot log log10 log2 "
    "max min sign sin sinh sqrt tan tanh"
)
"""Functions that a formula may call."""
_PLACE = "\0"


class Wrong(Struct, frozen=True):
    """An attempt that must fail a trial."""

    text: Excerpt
    fails: str
    place: Span
    """Of the name of that trial."""


class Exercise(FeatureBlock, frozen=True):
    """What a reader writes, and the trials that judge it."""

    id: str
    id_span: Span
    subject: Subject
    title: str
    names: tuple[str, ...]
    """The variables of a formula."""
    start: Excerpt
    solution: Excerpt
    wrong: tuple[Wrong, ...]
    trials: tuple[HiddenTrial, ...]
    trial_places: tuple[Span, ...]
    """Of their names."""
    setup: str
    """What runs before each trial."""
    lab: Lab
    """The solution in motion: a readout for each trial, and a button for each that has a `setup`.
    """
    task: tuple[Block, ...] = ()
    explain: tuple[Block, ...] = ()

    def child_blocks(self) -> tuple[Block, ...]:
        """The task, the lab and the explanation; none of a summary, beside which its lab stands."""
        return (*self.task, self.lab, *self.explain) if self.task else ()

    def summary(self) -> Exercise:
        """The exercise without its Markdown."""
        return replace(self, task=(), explain=(), lab=self.lab.summary())

    def anchors(self) -> tuple[str, ...]:
        """Its id."""
        return (self.id,)

    def progress_keys(self) -> tuple[str, tuple[str, ...]]:
        """The id, which is also the key of its only question."""
        return self.id, (self.id,)

    def given_id(self) -> tuple[str, Span]:
        """The id."""
        return self.id, self.id_span

    @property
    def bounds(self) -> tuple[str, str]:
        """What stands before and behind a text that a reader writes, to make a function of it."""
        before, _, after = attempt_function(self.subject, self.names, _PLACE).partition(_PLACE)
        return before, after

    def data(self) -> dict[str, Any]:
        """What the page and the engine need to try an attempt, as JSON has it."""
        buttons = [control.label for control in self.lab.fields.controls]
        return {
            "id": self.id,
            "subject": self.subject,
            "names": self.names,
            "maths": MATHS.split(),
            "bounds": self.bounds,
            "start": self.start.text.rstrip(),
            "trials": [
                {
                    "name": trial.name,
                    "t": trial.t,
                    "button": buttons.index(trial.name) if trial.name in buttons else None,
                    "min": trial.min,
                    "max": trial.max,
                    "unit": trial.unit,
                    "digits": trial.digits,
                    "hint": trial.hint,
                }
                for trial in self.trials
            ],
        }


def attempt_function(subject: Subject, names: tuple[str, ...], text: str) -> str:
    """The text of an attempt as a JavaScript function; empty for a model."""
    if subject == MODEL:
        return ""
    if subject == CONTROLLER:
        return LabCode(("controller",), "statements", text).function
    maths = ", ".join(MATHS.split())
    text = text.replace("^", "**")
    return (
        f"({', '.join(names)}) => {{ const {{{maths}}} = Math, pi = Math.PI; return ({text}\n) }}"
    )


class ExerciseOutput(Struct, frozen=True):
    """What a page shows of an exercise that was tried."""

    script: tuple[str, str] | None
    """Name and text of a file in Python that judges what a reader writes in it."""
    picture: bytes = b""
    """What a reader begins with, as PNG; empty if that cannot be shown."""


class PublishedExercise(Struct, frozen=True):
    """The files of an exercise in a site."""

    name: str
    path: str
    """Its site path; empty if there is none."""
    picture: str = ""
    """The site path of the picture; likewise."""


def exercise_trials(course: Course) -> Iterator[Trial]:
    """Yield every exercise of a course, in order."""
    for owner, document in course.owned_documents:
        for number, exercise in enumerate(find_blocks(document, Exercise), 1):
            yield Trial(f"{owner.id}-exercise-{number}", owner.id, exercise)
