"""Quizzes as a page shows them before any script runs: all readable, each answer behind a fold.

Entry point: `quiz(page, block)`. The script of the page finds each question by `data-question` and
its kind by `data-kind`.

The items of an order question are shown in an order that looks shuffled and depends on nothing but
their number and the quiz's id, and that is never the right one.
"""

from __future__ import annotations

import hashlib
import re
from typing import TYPE_CHECKING, assert_never

from markupsafe import Markup, escape

from coursebuild.model import (
    AnyQuestion,
    ChoiceQuestion,
    Heading,
    NumericQuestion,
    OpenQuestion,
    OrderQuestion,
    OutputQuestion,
    Quiz,
    plain_text,
)
from coursebuild.results import Outcome
from coursebuild.values import dataclass, replace

if TYPE_CHECKING:
    from coursebuild.render.context import PageContext


@dataclass(frozen=True, slots=True)
class Option:
    """An option of a question, lettered."""

    letter: str
    text: Markup
    feedback: Markup
    right: bool


@dataclass(frozen=True, slots=True)
class QuestionView:
    """A question, ready for its template."""

    kind: str
    """`mcq`, `several`, `predict`, `numeric`, `open`, `output`, `order`."""
    number: int
    label: str
    text: Markup
    explain: Markup
    hints: tuple[Markup, ...]
    options: tuple[Option, ...] = ()
    simulation: Markup = Markup()
    answer: str = ""
    """The number, or the output's line."""
    tolerance: str = ""
    unit: Markup = Markup()
    reference: Markup = Markup()
    items: tuple[Markup, ...] = ()
    """In the right order."""
    order: tuple[int, ...] = ()
    """Indices into `items`, as they are shown."""
    script: str = ""
    line: int = 0
    known: bool = True
    """Whether there is an answer: an output question has none where its script was not run."""


def quiz(page: PageContext, block: Quiz) -> Markup:
    """A quiz with its questions."""
    questions = tuple(
        _question(page, block, question, number)
        for number, question in enumerate(block.questions, 1)
    )
    headings = (b for b in page.document.blocks if isinstance(b, Heading))
    said = any(plain_text(h.children).strip() == block.title.strip() for h in headings)
    return page.template("blocks/quiz.html", quiz=block, questions=questions, titled=not said)


def _question(page: PageContext, block: Quiz, question: AnyQuestion, number: int) -> QuestionView:
    view = QuestionView(
        kind="",
        number=number,
        label=question.label,
        text=page.blocks(question.text),
        explain=page.blocks(question.explain),
        hints=tuple(page.blocks(hint) for hint in question.hints),
    )
    match question:
        case ChoiceQuestion():
            kind = "predict" if question.predict else "several" if question.several else "mcq"
            simulation = page.block(question.sim) if question.sim is not None else Markup()
            return replace(view, kind=kind, options=_options(page, question), simulation=simulation)
        case NumericQuestion():
            tolerance = f"{question.tolerance:.3g}"
            return replace(
                view,
                kind="numeric",
                answer=question.answer_text,
                tolerance=tolerance,
                unit=unit_html(question.unit),
            )
        case OpenQuestion():
            return replace(view, kind="open", reference=page.blocks(question.reference))
        case OutputQuestion():
            line = output_line(page, question.script, question.line)
            return replace(
                view,
                kind="output",
                answer=line or "",
                known=line is not None,
                script=question.script,
                line=question.line,
            )
        case OrderQuestion():
            items = tuple(page.inlines(item) for item in question.items)
            order = shuffle(len(items), f"{block.id}/{number}")
            return replace(view, kind="order", items=items, order=order)
        case _:
            assert_never(question)


def _options(page: PageContext, question: ChoiceQuestion) -> tuple[Option, ...]:
    return tuple(
        Option(
            letter(index),
            page.inlines(choice.text),
            page.blocks(choice.feedback),
            index in question.answers,
        )
        for index, choice in enumerate(question.options)
    )


def unit_html(unit: str) -> Markup:
    """A unit with its exponents raised: `kg m^2`, `m/s^-1`."""
    parts = re.split(r"\^\{?([-\u2212]?\d+)\}?", unit)
    raised = (
        Markup("<sup>{}</sup>").format(part.replace("-", "\u2212")) if i % 2 else escape(part)
        for i, part in enumerate(parts)
    )
    return Markup().join(raised)


def letter(index: int) -> str:
    """A, B, …, Z, AA, AB, …: how options are named."""
    name = ""
    index += 1
    while index:
        index, digit = divmod(index - 1, 26)
        name = chr(ord("A") + digit) + name
    return name


def output_line(page: PageContext, path: str, line: int) -> str | None:
    """A line (from 1) of what a script printed; `None` where it did not run to its end."""
    run = page.shown.runs.get(path)
    if run is None or run.outcome is not Outcome.OK:
        return None
    return dict(run.lines)[line]


def shuffle(count: int, key: str) -> tuple[int, ...]:
    """An order of `count` items that depends on `key` alone; never the right one if another is."""
    order = sorted(range(count), key=lambda i: hashlib.sha256(f"{key}/{i}".encode()).digest())
    if count > 1 and order == list(range(count)):
        order = [*order[1:], order[0]]
    return tuple(order)
