"""Quizzes as Markdown, and as a page shows them before any script runs: the answers folded.

The page's script finds each question by `data-question`, its key, and its kind by `data-kind`;
further data attributes hold what it needs to grade an answer. The items of an order question stand
in an order that looks shuffled, is never the right one, and depends only on how many they are, on
the quiz's id and on the question's number.
"""

from __future__ import annotations

import functools
import hashlib
import re
from collections.abc import Iterator

from markupsafe import Markup, escape

from coursebuild.api import IndexReader, MarkdownWriter, Outcome, PageContext, model
from coursebuild.core.pages.marks import escape_marks, fence, hang
from coursebuild.features.quiz import model as quizzes


def draw_quiz(page: PageContext, block: quizzes.Quiz) -> Markup:
    """Draw a quiz with its questions."""
    return page.template(
        "quiz/quiz.html",
        quiz=block,
        page=page,
        titled=bool(block.title) and not is_heading(page.document, block.title),
        anchored=block.id not in model.heading_anchors(page.document),
        kind_of=_kind,
        grading_attributes=functools.partial(_grading_attributes, page),
        output_line=functools.partial(output_line, page),
        letter=letter,
        shuffle=shuffle,
        unit_html=unit_html,
    )


def index_quiz(reader: IndexReader, block: quizzes.Quiz) -> None:
    """Give the search a quiz's title, its questions and options, and no answer."""
    reader.add("text", block.title)
    for question in block.questions:
        reader.blocks(question.text)
        if isinstance(question, quizzes.ChoiceQuestion):
            for option in question.options:
                reader.add("text", reader.text(option.text))
        elif isinstance(question, quizzes.OrderQuestion):
            # In the order of their texts: how they are written is the answer.
            for text in sorted(map(reader.text, question.items)):
                reader.add("text", text)


def is_heading(document: model.Document, title: str) -> bool:
    """Whether a heading of the document reads like the title."""
    headings = model.find_blocks(document, model.Heading)
    return any(model.plain_text(h.children).strip() == title.strip() for h in headings)


def _kind(question: quizzes.AnyQuestion) -> str:
    match question:
        case quizzes.ChoiceQuestion():
            return "predict" if question.predict else "several" if question.several else "mcq"
        case quizzes.NumericQuestion():
            return "numeric"
        case quizzes.OpenQuestion():
            return "open"
        case quizzes.OutputQuestion():
            return "output"
        case quizzes.OrderQuestion():
            return "order"


def _grading_attributes(
    page: PageContext, question: quizzes.AnyQuestion
) -> Iterator[tuple[str, str]]:
    match question:
        case quizzes.ChoiceQuestion():
            yield "answer", " ".join(question.options[at].key for at in question.answers)
            if question.gate:
                yield "gate", ""
            if question.run is not None:
                yield "run", question.run.text
        case quizzes.NumericQuestion():
            yield "answer", repr(question.answer).removesuffix(".0")
            yield "tolerance", repr(question.tolerance)
            yield "unit", question.unit
        case quizzes.OpenQuestion():
            return
        case quizzes.OutputQuestion():
            if line := output_line(page, question):
                yield "answer", line
                yield "compare", _comparison_rule(page, question.script)
        case quizzes.OrderQuestion():
            yield "answer", " ".join(question.item_keys)


def _comparison_rule(page: PageContext, script: str) -> str:
    recordings = model.find_blocks(page.document, model.Recording)
    starts = (recording.span.start for recording in recordings if recording.script == script)
    verdict = next(filter(None, map(page.inputs.verdicts.get, starts)), None)
    comparison = model.Comparison(model.Mode.DIGITS) if verdict is None else verdict.comparison
    match comparison.mode:
        case model.Mode.EXACT:
            return "exact"
        case model.Mode.DIGITS | model.Mode.VOLATILE:
            return "digits"
        case model.Mode.TOLERANCE:
            return f"rtol={float(comparison.rtol)!r} atol={float(comparison.atol)!r}"


def unit_html(unit: str) -> Markup:
    """A unit with its exponents raised: `kg m^2`, `m/s^-1`."""
    parts = re.split(r"\^\{?([-\u2212]?\d+)\}?", unit)
    pieces = (
        Markup("<sup>{}</sup>").format(part.replace("-", "\u2212")) if i % 2 else escape(part)
        for i, part in enumerate(parts)
    )
    return Markup().join(pieces)


