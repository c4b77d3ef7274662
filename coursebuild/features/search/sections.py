"""Splits a page into the sections that are searched.

Entry point: `SectionReader`, which reads a document, or HTML where a page shows none.

1. The blocks are walked in order, those in containers too; a heading begins a section.
2. Formulas become lines of plain text (`tex`); the section is also found by their commands.
3. Answers and explanations of quizzes are left out: a search must not give them away.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from html import unescape
from typing import Literal, assert_never

from msgspec import Struct

from coursebuild.core import model
from coursebuild.core.model.inlines import CodeSpan
from coursebuild.core.pages.html_tree import HtmlContent, parse_html
from coursebuild.core.registry import kind_of_block
from coursebuild.features.search.words import plain_formula


class SectionPiece(Struct, frozen=True):
    """A paragraph, a listing, a formula, an output."""

    kind: Literal["text", "code", "formula", "output"]
    text: str


class Section(Struct, frozen=True):
    """A heading with the content up to the next heading."""

    anchor: str
    """The anchor of its heading; empty before the first heading."""
    heading: str
    level: int
    """The level of its heading, from 1; 0 where there is none."""
    pieces: tuple[SectionPiece, ...]
    names: tuple[str, ...] = ()
    """Names that it is found by and that are not shown: of TeX commands, of files."""


_TAG = re.compile(r"<!--.*?-->|<(script|style)\b.*?</\1>|<[^>]*>", re.DOTALL | re.IGNORECASE)


_HEADINGS = {f"h{level}": level for level in range(1, 7)}
_SKIPPED_ELEMENTS = frozenset(
    ("script", "style", "nav", "svg", "pre", "template", "button", "select")
)
"""Elements that are not searched; code comes from the page's inputs."""
_LINES = frozenset(
    "p li dt dd td th tr table ul ol dl div section article figure figcaption summary main".split()
)


class SectionReader:
    """Collects the sections of a page."""

    def __init__(
        self, labels: Mapping[str, str] = {}, block_values: Mapping[int, Struct] = {}
    ) -> None:
        """Begin a page.

        Args:
            labels: the labels of the kinds of callouts, by name.
            block_values: the values of features' blocks, by the block's offset.
        """
        self._labels = labels
        self._block_values = block_values
        self._sections: list[Section] = []
        self._text = ""
        """The text of HTML since its last line."""
        self._begin("", "", 0)

    def _begin(self, anchor: str, heading: str, level: int) -> None:
        self._head = anchor, heading, level
        self._pieces: list[SectionPiece] = []
        self._names: dict[str, None] = {}

    def end(self) -> tuple[Section, ...]:
        """End the section, unless it has neither heading nor content, and return all sections."""
        if any(self._head) or self._pieces:
            section = Section(*self._head, tuple(self._pieces), tuple(self._names))
            self._sections.append(section)
        return tuple(self._sections)

    def add(self, kind: Literal["text", "code", "formula", "output"], text: str) -> None:
        """Add a piece to the section, unless it is empty."""
        text = text.strip("\n").rstrip() if kind in ("code", "output") else _line(text)
        if text:
            self._pieces.append(SectionPiece(kind, text))

    def add_name(self, name: str) -> None:
        """Add a name by which the section is found too."""
        self._names[name] = None

    def values(self, block: model.FeatureBlock) -> Struct | None:
        """Return the result of `FenceKind.values` for a block."""
        return self._block_values.get(block.span.start)

    def document(self, document: model.Document) -> None:
        """Read a full document, not its summary."""
        self.blocks(document.blocks)
        for footnote in document.footnotes:
            self.blocks(footnote.blocks)

    def blocks(self, blocks: Iterable[model.Block]) -> None:
        """Read blocks in order."""
        for block in blocks:
            self._block(block)

    def _block(self, block: model.Block) -> None:
        match block:
            case model.Paragraph() | model.HtmlFlow():
                self.add("text", self.text(block.children))
            case model.Heading():
                heading = _line(self.text(block.children))
                self.end()
                self._begin(block.anchor, heading, block.level)
            case model.ListBlock() | model.BlockQuote():
                self.blocks(model.child_blocks(block))
            case model.Callout():
                label = self._labels.get(block.kind, block.kind)
                self.add("text", f"{label}: {self.text(block.title)}" if block.title else label)
                self.blocks(block.blocks)
            case model.MathBlock():
                self.add("formula", self._formula(block.tex.text))
            case model.Table():
                for row in (block.header, *block.rows):
                    self.add("text", " | ".join(self.text(cell.children) for cell in row))
            case model.HtmlBlock():
                self.add("text", unescape(_TAG.sub(" ", block.html)))
            case model.ThematicBreak():
                pass
            case model.CodeBlock() | model.PlainCode() | model.Mjcf():
                self.add("code", block.code.text)
            case model.Script():
                self._names[block.path] = None
                self.add("code", block.code.text)
            case model.Recording():
                if isinstance(block.body, model.Table):
                    self._block(block.body)
                else:
                    self.add("output", block.body.text)
            case model.FeatureBlock():
                kind_of_block(block).index(self, block)
            case _:
                assert_never(block)

    def _formula(self, tex: str) -> str:
        text, names = plain_formula(tex)
        self._names |= dict.fromkeys(names)
        return text

    def text(self, inlines: Iterable[model.Inline]) -> str:
        """Return the text of inlines, as the search has it."""
        return "".join(map(self._inline, model.walk_inlines(inlines)))

    def _inline(self, inline: model.Inline) -> str:
        match inline:
            case model.Text() | CodeSpan() | model.NumberBinding():
                return inline.text
            case model.Math():
                if inline.meaning is not None:
                    self._names[inline.meaning.text] = None
                return self._formula(inline.tex.text)
            case model.SoftBreak() | model.HardBreak():
                return " "
            case model.Image():
                return inline.alt
            case model.RawInline():
                return " " if inline.html.lower().startswith("<br") else ""
            case _:
                return ""

    # --- HTML

    def html(self, body: str) -> None:
        """Read the body of a page: headings begin sections, other blocks begin lines."""
        self._elements(parse_html(body))
        self._end_line()

    def _elements(self, content: Iterable[HtmlContent]) -> None:
        for child in content:
            if isinstance(child, str):
                self._text += child
            elif child.name in _HEADINGS:
                self._end_line()
                self._elements(child.children)
                heading, self._text = _line(self._text), ""
                if child.name != "h1":  # the page's title
                    self.end()
                    id = child.attributes.get("id", "")
                    self._begin(id, heading, _HEADINGS[child.name])
            elif child.name in _LINES:
                self._end_line()
                self._elements(child.children)
                self._end_line()
            elif child.name not in _SKIPPED_ELEMENTS:
                self._elements(child.children)

    def _end_line(self) -> None:
        self.add("text", self._text)
        self._text = ""


def _line(text: str) -> str:
    return " ".join(text.split())
