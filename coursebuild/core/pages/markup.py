"""Writing blocks and inlines as HTML.

What depends on the course (the address of a lesson, the look of a formula or a lab) is a method of
the writer that `PageContext` overrides; as it is here, text is written that is on no page.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Literal, TypeAlias
from urllib.parse import quote

from markupsafe import Markup

from coursebuild.core import model
from coursebuild.core.pages.renderer import Strings
from coursebuild.core.pages.typography import (
    curl_apostrophes,
    isolate_ltr,
    join_units,
    split_quantities,
    unit_length,
)
from coursebuild.core.text.regex import regex

SpecialBlock: TypeAlias = (
    model.Callout
    | model.Mjcf
    | model.PlainCode
    | model.FeatureBlock
    | model.Recording
    | model.Script
    | model.ScriptPart
)


def escape(text: str) -> str:
    """Text as HTML, also for attributes in double quotes."""
    text = str.replace(text, "&", "&amp;").replace("<", "&lt;")
    return text.replace(">", "&gt;").replace('"', "&quot;")


_SIMPLE = regex('[^0-9&<>"]*+')
_APART = (type(None), model.SoftBreak, model.HardBreak)
"""What stands beside a text of which no word goes on."""


def raw_html(node: model.HtmlBlock | model.RawInline, url: Callable[[str], str]) -> str:
    """Raw HTML; `url` returns the addresses of the course's files on the page."""
    parts, position = list[str](), 0
    for media in node.media:
        if (address := url(media.url)) != media.url:  # otherwise it stays as written
            parts += (node.html[position : media.start], escape(address))
            position = media.end
    return "".join((*parts, node.html[position:]))


def reference_id(number: int, occurrence: int) -> str:
    """The id of a reference to a footnote, with a colon, unlike anchors of headings."""
    return f"fnref:{number}" if occurrence == 1 else f"fnref:{number}:{occurrence}"


def is_tight(block: model.Block) -> bool:
    """Whether a block is a paragraph of a tight list."""
    return isinstance(block, model.Paragraph) and block.tight


