"""A question as an item of QTI 2.1.

Entry point: `made_items(page, quiz)`, from the page of a quiz's document.

A quiz's texts are drawn as its page draws them, and brought into what QTI allows (`flow`). Names
are those of the IMS QTI 2.1 Assessment Test, Section, and Item Information Model, 2012:

1. A response and outcomes are declared: the points, and what to say.
2. The body has the question, hints that are opened one by one (`infoControl`), and an interaction.
3. Response processing compares, and says which feedback is shown: that of each option that was
   chosen, and the explanation.
"""

from __future__ import annotations

import posixpath
from typing import assert_never
from urllib.parse import unquote, urlsplit

from msgspec import Struct

from coursebuild.core.model import Document, document_blocks
from coursebuild.core.pages import urls
from coursebuild.core.pages.context import PageContext
from coursebuild.core.pages.packages.flow import Flow, FlowPlaces
from coursebuild.core.pages.packages.formulas import NAMESPACE as MATHML
from coursebuild.core.pages.packages.processing import (
    EXPLANATION,
    FEEDBACK,
    RESPONSE,
    SCORE,
    ResponseParts,
    compared,
    declared,
    double,
    feedback,
    matches,
    processing,
    response,
)
from coursebuild.core.pages.packages.xml import XSI, Element, add, document, element, identifier
from coursebuild.core.pages.page_inputs import PageInputs
from coursebuild.core.pages.tools import Tools
from coursebuild.core.text.source import Span
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
NAME = 32
"""Characters that an identifier should have at most, for systems that keep no more."""


class MadeItem(Struct, frozen=True):
    """A question as an item."""

    identifier: str
    data: bytes
    pictures: tuple[str, ...]
    """Site paths of the files that it shows."""


class Loss(Struct, frozen=True):
    """Something of a question that an item cannot hold, or why there is no item."""

    span: Span
    what: str


class MadeQuiz(Struct, frozen=True):
    """A quiz as items."""

    identifier: str
    title: str
    items: tuple[MadeItem, ...]
    losses: tuple[Loss, ...]


def made_items(page: PageContext, quiz: Quiz, base_url: str, language: str) -> MadeQuiz:
    """A quiz as items, and what could not be kept."""
    made, losses = [], []
    for number, question in enumerate(quiz.questions, 1):
        writer = _Writer(page, quiz, number, base_url, language)
        item = writer.item(question)
        losses += [Loss(question.span, what) for what in writer.flow.lost]
        made += [item] if item is not None else []
    return MadeQuiz(
        identifier("quiz.", quiz.id, most=NAME),
        quiz.title or quiz.id,
        tuple(made),
        tuple(losses),
    )


