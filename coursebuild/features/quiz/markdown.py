"""Quizzes as plain Markdown: a list of the questions, with their answers.

Entry point: `quiz_markdown`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, assert_never

from coursebuild.core.pages.marks import escape_marks, fence, hang
from coursebuild.features.quiz.model import (
    AnyQuestion,
    ChoiceQuestion,
    NumericQuestion,
    OpenQuestion,
    OrderQuestion,
    OutputQuestion,
    Quiz,
)
from coursebuild.features.quiz.page import is_heading, letter, output_line

if TYPE_CHECKING:
    from coursebuild.core.features import MarkdownWriter


def quiz_markdown(writer: MarkdownWriter, block: Quiz) -> str:
    """Write a quiz as a list of its questions, each with its answer."""
    questions = (
        hang(f"{number}. ", _question(writer, question))
        for number, question in enumerate(block.questions, 1)
    )
    has_heading = is_heading(writer.page.document, block.title)
    title = "" if has_heading else f"**{escape_marks(block.title)}**"
    return "\n\n".join(filter(None, (title, *questions)))


def _question(writer: MarkdownWriter, question: AnyQuestion) -> str:
    parts = [f"*{escape_marks(question.label)}*"] if question.label else []
    parts.append(writer.blocks(question.text))
    parts += _task(writer, question)
    for number, hint in enumerate(question.hints, 1):
        parts.append(writer.folded(writer.words("quiz.hint", n=number), writer.blocks(hint)))
    answer = "\n\n".join(filter(None, _answer(writer, question)))
    parts.append(writer.folded(writer.words("quiz.answer"), answer))
    return "\n\n".join(filter(None, parts))


def _task(writer: MarkdownWriter, question: AnyQuestion) -> list[str]:
    """Say how to answer, and list what there is to choose from."""
    match question:
        case ChoiceQuestion():
            instruction = "quiz.commit" if question.predict else ""
            instruction = "quiz.choose_all" if question.several else instruction
            options = (
                f"- {letter(at)}: {writer.inlines(option.text)}"
                for at, option in enumerate(question.options)
            )
            return [f"*{writer.words(instruction)}*" if instruction else "", "\n".join(options)]
        case NumericQuestion():
            unit = f"{writer.words('quiz.unit')} {escape_marks(question.unit)}"
            return [f"*{unit}*"] if question.unit else []
        case OpenQuestion():
            return []
        case OutputQuestion():
            task = writer.words("quiz.output_of", path=question.script, line=question.line)
            return [f"*{task}*"]
        case OrderQuestion():
            solution = [writer.inlines(item) for item in question.items]
            items = sorted(solution)
            items = [*items[1:], items[0]] if items == solution else items
            return [
                f"*{writer.words('quiz.order')}*",
                "\n".join(f"- {item}" for item in items),
            ]
        case _:
            assert_never(question)


def _answer(writer: MarkdownWriter, question: AnyQuestion) -> list[str]:
    explain = writer.blocks(question.explain)
    match question:
        case ChoiceQuestion():
            right = ", ".join(letter(at) for at in question.answers)
            feedback = [
                f"- {writer.words('quiz.feedback', option=letter(at))}: "
                + hang("", writer.blocks(option.feedback), 2)
                for at, option in enumerate(question.options)
                if option.feedback
            ]
            sim = writer.blocks((question.sim,)) if question.sim is not None else ""
            return [f"{right}.", explain, "\n".join(feedback), sim]
        case NumericQuestion():
            unit = f" {escape_marks(question.unit)}" if question.unit else ""
            tolerance = writer.words("quiz.tolerance", tolerance=f"{question.tolerance:.3g}")
            return [f"{escape_marks(question.answer_text)}{unit} ({tolerance}).", explain]
        case OpenQuestion():
            return [writer.blocks(question.reference), explain]
        case OutputQuestion():
            line = output_line(writer.page, question)
            answer = writer.words("quiz.none") if line is None else fence("text", line)
            return [answer, explain]
        case OrderQuestion():
            right = "\n".join(
                f"{at}. {writer.inlines(item)}" for at, item in enumerate(question.items, 1)
            )
            return [right, explain]
        case _:
            assert_never(question)
