"""Quizzes as a page shows them before any script runs: all readable, each answer behind a fold.

Entry point: `quiz(page, block)`. The page's script finds each question by `data-question`, its key,
and its kind by `data-kind`; what it grades by stands in further data attributes.

The items of an order question are shown in an order that looks shuffled and depends on nothing but
their number and the quiz's id, and that is never the right one.
"""

from __future__ import annotations

import hashlib
import re
from typing import TYPE_CHECKING, assert_never

from markupsafe import Markup, escape
from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core.model import Comparison, Heading, Mode, Recording, document_blocks, plain_text
from coursebuild.core.model.results import Outcome
from coursebuild.features.quiz.model import (
    AnyQuestion,
    ChoiceQuestion,
    NumericQuestion,
    OpenQuestion,
    OrderQuestion,
    OutputQuestion,
    Quiz,
)

if TYPE_CHECKING:
    from coursebuild.core.pages.context import PageContext


class Option(Struct, frozen=True):
    """An option of a question, lettered."""

    key: str
    letter: str
    text: Markup
    feedback: Markup
    right: bool


class OrderItem(Struct, frozen=True):
    """An item that is to be put in order."""

    key: str
    text: Markup


class QuestionView(Struct, frozen=True):
    """A question, ready for its template."""

    kind: str
    """`mcq`, `several`, `predict`, `numeric`, `open`, `output`, `order`."""
    key: str
    anchor: str
    number: int
    label: str
    text: Markup
    explain: Markup
    hints: tuple[Markup, ...]
    data: tuple[tuple[str, str], ...] = ()
    """Data attributes that the page's script grades by."""
    options: tuple[Option, ...] = ()
    several: bool = False
    """Whether all right options must be chosen."""
    simulation: Markup = Markup()
    answer: str = ""
    """The number, or the output's line."""
    tolerance: str = ""
    unit: Markup = Markup()
    reference: Markup = Markup()
    items: tuple[OrderItem, ...] = ()
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
    headings = [b for b in document_blocks(page.document) if isinstance(b, Heading)]
    said = any(plain_text(h.children).strip() == block.title.strip() for h in headings)
    return page.template(
        "quiz/quiz.html",
        quiz=block,
        questions=questions,
        titled=bool(block.title) and not said,
        # A heading of the same id stands for the quiz that it is above.
        anchored=all(heading.anchor != block.id for heading in headings),
    )


def _question(page: PageContext, block: Quiz, question: AnyQuestion, number: int) -> QuestionView:
    view = QuestionView(
        kind="",
        key=question.key,
        anchor=block.anchor(question.key),
        number=number,
        label=question.label,
        text=page.blocks(question.text),
        explain=page.blocks(question.explain),
        hints=tuple(page.blocks(hint) for hint in question.hints),
    )
    match question:
        case ChoiceQuestion():
            kind = "predict" if question.predict else "several" if question.several else "mcq"
            options = _options(page, question)
            right = " ".join(option.key for option in options if option.right)
            gate = (("gate", ""),) if question.gate else ()
            run = () if question.run is None else (("run", question.run.text),)
            return replace(
                view,
                kind=kind,
                data=(("answer", right), *gate, *run),
                options=options,
                several=question.several,
                simulation=page.block(question.sim) if question.sim is not None else Markup(),
            )
        case NumericQuestion():
            return _numeric(view, question)
        case OpenQuestion():
            return replace(view, kind="open", reference=page.blocks(question.reference))
        case OutputQuestion():
            return _output(page, view, question)
        case OrderQuestion():
            items = tuple(
                OrderItem(key, page.inlines(item))
                for key, item in zip(question.item_keys, question.items, strict=True)
            )
            order = shuffle(len(items), f"{block.id}/{number}")
            data = (("answer", " ".join(question.item_keys)),)
            return replace(view, kind="order", data=data, items=items, order=order)
        case _:
            assert_never(question)


def _numeric(view: QuestionView, question: NumericQuestion) -> QuestionView:
    data = (
        ("answer", question.answer_text),
        ("tolerance", repr(question.tolerance)),
        ("unit", question.unit),
    )
    return replace(
        view,
        kind="numeric",
        data=data,
        answer=question.answer_text,
        tolerance=f"{question.tolerance:.3g}",
        unit=unit_html(question.unit),
    )


def _output(page: PageContext, view: QuestionView, question: OutputQuestion) -> QuestionView:
    line = output_line(page, question.script, question.line)
    data = (("answer", line), ("compare", _compared(page, question.script))) if line else ()
    return replace(
        view,
        kind="output",
        data=data,
        answer=line or "",
        known=line is not None,
        script=question.script,
        line=question.line,
    )


def _compared(page: PageContext, script: str) -> str:
    """How the numbers in the output of a script are compared, for the page's script."""
    for block in document_blocks(page.document):
        if isinstance(block, Recording) and block.script == script:
            verdict = page.shown.verdicts.get(block.span.start)
            if verdict is not None:
                return _rule(verdict.comparison)
    return _rule(Comparison(Mode.DIGITS))


def _rule(comparison: Comparison) -> str:
    match comparison.mode:
        case Mode.EXACT:
            return "exact"
        case Mode.DIGITS | Mode.VOLATILE:
            return "digits"
        case Mode.TOLERANCE:
            return f"rtol={float(comparison.rtol)!r} atol={float(comparison.atol)!r}"
        case _:
            assert_never(comparison.mode)


def _options(page: PageContext, question: ChoiceQuestion) -> tuple[Option, ...]:
    return tuple(
        Option(
            choice.key,
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
