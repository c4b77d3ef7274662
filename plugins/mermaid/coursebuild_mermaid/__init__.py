"""Mermaid diagrams, drawn when the course is built: no script, no network, no second look.

A `mermaid` fence holds a diagram in Mermaid's language; `alt="…"` says what it shows.
"""

from __future__ import annotations

import base64
import re
from pathlib import Path

import mmdr
from markupsafe import Markup

from coursebuild.core.features import Feature, FenceKind, IndexReader, MarkdownWriter
from coursebuild.core.model import FeatureBlock
from coursebuild.core.pages.context import PageContext
from coursebuild.core.pages.marks import fence as code_block
from coursebuild.core.syntax.fence import Fence
from coursebuild.core.syntax.texts import TextParser
from coursebuild.core.text.diagnostics import Parsed, diagnose
from coursebuild.core.text.rules import Rule

SIZE = re.compile(r'viewBox="\S+ \S+ (\S+) (\S+)"')


class Diagram(FeatureBlock, frozen=True):
    """A diagram, as it was written and as it is drawn."""

    text: str
    alt: str
    """What it shows, for who cannot see it."""
    svg: str


def parse(fence: Fence, texts: TextParser) -> Parsed[Diagram | None]:
    """The diagram of a fence."""
    keys = fence.keys(values=("alt",))
    wrong = list(keys.diagnostics)
    alt = keys.value.value("alt") or ""
    if not alt.strip():
        help = 'write `mermaid alt="…"`, for readers who cannot see it'
        wrong.append(
            diagnose("mermaid-alt", fence.head, "this diagram is not described", help=help)
        )
    try:
        svg = mmdr.render(fence.body.text).svg()
    except ValueError as error:
        wrong.append(diagnose("mermaid-syntax", fence.body_span.first_line(), f"Mermaid: {error}"))
        return Parsed(None, tuple(wrong))
    text = fence.body.text.rstrip("\n")
    return Parsed(Diagram(fence.span, text, alt, svg), tuple(wrong))


def draw(page: PageContext, block: Diagram) -> Markup:
    """The diagram in a page: a picture, in which no script of it could run, and its text."""
    data = base64.b64encode(block.svg.encode()).decode()
    size = SIZE.search(block.svg)
    width, height = (f"{float(number):.0f}" for number in size.groups()) if size else ("", "")
    picture = Markup('<img src="data:image/svg+xml;base64,{}" alt="{}" width="{}" height="{}">')
    folded = Markup("<details><summary>{}</summary>\n{}</details>")
    text = folded.format(page.renderer.words("mermaid.text"), page.code("", block.text))
    image = picture.format(data, block.alt, width, height)
    return Markup('<figure class="mermaid">{}\n{}</figure>').format(image, text)


def markdown(writer: MarkdownWriter, block: Diagram) -> str:
    """The text itself, which many readers of Markdown draw."""
    return code_block("mermaid", block.text)


def index(reader: IndexReader, block: Diagram) -> None:
    """What it shows can be found."""
    reader.add("text", block.alt)


FEATURE = Feature(
    name="mermaid",
    fences=(
        FenceKind(
            name="mermaid", block=Diagram, parse=parse, draw=draw, markdown=markdown, index=index
        ),
    ),
    rules=(
        Rule("mermaid-alt", "error", "A diagram does not say what it shows."),
        Rule("mermaid-syntax", "error", "Mermaid cannot draw a diagram."),
    ),
    texts={
        "en": '[mermaid]\ntext = "The diagram as text"\n',
        "de": '[mermaid]\ntext = "Das Diagramm als Text"\n',
        "fr": '[mermaid]\ntext = "Le diagramme en texte"\n',
        "es": '[mermaid]\ntext = "El diagrama como texto"\n',
    },
    style=Path(__file__).with_name("mermaid.css").read_text(encoding="utf-8"),
)
