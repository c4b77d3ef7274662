"""The fields of an `exercise` fence; `parse` checks what no declaration of types can say."""

# No `from __future__ import annotations` here: msgspec would evaluate each annotation, a text then,
# again in every struct that inherits it.

from typing import Annotated

from msgspec import Meta, Struct

from coursebuild.core.model.fields import Blocks, Digits, OptionalBlocks, Text
from coursebuild.features.lab.schema import JAVASCRIPT_NAME, Camera, Height, Plot

LONGEST_TRIAL = 60
"""Simulated seconds: a reader waits for all trials."""


class HiddenTrial(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A trial of what a reader has written.

    `expr` is at least `min` and at most `max` at the time `t`.
    """

    name: Annotated[Text, Meta(description="what has to hold; unique among the trials; plain text")]
    expr: Annotated[Text, Meta(description="an expression that gives a number")]
    t: Annotated[
        Annotated[float, Meta(ge=0, le=LONGEST_TRIAL)],
        Meta(description="simulated time in seconds"),
    ] = 0
    setup: Annotated[str, Meta(description="statements run before the first step")] = ""
    min: Annotated[float | None, Meta(description="`expr` is not below")] = None
    max: Annotated[float | None, Meta(description="`expr` is not above")] = None
    unit: Annotated[str, Meta(description="shown after the value")] = ""
    digits: Annotated[Digits, Meta(description="decimal places shown")] = 3
    hint: Annotated[str, Meta(description="said to a reader who fails it; plain text")] = ""


class WrongAttempt(Struct, frozen=True, forbid_unknown_fields=True):
    """An attempt that must fail."""

    text: Annotated[Text, Meta(description="what a reader may write")]
    fails: Annotated[Text, Meta(description="the name of the trial that it must fail")]


class ExerciseFile(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """An exercise: a model, a controller or a formula that a reader writes and trials judge."""

    id: Annotated[
        str,
        Meta(
            pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]*$",
            description="unique in the course, and stable: a learner's progress is kept under it",
            extra={"expects": "letters, digits, `.`, `_` and `-`, with a letter or digit first"},
        ),
    ]
    text: Annotated[Blocks, Meta(description="what is to be done")]
    start: Annotated[Text, Meta(description="what stands in the editor at first")]
    solution: Annotated[Text, Meta(description="an attempt that passes all trials")]
    trials: Annotated[
        tuple[HiddenTrial, ...], Meta(min_length=1, max_length=20, description="what judges")
    ]
    wrong: Annotated[
        tuple[WrongAttempt, ...], Meta(max_length=20, description="attempts that must fail")
    ] = ()
    title: Annotated[str, Meta(description="the caption; plain text")] = ""
    explain: Annotated[OptionalBlocks, Meta(description="shown with the solution")] = ""
    model: Annotated[
        Text | None,
        Meta(description="the name of a model in models/; not where the reader writes it"),
    ] = None
    names: Annotated[
        tuple[
            Annotated[
                str,
                Meta(pattern=JAVASCRIPT_NAME, extra={"expects": "a name of JavaScript, in ASCII"}),
            ],
            ...,
        ],
        Meta(description="the variables of the formula, in the order of `ctx.answer(…)`"),
    ] = ()
    key: Annotated[
        Annotated[int, Meta(ge=0)] | Text | None,
        Meta(description="the keyframe to start from: its index or name"),
    ] = None
    setup: Annotated[str, Meta(description="statements run before each trial")] = ""
    camera: Camera | None = None
    still: Annotated[str, Meta(description="why nothing moves when a reader presses Play")] = ""
    height: Annotated[Height, Meta(description="of a picture 480 px wide, in px")] = 260
    plots: tuple[Plot, ...] = ()
