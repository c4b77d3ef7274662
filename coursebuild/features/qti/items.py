"""Quizzes as a content package of IMS QTI 2.1, and questions as its items.

The texts of a quiz are drawn as on its page, and converted (`flow`). Names are those of the IMS QTI
2.1 Assessment Test, Section, and Item Information Model, 2012; `item.jinja` holds them. Response
processing says which feedback is shown: that of each option chosen, and the explanation.
"""

from __future__ import annotations

import functools
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from markupsafe import Markup
from msgspec import Struct

from coursebuild.api import (
    Block,
    CachedFile,
    Course,
    Diagnostic,
    ExportContext,
    Inline,
    OutputFile,
    PageContext,
    SiteFile,
    diagnose,
    document_blocks,
    urls,
)
from coursebuild.core.pages.html_xml import element, identifier, markup, render_xml
from coursebuild.features.exercise.model import Exercise
from coursebuild.features.exercise.page import code_block, plain_task
from coursebuild.features.qti.flow import STRIKE_CLASS, Flow
from coursebuild.features.quiz import model
from coursebuild.features.quiz.page import letter, output_line, shuffle, unit_html

STYLE = "style.css"
_TEMPLATE = Path(__file__).with_name("item.jinja")
_NAME = 32
"""The most characters of an identifier: some systems keep no more."""


class QuestionItem(Struct, frozen=True):
    """A question, written as an item."""

    identifier: str
    data: bytes
    pictures: tuple[str, ...]
    """Site paths of the files that it shows."""


class QuizItems(Struct, frozen=True):
    """A quiz, written as items."""

    identifier: str
    title: str
    items: tuple[QuestionItem, ...]
    losses: tuple[Diagnostic, ...]
    """What an item cannot hold of its question, or why a question has no item."""


def quiz_items(page: PageContext, quiz: model.Quiz, course: Course) -> QuizItems:
    """Write a quiz as items."""
    items, losses = [], []
    for number, question in enumerate(quiz.questions, 1):
        writer = _Writer(page, quiz, number, course)
        item = writer.item(question)
        for loss in writer.flow.losses:
            message = f"the QTI package cannot hold all of this question: {loss}"
            losses.append(diagnose("package-reduced", question.span, message))
        items += [item] if item is not None else []
    name = identifier("quiz.", quiz.id, most=_NAME)
    return QuizItems(name, quiz.title or quiz.id, tuple(items), tuple(losses))


class _Writer:
    def __init__(self, page: PageContext, quiz: model.Quiz, number: int, course: Course) -> None:
        self.page = page
        self.words = page.renderer.words
        self.quiz = quiz
        self.number = number
        self.course = course
        self.pictures: dict[str, None] = {}
        self.flow = Flow(self._link, self._picture)

    def item(self, question: model.AnyQuestion) -> QuestionItem | None:
        response = self._response(question)
        if response is None:
            return None
        name = identifier("q.", self.quiz.anchor(question.key), most=_NAME)
        title = question.label or self.words("package.question", n=self.number)
        values = {
            "identifier": name,
            "title": f"{self.quiz.title}: {title}" if self.quiz.title else title,
            "language": self.words.language,
            "style": STYLE,
            "text": self._blocks(question.text),
            "task": "",
            "hints": [
                (self.words("package.hint", n=number), self._blocks(hint))
                for number, hint in enumerate(question.hints, 1)
            ],
            "feedback": [],
        }
        values |= response | {"explanation": self._explanation(question)}
        data = render_xml(_TEMPLATE, **values)
        return QuestionItem(name, data, tuple(self.pictures))

    def _explanation(self, question: model.AnyQuestion) -> Markup:
        """What every learner reads after an answer, right or wrong."""
        html = self._reference(question) if isinstance(question, model.OpenQuestion) else Markup()
        html += self._blocks(question.explain)
        if isinstance(question, model.ChoiceQuestion) and question.sim is not None:
            address = self._link(f"#{self.quiz.anchor(question.key)}")
            if address is None:
                self.flow.lose("its simulation is on its page alone, and left out")
            else:
                link = element("a", {"href": address}, self.words("package.simulation"))
                html += markup([element("p", {}, link)])
                self.flow.lose("its simulation is on its page alone, and the item links it")
        return html

    # --- texts

    def _blocks(self, blocks: tuple[Block, ...]) -> Markup:
        return markup(self.flow.blocks(self.page.blocks(blocks)))

    def _line(self, inlines: tuple[Inline, ...]) -> Markup:
        return markup(self.flow.line(self.page.inlines(inlines)))

    def _link(self, address: str) -> str | None:
        """Turn an address on the page into one for the package; `None` if there is none."""
        parts = urlsplit(address)
        if parts.scheme or parts.netloc:
            return address if parts.scheme in ("http", "https", "mailto") else None
        if not self.course.base_url:
            return None
        path = self.page.place.target(address)[0] or self.page.place.path
        rest = address[len(address.split("#", 1)[0].split("?", 1)[0]) :]
        return f"{self.course.base_url.rstrip('/')}/{urls.encode(path)}{rest}"

    def _picture(self, address: str) -> str | None:
        """Turn a picture's address on the page into one in the package; `None` if there is none."""
        if address.startswith("data:"):
            return address
        path, _ = self.page.place.target(address)
        if path is None or not path.startswith(("files/", "models/")):
            return None
        self.pictures[path] = None
        return f"../{urls.encode(path)}"

    # --- kinds of questions

    def _response(self, question: model.AnyQuestion) -> dict[str, Any] | None:
        """The values of the template that depend on the kind; `None` if the answer is unknown."""
        match question:
            case model.ChoiceQuestion():
                options = [(letter(index), option) for index, option in enumerate(question.options)]
                feedback = [(name, o.feedback) for name, o in options if o.feedback]
                return {
                    "cardinality": "multiple" if question.several else "single",
                    "base": "identifier",
                    "right": [letter(index) for index in question.answers],
                    "task": self.words("package.choose_all") if question.several else "",
                    "options": [(name, self._line(option.text)) for name, option in options],
                    "feedback": [(name, self._blocks(blocks)) for name, blocks in feedback],
                }
            case model.NumericQuestion():
                unit = self.flow.line(unit_html(question.unit)) if question.unit else []
                return {
                    "cardinality": "single",
                    "base": "float",
                    "right": [_double(question.answer)],
                    "length": 12,
                    "unit": markup([" ", *unit] if unit else []),
                    "tolerance": _double(question.tolerance),
                }
            case model.OutputQuestion():
                return self._output(question)
            case model.OpenQuestion():
                reference = self._reference(question)
                return {
                    "cardinality": "single", "base": "string", "right": [], "reference": reference
                }  # fmt: skip
            case model.OrderQuestion():
                order = shuffle(len(question.items), f"{self.quiz.id}/{self.number}")
                names = {index: letter(place) for place, index in enumerate(order)}
                return {
                    "cardinality": "ordered",
                    "base": "identifier",
                    "right": [names[index] for index in range(len(names))],
                    "task": self.words("package.order"),
                    "options": [(names[i], self._line(question.items[i])) for i in order],
                }

    def _output(self, question: model.OutputQuestion) -> dict[str, Any] | None:
        answer = output_line(self.page, question)
        if answer is None:
            self.flow.lose("it is left out: its script was not run, so nobody knows the key")
            return None
        return {
            "cardinality": "single",
            "base": "string",
            "right": [answer],
            "task": self.words("package.output_of", path=question.script, line=question.line),
            "length": min(max(len(answer), 12), 80),
            "unit": "",
        }

    def _reference(self, question: model.OpenQuestion) -> Markup:
        title = element("p", {}, self.words("package.reference"))
        return markup([title]) + self._blocks(question.reference)


