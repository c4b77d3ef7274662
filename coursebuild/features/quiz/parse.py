"""`quiz` fences.

If some questions have mistakes, the quiz holds the others, so that diagnostics that only later
steps can make (of a formula, a link, a script that no lesson has) come in the same run.

A question's key is its `id`, or else a hash of its kind and its text; the key of an option or an
item is a hash of its text. So answers lead back to their question, whatever else changes.
"""

from __future__ import annotations

import unicodedata
from collections.abc import Iterable, Iterator
from itertools import chain, repeat

from msgspec.structs import replace

from coursebuild.api import (
    Diagnostic,
    Excerpt,
    Fence,
    Parsed,
    Prose,
    Span,
    TextParser,
    decode,
    diagnose,
    parse_json,
)
from coursebuild.core.syntax.decode import Decoding, check_unique, has_value
from coursebuild.core.syntax.fence import with_units
from coursebuild.core.syntax.json_text import to_one_line
from coursebuild.core.syntax.nodes import JSON, Node, ObjectNode, StringNode
from coursebuild.core.text.diagnostics import sort_diagnostics
from coursebuild.core.text.source import key_of, unique_name
from coursebuild.core.text.units import check_unit
from coursebuild.features.lab.parse import sim_lab
from coursebuild.features.lab.relations import check_lab
from coursebuild.features.quiz import model, schema

TOLERANCE = 0.02
"""The tolerance of a numeric question that gives none, as a share of the answer."""


def parse_fence(fence: Fence, texts: TextParser) -> Parsed[model.Quiz | None]:
    """Parse a `quiz` fence, which has no keys."""
    quiz = parse_quiz(fence.span, fence.body, texts)
    return Parsed(quiz.value, (*fence.keys().diagnostics, *quiz.diagnostics))


def parse_quiz(span: Span, body: Excerpt, texts: TextParser) -> Parsed[model.Quiz | None]:
    """Parse the quiz of a fence; `span` is all of the fence and `body` the text inside.

    Never raises. A quiz that comes with diagnostics is not to be published.
    """
    json = parse_json(body, span.first_line())
    node = json.value
    if node is None:
        return Parsed(None, sort_diagnostics(json.diagnostics))
    comma = texts.has_decimal_comma
    decoding = decode(node, schema.QuizFile, "the quiz", JSON, comma=comma)
    prose = Prose.read(decoding.texts, texts)
    diagnostics = [*json.diagnostics, *decoding.diagnostics, *prose.diagnostics]
    if not isinstance(node, ObjectNode):
        return Parsed(None, sort_diagnostics(diagnostics))
    nodes = node.objects("questions")
    ids = [node.get("id") for node in nodes]
    places = [(id.value, id.span) for id in ids if isinstance(id, StringNode)]
    help = "a learner's answer is kept under it; give each question its own, or none"
    message = "the question id `{}` is used twice in this quiz"
    diagnostics += check_unique(places, "question-id-repeated", message, help=help)
    keys = _keys(nodes, decoding)
    questions: list[model.AnyQuestion] = []
    for question_node in nodes:
        diagnostics += _check(question_node, decoding)
    for question_node in nodes:
        # If its JSON is wrong, nobody knows what its texts were meant to be.
        is_garbled = any(question_node.span.contains(d.span) for d in json.diagnostics)
        question = _question(question_node, keys.get(question_node, ""), decoding, prose, comma)
        if question is None or is_garbled:
            continue
        if isinstance(question, model.ChoiceQuestion) and question.sim is not None:
            sim_span = question.sim.span
            if any(sim_span.contains(d.span) for d in diagnostics):
                question = replace(question, sim=None)  # so that no trial runs it
        questions.append(question)
    fields, id_node, id, title = decoding.value, node.get("id"), "", ""
    if fields is not None:
        id, title = fields.id, fields.title
    elif isinstance(id_node, StringNode) and all(d.span != id_node.mark for d in diagnostics):
        id = id_node.value
    question_keys = tuple(question.key for question in questions)
    units = (
        (answer, unit.value)
        for question_node in nodes
        if isinstance(answer := question_node.get("answer"), StringNode)
        and isinstance(unit := question_node.get("unit"), StringNode)
    )
    numbers = with_units(prose.numbers, units)
    quiz = model.Quiz(
        span, id, node.place("id"), title, tuple(questions), question_keys, numbers=numbers
    )
    return Parsed(quiz, sort_diagnostics(diagnostics))


def _keys(
    nodes: tuple[ObjectNode, ...], decoding: Decoding[schema.QuizFile]
) -> dict[ObjectNode, str]:
    """Map each question to its key: its id, or one made of its text that is nobody's id."""
    structs = ((node, decoding.structs.get(node)) for node in nodes)
    questions = [(node, fields) for node, fields in structs if isinstance(fields, schema.AnyFields)]
    ids = {node: fields.id for node, fields in questions if fields.id is not None}
    without_id = [(node, fields) for node, fields in questions if node not in ids]
    texts = ((str(fields.__struct_config__.tag), fields.q) for _, fields in without_id)
    keys = unique_keys(texts, ids.values())
    return ids | {node: key for (node, _), key in zip(without_id, keys, strict=True)}


# ---------------------------------------------------------------------------------------- checks


