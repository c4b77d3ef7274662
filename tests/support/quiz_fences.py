"""`quiz` fences, as a lesson's reader reads them."""

from __future__ import annotations

from coursebuild.core.model import document_blocks
from coursebuild.core.syntax.document import parse_document
from coursebuild.core.text.diagnostics import Parsed
from coursebuild.core.text.source import Source
from coursebuild.features.quiz.model import Quiz


def parse(body: str, prefix: str = "", newline: str = "\n") -> Parsed[Quiz | None]:
    """A quiz from the third line of a lesson on, each line after a prefix."""
    rows = ["Before.", "```quiz", *(body.split("\n") if body else []), "```", "After."]
    text = newline.join(prefix + row for row in rows) + newline
    result = parse_document(Source("content/lessons/4.2-x.md", text), frozenset(), lesson=True)
    quizzes = (block for block in document_blocks(result.value) if isinstance(block, Quiz))
    return Parsed(next(quizzes, None), result.diagnostics)


MCQ = '{"kind": "mcq", "q": "Q", "options": ["a", "b"], %s}'
