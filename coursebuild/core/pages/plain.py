"""Markdown without a course: CommonMark's own HTML.

Entry points: `PlainContext`, `plain_html` (a document on its own). Headings have no ids, code has
no colours, formulas stay TeX, and a block of ours is shown as Markdown alone would show what it
holds.
"""

from __future__ import annotations

from typing import assert_never

from markupsafe import Markup

from coursebuild.core.model import (
    Callout,
    Document,
    ExampleTarget,
    FeatureBlock,
    Image,
    LessonTarget,
    LevelTarget,
    Mjcf,
    ModelTarget,
    NumberBinding,
    PageTarget,
    PlainCode,
    Recording,
    Script,
    Table,
    Target,
    TermTarget,
    UrlTarget,
)
from coursebuild.core.pages.html_context import HtmlOptions, OwnBlock
from coursebuild.core.pages.markup import (
    escape,
    render_blocks,
    render_footnotes,
    render_inlines,
    render_table,
)

PLAIN = HtmlOptions(plain=True)


def plain_html(document: Document) -> Markup:
    """A document as plain HTML, its footnotes last."""
    context = PlainContext()
    blocks = render_blocks(document.blocks, context, PLAIN)
    return blocks + render_footnotes(document.footnotes, context, PLAIN)


class PlainContext:
    """A context that knows no course."""

    def href(self, target: Target) -> str:
        """The destination as an author writes it."""
        match target:
            case LessonTarget():
                return f"lesson:{target.id}" + (f"#{target.anchor}" if target.anchor else "")
            case PageTarget():
                return f"page:{target.id}" + (f"#{target.anchor}" if target.anchor else "")
            case LevelTarget():
                return f"level:{target.id}"
            case ModelTarget():
                return f"model:{target.name}" + (f"#{target.anchor}" if target.anchor else "")
            case TermTarget():
                return f"term:{target.id}"
            case ExampleTarget():
                return target.path
            case UrlTarget():
                return target.url
            case _:
                assert_never(target)

    def reference(self, target: Target) -> str:
        """Nothing."""
        return ""

    def url(self, url: str) -> str:
        """The address as written."""
        return url

    def figure(self, image: Image, caption: Markup) -> Markup:
        """A paragraph."""
        return Markup(f"<p>{render_inlines((image,), self, PLAIN)}\n{caption}</p>\n")

    def math(self, tex: str) -> Markup:
        """The TeX between its delimiters."""
        return Markup(rf'<span class="math">\({escape(tex)}\)</span>')

    def display(self, tex: str, start: int) -> Markup:
        """The same for a formula on a line of its own."""
        return Markup(rf'<span class="math">\[{escape(tex)}\]</span>')

    def code(self, language: str, text: str) -> Markup:
        """The code as text."""
        name = f' class="language-{escape(language)}"' if language else ""
        return Markup(f"<pre><code{name}>{escape(text)}</code></pre>\n")

    def binding(self, binding: NumberBinding) -> Markup:
        """The number as a code span."""
        return Markup(f"<code>{escape(binding.text)}</code>")

    def block(self, block: OwnBlock) -> Markup:
        """What a block of ours holds, as Markdown alone would show it."""
        match block:
            case Callout():
                title = (
                    f"<p>{render_inlines(block.title, self, PLAIN)}</p>\n" if block.title else ""
                )
                inner = render_blocks(block.blocks, self, PLAIN)
                return Markup(f"<blockquote>\n{title}{inner}</blockquote>\n")
            case Script() | PlainCode():
                return self.code("python", block.code.text)
            case Mjcf():
                return self.code("mjcf", block.code.text)
            case Recording():
                caption = Markup(f"<p>{render_inlines(block.caption, self, PLAIN)}</p>\n")
                if isinstance(block.body, Table):
                    return caption + render_table(block.body, self, PLAIN)
                return caption + self.code("text", block.body.text)
            case FeatureBlock():
                return Markup(render_blocks(block.child_blocks(), self, PLAIN))
            case _:
                assert_never(block)
