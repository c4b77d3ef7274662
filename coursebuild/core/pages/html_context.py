"""What the writer of HTML (`markup.py`) asks, since it depends on the course.

Entry points: `Context`, the answers for text that stands on no page; `OwnBlock`, the blocks that
are more than Markdown.
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

OwnBlock: TypeAlias = Callout | Mjcf | PlainCode | FeatureBlock | Recording | Script
"""The blocks that are more than Markdown."""


class Context:
    """Answers for text that stands on no page. A `Markup` is HTML already, a string is not."""

    @property
    def words(self) -> Strings:
        """The interface's words, which headings, tables, tasks and footnotes need."""
        return Strings({})

    @property
    def direction(self) -> Literal["", "ltr", "rtl"]:
        """Which way text runs, so that numbers are kept with their units; empty: they are not."""
        return ""

    def href(self, target: Target) -> str:
        """The address of a link."""
        return ""

    def reference(self, target: Target) -> str:
        """What a link without a text says; empty where it says nothing."""
        return ""

    def url(self, url: str) -> str:
        """The address of an image that is written as `url`."""
        return url

    def figure(self, image: Image, caption: Markup) -> Markup:
        """An image with a caption, with its line end."""
        return Markup()

    def math(self, tex: str) -> Markup:
        """A formula in a line of text, set."""
        return Markup(rf'<span class="math">\({escape(tex)}\)</span>')

    def display(self, tex: str, start: int) -> Markup:
        """A formula on a line of its own, which begins at an offset of the document."""
        return Markup(rf'<span class="math">\[{escape(tex)}\]</span>')

    def code(self, language: str, text: str) -> Markup:
        """A whole block of code that is only shown."""
        return Markup(f"<pre><code>{escape(text)}</code></pre>\n")

    def binding(self, binding: NumberBinding) -> Markup:
        """A number that is bound to an output."""
        return escape(binding.text)

    def block(self, block: OwnBlock) -> Markup:
        """A block that is more than Markdown."""
        return Markup()
