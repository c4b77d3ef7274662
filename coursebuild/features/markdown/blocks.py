"""Writes blocks and inlines as CommonMark with tables, footnotes and `$`, for readers elsewhere.

Entry point: `BlockWriter`, whose subclasses decide where links lead and how the course's own blocks
are written.

1. A text that has no escapes or entities is copied from its source, where it was read as text
   between the same neighbours. In any other text (also that from JSON) all marks are escaped.
2. What can begin another block at the start of a line is escaped when a paragraph is complete.
3. Containers indent their blocks.
"""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Iterable
from typing import Literal, TypeAlias, assert_never

from coursebuild.core import model
from coursebuild.core.pages.marks import (
    block_quote,
    code_span,
    escape_marks,
    fence,
    guard_lines,
    hang,
    link,
    picture,
    table,
)
from coursebuild.core.pages.markup import SpecialBlock, escape, is_tight, raw_html

_SPACED_BLOCKS = (
    *(model.Callout, model.PlainCode, model.Script, model.Recording, model.Mjcf),
    *(model.FeatureBlock, model.HtmlBlock, model.Table, model.MathBlock),
)
"""Blocks with empty lines around them, even in a tight list."""

_Room: TypeAlias = Literal["block", "line", "cell"]
"""What inlines may fill: lines of their own, a single line, or a cell of a table."""
_LAST_MARKS = re.compile(r"(^|\s)(#+)$")
_ALWAYS_ESCAPED = re.compile(r"[$`]")
"""Marks that other readers of Markdown may understand where ours reads text."""
_PIPE = re.compile(r"(?<!\\)\|")
_COMMENT = re.compile(r"(?<!\\)%")
_MINUS = re.compile(r"(?<!\w)-(?=\d)")


class BlockWriter(ABC):
    """Writes blocks; the abstract methods are for what depends on the purpose of the Markdown."""

    @abstractmethod
    def href(self, target: model.Target) -> str:
        """Return the address of a link."""

    @abstractmethod
    def url(self, url: str) -> str:
        """Return the address of a picture whose source says `url`."""

    @abstractmethod
    def reference(self, note: int) -> str:
        """Return a reference to a footnote."""

    @abstractmethod
    def link_text(self, target: model.Target) -> str:
        """Return the text for a link without one: the number of a formula, or nothing."""

    @abstractmethod
    def formula_number(self, start: int) -> str:
        """Return the number to be shown with the formula at an offset; empty for none."""

    def citation(self, citation: model.Citation) -> str:
        """Return a citation of sources."""
        return escape_marks(citation.span.text)

    def number(self, label: model.Label | None) -> str:
        """Return the name that a label gives, such as "Figure 4.2.3"; empty for none."""
        return ""

    @abstractmethod
    def own_block(self, block: SpecialBlock) -> str:
        """Write one of the course's own blocks, without its last line end; may be empty."""

    def inlines(self, inlines: Iterable[model.Inline]) -> str:
        """Write inlines on one line, such as a title."""
        return " ".join(self._inlines(inlines, "line").split("\n")).strip()

    def footnotes(self, footnotes: Iterable[model.Footnote]) -> str:
        """Write the definitions of footnotes, for references such as `[^1]`."""
        return "\n\n".join(
            hang(f"[^{note.number}]: ", self.blocks(note.blocks), 4) for note in footnotes
        )

    # --- blocks

    def blocks(self, blocks: Iterable[model.Block], *, tight: bool = False) -> str:
        """Write blocks, without the last line end."""
        text, previous = "", None
        for block in blocks:
            block_text = self._block(block, previous)
            if block_text and text:
                is_apart = (
                    not tight
                    or isinstance(previous, _SPACED_BLOCKS)
                    or isinstance(block, _SPACED_BLOCKS)
                )
                text += "\n\n" if is_apart else "\n"
            if block_text:
                text += block_text
                previous = block
        return text

    def _block(self, block: model.Block, previous: model.Block | None = None) -> str:
        match block:
            case model.Heading():
                return self._heading(block)
            case model.Paragraph():
                text = self._inlines(block.children)
                if number := self.number(block.label):
                    text = text.removeprefix("Figure:").lstrip()
                    text = f"**{escape_marks(number)}:** {text}"
                return text
            case model.HtmlFlow():
                return "".join(map(self._in_html, block.children))
            case model.ListBlock():
                return self._list(block, after_list=isinstance(previous, model.ListBlock))
            case model.BlockQuote():
                return block_quote(self.blocks(block.blocks))
            case model.CodeBlock():
                code = fence(re.sub(r"[\s`]", "", block.language), block.code.text)
                return self.below_caption(block, code)
            case model.HtmlBlock():
                return raw_html(block, self.url).rstrip("\n")
            case model.ThematicBreak():
                return "___"
            case model.MathBlock():
                tex, tag = _remove_empty_lines(block.tex.text), self._tag(block.span.start)
                return "\n".join(filter(None, ("$$", tex, tag, "$$")))
            case model.Table():
                return self.below_caption(block, self._table(block), self.inlines(block.caption))
            case _:
                return self.own_block(block)

    def below_caption(self, block: model.Labelled, text: str, caption: str = "") -> str:
        """Write a block below its number and its caption, if it has one of the two."""
        if number := self.number(block.label):
            caption = f"**{escape_marks(number)}:** {caption}".rstrip()
        return f"{caption}\n\n{text}" if caption else text

    def _in_html(self, inline: model.Inline) -> str:
        """Write an inline within HTML, where text is no Markdown."""
        if isinstance(inline, model.Text):
            return escape(inline.text)
        return self._inline(inline, "block")

    def _heading(self, heading: model.Heading) -> str:
        text = _LAST_MARKS.sub(r"\1\\\2", self.inlines(heading.children))
        return f"{'#' * heading.level} {text}".rstrip()

    def _list(self, block: model.ListBlock, *, after_list: bool) -> str:
        """Write a list; directly after another list it has different marks, to stay separate."""
        number, mark = block.start, "*" if after_list else "-"
        tight = all(
            is_tight(inner) or not isinstance(inner, model.Paragraph)
            for item in block.items
            for inner in item.blocks
        )
        items: list[str] = []
        for item in block.items:
            if number is not None:
                mark = f"{number}{')' if after_list else '.'}"
                number += 1
            items.append(self._item(f"{mark} ", item, tight=tight))
        return ("\n" if tight else "\n\n").join(items)

    def _item(self, mark: str, item: model.ListItem, *, tight: bool) -> str:
        text = self.blocks(item.blocks, tight=tight)
        if item.checked is not None:
            text = f"[{'x' if item.checked else ' '}] {text or '&nbsp;'}"
        elif item.blocks and isinstance(item.blocks[0], model.ListBlock):
            text = f"\n{text}"  # three marks on one line would be a thematic break
        return hang(mark, text, len(mark))

    def _table(self, block: model.Table) -> str:
        rows = (map(self._cell, row) for row in block.rows)
        return table(map(self._cell, block.header), rows, (align or "" for align in block.align))

    def _cell(self, cell: model.Cell) -> str:
        return self._inlines(cell.children, "cell").replace("\n", " ")

    # --- inlines

    def _inlines(self, inlines: Iterable[model.Inline], room: _Room = "block") -> str:
        text = self._join_inlines(inlines, room)
        return guard_lines(text) if room == "block" else text

    def _join_inlines(self, inlines: Iterable[model.Inline], room: _Room) -> str:
        return "".join([self._inline(inline, room) for inline in inlines])

    def _inline(self, inline: model.Inline, room: _Room) -> str:
        match inline:
            case model.Text():
                return _text(inline, room)
            case model.SoftBreak():
                return "\n" if room == "block" else " "
            case model.HardBreak():
                if room != "block":
                    return " "
                return "\\\n" if inline.span.text.startswith("\\") else "  \n"
            case model.CodeSpan():
                source = inline.span.text
                ticks = source[: len(source) - len(source.lstrip("`"))]
                return _escape_pipes(code_span(inline.text, ticks), room)
            case model.NumberBinding():
                return escape_marks(_MINUS.sub("\u2212", inline.text))
            case model.Math():
                tag = self._tag(inline.span.start) if inline.display else ""
                return _formula(inline, tag, room)
            case model.Emphasis() | model.Strong() | model.Term() | model.Strikethrough():
                mark = _delimiter(inline)
                return f"{mark}{self._join_inlines(inline.children, room)}{mark}"
            case model.Link():
                text = self._join_inlines(inline.children, room)
                return self._link(inline, text, room)
            case model.Image():
                url = self.url(inline.url)
                return _escape_pipes(picture(inline.alt, url, inline.title), room)
            case model.RawInline():
                return _escape_pipes(raw_html(inline, self.url), room)
            case model.FootnoteRef():
                return self.reference(inline.number)
            case model.Citation():
                return _escape_pipes(self.citation(inline), room)
            case _:
                assert_never(inline)

    def _tag(self, start: int) -> str:
        number = self.formula_number(start)
        return f"\\tag{{{number}}}" if number else ""

    def _link(self, node: model.Link, text: str, room: _Room) -> str:
        source = node.span.text
        if source == f"<{model.plain_text(node.children)}>" and room != "cell":
            return source
        href = self.href(node.target)
        text = text or escape_marks(self.link_text(node.target))
        return link(text, href.replace("|", "%7C") if room == "cell" else href, node.title)


