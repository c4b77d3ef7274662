"""A question as an item of QTI 2.1.

Entry point: `quiz_items(page, quiz, course)`.

A quiz's texts are drawn as its page draws them, and brought into what QTI allows (`flow`). Names
are those of the IMS QTI 2.1 Assessment Test, Section, and Item Information Model, 2012:

1. A response and outcomes are declared: the points, and what to say.
2. The body has the question, hints that are opened one by one (`infoControl`), and an interaction.
3. Response processing (`processing`) compares, and says which feedback is shown: that of each
   option that was chosen, and the explanation.
"""

from __future__ import annotations

import posixpath
from typing import assert_never
from urllib.parse import unquote, urlsplit

from msgspec import Struct

from coursebuild.core.model import Block, Course, Inline
from coursebuild.core.pages import urls
from coursebuild.core.pages.context import PageContext
from coursebuild.core.pages.xml import XSI, Element, add, document, element, identifier
from coursebuild.core.text.source import Span
from coursebuild.features.qti.flow import Flow
from coursebuild.features.qti.mathml import NAMESPACE as MATHML
from coursebuild.features.qti.processing import (
    EXPLANATION,
    RESPONSE,
    ResponseParts,
    compared,
    double,
    feedback,
    matches,
    outcomes,
    processing,
    response,
)
from coursebuild.features.quiz.model import (
    AnyQuestion,
    ChoiceQuestion,
    NumericQuestion,
    OpenQuestion,
    OrderQuestion,
    OutputQuestion,
    Quiz,
)
from coursebuild.features.quiz.page import letter, output_line, shuffle, unit_html

NAMESPACE = "http://www.imsglobal.org/xsd/imsqti_v2p1"
SCHEMA = "http://www.imsglobal.org/xsd/qti/qtiv2p1/imsqti_v2p1.xsd"
STYLE = "style.css"
_NAME = 32
"""Characters that an identifier should have at most, for systems that keep no more."""


class QuestionItem(Struct, frozen=True):
    """A question as an item."""

    identifier: str
    data: bytes
    pictures: tuple[str, ...]
    """Site paths of the files that it shows."""


class QuizItems(Struct, frozen=True):
    """A quiz as items."""

    identifier: str
    title: str
    items: tuple[QuestionItem, ...]
    losses: tuple[tuple[Span, str], ...]
    """Something of a question that an item cannot hold, or why there is no item."""


def quiz_items(page: PageContext, quiz: Quiz, course: Course) -> QuizItems:
    """A quiz as items, and what could not be kept."""
    items, losses = [], []
    for number, question in enumerate(quiz.questions, 1):
        writer = _Writer(page, quiz, number, course)
        item = writer.item(question)
        losses += [(question.span, loss) for loss in writer.flow.lost]
        items += [item] if item is not None else []
    name = identifier("quiz.", quiz.id, most=_NAME)
    return QuizItems(name, quiz.title or quiz.id, tuple(items), tuple(losses))