def letter(index: int) -> str:
    """A, B, …, Z, AA, AB, …: how options are named."""
    name = ""
    index += 1
    while index:
        index, digit = divmod(index - 1, 26)
        name = chr(ord("A") + digit) + name
    return name


def output_line(page: PageContext, question: quizzes.OutputQuestion) -> str | None:
    """Return the line of output asked for; `None` if the script did not run to its end."""
    run = page.inputs.runs.get(question.script)
    if run is None or run.outcome is not Outcome.OK:
        return None
    return dict(run.lines)[question.line]


def shuffle(count: int, key: str) -> tuple[int, ...]:
    """Return an order of `count` items that depends only on `key`, and is not the right one."""
    order = sorted(range(count), key=lambda i: hashlib.sha256(f"{key}/{i}".encode()).digest())
    if count > 1 and order == list(range(count)):
        order = [*order[1:], order[0]]
    return tuple(order)


def quiz_markdown(writer: MarkdownWriter, block: quizzes.Quiz) -> str:
    """Write a quiz as a list of its questions, each with its answer."""
    has_heading = is_heading(writer.page.document, block.title)
    texts = [] if has_heading else [f"**{escape_marks(block.title)}**"]
    for number, question in enumerate(block.questions, 1):
        parts = [f"*{escape_marks(question.label)}*"] if question.label else []
        parts.append(writer.blocks(question.text))
        parts += _task(writer, question)
        for n, hint in enumerate(question.hints, 1):
            parts.append(writer.folded(writer.words("quiz.hint", n=n), writer.blocks(hint)))
        answer = "\n\n".join(filter(None, _answer(writer, question)))
        parts.append(writer.folded(writer.words("quiz.answer"), answer))
        texts.append(hang(f"{number}. ", "\n\n".join(filter(None, parts))))
    return "\n\n".join(filter(None, texts))


def _task(writer: MarkdownWriter, question: quizzes.AnyQuestion) -> list[str]:
    """Say how to answer, and list what there is to choose from."""
    match question:
        case quizzes.ChoiceQuestion():
            instruction = "quiz.commit" if question.predict else ""
            instruction = "quiz.choose_all" if question.several else instruction
            options = (
                f"- {letter(at)}: {writer.inlines(option.text)}"
                for at, option in enumerate(question.options)
            )
            return [f"*{writer.words(instruction)}*" if instruction else "", "\n".join(options)]
        case quizzes.NumericQuestion():
            unit = f"{writer.words('quiz.unit')} {escape_marks(question.unit)}"
            return [f"*{unit}*"] if question.unit else []
        case quizzes.OpenQuestion():
            return []
        case quizzes.OutputQuestion():
            task = writer.words("quiz.output_of", path=question.script, line=question.line)
            return [f"*{task}*"]
        case quizzes.OrderQuestion():
            solution = [writer.inlines(item) for item in question.items]
            items = sorted(solution)
            items = [*items[1:], items[0]] if items == solution else items
            return [
                f"*{writer.words('quiz.order')}*",
                "\n".join(f"- {item}" for item in items),
            ]


def _answer(writer: MarkdownWriter, question: quizzes.AnyQuestion) -> list[str]:
    explain = writer.blocks(question.explain)
    match question:
        case quizzes.ChoiceQuestion():
            right = ", ".join(letter(at) for at in question.answers)
            feedback = [
                f"- {writer.words('quiz.feedback', option=letter(at))}: "
                + hang("", writer.blocks(option.feedback), 2)
                for at, option in enumerate(question.options)
                if option.feedback
            ]
            sim = writer.blocks((question.sim,)) if question.sim is not None else ""
            return [f"{right}.", explain, "\n".join(feedback), sim]
        case quizzes.NumericQuestion():
            unit = f" {question.unit}" if question.unit else ""
            tolerance = writer.words("quiz.tolerance", tolerance=question.tolerance_text + unit)
            return [escape_marks(f"{question.answer_text}{unit} ({tolerance})."), explain]
        case quizzes.OpenQuestion():
            return [writer.blocks(question.reference), explain]
        case quizzes.OutputQuestion():
            line = output_line(writer.page, question)
            answer = writer.words("quiz.none") if line is None else fence("text", line)
            return [answer, explain]
        case quizzes.OrderQuestion():
            right = "\n".join(
                f"{at}. {writer.inlines(item)}" for at, item in enumerate(question.items, 1)
            )
            return [right, explain]
