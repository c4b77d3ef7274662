"""Texts with the nodes, values and mistakes that are read from them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from coursebuild.core.model import FeatureBlock, document_blocks
from coursebuild.core.syntax.document import parse_document
from coursebuild.core.syntax.json_text import parse_json
from coursebuild.core.syntax.nodes import (
    ArrayNode,
    BoolNode,
    DateNode,
    Node,
    NullNode,
    NumberNode,
    ObjectNode,
    StringNode,
)
from coursebuild.core.text.diagnostics import Diagnostic, Parsed
from coursebuild.core.text.source import Excerpt, Source
from coursebuild.features.lab.model import Lab
from coursebuild.features.quiz.model import Quiz
from support.fixture_cases import check_lines

FOLDER = Path(__file__).parents[1] / "fixtures" / "texts"

Reader = Callable[[str], tuple[object, tuple[Diagnostic, ...]]]
"""Reads a text: returns its value, or None if it has none, and its diagnostics."""


def check_texts(name: str, read: Reader, *, rewriting: bool) -> None:
    def convert(text: str) -> list[str]:
        value, diagnostics = read(text)
        return format_diagnostics(diagnostics) + ["and it is read"] * (value is not None)

    check_lines(FOLDER / f"{name}.md", convert, rewriting=rewriting)


def format_diagnostics(diagnostics: tuple[Diagnostic, ...]) -> list[str]:
    """Each mistake in a line: its place, rule, message and help."""
    return [
        f"{d.span.line}:{d.span.column}-{d.span.end_column} {d.rule}: {d.message}"
        + (f" [{d.help}]" if d.help else "")
        for d in diagnostics
    ]


def plain(node: Node) -> object:
    """The value as `json.loads` and `tomllib.loads` give it, but for dates."""
    match node:
        case ObjectNode():
            return {name: plain(member.value) for name, member in node.members.items()}
        case ArrayNode():
            return [plain(item) for item in node.items]
        case StringNode():
            assert node.excerpt.text == node.value
            return node.value
        case NumberNode() | BoolNode():
            return node.value
        case NullNode():
            return None
        case DateNode():
            return "a date"
        case _:
            raise AssertionError(node)


B = TypeVar("B", bound=FeatureBlock)
MCQ = '{"kind": "mcq", "q": "Q", "options": ["a", "b"], %s}'


def parse_text(text: str) -> Parsed[Node | None]:
    source = Source("lesson.md", text)
    return parse_json(Excerpt.of_span(source.span()), source.span(0, 0))


def parse_lab(body: str, kind: str = "simlab") -> Parsed[Lab | None]:
    """The lab whose JSON begins in the second line of a lesson."""
    return _parse_block(Lab, f"```lab {kind}\n{body}\n```\n")


def parse_quiz(body: str, prefix: str = "", newline: str = "\n") -> Parsed[Quiz | None]:
    """A quiz from the third line of a lesson on, each line after a prefix."""
    rows = ["Before.", "```quiz", *(body.split("\n") if body else []), "```", "After."]
    return _parse_block(Quiz, newline.join(prefix + row for row in rows) + newline)


def _parse_block(kind: type[B], text: str) -> Parsed[B | None]:
    result = parse_document(Source("content/lessons/4.2-x.md", text), frozenset(), lesson=True)
    blocks = (block for block in document_blocks(result.value) if isinstance(block, kind))
    return Parsed(next(blocks, None), result.diagnostics)