def _text(node: model.Text, room: _Room) -> str:
    """Write a text, copied from its source if that is the same."""
    source = node.span.text
    if source != node.text:
        text = escape_marks(node.text)
        if text[:1].isspace() and not source[:1].isspace():
            text = f"&#{ord(text[0])};{text[1:]}"
        if text[-1:].isspace() and not source[-1:].isspace():
            text = f"{text[:-1]}&#{ord(text[-1])};"
        return text.replace("\n", "&#10;")
    source = _ALWAYS_ESCAPED.sub(lambda match: f"\\{match[0]}", source)
    return _escape_pipes(source, room)


def _escape_pipes(text: str, room: _Room) -> str:
    """Escape the pipes of a text in a cell of a table."""
    return _PIPE.sub(r"\\|", text) if room == "cell" else text


def _delimiter(node: model.Emphasis | model.Strong | model.Term | model.Strikethrough) -> str:
    """Return the marks around a text; those of emphasis are as in its source."""
    if isinstance(node, model.Strikethrough):
        return "~~"
    mark = "_" if node.span.text[:1] == "_" else "*"
    return mark * 2 if isinstance(node, model.Strong) else mark


def _formula(node: model.Math, tag: str, room: _Room) -> str:
    """Write a formula between dollar signs, with its number if it has one."""
    tex = f"{node.tex.text}\n{tag}" if tag else node.tex.text  # it can end with a comment
    if room == "cell":  # a pipe would end the cell, and an escaped one is another sign
        tex = tex.replace(r"\|", r"\Vert{}").replace("|", r"\vert{}")
    if _COMMENT.search(tex):  # the line end ends the comment
        tex = _remove_empty_lines(tex)
    elif "\n" in tex:
        tex = " ".join(part.strip() for part in tex.split("\n"))
    return f"$${tex}$$" if node.display else f"${tex}$"


def _remove_empty_lines(tex: str) -> str:
    """Remove empty lines from TeX: a formula would end there."""
    return "\n".join(line for line in tex.split("\n") if line.strip())
