"""What the parsers of quizzes and labs need from Markdown, without knowing how it is parsed.

Entry points: `TextParser`, `Prose.read`. The parser of a document hands itself in this shape to
`parse_quiz` and `parse_lab`, so that their texts share the document's footnotes, anchors and rules.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Protocol

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

    _blocks: dict[Node, tuple[Block, ...]]
    _inlines: dict[Node, tuple[Inline, ...]]
    diagnostics: tuple[Diagnostic, ...]

    @classmethod
    def read(cls, texts: Iterable[tuple[StringNode, str]], parser: TextParser) -> Prose:
        """Parse each text, `blocks` or `inlines`; a blank one says nothing."""
        blocks: dict[Node, tuple[Block, ...]] = {}
        inlines: dict[Node, tuple[Inline, ...]] = {}
        found: list[Diagnostic] = []
        for node, kind in texts:
            if not node.value.strip():
                continue
            if kind == "blocks":
                whole = parser.blocks(node.excerpt)
                blocks[node] = whole.value
                found += whole.diagnostics
            else:
                line = parser.inlines(node.excerpt)
                inlines[node] = line.value
                found += line.diagnostics
        return cls(blocks, inlines, tuple(found))

    def blocks(self, node: Node | None) -> tuple[Block, ...]:
        """The blocks of a string; none for a field that is not given."""
        return self._blocks.get(node, ()) if node is not None else ()

    def inlines(self, node: Node | None) -> tuple[Inline, ...]:
        """The inlines of a string; none for a field that is not given."""
        return self._inlines.get(node, ()) if node is not None else ()

    def each_blocks(self, node: Node | None) -> tuple[tuple[Block, ...], ...]:
        """The blocks of each string of an array."""
        return tuple(self.blocks(item) for item in _items(node))

    def each_inlines(self, node: Node | None) -> tuple[tuple[Inline, ...], ...]:
        """The inlines of each string of an array."""
        return tuple(self.inlines(item) for item in _items(node))


def _items(node: Node | None) -> tuple[Node, ...]:
    return node.items if isinstance(node, ArrayNode) else ()
