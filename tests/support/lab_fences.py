"""`lab` fences, and what an author is told of them."""

from __future__ import annotations

from coursebuild.core.model import Block, Inline, Paragraph, Text
from coursebuild.core.text.diagnostics import Parsed
from coursebuild.core.text.source import Excerpt, Source
from coursebuild.features.lab.model import Lab
from coursebuild.features.lab.parse import parse_lab
from support.positioned_nodes import shown


class Plain:
    """A parser of texts to which all is text."""

    def blocks(self, excerpt: Excerpt) -> Parsed[tuple[Block, ...]]:
        return Parsed((Paragraph(excerpt.span(), self.inlines(excerpt).value),))

    def inlines(self, excerpt: Excerpt) -> Parsed[tuple[Inline, ...]]:
        return Parsed((Text(excerpt.span(), excerpt.text),))


def parse(body: str, kind: str = "simlab") -> Parsed[Lab | None]:
    """The lab whose JSON begins in the second line."""
    source = Source("content/lessons/4.2-x.md", f"```lab {kind}\n{body}\n```\n")
    span = source.span(0, len(source.text) - 1)
    start = source.text.index("\n") + 1
    inner = Excerpt.of_span(source.span(start, start + len(body)))
    return parse_lab(span, kind, source.span(7, 7 + len(kind)), inner, Plain())


def told(body: str, kind: str = "simlab") -> list[str]:
    return shown(parse(body, kind).diagnostics)
