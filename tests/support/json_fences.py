"""JSON, and `lab` and `quiz` fences, read as the text of a lesson."""

from __future__ import annotations

from typing import TypeVar

from coursebuild.core.model import FeatureBlock, document_blocks
from coursebuild.core.syntax.document import parse_document
from coursebuild.core.syntax.json_text import parse_json
from coursebuild.core.syntax.nodes import Node
from coursebuild.core.text.diagnostics import Parsed
from coursebuild.core.text.source import Excerpt, Source
from coursebuild.features.lab.model import Lab
from coursebuild.features.quiz.model import Quiz

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
