"""Formats texts (`format_text`), and checks that readers see no difference (`check_formatting`)."""

from __future__ import annotations

import json
import re

from coursebuild.core.syntax.document import parse_document
from coursebuild.core.text.diagnostics import Parsed
from coursebuild.core.text.source import Source
from coursebuild.features.authoring.format import format_document
from coursebuild.features.lab.model import Lab
from coursebuild.features.quiz.model import Quiz
from support.plain_html import plain_html
from support.random_lessons import KINDS


def format_text(text: str, width: int, lesson: bool = True) -> Parsed[str]:
    source = Source("content/lessons/1.1-a.md", text)
    return format_document(source, KINDS, lesson=lesson, width=width)


def check_formatting(text: str, width: int, lesson: bool) -> None:
    """Check that a reader sees the same, and that formatting once more changes nothing."""
    result = format_text(text, width, lesson)
    if result.diagnostics:
        assert result.value == text
    else:
        assert reader_view(result.value, lesson) == reader_view(text, lesson)
        assert format_text(result.value, width, lesson) == Parsed(result.value)


def reader_view(text: str, lesson: bool) -> list[object]:
    """Return the page as HTML, with white space folded outside of code, and the JSON in fences."""
    document = parse_document(Source("content/lessons/1.1-a.md", text), KINDS, lesson=lesson).value
    parts = re.split(r"(<pre.*?</pre>)", str(plain_html(document)), flags=re.DOTALL)
    html = [part if part.startswith("<pre") else " ".join(part.split()) for part in parts]
    fences = [b.span.text.split("\n", 1)[1] for b in document.blocks if isinstance(b, Lab | Quiz)]
    return [html, *(json.loads(text[:-3]) for text in fences if text.startswith("{"))]
