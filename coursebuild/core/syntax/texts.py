"""Markdown inside fences of features, which need not know how it is parsed.

Entry points: `TextParser`, `Prose.read`. The parser of a document gives features a `TextParser`, so
that texts in quizzes and labs share the document's footnotes, anchors and rules.
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
    """Parses Markdown inside another language; the spans of nodes point into the lesson."""

    def blocks(self, excerpt: Excerpt) -> Parsed[tuple[Block, ...]]:
        """The blocks of a text; math between the tags of HTML is math. Never raises."""
        ...

    def inlines(self, excerpt: Excerpt) -> Parsed[tuple[Inline, ...]]:
        """The inlines of a text of at most one paragraph; line ends are soft. Never raises."""
        ...


class Prose(Struct, frozen=True):
    """The Markdown strings inside a quiz or a lab, each parsed once."""

    _content: dict[Node, tuple[Any, ...]]
    diagnostics: tuple[Diagnostic, ...]

    @classmethod
    def read(cls, texts: Iterable[tuple[StringNode, str]], parser: TextParser) -> Prose:
        """Parse each text as `blocks` or `inlines`, but for blank ones."""
        content: dict[Node, tuple[Any, ...]] = {}
        diagnostics: list[Diagnostic] = []
        for node, kind in texts:
            if node.value.strip():
                parse = parser.blocks if kind == "blocks" else parser.inlines
                parsed_text: Parsed[tuple[Any, ...]] = parse(node.excerpt)
                content[node] = parsed_text.value
                diagnostics += parsed_text.diagnostics
        return cls(content, tuple(diagnostics))

    def blocks(self, node: Node | None) -> tuple[Block, ...]:
        """The blocks of a string; none for a field that is not given."""
        return () if node is None else self._content.get(node, ())

    def inlines(self, node: Node | None) -> tuple[Inline, ...]:
        """The inlines of a string; none for a field that is not given."""
        return () if node is None else self._content.get(node, ())

    def each_item(self, node: Node | None) -> tuple[tuple[Any, ...], ...]:
        """The blocks or inlines of each string of an array."""
        items = node.items if isinstance(node, ArrayNode) else ()
        return tuple(self._content.get(item, ()) for item in items)
