"""Blocks and inlines as Markdown that needs no course: CommonMark with tables, footnotes and `$`.

Entry points: `write_blocks`, `write_inlines`, `write_footnotes`; `MarkdownContext`, which says
where links lead and what our own blocks become.

1. A text that stands in the source as it reads is written as it stands there: it was read as text
   once, between the same neighbours. Any other (with escapes or entities in it, or out of JSON) has
   all its marks escaped.
2. What may begin another block where a line begins is escaped when the paragraph is put together.
3. Containers indent what they hold.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Protocol, assert_never

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
from coursebuild.features.markdown.texts import (
    delimiter,
    formula,
    no_empty_lines,
    number_text,
    piped,
    text_source,
)


class MarkdownContext(Protocol):
    """What depends on where the Markdown goes."""

    def href(self, target: model.Target) -> str:
        """The address of a link."""
        ...

    def url(self, url: str) -> str:
        """The address of a picture that is written as `url`."""
        ...

    def reference(self, note: int) -> str:
        """A reference to a footnote."""
        ...

    def named(self, target: model.Target) -> str:
        """What a link without a text says: the number of a formula; empty for none."""
        ...

    def number(self, start: int) -> str:
        """The number that is to stand beside the formula at an offset; empty for none."""
        ...

    def own(self, block: OwnBlock) -> str:
        """A block of ours, without its last line end; empty for none."""
        ...


def write_blocks(blocks: Iterable[model.Block], context: MarkdownContext) -> str:
    """Blocks one after the other, an empty line between two, without the last line end."""
    return _Writer(context).blocks(blocks)


def write_inlines(inlines: tuple[model.Inline, ...], context: MarkdownContext) -> str:
    """Inlines in one line, such as a title."""
    return _Writer(context).line(inlines)


def write_footnotes(footnotes: Iterable[model.Footnote], context: MarkdownContext) -> str:
    """The definitions of footnotes, which are referred to as `[^1]`."""
    return "\n\n".join(
        hang(f"[^{note.number}]: ", write_blocks(note.blocks, context), 4) for note in footnotes
    )


_APART = (
    *(model.Callout, model.PlainCode, model.Script, model.Recording, model.Mjcf),
    *(model.FeatureBlock, model.HtmlBlock, model.Table, model.MathBlock),
)
"""Blocks that an empty line parts from others, even in a tight list."""

_LAST_MARKS = re.compile(r"(^|\s)(#+)$")


class _Writer:
    def __init__(self, context: MarkdownContext) -> None:
        self.context = context

    def line(self, inlines: Iterable[model.Inline]) -> str:
        return " ".join(self.inlines(inlines, line=True).split("\n")).strip()

    # --- blocks

    def blocks(self, blocks: Iterable[model.Block], *, tight: bool = False) -> str:
        written, before = "", None
        for block in blocks:
            text = self.block(block, before)
            if text and written:
                apart = not tight or isinstance(before, _APART) or isinstance(block, _APART)
                written += "\n\n" if apart else "\n"
            if text:
                written += text
                before = block
        return written

    def block(self, block: model.Block, after: model.Block | None = None) -> str:
        match block:
            case model.Heading():
                return self._heading(block)
            case model.Paragraph():
                return self.inlines(block.children)
            case model.HtmlFlow():
                return "".join(map(self._in_html, block.children))
            case model.ListBlock():
                return self._list(block, other=isinstance(after, model.ListBlock))
            case model.BlockQuote():
                return quoted(self.blocks(block.blocks))
            case model.CodeBlock():
                return fence(re.sub(r"[\s`]", "", block.language), block.code.text)
            case model.HtmlBlock():
                return raw_html(block, self.context.url).rstrip("\n")
            case model.ThematicBreak():
                return "___"
            case model.MathBlock():
                tex, tag = no_empty_lines(block.tex.text), self._tag(block.span.start)
                return "\n".join(filter(None, ("$$", tex, tag, "$$")))
            case model.Table():
                return self._table(block)
            case _:
                return self.context.own(block)

    def _in_html(self, inline: model.Inline) -> str:
        """An inline in HTML, where text is no Markdown."""
        if isinstance(inline, model.Text):
            return escape(inline.text)
        return self._inline(inline, line=False, cell=False)

    def _heading(self, heading: model.Heading) -> str:
        text = _LAST_MARKS.sub(r"\1\\\2", self.line(heading.children))
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
        return self.inlines(cell.children, line=True, cell=True).replace("\n", " ")

    # --- inlines

    def inlines(
        self, inlines: Iterable[model.Inline], *, line: bool = False, cell: bool = False
    ) -> str:
        text = self._joined(inlines, line=line, cell=cell)
        return text if line else guarded(text)

    def _joined(self, inlines: Iterable[model.Inline], *, line: bool, cell: bool) -> str:
        return "".join([self._inline(one, line=line, cell=cell) for one in inlines])

    def _inline(self, inline: model.Inline, *, line: bool, cell: bool) -> str:
        match inline:
            case model.Text():
                return text_source(inline, cell=cell)
            case model.SoftBreak():
                return " " if line else "\n"
            case model.HardBreak():
                if line:
                    return " "
                return "\\\n" if inline.span.text.startswith("\\") else "  \n"
            case model.CodeSpan():
                source = inline.span.text
                ticks = source[: len(source) - len(source.lstrip("`"))]
                return piped(code_span(inline.text, ticks), cell=cell)
            case model.NumberBinding():
                return escaped(number_text(inline))
            case model.Math():
                tag = self._tag(inline.span.start) if inline.display else ""
                return formula(inline, tag, cell=cell)
            case model.Emphasis():
                mark = delimiter(inline.span.text, "*")
                return f"{mark}{self._joined(inline.children, line=line, cell=cell)}{mark}"
            case model.Strong():
                mark = delimiter(inline.span.text, "*") * 2
                return f"{mark}{self._joined(inline.children, line=line, cell=cell)}{mark}"
            case model.Term():
                return f"*{self._joined(inline.children, line=line, cell=cell)}*"
            case model.Strikethrough():
                return f"~~{self._joined(inline.children, line=line, cell=cell)}~~"
            case model.Link():
                text = self._joined(inline.children, line=line, cell=cell)
                return self._link(inline, text, cell=cell)
            case model.Image():
                url = self.context.url(inline.url)
                return piped(picture(inline.alt, url, inline.title), cell=cell)
            case model.RawInline():
                return piped(raw_html(inline, self.context.url), cell=cell)
            case model.FootnoteRef():
                return self.context.reference(inline.number)
            case _:
                assert_never(inline)

    def _tag(self, start: int) -> str:
        number = self.context.number(start)
        return f"\\tag{{{number}}}" if number else ""

    def _link(self, node: model.Link, text: str, *, cell: bool) -> str:
        source = node.span.text
        if source == f"<{model.plain_text(node.children)}>" and not cell:
            return source
        href = self.context.href(node.target)
        text = text or escaped(self.context.named(node.target))
        return link(text, href.replace("|", "%7C") if cell else href, node.title)
