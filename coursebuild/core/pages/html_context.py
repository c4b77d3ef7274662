"""What the writer of HTML (`markup.py`) asks a page.

Entry points: `Context`, which is asked what depends on the course; `HtmlOptions`, details of the
HTML; `OwnBlock`, the blocks that are more than Markdown.
"""

from __future__ import annotations

from typing import Literal, Protocol, TypeAlias

from markupsafe import Markup
from msgspec import Struct, field

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

OwnBlock: TypeAlias = Callout | Mjcf | PlainCode | FeatureBlock | Recording | Script
"""The blocks that are more than Markdown."""


class Context(Protocol):
    """Answers for one page. A `Markup` is HTML already, a string is not."""

    def href(self, target: Target) -> str:
        """The address of a link."""
        ...

    def reference(self, target: Target) -> str:
        """What a link without a text says; empty where it says nothing."""
        ...

    def url(self, url: str) -> str:
        """The address of an image that is written as `url`."""
        ...

    def figure(self, image: Image, caption: Markup) -> Markup:
        """An image with a caption, with its line end."""
        ...

    def math(self, tex: str) -> Markup:
        """A formula in a line of text, set."""
        ...

    def display(self, tex: str, start: int) -> Markup:
        """A formula on a line of its own, which begins at an offset of the document."""
        ...

    def code(self, language: str, text: str) -> Markup:
        """A whole block of code that is only shown."""
        ...

    def binding(self, binding: NumberBinding) -> Markup:
        """A number that is bound to an output."""
        ...

    def block(self, block: OwnBlock) -> Markup:
        """A block that is more than Markdown."""
        ...


class Words(Struct, frozen=True):
    """The words that Markdown's own elements need; `{number}` and `{occurrence}` are filled in."""

    anchor: str = "Link to this section"
    formula: str = "Link to this formula"
    footnotes: str = "Footnotes"
    footnote: str = "Footnote {number}"
    back: str = "Back to reference {number}"
    back_again: str = "Back to reference {number}, place {occurrence}"
    table: str = "Table"
    done: str = "Done"
    not_done: str = "Not done"


class HtmlOptions(Struct, frozen=True):
    """Details of the HTML."""

    words: Words = field(default_factory=Words)
    plain: bool = False
    """Whether it is CommonMark's own: headings without ids, tables without a box that scrolls."""
    quantities: Literal["", "ltr", "rtl"] = ""
    """Whether numbers are kept with their units, and in which direction the text runs."""
