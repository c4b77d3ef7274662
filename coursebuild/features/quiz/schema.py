"""The fields of a `quiz` fence; `parse` checks what no declaration of types can say."""

# No `from __future__ import annotations` here: msgspec would evaluate each annotation, a text then,
# again in every struct that inherits it.

from typing import Annotated, TypeAlias

from msgspec import Meta, Struct

from coursebuild.core.model.fields import (
    Blocks,
    BoundFloat,
    Inlines,
    NotNegative,
    OptionalBlocks,
    Text,
)
from coursebuild.features.lab.schema import SimLab, Step

Index: TypeAlias = Annotated[int, Meta(extra_json_schema={"minimum": 0})]
"""The index of an option; `parse` checks that there is such an option."""
Options: TypeAlias = Annotated[tuple[Inlines, ...], Meta(min_length=2)]
Answer: TypeAlias = Index | Annotated[tuple[Index, ...], Meta(min_length=1)]


QuestionId: TypeAlias = Annotated[
    str,
    Meta(
        pattern=r"^[a-z0-9][a-z0-9-]*$",
        extra={"expects": "lower-case letters, digits and `-`, with a letter or digit first"},
    ),
]


class Common(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The fields that every question has."""

    q: Annotated[Blocks, Meta(description="the question")]
    id: Annotated[
        QuestionId | None,
        Meta(
            description="unique in the quiz, and stable; without it a learner's answer is kept"
            " under the text of `q`"
        ),
    ] = None
    label: Annotated[str, Meta(description="a short name, shown instead of the number")] = ""
    explain: Annotated[OptionalBlocks, Meta(description="shown with the answer")] = ""
    hints: Annotated[tuple[Blocks, ...], Meta(description="revealed one by one")] = ()


class WithOptions(Common, frozen=True, kw_only=True):
    """The fields that every question with options has."""

    options: Annotated[Options, Meta(description="what to choose from")]
    answer: Annotated[
        Answer,
        Meta(description="the index of the right option, or all indices; the first is 0"),
    ]
    feedback: Annotated[
        tuple[OptionalBlocks, ...] | None,
        Meta(description="one text for each option, said to a learner who takes it"),
    ] = None

    @property
    def answers(self) -> tuple[int, ...]:
        """The indices of all right options."""
        return self.answer if isinstance(self.answer, tuple) else (self.answer,)


class MultipleChoice(WithOptions, frozen=True, kw_only=True, tag_field="kind", tag="mcq"):
    """A question with options; with a list of answers all of them must be chosen."""


class Predict(WithOptions, frozen=True, kw_only=True, tag_field="kind", tag="predict"):
    """A prediction: what shows the answer opens once the learner has committed to one."""

    sim: Annotated[SimLab | None, Meta(description="the simulation that shows the answer")] = None
    gate: Annotated[
        bool,
        Meta(
            description="hides what follows the quiz, up to the next heading, but for the next lab"
        ),
    ] = False
    run: Annotated[
        Step | tuple[Step, ...] | None,
        Meta(
            description="starts the next lab of the section: the label of a button to press, or "
            "values of controls by their labels; or a list of these, done in order"
        ),
    ] = None


class Numeric(Common, frozen=True, kw_only=True, tag_field="kind", tag="numeric"):
    """A question whose answer is a number."""

    answer: Annotated[BoundFloat, Meta(description="the number, in `unit`")]
    tol: Annotated[
        NotNegative | None,
        Meta(description="absolute tolerance; without it 2 % of the answer"),
    ] = None
    unit: Annotated[str, Meta(description="shown beside the field, as in `kg m^2`")] = ""


class Open(Common, frozen=True, kw_only=True, tag_field="kind", tag="open"):
    """A question that the learner answers in words and compares with a reference."""

    reference: Annotated[Blocks, Meta(description="the answer to compare with")]


class OutputFields(Common, frozen=True, kw_only=True, tag_field="kind", tag="output"):
    """What does a script print? The key is its verified output."""

    of: Annotated[Text, Meta(description="the script, as in `examples/x.py`")]
    line: Annotated[int, Meta(ge=1, description="the line of its output, from 1")]


class OrderFields(Common, frozen=True, kw_only=True, tag_field="kind", tag="order"):
    """Items to be put in order."""

    items: Annotated[
        tuple[Inlines, ...],
        Meta(min_length=2, description="the items in the right order; they are shown mixed"),
    ]


AnyFields: TypeAlias = MultipleChoice | Predict | Numeric | Open | OutputFields | OrderFields


class QuizFile(Struct, frozen=True, forbid_unknown_fields=True):
    """A quiz: questions that a learner answers in the page."""

    id: Annotated[
        str,
        Meta(
            pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]*$",
            description="unique in the course, and stable: a learner's progress is kept under it",
            extra={"expects": "letters, digits, `.`, `_` and `-`, with a letter or digit first"},
        ),
    ]
    questions: Annotated[
        tuple[AnyFields, ...], Meta(min_length=1, description="in the order of the page")
    ]
    title: Annotated[str, Meta(description="the heading; plain text")] = ""
