"""A quiz as a value."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TypeAlias

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.api import Block, Excerpt, FeatureBlock, Inline, Span
from coursebuild.features.lab.model import Lab


class Choice(Struct, frozen=True):
    """An option of a question, with the feedback for a learner who takes it."""

    span: Span
    key: str
    """Unique among the options of its question; made from the text alone."""
    text: tuple[Inline, ...]
    feedback: tuple[Block, ...]


class Question(Struct, frozen=True):
    """What every question has, whatever its kind."""

    span: Span
    key: str
    """Unique among the questions of its quiz; a learner's answer is kept under it."""
    label: str
    text: tuple[Block, ...]
    explain: tuple[Block, ...]
    hints: tuple[tuple[Block, ...], ...]


class ChoiceQuestion(Question, frozen=True):
    """`mcq` and `predict`.

    `answers` are indices of the right options; `several` when all right ones must be chosen.
    """

    options: tuple[Choice, ...]
    answers: tuple[int, ...]
    several: bool
    sim: Lab | None
    """For `predict`: opened once the learner has committed to an answer."""
    predict: bool
    gate: bool
    """Whether what follows the quiz is hidden until the learner has answered."""
    gate_span: Span
    run: Excerpt | None
    """The steps then done with the next lab of the section, as JSON."""


class NumericQuestion(Question, frozen=True):
    """A number: right within `tolerance` (absolute) of `answer`, in `unit`."""

    answer: float
    answer_text: str
    """As readers see it, without the unit; so is `tolerance_text`."""
    tolerance: float
    tolerance_text: str
    unit: str


class OpenQuestion(Question, frozen=True):
    """Free text, compared by the learner with `reference`."""

    reference: tuple[Block, ...]


class OutputQuestion(Question, frozen=True):
    """What does the script print? The answer is line `line`, from 1, of its verified output."""

    script: str
    script_span: Span
    line: int
    line_span: Span


class OrderQuestion(Question, frozen=True):
    """Put the items in order; they are written in the right order."""

    items: tuple[tuple[Inline, ...], ...]
    item_keys: tuple[str, ...]
    """The key of each item, made from its text alone."""


AnyQuestion: TypeAlias = (
    ChoiceQuestion | NumericQuestion | OpenQuestion | OutputQuestion | OrderQuestion
)


class Quiz(FeatureBlock, frozen=True):
    """A quiz; `id` is unique in the course and stable."""

    id: str
    id_span: Span
    title: str
    questions: tuple[AnyQuestion, ...]
    keys: tuple[str, ...]
    """The keys of all questions, even if `questions` holds only some of them."""

    def anchor(self, key: str) -> str:
        """Return the anchor of the question with this key."""
        return f"{self.id}.{key}"

    def child_blocks(self) -> tuple[Block, ...]:
        """The texts of its questions."""
        blocks: list[Block] = []
        for question in self.questions:
            blocks += (*question.text, *question.explain, *(b for h in question.hints for b in h))
            if isinstance(question, ChoiceQuestion):
                blocks += [block for option in question.options for block in option.feedback]
                blocks += [question.sim] if question.sim is not None else []
            if isinstance(question, OpenQuestion):
                blocks += question.reference
        return tuple(blocks)

    def child_inlines(self) -> tuple[Inline, ...]:
        """Options, and items to be put in order."""
        inlines: list[Inline] = []
        for question in self.questions:
            if isinstance(question, ChoiceQuestion):
                inlines += [inline for option in question.options for inline in option.text]
            if isinstance(question, OrderQuestion):
                inlines += [inline for item in question.items for inline in item]
        return tuple(inlines)

    def summary(self) -> Quiz:
        """The quiz with the questions whose answer a script gives, without their texts."""
        bare = (
            replace(question, text=(), explain=(), hints=())
            for question in self.questions
            if isinstance(question, OutputQuestion)
        )
        return replace(self, questions=tuple(bare))

    def anchors(self) -> tuple[str, ...]:
        """The anchors of the quiz and of its questions; none where its id cannot be read."""
        return (self.id, *map(self.anchor, self.keys)) if self.id else ()

    def quoted_lines(self) -> tuple[tuple[str, int], ...]:
        """The lines of output that questions ask for, as (script, line)."""
        return tuple((question.script, question.line) for question in self.output_questions())

    def progress_keys(self) -> tuple[str, tuple[str, ...]]:
        """The keys under which a reader's answers are kept: of the quiz, and of its questions."""
        return self.id, self.keys

    def given_id(self) -> tuple[str, Span] | None:
        """The id; `None` where it cannot be read."""
        return (self.id, self.id_span) if self.id else None

    def output_questions(self) -> Iterator[OutputQuestion]:
        """The questions whose answer a script gives."""
        return (question for question in self.questions if isinstance(question, OutputQuestion))
