"""Tabs: versions of a text, of which a reader sees one at a time.

A `tabs` fence holds Markdown, split by lines `=== Title`. Without a script all versions are shown
one below the other with their titles; the script turns them into tabs.
"""

from __future__ import annotations

import re
from pathlib import Path

from markupsafe import Markup
from msgspec import Struct

from coursebuild.api import (
    Block,
    Diagnostic,
    Feature,
    FeatureBlock,
    Fence,
    FenceKind,
    IndexReader,
    MarkdownWriter,
    PageContext,
    PagePart,
    Parsed,
    Rule,
    Span,
    TextParser,
    diagnose,
)

TITLE = re.compile(r"===[ \t]+(?P<title>\S.*?)[ \t]*$", re.MULTILINE)
"""A line that begins a tab."""


class Tab(Struct, frozen=True):
    """One version of the text."""

    title: str
    blocks: tuple[Block, ...]


class Tabs(FeatureBlock, frozen=True):
    """All versions; the first one is shown first."""

    tabs: tuple[Tab, ...]

    def child_blocks(self) -> tuple[Block, ...]:
        """Return the blocks of all tabs."""
        return tuple(block for tab in self.tabs for block in tab.blocks)


def parse(fence: Fence, texts: TextParser) -> Parsed[Tabs | None]:
    """Read the tabs of a fence."""
    text = fence.body.text
    titles = list(TITLE.finditer(text))
    diagnostics: list[Diagnostic] = []
    if text[: titles[0].start() if titles else None].strip():
        message, help = "this text stands in no tab", "begin with a line `=== Title`"
        diagnostics.append(_diagnose(fence.body.span().first_line(), message, help))
    if len(titles) < 2:
        message = "there is only one tab" if titles else "there are no tabs"
        help = "begin each of two or more with `=== Title`"
        diagnostics.append(_diagnose(fence.head, message, help))
    tabs: list[Tab] = []
    for title, following in zip(titles, [*titles[1:], None], strict=True):
        end = following.start() if following else len(text)
        body = texts.blocks(fence.body.slice(title.end(), end))
        tabs.append(Tab(title["title"], body.value))
        diagnostics += body.diagnostics
    return Parsed(Tabs(fence.span, tuple(tabs)), tuple(diagnostics))


def _diagnose(place: Span, message: str, help: str) -> Diagnostic:
    return diagnose("tabs", place, message, help=help)


def draw(page: PageContext, block: Tabs) -> Markup:
    """Draw the tabs on a page."""
    part = Markup('<section><p class="tab-title">{}</p>\n{}</section>\n')
    parts = (part.format(tab.title, page.blocks(tab.blocks)) for tab in block.tabs)
    return Markup('<div class="tabs" data-tabs>\n{}</div>').format(Markup().join(parts))


def markdown(writer: MarkdownWriter, block: Tabs) -> str:
    """Write the versions one below the other."""
    return "\n\n".join(f"**{tab.title}**\n\n{writer.blocks(tab.blocks)}" for tab in block.tabs)


def index(reader: IndexReader, block: Tabs) -> None:
    """Let the search find all versions."""
    for tab in block.tabs:
        reader.add("text", tab.title)
        reader.blocks(tab.blocks)


FEATURE = Feature(
    name="tabs",
    fences=(
        FenceKind(name="tabs", block=Tabs, parse=parse, draw=draw, markdown=markdown, index=index),
    ),
    rules=(Rule("tabs", "error", "A block of tabs cannot be read."),),
    style=Path(__file__).with_name("tabs.css").read_text(encoding="utf-8"),
    parts=(
        PagePart(
            mark="data-tabs",
            code=Path(__file__).with_name("tabs.js").read_text(encoding="utf-8"),
        ),
    ),
)