class _Writer:
    """Writes one item."""

    def __init__(
        self, page: PageContext, quiz: Quiz, number: int, base_url: str, language: str
    ) -> None:
        self.page = page
        self.quiz = quiz
        self.number = number
        self.base_url = base_url
        self.language = language
        self.pictures: dict[str, None] = {}
        self.flow = Flow(FlowPlaces(self._link, self._picture))

    def item(self, question: AnyQuestion) -> MadeItem | None:
        """The item, or nothing where the question has no answer."""
        parts = self._parts(question)
        if parts is None:
            return None
        name = identifier("q.", self.quiz.anchor(question.key), most=NAME)
        words = self.page.tools.words
        title = question.label or words("package.question", n=self.number)
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
                "xml:lang": self.language,
            },
        )
        add(root, parts.response, *self._outcomes())
        add(root, element("stylesheet", {"href": f"../{STYLE}", "type": "text/css"}))
        add(root, self._body(question, parts))
        explanation = self._explanation(question)
        says = [EXPLANATION] if explanation is not None else []
        add(root, processing(parts, says))
        add(root, *parts.feedback, explanation)
        return MadeItem(name, document(root), tuple(self.pictures))

    def _outcomes(self) -> tuple[Element, Element]:
        zero = element("defaultValue", {}, element("value", {}, "0"))
        score = element("outcomeDeclaration", declared(SCORE, "single", "float"), zero)
        score.set("normalMaximum", "1")
        return score, element("outcomeDeclaration", declared(FEEDBACK, "multiple", "identifier"))

    def _body(self, question: AnyQuestion, parts: ResponseParts) -> Element:
        body = element("itemBody", {}, *self._blocks(question.text), *parts.before)
        for number, hint in enumerate(question.hints, 1):
            title = self.page.tools.words("package.hint", n=number)
            add(body, element("infoControl", {"title": title}, *self._blocks(hint)))
        add(body, *parts.interaction)
        return body

    def _explanation(self, question: AnyQuestion) -> Element | None:
        inner: list[Element] = []
        if isinstance(question, OpenQuestion):
            inner += [self._said("package.reference"), *self._blocks(question.reference)]
        inner += self._blocks(question.explain)
        if isinstance(question, ChoiceQuestion) and question.sim is not None:
            address = self._link(f"#{self.quiz.anchor(question.key)}")
            if address is None:
                self.flow.lost.append("its simulation is on its page alone, and left out")
            else:
                words = self.page.tools.words("package.simulation")
                inner.append(element("p", {}, element("a", {"href": address}, words)))
                self.flow.lost.append("its simulation is on its page alone, and the item links it")
        return feedback(EXPLANATION, inner) if inner else None

    # --- texts

    def _blocks(self, content: tuple[object, ...]) -> list[Element]:
        return self.flow.blocks(self.page.blocks(content))  # type: ignore[arg-type]

    def _said(self, key: str, **values: str | int) -> Element:
        return element("p", {}, self.page.tools.words(key, **values))

    def _link(self, address: str) -> str | None:
        parts = urlsplit(address)
        if parts.scheme or parts.netloc:
            return address if parts.scheme in ("http", "https", "mailto") else None
        if not self.base_url:
            return None
        path = self._site_path(parts.path) if parts.path else self.page.place.path
        rest = address[len(address.split("#", 1)[0].split("?", 1)[0]) :]
        return f"{self.base_url.rstrip('/')}/{urls.encode(path)}{rest}"

    def _picture(self, address: str) -> str | None:
        parts = urlsplit(address)
        if parts.scheme == "data":
            return address
        path = self._site_path(parts.path)
        if parts.scheme or parts.netloc or not parts.path or not _is_file(path):
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
        names = [letter(index) for index in range(len(question.options))]
        choices = [
            element("simpleChoice", {"identifier": name}, *self._text(option.text))
            for name, option in zip(names, question.options, strict=True)
        ]
        said = [
            feedback(name, self._blocks(option.feedback), title=name)
            for name, option in zip(names, question.options, strict=True)
            if option.feedback
        ]
        most = "0" if question.several else "1"
        given = {"responseIdentifier": RESPONSE, "shuffle": "false", "maxChoices": most}
        cardinality = "multiple" if question.several else "single"
        right = [names[index] for index in question.answers]
        return ResponseParts(
            response(cardinality, "identifier", right),
            (element("choiceInteraction", given, *choices),),
            before=(self._said("package.choose_all"),) if question.several else (),
            test=matches,
            feedback=tuple(said),
            chosen=bool(said),
        )

    def _numeric(self, question: NumericQuestion) -> ResponseParts:
        field = element("textEntryInteraction", {"responseIdentifier": RESPONSE})
        field.set("expectedLength", "12")
        line = element("p", {}, field)
        if question.unit:
            add(line, " ", *self.flow.line(unit_html(question.unit)))
        within = double(question.tolerance)

        def test() -> Element:
            how = {"toleranceMode": "absolute", "tolerance": f"{within} {within}"}
            return element("equal", how, *compared())

        return ResponseParts(
            response("single", "float", [double(question.answer)]), (line,), test=test
        )

    def _output(self, question: OutputQuestion) -> ResponseParts | None:
        answer = output_line(self.page, question.script, question.line)
        if answer is None:
            self.flow.lost.append("it is left out: its script was not run, so nobody knows the key")
            return None
        asked = self._said("package.output_of", path=question.script, line=question.line)
        size = str(min(max(len(answer), 12), 80))
        field = element("textEntryInteraction", {"responseIdentifier": RESPONSE})
        field.set("expectedLength", size)
        return ResponseParts(
            response("single", "string", [answer]),
            (element("p", {}, field),),
            before=(asked,),
            test=lambda: element("stringMatch", {"caseSensitive": "true"}, *compared()),
        )

    def _open(self, question: OpenQuestion) -> ResponseParts:
        reference = [self._said("package.reference"), *self._blocks(question.reference)]
        given = {"responseIdentifier": RESPONSE, "expectedLines": "6"}
        return ResponseParts(
            response("single", "string", ()),
            (
                element("rubricBlock", {"view": "scorer"}, *reference),
                element("extendedTextInteraction", given),
            ),
        )

    def _order(self, question: OrderQuestion) -> ResponseParts:
        shown = shuffle(len(question.items), f"{self.quiz.id}/{self.number}")
        names = {index: letter(place) for place, index in enumerate(shown)}
        choices = [
            element(
                "simpleChoice", {"identifier": names[index]}, *self._text(question.items[index])
            )
            for index in shown
        ]
        right = [names[index] for index in range(len(question.items))]
        given = {"responseIdentifier": RESPONSE, "shuffle": "false"}
        return ResponseParts(
            response("ordered", "identifier", right),
            (element("orderInteraction", given, *choices),),
            before=(self._said("package.order"),),
            test=matches,
        )

    def _text(self, text: tuple[object, ...]) -> list[Element | str]:
        return self.flow.line(self.page.inlines(text))  # type: ignore[arg-type]


def _is_file(path: str) -> bool:
    return path.startswith("files/") or path.startswith("models/")


def page_quizzes(
    inputs: PageInputs, document: Document, tools: Tools, base_url: str, language: str
) -> tuple[MadeQuiz, ...]:
    """The quizzes of a document, in its order."""
    assert inputs.shown is not None
    page = PageContext.made(tools, inputs.shown, urls.Place(inputs.path), document)
    quizzes = (block for block in document_blocks(document) if isinstance(block, Quiz))
    return tuple(made_items(page, quiz, base_url, language or "en") for quiz in quizzes)
