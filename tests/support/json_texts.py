"""JSON that is read as the text of a lesson."""

from __future__ import annotations

from coursebuild.diagnostics import Parsed
from coursebuild.source import Excerpt, Source
from coursebuild.syntax.json_text import parse_json
from coursebuild.syntax.nodes import Node


def parse(text: str) -> Parsed[Node | None]:
    source = Source("lesson.md", text)
    return parse_json(Excerpt.of_span(source.span()), source.span(0, 0))
