"""What the parsers of quizzes and labs need from Markdown, without knowing how it is parsed.

Entry points: `TextParser`, `Prose.read`. The parser of a document hands itself in this shape to
`parse_quiz` and `parse_lab`, so that their texts share the document's footnotes, anchors and rules.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Protocol

from msgspec import Struct

from coursebuild.core.model import Block, Inline
from coursebuild.core.syntax.nodes import ArrayNode, Node, StringNode
from coursebuild.core.text.diagnostics import Diagnostic, Parsed
from coursebuild.core.text.source import Excerpt


class TextParser(Protocol):
    """Markdown inside another language: every node's span points at the lesson's own text."""

    def blocks(self, excerpt: Excerpt) -> Parsed[tuple[Block, ...]]:
        """The blocks of a text; math between the tags of HTML is math. Never raises."""
        ...

    def inlines(self, excerpt: Excerpt) -> Parsed[tuple[Inline, ...]]:
        """The inlines of a text of at most one paragraph; line ends are soft. Never raises."""
        ...


class Prose(Struct, frozen=True):
    """The Markdown strings inside a quiz or a lab, each parsed once."""

    _read: dict[Node, tuple[Any, ...]]
    diagnostics: tuple[Diagnostic, ...]

    @classmethod
    def read(cls, texts: Iterable[tuple[StringNode, str]], parser: TextParser) -> Prose:
        """Parse each text, `blocks` or `inlines`; a blank one says nothing."""
        parsed = {
            node: parser.blocks(node.excerpt) if kind == "blocks" else parser.inlines(node.excerpt)
            for node, kind in texts
            if node.value.strip()
        }
        found = tuple(wrong for one in parsed.values() for wrong in one.diagnostics)
        return cls({node: one.value for node, one in parsed.items()}, found)

    def blocks(self, node: Node | None) -> tuple[Block, ...]:
        """The blocks of a string; none for a field that is not given."""
        return () if node is None else self._read.get(node, ())

    def inlines(self, node: Node | None) -> tuple[Inline, ...]:
        """The inlines of a string; none for a field that is not given."""
        return () if node is None else self._read.get(node, ())

    def each_item(self, node: Node | None) -> tuple[tuple[Any, ...], ...]:
        """What the strings of an array hold, blocks or inlines, one after the other."""
        items = node.items if isinstance(node, ArrayNode) else ()
        return tuple(self._read.get(item, ()) for item in items)
