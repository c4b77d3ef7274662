"""Io cards: three lines that say what a script takes, does and gives."""

from __future__ import annotations

from typing import TYPE_CHECKING

from markupsafe import Markup

from coursebuild.core.features import Feature, FenceKind, IndexReader, MarkdownWriter
from coursebuild.features.io.parse import Io, parse_io

if TYPE_CHECKING:
    from coursebuild.core.pages.context import PageContext


def draw(page: PageContext, card: Io) -> Markup:
    """Draw the card as a list of terms."""
    rows = tuple((page.renderer.words(name), page.inlines(text)) for name, text in card.parts())
    return page.template("io/io.html", rows=rows)


def markdown(writer: MarkdownWriter, card: Io) -> str:
    """Write the card as a list."""
    rows = ((writer.words(name), writer.inlines(text)) for name, text in card.parts())
    return "\n".join(f"- **{label}:** {text}" for label, text in rows)


def index(reader: IndexReader, card: Io) -> None:
    """Index all lines of the card."""
    for _, text in card.parts():
        reader.add("text", reader.text(text))


KIND = FenceKind(
    name="io",
    block=Io,
    parse=parse_io,
    draw=draw,
    markdown=markdown,
    index=index,
    nested=True,
    wide=False,
)
FEATURE = Feature(name="io", fences=(KIND,))
