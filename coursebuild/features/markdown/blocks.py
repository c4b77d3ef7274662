"""Blocks and inlines as Markdown that needs no course: CommonMark with tables, footnotes and `$`.

Entry point: `BlockWriter`, of which each kind says where links lead and what our own blocks become.

1. A text that stands in the source as it reads is written as it stands there: it was read as text
   once, between the same neighbours. Any other (with escapes or entities in it, or out of JSON) has
   all its marks escaped.
2. What may begin another block where a line begins is escaped when the paragraph is put together.
3. Containers indent what they hold.
"""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Iterable
from typing import assert_never

from coursebuild.core import model
from coursebuild.core.pages.html_context import OwnBlock
from coursebuild.core.pages.marks import (
    code_span,
    escaped,
    fence,
    guarded,
    hang,
    link,
    picture,
    quoted,
    table,
)
from coursebuild.core.pages.markup import escape, is_tight, raw_html

_APART = (
    *(model.Callout, model.PlainCode, model.Script, model.Recording, model.Mjcf),
    *(model.FeatureBlock, model.HtmlBlock, model.Table, model.MathBlock),
)
"""Blocks that an empty line parts from others, even in a tight list."""

_LAST_MARKS = re.compile(r"(^|\s)(#+)$")
_ALWAYS = re.compile(r"[$`]")
"""What is escaped wherever it is text: another reader may see more in it than ours did."""
_PIPE = re.compile(r"(?<!\\)\|")
_COMMENT = re.compile(r"(?<!\\)%")
_MINUS = re.compile(r"(?<!\w)-(?=\d)")


class BlockWriter(ABC):
    """Writes blocks; a kind of its own says what depends on where the Markdown goes."""

    @abstractmethod
    def href(self, target: model.Target) -> str:
        """The address of a link."""

    @abstractmethod
    def url(self, url: str) -> str:
        """The address of a picture that is written as `url`."""

    @abstractmethod
    def reference(self, note: int) -> str:
        """A reference to a footnote."""

    @abstractmethod
    def named(self, target: model.Target) -> str:
        """What a link without a text says: the number of a formula; empty for none."""

    @abstractmethod
    def number(self, start: int) -> str:
        """The number that is to stand beside the formula at an offset; empty for none."""

    @abstractmethod
    def own(self, block: OwnBlock) -> str:
        """A block of ours, without its last line end; empty for none."""

    def inlines(self, inlines: Iterable[model.Inline]) -> str:
        """Inlines in one line, such as a title."""
        return " ".join(self._inlines(inlines, line=True).split("\n")).strip()

    def footnotes(self, footnotes: Iterable[model.Footnote]) -> str:
        """The definitions of footnotes, which are referred to as `[^1]`."""
        return "\n\n".join(
            hang(f"[^{note.number}]: ", self.blocks(note.blocks), 4) for note in footnotes
        )

    # --- blocks

    def blocks(self, blocks: Iterable[model.Block], *, tight: bool = False) -> str:
        """Blocks one after the other, without the last line end."""
        written, before = "", None
        for block in blocks:
            text = self._block(block, before)
            if text and written:
                apart = not tight or isinstance(before, _APART) or isinstance(block, _APART)
                written += "\n\n" if apart else "\n"
            if text:
                written += text
                before = block
        return written

    def _block(self, block: model.Block, after: model.Block | None = None) -> str:
        match block:
            case model.Heading():
                return self._heading(block)
            case model.Paragraph():
                return self._inlines(block.children)
            case model.HtmlFlow():
                return "".join(map(self._in_html, block.children))
            case model.ListBlock():
                return self._list(block, other=isinstance(after, model.ListBlock))
            case model.BlockQuote():
                return quoted(self.blocks(block.blocks))
            case model.CodeBlock():
                return fence(re.sub(r"[\s`]", "", block.language), block.code.text)
            case model.HtmlBlock():
                return raw_html(block, self.url).rstrip("\n")
            case model.ThematicBreak():
                return "___"
            case model.MathBlock():
                tex, tag = _no_empty_lines(block.tex.text), self._tag(block.span.start)
                return "\n".join(filter(None, ("$$", tex, tag, "$$")))
            case model.Table():
                return self._table(block)
            case _:
                return self.own(block)

    def _in_html(self, inline: model.Inline) -> str:
        """An inline in HTML, where text is no Markdown."""
        if isinstance(inline, model.Text):
            return escape(inline.text)
        return self._inline(inline, line=False, cell=False)

    def _heading(self, heading: model.Heading) -> str:
        text = _LAST_MARKS.sub(r"\1\\\2", self.inlines(heading.children))
        return f"{'#' * heading.level} {text}".rstrip()

    def _list(self, block: model.ListBlock, *, other: bool) -> str:
        """A list; one right after another has other marks, by which it is known as another."""
        number, mark = block.start, "*" if other else "-"
        tight = all(
            is_tight(inner) or not isinstance(inner, model.Paragraph)
            for item in block.items
            for inner in item.blocks
        )
        items: list[str] = []
        for item in block.items:
            if number is not None:
                mark = f"{number}{')' if other else '.'}"
                number += 1
            items.append(self._item(f"{mark} ", item, tight=tight))
        return ("\n" if tight else "\n\n").join(items)

    def _item(self, mark: str, item: model.ListItem, *, tight: bool) -> str:
        text = self.blocks(item.blocks, tight=tight)
        if item.checked is not None:
            text = f"[{'x' if item.checked else ' '}] {text or '&nbsp;'}"
        elif item.blocks and isinstance(item.blocks[0], model.ListBlock):
            text = f"\n{text}"  # three marks in a line would be a break
        return hang(mark, text, len(mark))

    def _table(self, block: model.Table) -> str:
        rows = (map(self._cell, row) for row in block.rows)
        return table(map(self._cell, block.header), rows, (one or "" for one in block.align))

    def _cell(self, cell: model.Cell) -> str:
        return self._inlines(cell.children, line=True, cell=True).replace("\n", " ")

    # --- inlines

    def _inlines(
        self, inlines: Iterable[model.Inline], *, line: bool = False, cell: bool = False
    ) -> str:
        text = self._joined(inlines, line=line, cell=cell)
        return text if line else guarded(text)

    def _joined(self, inlines: Iterable[model.Inline], *, line: bool, cell: bool) -> str:
        return "".join([self._inline(one, line=line, cell=cell) for one in inlines])

    def _inline(self, inline: model.Inline, *, line: bool, cell: bool) -> str:
        match inline:
            case model.Text():
                return _text(inline, cell=cell)
            case model.SoftBreak():
                return " " if line else "\n"
            case model.HardBreak():
                if line:
                    return " "
                return "\\\n" if inline.span.text.startswith("\\") else "  \n"
            case model.CodeSpan():
                source = inline.span.text
                ticks = source[: len(source) - len(source.lstrip("`"))]
                return _piped(code_span(inline.text, ticks), cell=cell)
            case model.NumberBinding():
                return escaped(_MINUS.sub("\u2212", inline.text))
            case model.Math():
                tag = self._tag(inline.span.start) if inline.display else ""
                return _formula(inline, tag, cell=cell)
            case model.Emphasis() | model.Strong() | model.Term() | model.Strikethrough():
                mark = _delimiter(inline)
                return f"{mark}{self._joined(inline.children, line=line, cell=cell)}{mark}"
            case model.Link():
                text = self._joined(inline.children, line=line, cell=cell)
                return self._link(inline, text, cell=cell)
            case model.Image():
                url = self.url(inline.url)
                return _piped(picture(inline.alt, url, inline.title), cell=cell)
            case model.RawInline():
                return _piped(raw_html(inline, self.url), cell=cell)
            case model.FootnoteRef():
                return self.reference(inline.number)
            case _:
                assert_never(inline)

    def _tag(self, start: int) -> str:
        number = self.number(start)
        return f"\\tag{{{number}}}" if number else ""

    def _link(self, node: model.Link, text: str, *, cell: bool) -> str:
        source = node.span.text
        if source == f"<{model.plain_text(node.children)}>" and not cell:
            return source
        href = self.href(node.target)
        text = text or escaped(self.named(node.target))
        return link(text, href.replace("|", "%7C") if cell else href, node.title)


