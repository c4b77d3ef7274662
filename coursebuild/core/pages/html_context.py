"""What the writer of HTML (`markup.py`) needs to know about the course.

Entry points: `Context`, with the values for text that is on no page; `SpecialBlock`, the blocks
beyond Markdown.
"""

from __future__ import annotations

from typing import Literal, TypeAlias

from markupsafe import Markup, escape

from coursebuild.core.model import (
    Callout,
    FeatureBlock,
    Image,
    Mjcf,
    NumberBinding,
    PlainCode,
    Recording,
    Script,
    Target,
)
from coursebuild.core.pages.strings import Strings

SpecialBlock: TypeAlias = Callout | Mjcf | PlainCode | FeatureBlock | Recording | Script
"""The blocks beyond Markdown."""


class Context:
    """The context of text that is on no page. A `Markup` is HTML already, a string is not."""

    @property
    def words(self) -> Strings:
        """The interface texts, which headings, tables, tasks and footnotes need."""
        return Strings({})

    @property
    def direction(self) -> Literal["", "ltr", "rtl"]:
        """The direction of text, to keep numbers with their units; empty not to do that."""
        return ""

    def href(self, target: Target) -> str:
        """The address of a link."""
        return ""

    def reference(self, target: Target) -> str:
        """The text of a link that has none; perhaps empty."""
        return ""

    def url(self, url: str) -> str:
        """The address of an image that is written as `url`."""
        return url

    def figure(self, image: Image, caption: Markup) -> Markup:
        """An image with a caption, with its line end."""
        return Markup()

    def math(self, tex: str) -> Markup:
        """An inline formula, typeset."""
        return Markup(rf'<span class="math">\({escape(tex)}\)</span>')

    def display(self, tex: str, start: int) -> Markup:
        """A formula on a line of its own, at an offset in the document."""
        return Markup(rf'<span class="math">\[{escape(tex)}\]</span>')

    def code(self, language: str, text: str) -> Markup:
        """A block of code that is only shown, not run."""
        return Markup(f"<pre><code>{escape(text)}</code></pre>\n")

    def binding(self, binding: NumberBinding) -> Markup:
        """A number that is bound to an output."""
        return escape(binding.text)

    def block(self, block: SpecialBlock) -> Markup:
        """A block beyond Markdown."""
        return Markup()
