"""`quiz` fences."""

from __future__ import annotations

from dataclasses import dataclass, field

from coursebuild.core.model import Block, Inline, Paragraph, Text
from coursebuild.core.text.diagnostics import Parsed, diagnose
from coursebuild.core.text.source import Excerpt, Source, Span
from coursebuild.features.quiz.model import Quiz
from coursebuild.features.quiz.parse import parse_quiz


@dataclass
class Plain:
    """A parser of texts to which all is text, and `BAD` a mistake."""

    asked: list[tuple[str, str]] = field(default_factory=list)

    def blocks(self, excerpt: Excerpt) -> Parsed[tuple[Block, ...]]:
        inner = self.inlines(excerpt)
        self.asked[-1] = ("blocks", excerpt.text)
        return Parsed((Paragraph(excerpt.span(), inner.value),), inner.diagnostics)

    def inlines(self, excerpt: Excerpt) -> Parsed[tuple[Inline, ...]]:
        self.asked.append(("inlines", excerpt.text))
        at = excerpt.text.find("BAD")
        found = (diagnose("math-syntax", excerpt.span(at, at + 3), "bad"),) if at >= 0 else ()
        return Parsed((Text(excerpt.span(), excerpt.text),), found)


def fence(body: str, prefix: str = "", newline: str = "\n") -> tuple[Span, Excerpt]:
    """The body between fences, each line after a prefix, from the third line on."""
    rows = ["Before.", "```quiz", *(body.split("\n") if body else []), "```", "After."]
    text = newline.join(prefix + row for row in rows) + newline
    source = Source("content/lessons/4.2-x.md", text)
    starts = source.line_starts
    inner = [(row, starts[i + 2] + len(prefix)) for i, row in enumerate(rows[2:-2])]
    last = len(rows) - 2
    span = source.span(starts[1] + len(prefix), starts[last] + len(prefix) + 3)
    if inner:
        return span, Excerpt.of_lines(source, inner)
    return span, Excerpt.of_span(source.span(starts[2], starts[2]))


def parse(body: str, prefix: str = "", newline: str = "\n") -> Parsed[Quiz | None]:
    return parse_quiz(*fence(body, prefix, newline), Plain())


MCQ = '{"kind": "mcq", "q": "Q", "options": ["a", "b"], %s}'
