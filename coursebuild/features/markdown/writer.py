"""Documents as CommonMark with tables, footnotes and `$`, for readers elsewhere.

A text that has no escapes or entities is copied from its source, where it was read as text between
the same neighbours. In any other text (also that from JSON) all marks are escaped. What can begin
another block at the start of a line is escaped when a paragraph is complete.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Literal, TypeAlias

from markupsafe import Markup

from coursebuild.api import PageContext, marks, model, regex
from coursebuild.core.pages.markup import escape, is_tight, raw_html
from coursebuild.core.pages.page_writer import output_receipt, run_commands, script_receipt
from coursebuild.core.registry import kind_of_block
from coursebuild.features.markdown.from_html import html_to_markdown

_SPACED_BLOCKS = (
    *(model.Callout, model.PlainCode, model.Script, model.ScriptPart, model.Recording),
    *(model.Mjcf, model.FeatureBlock, model.HtmlBlock, model.Table, model.MathBlock),
)
"""Blocks with empty lines around them, even in a tight list."""

_Room: TypeAlias = Literal["block", "line", "cell"]
"""What inlines may fill: lines of their own, a single line, or a cell of a table."""
_LAST_MARKS = regex(r"(^|\s)(#+)$")
_PIPE = regex(r"(?<!\\)\|")
_COMMENT = regex(r"(?<!\\)%")
_MINUS = regex(r"(?<!\w)-(?=\d)")


@dataclass(frozen=True)
class DocumentWriter:
    """Writes a document as plain Markdown."""

    page: PageContext
    locate: Callable[[str], str]
    """Convert an address on the page to one in the Markdown."""
    live: str
    """The address of the page, where labs run."""
    notebook: bool = False
    """Whether scripts have cells of their own, answers are folded, and footnotes are a list."""

    def inlines(self, inlines: Iterable[model.Inline]) -> str:
        """Write inlines on one line, such as a title."""
        return " ".join(self._inlines(inlines, "line").split("\n")).strip()

    def footnotes(self, footnotes: Iterable[model.Footnote]) -> str:
        """Write the definitions of footnotes, for references such as `[^1]`."""
        return "\n\n".join(
            marks.hang(f"[^{note.number}]: ", self.blocks(note.blocks), 4) for note in footnotes
        )

    # --- blocks

    def blocks(self, blocks: Iterable[model.Block], *, tight: bool = False) -> str:
        """Write blocks, without the last line end."""
        text, previous = "", None
        for block in blocks:
            block_text = self.block(block, previous)
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

    def block(self, block: model.Block, previous: model.Block | None = None) -> str:
        """Write a block, without its last line end; may be empty."""
        match block:
            case model.Heading():
                text = _LAST_MARKS.sub(r"\1\\\2", self.inlines(block.children))
                return f"{'#' * block.level} {text}".rstrip()
            case model.Paragraph():
                text = self._inlines(block.children)
                if number := self.number(block.label):
                    text = f"**{marks.escape_marks(number)}:** {text}"
                return text
            case model.HtmlFlow():
                return "".join(map(self._in_html, block.children))
            case model.ListBlock():
                return self._list(block, after_list=isinstance(previous, model.ListBlock))
            case model.BlockQuote():
                return marks.block_quote(self.blocks(block.blocks))
            case model.CodeBlock():
                code = marks.fence(re.sub(r"[\s`]", "", block.language), block.code.text)
                return self._below_caption(block, code)
            case model.HtmlBlock():
                return raw_html(block, self.url).rstrip("\n")
            case model.ThematicBreak():
                return "___"
            case model.MathBlock():
                tex, tag = _remove_empty_lines(block.tex.text), self._tag(block.span.start)
                return "\n".join(filter(None, ("$$", tex, tag, "$$")))
            case model.Table():
                rows = (map(self._cell, row) for row in block.rows)
                header, align = map(self._cell, block.header), (mark or "" for mark in block.align)
                text = marks.table(header, rows, align)
                return self._below_caption(block, text, self.inlines(block.caption))
            case model.Callout():
                name = self.number(block.label) or self.page.inputs.callouts[block.kind].label
                label = f"**{marks.escape_marks(name)}**"
                title = self.inlines(block.title)
                head = f"{label} {title}" if title else label
                inner = self.blocks(block.blocks)
                return marks.block_quote(f"{head}\n\n{inner}" if inner else head)
            case model.PlainCode():
                return self._below_caption(block, marks.fence(block.language, block.code.text))
            case model.Script() | model.ScriptPart():
                return self._script(block)
            case model.Recording():
                is_joined = any(block in outputs for outputs in self.page.script_outputs.values())
                return "" if is_joined else self.recording(block)
            case model.Mjcf():
                engine = self.page.inputs.engine
                label = (
                    self.words("mjcf.fragment", element=block.fragment)
                    if block.fragment
                    else self.words("mjcf.label")
                )
                if block.error is None:
                    verdict = f"*{self.words('mjcf.compiles', engine=engine)}*"
                else:
                    fails = self.words("mjcf.fails", engine=engine)
                    verdict = f"*{fails}* {marks.code_span(block.error)}"
                text = f"{label}:\n\n{marks.fence('xml', block.code.text)}\n\n{verdict}"
                return self._below_caption(block, text)
            case model.FeatureBlock():
                return self._below_caption(block, kind_of_block(block).markdown(self, block))

    def _below_caption(self, block: model.Labelled, text: str, caption: str = "") -> str:
        if number := self.number(block.label):
            caption = f"**{marks.escape_marks(number)}:** {caption}".rstrip()
        return f"{caption}\n\n{text}" if caption else text

    def _in_html(self, inline: model.Inline) -> str:
        """Write an inline within HTML, where text is no Markdown."""
        if isinstance(inline, model.Text):
            return escape(inline.text)
        return self._inline(inline, "block")

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
        return marks.hang(mark, text, len(mark))

    def _cell(self, cell: model.Cell) -> str:
        return self._inlines(cell.children, "cell").replace("\n", " ")

    # --- inlines

    def _inlines(self, inlines: Iterable[model.Inline], room: _Room = "block") -> str:
        text = self._join_inlines(inlines, room)
        return marks.guard_lines(text) if room == "block" else text

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
                return _escape_pipes(marks.code_span(inline.text, ticks), room)
            case model.NumberBinding():
                return marks.escape_marks(_MINUS.sub("\u2212", inline.text))
            case model.Math():
                tag = self._tag(inline.span.start) if inline.display else ""
                tex = inline.tex.text  # which can end with a comment
                tex = f"{tex}\n{tag}" if tag else tex
                if room == "cell":  # a pipe would end the cell, and an escaped one is another sign
                    tex = tex.replace(r"\|", r"\Vert{}").replace("|", r"\vert{}")
                if _COMMENT.search(tex):  # the line end ends the comment
                    tex = _remove_empty_lines(tex)
                elif "\n" in tex:
                    tex = " ".join(part.strip() for part in tex.split("\n"))
                return f"$${tex}$$" if inline.display else f"${tex}$"
            case model.Strikethrough():
                return f"~~{self._join_inlines(inline.children, room)}~~"
            case model.Emphasis() | model.Strong() | model.Term():
                mark = "_" if inline.span.text[:1] == "_" else "*"  # as in its source
                mark *= 2 if isinstance(inline, model.Strong) else 1
                return f"{mark}{self._join_inlines(inline.children, room)}{mark}"
            case model.Link():
                text = self._join_inlines(inline.children, room)
                return self._link(inline, text, room)
            case model.Image():
                url = self.url(inline.url)
                return _escape_pipes(marks.picture(inline.alt, url, inline.title), room)
            case model.RawInline():
                return _escape_pipes(raw_html(inline, self.url), room)
            case model.FootnoteRef():
                return self.reference(inline.number)
            case model.Citation():
                return _escape_pipes(self.citation(inline), room)

    def _tag(self, start: int) -> str:
        number = self.formula_number(start)
        return f"\\tag{{{number}}}" if number else ""

    def _link(self, node: model.Link, text: str, room: _Room) -> str:
        source = node.span.text
        if source == f"<{model.plain_text(node.children)}>" and room != "cell":
            return source
        href = self.href(node.target)
        text = text or marks.escape_marks(self.link_text(node.target))
        return marks.link(text, href.replace("|", "%7C") if room == "cell" else href, node.title)

    # --- what depends on the page

    def href(self, target: model.Target) -> str:
        """Return the address of a link."""
        return self.locate(self.page.href(target))

    def url(self, url: str) -> str:
        """Return the address of a picture."""
        return self.locate(self.page.url(url))

    def reference(self, note: int) -> str:
        """Return a reference to a footnote."""
        return f"<sup>{note}</sup>" if self.notebook else f"[^{note}]"

    def link_text(self, target: model.Target) -> str:
        """Return the text for a link without one."""
        return self.page.reference(target)

    def formula_number(self, start: int) -> str:
        """Return the number of a formula that does not show one itself."""
        item = self.page.numbered_items.get(start)
        return item.number if item is not None and item.has_margin_number else ""

    def number(self, label: model.Label | None) -> str:
        """Return the name that a label gives, such as "Figure 4.2.3"; empty without one."""
        return "" if label is None else self.page.number(label)

    def citation(self, citation: model.Citation) -> str:
        """Return a citation, with links to the references below the text."""
        return self.html(self.page.citation(citation))

    def references(self) -> str:
        """Return the list of the sources that the document cites; perhaps empty."""
        entries = (self.html(entry.html) for entry in self.page.inputs.citations.entries)
        items = "\n".join(marks.hang("- ", entry) for entry in entries)
        return f"**{self.words('references.title')}**\n\n{items}" if items else ""

    def html(self, html: Markup) -> str:
        """Convert HTML of a template to Markdown."""
        return html_to_markdown(str(html), self.locate)

    def words(self, key: str, **values: str | int | float) -> str:
        """Return a text of the interface as Markdown."""
        return marks.escape_marks(self.page.renderer.words(key, **values))

    # --- scripts and outputs

    def is_cell(self, block: model.Script | model.ScriptPart) -> bool:
        """Whether a notebook has the whole script in a cell at the place of this block."""
        script = self.page.script_places[block.span.start][0]
        is_end = not script.parts or script.parts[-1].span == block.span
        return self.notebook and script.is_python and is_end

    def _script(self, block: model.Script | model.ScriptPart) -> str:
        """Write a script or a part of one, with the outputs that follow it."""
        script, first = self.page.script_places[block.span.start]
        begins = isinstance(block, model.Script)
        name = marks.link(
            marks.code_span(block.path), self.locate(self.page.place.href(block.path))
        )
        if number := self.number(block.label):
            name = f"**{marks.escape_marks(number)}** {name}"
        if self.is_cell(block):
            return self.words("exports.cell_below", path="\ue000").replace("\ue000", name)
        recordings = self.page.script_outputs.get(block.span.start, ())
        parts = [self.recording(recording) for recording in recordings]
        if self.notebook and block.show == "hidden":
            return "\n\n".join(parts)
        download = self.page.inputs.downloads.get(block.path)
        if begins and not self.notebook and download is not None:
            unpack = self.words("code.unpack", file=download.file) if download.is_archive else ""
            then, otherwise = (f", {self.words(name)} " for name in ("code.then", "code.or"))
            ways = run_commands(download, script.args)
            commands = otherwise.join(then.join(map(marks.code_span, steps)) for steps in ways)
            run = f"{self.words('code.run')}: {unpack} {commands}"
            if download.unknown_modules:
                modules = self.page.words.join(download.unknown_modules)
                run += f" ({self.words('code.requires', modules=modules)})"
            run += "" if download.was_run else f" ({self.words('code.unrun')})"
            parts.insert(0, " ".join(run.split()))
        if script.parts:
            last = first + block.code.text.rstrip("\n").count("\n")
            lines = self.words("code.lines", first=first, last=last)
            name += f", {lines if first < last else self.words('code.line', first=first)}"
        parts[:0] = [f"{name}:", marks.fence(script.language, block.code.text.rstrip("\n"))]
        if isinstance(block, model.Script) and not recordings and not self.notebook:
            receipt = script_receipt(self.page, block)
            parts.append(f"*{marks.escape_marks(receipt.text)}*")
        return "\n\n".join(parts)

    def recording(self, block: model.Recording) -> str:
        """Write an output with its caption and its receipt."""
        if isinstance(block.body, model.Table):
            body = self.blocks((block.body,))
        else:
            body = marks.fence("text", block.body.text)
        return f"{self.caption(block)}\n\n{body}\n\n{self.receipt(block)}"

    def caption(self, block: model.Recording) -> str:
        """Write the caption of an output."""
        return self.inlines(block.caption) or marks.escape_marks(self.words("code.caption"))

    def receipt(self, block: model.Recording) -> str:
        """Write the receipt of an output: how it was verified."""
        return f"*{marks.escape_marks(output_receipt(self.page, block).text)}*"

    def folded(self, label: str, text: str) -> str:
        """Write a text with its label; in a notebook it is folded."""
        if self.notebook:
            return f"<details>\n<summary>{label}</summary>\n\n{text}\n\n</details>"
        begins_block = text.startswith(("```", "- ", "1. ", "$$", "> ", "| ", "<"))
        return f"**{label}:**\n\n{text}" if begins_block else f"**{label}:** {text}"


def _text(node: model.Text, room: _Room) -> str:
    """Write a text, copied from its source if that is the same."""
    source = node.span.text
    if source != node.text:
        text = marks.escape_marks(node.text)
        if text[:1].isspace() and not source[:1].isspace():
            text = f"&#{ord(text[0])};{text[1:]}"
        if text[-1:].isspace() and not source[-1:].isspace():
            text = f"{text[:-1]}&#{ord(text[-1])};"
        return text.replace("\n", "&#10;")
    for mark in "$`":  # which other readers of Markdown may understand where ours reads text
        source = source.replace(mark, f"\\{mark}")
    return _escape_pipes(source, room)


def _escape_pipes(text: str, room: _Room) -> str:
    return _PIPE.sub(r"\\|", text) if room == "cell" else text


def _remove_empty_lines(tex: str) -> str:
    """Remove empty lines from TeX: a formula would end there."""
    return "\n".join(line for line in tex.split("\n") if line.strip())