def _check(node: ObjectNode, decoding: Decoding[schema.QuizFile]) -> Iterator[Diagnostic]:
    sim = node.get("sim")
    match decoding.structs.get(node):
        case schema.MultipleChoice() | schema.Predict() as fields:
            yield from _check_distinct(node, "options", "two options are the same: `{}`")
            count = len(fields.options)
            spans = [item.span for item in node.items("answer")] or [node.place("answer")]
            answers = list(zip(fields.answers, spans, strict=True))
            for number, span in answers:
                if not 0 <= number < count:
                    message = f"there is no option {number}: they are numbered 0 to {count - 1}"
                    yield diagnose("quiz-answer", span, message)
            yield from check_unique(answers, "quiz-answer", "the option {} is named twice")
            if fields.feedback is not None and len(fields.feedback) != count:
                texts = "1 text" if len(fields.feedback) == 1 else f"{len(fields.feedback)} texts"
                message = f"`feedback` has {texts} for {count} options"
                help = 'an option without feedback has `""`'
                place = (node.get("feedback") or node).span
                yield diagnose("field-value", place, message, help=help)
        case schema.Numeric() as fields:
            if fields.answer == 0 and fields.tol is None:
                message = (
                    "`tol` is missing: the usual tolerance is a share of the answer, which is 0"
                )
                yield diagnose("field-missing", node.place("answer"), message)
            elif fields.tol is not None and 0 < abs(fields.answer) <= fields.tol:
                message = "`tol` must be less than the answer, or else 0 would be right"
                yield diagnose("field-value", node.place("tol"), message)
            if isinstance(unit := node.get("unit"), StringNode):
                yield from check_unit(unit.excerpt)
        case schema.OrderFields():
            yield from _check_distinct(node, "items", "two items are the same: `{}`")
        case _:
            pass
    if isinstance(sim, ObjectNode) and sim in decoding.structs:
        yield from check_lab(sim, decoding.structs)


def _check_distinct(node: ObjectNode, name: str, message: str) -> Iterator[Diagnostic]:
    texts = ((item.value.strip(), item.span) for item in node.strings(name))
    yield from check_unique(texts, "field-value", message)


# ------------------------------------------------------------------------------------- questions


def _question(
    node: ObjectNode, key: str, decoding: Decoding[schema.QuizFile], prose: Prose, comma: bool
) -> model.AnyQuestion | None:
    fields = decoding.structs.get(node)
    if not isinstance(fields, schema.AnyFields):
        return None
    text, explain = prose.blocks(node.get("q")), prose.blocks(node.get("explain"))
    common = (node.span, key, fields.label, text, explain, prose.each_item(node.get("hints")))
    match fields:
        case schema.MultipleChoice() | schema.Predict():
            sim = node.get("sim")
            lab = None
            if isinstance(sim, ObjectNode):
                lab = sim_lab(sim.span, sim.mark, sim, decoding.structs, prose)
            run = node.get("run") if has_value(node, "run") else None
            return model.ChoiceQuestion(
                *common,
                options=_choices(node, fields.options, prose),
                answers=tuple(sorted(fields.answers)),
                several=isinstance(fields.answer, tuple),
                sim=lab,
                predict=isinstance(fields, schema.Predict),
                gate=isinstance(fields, schema.Predict) and fields.gate,
                gate_span=node.place("gate"),
                run=None if run is None else to_one_line(run),
            )
        case schema.Numeric():
            answer: Node | None = node.get("answer")
            point = "," if comma else "."
            answer_text = answer.raw.replace(".", point) if answer is not None else ""
            if isinstance(answer, StringNode):
                answer_text = answer.value.split("`")[1]
            tolerance = TOLERANCE * abs(fields.answer) if fields.tol is None else fields.tol
            return model.NumericQuestion(
                *common,
                fields.answer,
                answer_text,
                tolerance,
                f"{tolerance:.3g}".replace(".", point),
                fields.unit,
            )
        case schema.Open():
            return model.OpenQuestion(*common, prose.blocks(node.get("reference")))
        case schema.OutputFields():
            script, line = node.place("of"), node.place("line")
            return model.OutputQuestion(*common, fields.of, script, fields.line, line)
        case schema.OrderFields():
            keys = tuple(unique_keys(("item", text) for text in fields.items))
            return model.OrderQuestion(*common, prose.each_item(node.get("items")), keys)


def _choices(node: ObjectNode, texts: tuple[str, ...], prose: Prose) -> tuple[model.Choice, ...]:
    feedback = prose.each_item(node.get("feedback"))
    keys = unique_keys(("option", text) for text in texts)
    return tuple(
        model.Choice(item.span, key, prose.inlines(item), text)
        for item, key, text in zip(
            node.items("options"), keys, chain(feedback, repeat(())), strict=False
        )
    )


def text_key(kind: str, text: str) -> str:
    """Return the key of a text of a kind (`mcq`, `option`), whatever its white space."""
    normalized_text = unicodedata.normalize("NFC", " ".join(text.split()))
    return key_of(f"{kind}\n{normalized_text}")[:8]  # few, as addresses hold it


def unique_keys(texts: Iterable[tuple[str, str]], used_keys: Iterable[str] = ()) -> Iterator[str]:
    """Yield the keys of texts, given as (kind, text); a key already in use gets a number."""
    all_keys = set(used_keys)
    for kind, text in texts:
        key = unique_name(text_key(kind, text), all_keys)
        all_keys.add(key)
        yield key