def _text(node: model.Text, *, cell: bool) -> str:
    """A text as it stands in its source, where it reads there as it does here."""
    source = node.span.text
    if source != node.text:
        text = escaped(node.text)
        if text[:1].isspace() and not source[:1].isspace():
            text = f"&#{ord(text[0])};{text[1:]}"
        if text[-1:].isspace() and not source[-1:].isspace():
            text = f"{text[:-1]}&#{ord(text[-1])};"
        return text.replace("\n", "&#10;")
    source = _ALWAYS.sub(lambda match: f"\\{match[0]}", source)
    return _piped(source, cell=cell)


def _piped(text: str, *, cell: bool) -> str:
    """Marks, whose pipes are escaped in a cell of a table."""
    return _PIPE.sub(r"\\|", text) if cell else text


def _delimiter(node: model.Emphasis | model.Strong | model.Term | model.Strikethrough) -> str:
    """The marks around a text, for emphasis those of its source."""
    if isinstance(node, model.Strikethrough):
        return "~~"
    mark = "_" if node.span.text[:1] == "_" else "*"
    return mark * 2 if isinstance(node, model.Strong) else mark


def _formula(node: model.Math, tag: str, *, cell: bool) -> str:
    """A formula between its dollars, with its number, if it has one."""
    tex = f"{node.tex.text}\n{tag}" if tag else node.tex.text  # it may end with a comment
    if cell:  # a pipe would end the cell, and an escaped one is another sign
        tex = tex.replace(r"\|", r"\Vert{}").replace("|", r"\vert{}")
    if _COMMENT.search(tex):  # a line's end ends a comment
        tex = _no_empty_lines(tex)
    elif "\n" in tex:
        tex = " ".join(part.strip() for part in tex.split("\n"))
    return f"$${tex}$$" if node.display else f"${tex}$"


def _no_empty_lines(tex: str) -> str:
    """TeX without empty lines, at which a formula would end."""
    return "\n".join(line for line in tex.split("\n") if line.strip())
