"""`quiz` fences.

Entry points: `parse_fence`; `parse_quiz`, from the text inside one.

1. The JSON is read into nodes, and these into the declared fields.
2. Each question whose own fields are right is checked for what no type can say: an answer that is
   one of the options, as many feedbacks as options, a tolerance where the answer is 0.
3. The Markdown in it is parsed, and all of it becomes a `Quiz`. One with mistakes becomes a quiz of
   those questions that are right, so that what is wrong in them beside (a formula, a link, a script
   that no lesson has) is told in the same run.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain, repeat
from typing import assert_never

from msgspec.structs import replace

from coursebuild.core.syntax.decode import Decoding, decode
from coursebuild.core.syntax.fence import Fence
from coursebuild.core.syntax.fields import check_unique, has_value
from coursebuild.core.syntax.json_text import parse_json, to_one_line
from coursebuild.core.syntax.nodes import Node, ObjectNode, StringNode
from coursebuild.core.syntax.texts import Prose, TextParser
from coursebuild.core.syntax.wording import JSON
from coursebuild.core.text.diagnostics import Diagnostic, Parsed, diagnose, sort_diagnostics
from coursebuild.core.text.source import Excerpt, Span
from coursebuild.core.text.units import check_unit
from coursebuild.features.quiz.keys import unique_keys
from coursebuild.features.quiz.model import (
    AnyQuestion,
    Choice,
    ChoiceQuestion,
    NumericQuestion,
    OpenQuestion,
    OrderQuestion,
    OutputQuestion,
    Quiz,
)
from coursebuild.features.quiz.schema import (
    AnyFields,
    MultipleChoice,
    Numeric,
    Open,
    OrderFields,
    OutputFields,
    Predict,
    QuizFile,
)

TOLERANCE = 0.02
"""Of the answer's size, where a numeric question gives no tolerance."""


def parse_fence(fence: Fence, texts: TextParser) -> Parsed[Quiz | None]:
    """A `quiz` fence, which has no keys."""
    quiz = parse_quiz(fence.span, fence.body, texts)
    return Parsed(quiz.value, (*fence.keys().diagnostics, *quiz.diagnostics))


def parse_quiz(span: Span, body: Excerpt, texts: TextParser) -> Parsed[Quiz | None]:
    """The quiz of a fence; `span` is all of it and `body` the text inside. Never raises.

    It can be there along with diagnostics, and is then not to be published.
    """
    parsed = parse_json(body, span.first_line())
    node = parsed.value
    if node is None:
        return Parsed(None, sort_diagnostics(parsed.diagnostics))
    decoding = decode(node, QuizFile, "the quiz", JSON)
    prose = Prose.read(decoding.texts, texts)
    found: list[Diagnostic] = [*parsed.diagnostics, *decoding.diagnostics, *prose.diagnostics]
    if not isinstance(node, ObjectNode):
        return Parsed(None, sort_diagnostics(found))
    nodes = node.objects("questions")
    found += _check_ids(nodes)
    keys = _keys(nodes, decoding)
    questions: list[AnyQuestion] = []
    for question in nodes:
        found += _check(question, decoding)
    for question in nodes:
        # Where its JSON is wrong, nobody knows what its texts were meant to be.
        garbled = any(question.span.contains(d.span) for d in parsed.diagnostics)
        built = _question(question, keys.get(question, ""), decoding, prose)
        questions += [_sound(built, found)] if built is not None and not garbled else []
    fields = decoding.value
    id, title = (fields.id, fields.title) if fields is not None else (_id(node, found), "")
    present = tuple(question.key for question in questions)
    quiz = Quiz(span, id, node.place("id"), title, tuple(questions), present)
    return Parsed(quiz, sort_diagnostics(found))


def _id(node: ObjectNode, found: list[Diagnostic]) -> str:
    """The id of a quiz with mistakes; empty where the id is one of them."""
    given = node.get("id")
    wrong = any(given is not None and d.span == given.mark for d in found)
    return given.value if isinstance(given, StringNode) and not wrong else ""


def _sound(question: AnyQuestion, found: list[Diagnostic]) -> AnyQuestion:
    """A question without its simulation where that has mistakes: it would be tried with them."""
    if not isinstance(question, ChoiceQuestion) or question.sim is None:
        return question
    wrong = any(question.sim.span.contains(diagnostic.span) for diagnostic in found)
    return replace(question, sim=None) if wrong else question


def _keys(nodes: tuple[ObjectNode, ...], decoding: Decoding[QuizFile]) -> dict[ObjectNode, str]:
    """The key of each question: its id, or that of its text, which must not be another's id."""
    fields = ((node, decoding.structs.get(node)) for node in nodes)
    known = [(node, one) for node, one in fields if isinstance(one, AnyFields)]
    given = {node: one.id for node, one in known if one.id is not None}
    others = [(node, one) for node, one in known if node not in given]
    kinds = ((str(one.__struct_config__.tag), one.q) for _, one in others)
    keys = unique_keys(kinds, given.values())
    return given | {node: key for (node, _), key in zip(others, keys, strict=True)}


