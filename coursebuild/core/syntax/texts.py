"""What the parsers of quizzes and labs need from Markdown, without knowing how it is parsed.

Entry point: `TextParser`. The parser of a document hands itself in this shape to `parse_quiz` and
`parse_lab`, so that their texts share the document's footnotes, anchors and rules.
"""

from __future__ import annotations

from typing import Protocol

from coursebuild.core.model import Block, Inline
from coursebuild.core.text.diagnostics import Parsed
from coursebuild.core.text.source import Excerpt


class TextParser(Protocol):
    """Markdown inside another language: every node's span points at the lesson's own text."""

    def blocks(self, excerpt: Excerpt) -> Parsed[tuple[Block, ...]]:
        """The blocks of a text; math between the tags of HTML is math. Never raises."""
        ...

    def inlines(self, excerpt: Excerpt) -> Parsed[tuple[Inline, ...]]:
        """The inlines of a text of at most one paragraph; line ends are soft. Never raises."""
        ...
