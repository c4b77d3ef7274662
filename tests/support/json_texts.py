"""JSON that is read as the text of a lesson."""

from __future__ import annotations

from coursebuild.core.syntax.json_text import parse_json
from coursebuild.core.syntax.nodes import Node
from coursebuild.core.text.diagnostics import Parsed
from coursebuild.core.text.source import Excerpt, Source


def parse(text: str) -> Parsed[Node | None]:
    source = Source("lesson.md", text)
    return parse_json(Excerpt.of_span(source.span()), source.span(0, 0))