class HtmlWriter:
    """Writes blocks and inlines. A `Markup` is HTML already, a string is not."""

    @property
    def words(self) -> Strings:
        """The interface texts, which headings, tables, tasks and footnotes need."""
        return Strings({})

    @property
    def direction(self) -> Literal["", "ltr", "rtl"]:
        """The direction of text, to keep numbers with their units; empty not to do that."""
        return ""

    def href(self, target: model.Target) -> str:
        """The address of a link."""
        return ""

    def reference(self, target: model.Target) -> str:
        """The text of a link that has none; perhaps empty."""
        return ""

    def url(self, url: str) -> str:
        """The address of an image that is written as `url`."""
        return url

    def sides(self, url: str) -> Markup:
        """The attributes that keep the place of an image until it has arrived."""
        return Markup()

    def number(self, label: model.Label | None) -> str:
        """The name that a label gives, such as "Figure 4.2.3"; empty without one."""
        return ""

    def figure(self, block: model.Paragraph, image: model.Image, caption: Markup) -> Markup:
        """The image of a figure with its caption, with its line end."""
        return Markup()

    def math(self, tex: str) -> Markup:
        """An inline formula, typeset."""
        return Markup(rf'<span class="math">\({escape(tex)}\)</span>')

    def display(self, tex: str, start: int) -> Markup:
        """A formula on a line of its own, at an offset in the document."""
        return Markup(rf'<span class="math">\[{escape(tex)}\]</span>')

    def citation(self, citation: model.Citation) -> Markup:
        """A citation of sources."""
        return Markup(escape(citation.span.text))

    def code_href(self, code: model.CodeSpan) -> str:
        """The address of what inline code names; mostly empty."""
        return ""

    def code(self, language: str, text: str) -> Markup:
        """A block of code that is only shown, not run."""
        return Markup(f"<pre><code>{escape(text)}</code></pre>\n")

    def binding(self, binding: model.NumberBinding) -> Markup:
        """A number that is bound to an output."""
        return Markup(escape(binding.text))

    def block(self, block: SpecialBlock) -> Markup:
        """A block beyond Markdown, with its line end."""
        return Markup()

    # -- what it writes

    def render_blocks(self, blocks: Iterable[model.Block]) -> Markup:
        """Blocks one after the other, each with its line end."""
        return Markup(self._blocks(blocks))

    def inlines(self, inlines: Iterable[model.Inline]) -> Markup:
        """Inlines one after the other."""
        return Markup(self._inlines(inlines))

    def render_footnotes(self, footnotes: Iterable[model.Footnote]) -> Markup:
        """The footnotes of a document as a section; empty if there are none."""
        items = "".join(map(self._footnote, footnotes))
        if not items:
            return Markup()
        label = escape(self.words("markup.footnotes"))
        start = f'<section class="footnotes" role="doc-endnotes" aria-label="{label}">'
        return Markup(f"{start}\n<ol>\n{items}</ol>\n</section>\n")

    # -- the following methods return HTML as plain strings, which are joined faster

    def _blocks(self, blocks: Iterable[model.Block]) -> str:
        return "".join(map(self._block, blocks))

    def _inlines(self, inlines: Iterable[model.Inline]) -> str:
        """Inlines; in prose with formulas and bound numbers joined to their units."""
        if not self.direction:
            return "".join(map(self._inline, inlines))
        row, parts = tuple(inlines), list[str]()
        unit_end = 0
        for before, inline, after in zip((None, *row), row, (*row[1:], None), strict=False):
            if isinstance(inline, model.Text):
                text = inline.text[unit_end:]
                if "'" in text and self.direction == "ltr":
                    text = curl_apostrophes(
                        text, not isinstance(before, _APART), not isinstance(after, _APART)
                    )
                parts.append(self._text(text))
                unit_end = 0
                continue
            html = self._inline(inline)
            is_number = isinstance(inline, model.NumberBinding) or (
                isinstance(inline, model.Math) and not inline.display
            )
            if (
                is_number
                and isinstance(after, model.Text)
                and (unit_end := unit_length(after.text))
            ):
                html += escape(after.text[:unit_end].replace(" ", "\u00a0"))
                if self.direction == "rtl":
                    html = isolate_ltr(Markup(html))
            parts.append(html)
        return "".join(parts)

    def _text(self, text: str) -> str:
        """Text with quantities joined to their units, and isolated in text from the right."""
        if _SIMPLE.fullmatch(text):  # as most are
            return text
        text = join_units(text)
        if self.direction == "ltr":
            return escape(text)
        pieces = ((escape(piece), is_quantity) for piece, is_quantity in split_quantities(text))
        return "".join(
            isolate_ltr(Markup(piece)) if is_quantity else piece for piece, is_quantity in pieces
        )

    # -- blocks

    def _block(self, block: model.Block) -> str:
        """A block, with its line end unless it is a paragraph of a tight list."""
        match block:
            case model.Paragraph() if block.figure:
                image = next(part for part in block.children if isinstance(part, model.Image))
                caption = self._inlines(part for part in block.children if part is not image)
                return self.figure(block, image, Markup(caption.strip()))
            case model.Paragraph():
                inner = self._inlines(block.children)
                return inner if block.tight else f"<p{_source(block.source_mark)}>{inner}</p>\n"
            case model.Heading():
                return self._heading(block)
            case model.ListBlock():
                return self._list(block)
            case model.BlockQuote():
                return f"<blockquote>\n{self._blocks(block.blocks)}</blockquote>\n"
            case model.CodeBlock():
                return self._captioned(block, (), self.code(block.language, block.code.text))
            case model.HtmlBlock():
                return raw_html(block, self.url)
            case model.HtmlFlow():
                return f"{self._inlines(block.children)}\n"
            case model.ThematicBreak():
                return "<hr>\n"
            case model.MathBlock():
                return f"{self.display(block.tex.text, block.span.start)}\n"
            case model.Table():
                return self._table(block)
            case model.PlainCode():
                return self._captioned(block, (), self.block(block))
            case model.Callout() | model.Mjcf():
                return self.block(block)
            case model.Script() | model.ScriptPart():
                return self.block(block)
            case model.Recording() | model.FeatureBlock():
                return self.block(block)

    def _heading(self, heading: model.Heading) -> str:
        inner, name = self._inlines(heading.children), f"h{heading.level}"
        anchor = escape(heading.anchor)
        kinds = f' class="{escape(" ".join(heading.classes))}"' if heading.classes else ""
        label = escape(self.words("markup.anchor"))
        link = f'<a class="anchor" href="#{quote(heading.anchor)}" aria-label="{label}">#</a>'
        return f'<{name} id="{anchor}"{kinds}>{inner} {link}</{name}>\n'

    def _list(self, block: model.ListBlock) -> str:
        start = "" if block.start is None or block.start == 1 else f' start="{block.start}"'
        name = "ul" if block.start is None else "ol"
        tasks = any(item.checked is not None for item in block.items)
        mark = (' class="task-list"' if tasks else "") + _source(block.source_mark)
        return f"<{name}{start}{mark}>\n{''.join(map(self._item, block.items))}</{name}>\n"

    def _item(self, item: model.ListItem) -> str:
        """An item; a tight paragraph follows on the same line."""
        parts = ["<li>"]
        if item.checked is not None:
            label = escape(self.words("markup.done" if item.checked else "markup.not_done"))
            state = " checked" if item.checked else ""
            parts.append(f'<input type="checkbox" disabled{state} aria-label="{label}"> ')
        line_end = False
        for block in item.blocks:
            if not (line_end or (is_tight(block) and len(parts) == 1 + (item.checked is not None))):
                parts.append("\n")
            parts.append(self._block(block))
            line_end = not is_tight(block)
        return "".join([*parts, "</li>\n"])

    def _table(self, table: model.Table) -> str:
        """A table, below its caption; its columns are aligned by class."""
        head = self._row(table.header, table, 'th scope="col"')
        rows = "".join(self._row(row, table, "td") for row in table.rows)
        body = f"<tbody>\n{rows}</tbody>\n" if rows else ""
        html = f"<table{_source(table.source_mark)}>\n<thead>\n{head}</thead>\n{body}</table>\n"
        label = escape(self.words("markup.table"))
        html = f'<div class="table" role="group" aria-label="{label}" tabindex="0">\n{html}</div>\n'
        return self._captioned(table, table.caption, html)

    def _captioned(
        self, block: model.Labelled, caption: tuple[model.Inline, ...], html: str
    ) -> str:
        """A block below its number and its caption, if it has one of the two."""
        if block.label is None and not caption:
            return html
        id = "" if block.label is None else f' id="{escape(block.label.id)}"'
        number = escape(self.number(block.label))
        parts = (number and f'<span class="numbered">{number}</span>', self._inlines(caption))
        head = f"<figcaption>{' '.join(filter(None, parts))}</figcaption>"
        return f'<figure class="captioned"{id}>\n{head}\n{html}</figure>\n'

    def _row(self, cells: tuple[model.Cell, ...], table: model.Table, tag: str) -> str:
        parts = ["<tr>\n"]
        for cell, align in zip(cells, table.align, strict=True):
            mark = f' class="align-{align}"' if align else ""
            cell_tag = tag if cell.children else "td"  # an empty header is none
            parts.append(f"<{cell_tag}{mark}>{self._inlines(cell.children)}</{cell_tag[:2]}>\n")
        return "".join([*parts, "</tr>\n"])

    # -- inlines

    def _inline(self, inline: model.Inline) -> str:
        match inline:
            case model.Text():
                return escape(inline.text)
            case model.SoftBreak():
                return "\n"
            case model.CodeSpan():
                code, href = f"<code>{escape(inline.text)}</code>", self.code_href(inline)
                return f'<a class="name" href="{escape(href)}">{code}</a>' if href else code
            case model.Math():
                if inline.display:
                    return self.display(inline.tex.text, inline.span.start)
                return self.math(inline.tex.text)
            case model.Term():
                inner = self._inlines(inline.children)
                return f'<dfn id="{escape(inline.anchor)}">{inner}</dfn>'
            case model.Emphasis():
                return f"<em>{self._inlines(inline.children)}</em>"
            case model.Strong():
                return f"<strong>{self._inlines(inline.children)}</strong>"
            case model.Strikethrough():
                return f"<del>{self._inlines(inline.children)}</del>"
            case model.Link():
                return self._link(inline)
            case model.Image():
                return self._image(inline)
            case model.RawInline():
                return raw_html(inline, self.url)
            case model.HardBreak():
                return "<br>\n"
            case model.NumberBinding():
                return self.binding(inline)
            case model.FootnoteRef():
                return self._reference(inline)
            case model.Citation():
                return self.citation(inline)

    def _link(self, link: model.Link) -> str:
        title = f' title="{escape(link.title)}"' if link.title else ""
        href = escape(self.href(link.target))
        inner = self._inlines(link.children) or escape(self.reference(link.target))
        url_class = ' class="url"' if inner == href else ""  # an address as its own text
        return f'<a href="{href}"{title}{url_class}>{inner}</a>'

    def _image(self, image: model.Image) -> str:
        title = f' title="{escape(image.title)}"' if image.title else ""
        url = escape(self.url(image.url))
        return f'<img src="{url}" alt="{escape(image.alt)}"{title}{self.sides(image.url)}>'

    # -- footnotes

    def _reference(self, reference: model.FootnoteRef) -> str:
        number = reference.number
        label = escape(self.words("markup.footnote", number=number))
        name = reference_id(number, reference.occurrence)
        return (
            f'<sup class="footnote-ref"><a href="#fn:{number}" id="{name}" role="doc-noteref"'
            f' aria-label="{label}">{number}</a></sup>'
        )

    def _footnote(self, footnote: model.Footnote) -> str:
        """A footnote; the links back are at the end of its last paragraph."""
        back = " ".join(self._back(footnote.number, k + 1) for k in range(footnote.references))
        last = footnote.blocks[-1] if footnote.blocks else None
        inner = self._blocks(footnote.blocks[:-1])
        if isinstance(last, model.Paragraph):
            inner += f"<p>{self._inlines(last.children)} {back}</p>\n"
        else:
            inner += f"{'' if last is None else self._block(last)}<p>{back}</p>\n"
        return f'<li id="fn:{footnote.number}">\n{inner}</li>\n'

    def _back(self, number: int, occurrence: int) -> str:
        key = "markup.back" if occurrence == 1 else "markup.back_again"
        label = escape(self.words(key, number=number, occurrence=occurrence))
        mark = "" if occurrence == 1 else f"<sup>{occurrence}</sup>"
        arrow = "↪" if self.direction == "rtl" else "↩"
        return (
            f'<a href="#{reference_id(number, occurrence)}" class="footnote-back"'
            f' role="doc-backlink" aria-label="{label}">{arrow}{mark}</a>'
        )


def _source(mark: model.SourceMark | None) -> str:
    """The attribute by which a block names the source of its numbers to who points at it."""
    return "" if mark is None else f' title="{escape(mark.source)}"'
