"""The Markdown inside a quiz or a lab, parsed once.

Entry point: `Prose.read(texts, parser)`.
"""

from __future__ import annotations

from collections.abc import Iterable

from msgspec import Struct

from coursebuild.core.model import Block, Inline
from coursebuild.core.syntax.nodes import ArrayNode, Node, StringNode
from coursebuild.core.syntax.texts import TextParser
from coursebuild.core.text.diagnostics import Diagnostic


class Prose(Struct, frozen=True):
    """What each marked string says."""

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