# ---------------------------------------------------------------------------------------- checks


def _check_ids(nodes: tuple[ObjectNode, ...]) -> Iterator[Diagnostic]:
    given = [node.get("id") for node in nodes]
    named = [(id.value, id.span) for id in given if isinstance(id, StringNode)]
    help = "a learner's answer is kept under it; give each question its own, or none"
    message = "the question id `{}` is used twice in this quiz"
    yield from check_unique(named, "question-id-repeated", message, help=help)


def _check(node: ObjectNode, decoding: Decoding[QuizFile]) -> Iterator[Diagnostic]:
    sim = node.get("sim")
    match decoding.structs.get(node):
        case MultipleChoice() | Predict() as fields:
            yield from _check_choices(node, fields)
        case Numeric() as fields:
            if fields.answer == 0 and fields.tol is None:
                message = "`tol` is missing: of an answer that is 0 it cannot be a share"
                yield diagnose("field-missing", node.place("answer"), message)
            if isinstance(unit := node.get("unit"), StringNode):
                yield from check_unit(unit.excerpt)
        case OrderFields():
            yield from _check_distinct(node, "items", "two items are the same: `{}`")
        case _:
            pass
    if isinstance(sim, ObjectNode) and sim in decoding.structs:
        from coursebuild.features.lab.relations import check_lab

        yield from check_lab(sim, decoding.structs)


def _check_choices(node: ObjectNode, fields: MultipleChoice | Predict) -> Iterator[Diagnostic]:
    yield from _check_distinct(node, "options", "two options are the same: `{}`")
    count = len(fields.options)
    spans = [item.span for item in node.items("answer")] or [node.place("answer")]
    named = list(zip(fields.answers, spans, strict=True))
    for number, span in named:
        if not 0 <= number < count:
            message = f"there is no option {number}: they are numbered 0 to {count - 1}"
            yield diagnose("quiz-answer", span, message)
    yield from check_unique(named, "quiz-answer", "the option {} is named twice")
    if fields.feedback is not None and len(fields.feedback) != count:
        texts = "1 text" if len(fields.feedback) == 1 else f"{len(fields.feedback)} texts"
        message = f"`feedback` has {texts} for {count} options"
        help = 'an option without feedback has `""`'
        yield diagnose("field-value", node.place("feedback"), message, help=help)


def _check_distinct(node: ObjectNode, name: str, message: str) -> Iterator[Diagnostic]:
    named = ((item.value.strip(), item.span) for item in node.strings(name))
    yield from check_unique(named, "field-value", message)


# ------------------------------------------------------------------------------------- questions


def _question(
    node: ObjectNode, key: str, decoding: Decoding[QuizFile], prose: Prose
) -> AnyQuestion | None:
    fields = decoding.structs.get(node)
    if not isinstance(fields, AnyFields):
        return None
    text, explain = prose.blocks(node.get("q")), prose.blocks(node.get("explain"))
    common = (node.span, key, fields.label, text, explain, prose.each_item(node.get("hints")))
    match fields:
        case MultipleChoice() | Predict():
            sim = node.get("sim")
            lab = None
            if isinstance(sim, ObjectNode):
                from coursebuild.features.lab.parse import sim_lab

                lab = sim_lab(sim.span, sim.mark, sim, decoding.structs, prose)
            run = node.get("run") if has_value(node, "run") else None
            return ChoiceQuestion(
                *common,
                options=_choices(node, fields.options, prose),
                answers=tuple(sorted(fields.answers)),
                several=isinstance(fields.answer, tuple),
                sim=lab,
                predict=isinstance(fields, Predict),
                gate=isinstance(fields, Predict) and fields.gate,
                gate_span=node.place("gate"),
                run=None if run is None else to_one_line(run),
            )
        case Numeric():
            answer: Node | None = node.get("answer")
            written = answer.raw if answer is not None else ""
            tolerance = TOLERANCE * abs(fields.answer) if fields.tol is None else fields.tol
            return NumericQuestion(*common, fields.answer, written, tolerance, fields.unit)
        case Open():
            return OpenQuestion(*common, prose.blocks(node.get("reference")))
        case OutputFields():
            script, line = node.place("of"), node.place("line")
            return OutputQuestion(*common, fields.of, script, fields.line, line)
        case OrderFields():
            keys = tuple(unique_keys(("item", text) for text in fields.items))
            return OrderQuestion(*common, prose.each_item(node.get("items")), keys)
        case _:
            assert_never(fields)


def _choices(node: ObjectNode, texts: tuple[str, ...], prose: Prose) -> tuple[Choice, ...]:
    feedback = prose.each_item(node.get("feedback"))
    keys = unique_keys(("option", text) for text in texts)
    return tuple(
        Choice(item.span, key, prose.inlines(item), text)
        for item, key, text in zip(
            node.items("options"), keys, chain(feedback, repeat(())), strict=False
        )
    )