def _double(value: float) -> str:
    """Write a number as XML Schema does, with all its digits; zero has no sign."""
    return repr(float(value) + 0.0)


def _as_quiz(page: PageContext, block: Exercise) -> model.Quiz:
    """An exercise as a quiz with an open question: a person judges what a platform cannot run."""
    words = page.renderer.words
    question = model.OpenQuestion(
        block.span,
        "task",
        words("exercise.label"),
        plain_task(words, block),
        block.explain,
        (),
        (code_block(block, block.solution),),
    )
    title = block.title or words("exercise.untitled")
    return model.Quiz(block.span, block.id, block.id_span, title, (question,), (question.key,))


_FOLDER = Path(__file__).parent
_STYLE_SHEET = f"""\
.{STRIKE_CLASS} {{ text-decoration: line-through; }}
.align-center {{ text-align: center; }}
.align-right {{ text-align: right; }}
"""


def package_files(context: ExportContext) -> Iterator[SiteFile | Diagnostic]:
    """Yield the files, none if no question has an answer, and report what items cannot hold."""
    quizzes: list[QuizItems] = []
    for owner in context.course.owners:
        summary = owner.document
        kinds = (model.Quiz, Exercise)
        if not summary or not any(isinstance(b, kinds) for b in document_blocks(summary)):
            continue
        page = context.page(summary)
        for block in document_blocks(page.document):
            if isinstance(block, Exercise):
                block = _as_quiz(page, block)
            if not isinstance(block, model.Quiz):
                continue
            quiz = quiz_items(page, block, context.course)
            yield from quiz.losses
            if quiz.items:
                quizzes.append(quiz)
            test = render_xml(_FOLDER / "test.jinja", quiz=quiz)
            yield OutputFile(f"tests/{quiz.identifier}.xml", test)
            for item in quiz.items:
                yield OutputFile(f"items/{item.identifier}.xml", item.data)
    if quizzes:
        pictures = {path for quiz in quizzes for item in quiz.items for path in item.pictures}
        for path in context.course.files:
            if urls.file_path(path) in pictures:
                read = functools.partial(context.read, path)
                yield CachedFile(urls.file_path(path), "", read)
        yield OutputFile(STYLE, _STYLE_SHEET.encode())
        manifest = render_xml(
            _FOLDER / "manifest.jinja",
            identifier=identifier("course.", context.course.key),
            course=context.course,
            language=context.course.language or "en",
            quizzes=quizzes,
            style=STYLE,
            encode=urls.encode,
        )
        yield OutputFile("imsmanifest.xml", manifest)