class _Writer:
    """Writes one item."""

    def __init__(self, page: PageContext, quiz: Quiz, number: int, course: Course) -> None:
        self.page = page
        self.words = page.renderer.words
        self.quiz = quiz
        self.number = number
        self.course = course
        self.pictures: dict[str, None] = {}
        self.flow = Flow(self._link, self._picture)

    def item(self, question: AnyQuestion) -> QuestionItem | None:
        """The item, or nothing where the question has no answer."""
        parts = self._parts(question)
        if parts is None:
            return None
        name = identifier("q.", self.quiz.anchor(question.key), most=_NAME)
        title = question.label or self.words("package.question", n=self.number)
        root = element(
            "assessmentItem",
            {
                "xmlns": NAMESPACE,
                "xmlns:m": MATHML,
                "xmlns:xsi": XSI,
                "xsi:schemaLocation": f"{NAMESPACE} {SCHEMA}",
                "identifier": name,
                "title": f"{self.quiz.title}: {title}" if self.quiz.title else title,
                "adaptive": "false",
                "timeDependent": "false",
                "xml:lang": self.course.language or "en",
            },
        )
        add(root, parts.response, *outcomes())
        add(root, element("stylesheet", {"href": f"../{STYLE}", "type": "text/css"}))
        add(root, self._body(question, parts))
        explanation = self._explanation(question)
        add(root, processing(parts, explained=explanation is not None))
        add(root, *parts.feedback, explanation)
        return QuestionItem(name, document(root), tuple(self.pictures))

    def _body(self, question: AnyQuestion, parts: ResponseParts) -> Element:
        body = element("itemBody", {}, *self._blocks(question.text), *parts.before)
        for number, hint in enumerate(question.hints, 1):
            title = self.words("package.hint", n=number)
            add(body, element("infoControl", {"title": title}, *self._blocks(hint)))
        add(body, *parts.interaction)
        return body

    def _explanation(self, question: AnyQuestion) -> Element | None:
        inner = self._reference(question) if isinstance(question, OpenQuestion) else []
        inner += self._blocks(question.explain)
        if isinstance(question, ChoiceQuestion) and question.sim is not None:
            address = self._link(f"#{self.quiz.anchor(question.key)}")
            if address is None:
                self.flow.lost.append("its simulation is on its page alone, and left out")
            else:
                link = element("a", {"href": address}, self.words("package.simulation"))
                inner.append(element("p", {}, link))
                self.flow.lost.append("its simulation is on its page alone, and the item links it")
        return feedback(EXPLANATION, inner) if inner else None

    # --- texts

    def _blocks(self, blocks: tuple[Block, ...]) -> list[Element]:
        return self.flow.blocks(self.page.blocks(blocks))

    def _line(self, inlines: tuple[Inline, ...]) -> list[Element | str]:
        return self.flow.line(self.page.inlines(inlines))

    def _words(self, key: str, **values: str | int) -> Element:
        return element("p", {}, self.words(key, **values))

    def _link(self, address: str) -> str | None:
        """An address on the page for someone who has the package alone, if there is one."""
        parts = urlsplit(address)
        if parts.scheme or parts.netloc:
            return address if parts.scheme in ("http", "https", "mailto") else None
        if not self.course.base_url:
            return None
        path = self._site_path(parts.path) if parts.path else self.page.place.path
        rest = address[len(address.split("#", 1)[0].split("?", 1)[0]) :]
        return f"{self.course.base_url.rstrip('/')}/{urls.encode(path)}{rest}"

    def _picture(self, address: str) -> str | None:
        """Where the picture at an address on the page is in the package, if it can be there."""
        parts = urlsplit(address)
        if parts.scheme == "data":
            return address
        path = self._site_path(parts.path)
        if parts.scheme or parts.netloc or not path.startswith(("files/", "models/")):
            return None
        self.pictures[path] = None
        return f"../{urls.encode(path)}"

    def _site_path(self, path: str) -> str:
        folder = posixpath.dirname(self.page.place.path)
        return posixpath.normpath(posixpath.join(folder, unquote(path)))

    # --- kinds of questions

    def _parts(self, question: AnyQuestion) -> ResponseParts | None:
        match question:
            case ChoiceQuestion():
                return self._choice(question)
            case NumericQuestion():
                return self._numeric(question)
            case OutputQuestion():
                return self._output(question)
            case OpenQuestion():
                return self._open(question)
            case OrderQuestion():
                return self._order(question)
            case _:
                assert_never(question)

    def _choice(self, question: ChoiceQuestion) -> ResponseParts:
        options = [(letter(index), option) for index, option in enumerate(question.options)]
        choices = (
            element("simpleChoice", {"identifier": name}, *self._line(option.text))
            for name, option in options
        )
        given = {"responseIdentifier": RESPONSE, "shuffle": "false"}
        given["maxChoices"] = "0" if question.several else "1"
        interaction = element("choiceInteraction", given, *choices)
        answers = tuple(
            feedback(name, self._blocks(option.feedback), title=name)
            for name, option in options
            if option.feedback
        )
        cardinality = "multiple" if question.several else "single"
        return ResponseParts(
            response(cardinality, "identifier", [letter(index) for index in question.answers]),
            (interaction,),
            before=(self._words("package.choose_all"),) if question.several else (),
            test=matches(),
            feedback=answers,
        )

    def _numeric(self, question: NumericQuestion) -> ResponseParts:
        field = element("textEntryInteraction", {"responseIdentifier": RESPONSE})
        field.set("expectedLength", "12")
        line = element("p", {}, field)
        if question.unit:
            add(line, " ", *self.flow.line(unit_html(question.unit)))
        within = double(question.tolerance)
        how = {"toleranceMode": "absolute", "tolerance": f"{within} {within}"}
        return ResponseParts(
            response("single", "float", [double(question.answer)]),
            (line,),
            test=element("equal", how, *compared()),
        )

    def _output(self, question: OutputQuestion) -> ResponseParts | None:
        answer = output_line(self.page, question.script, question.line)
        if answer is None:
            self.flow.lost.append("it is left out: its script was not run, so nobody knows the key")
            return None
        field = element("textEntryInteraction", {"responseIdentifier": RESPONSE})
        field.set("expectedLength", str(min(max(len(answer), 12), 80)))
        return ResponseParts(
            response("single", "string", [answer]),
            (element("p", {}, field),),
            before=(self._words("package.output_of", path=question.script, line=question.line),),
            test=element("stringMatch", {"caseSensitive": "true"}, *compared()),
        )

    def _open(self, question: OpenQuestion) -> ResponseParts:
        given = {"responseIdentifier": RESPONSE, "expectedLines": "6"}
        reference = element("rubricBlock", {"view": "scorer"}, *self._reference(question))
        return ResponseParts(
            response("single", "string", ()),
            (reference, element("extendedTextInteraction", given)),
        )

    def _reference(self, question: OpenQuestion) -> list[Element]:
        return [self._words("package.reference"), *self._blocks(question.reference)]

    def _order(self, question: OrderQuestion) -> ResponseParts:
        shown = shuffle(len(question.items), f"{self.quiz.id}/{self.number}")
        names = {index: letter(place) for place, index in enumerate(shown)}
        choices = (
            element(
                "simpleChoice", {"identifier": names[index]}, *self._line(question.items[index])
            )
            for index in shown
        )
        given = {"responseIdentifier": RESPONSE, "shuffle": "false"}
        return ResponseParts(
            response("ordered", "identifier", [names[index] for index in range(len(names))]),
            (element("orderInteraction", given, *choices),),
            before=(self._words("package.order"),),
            test=matches(),
        )
