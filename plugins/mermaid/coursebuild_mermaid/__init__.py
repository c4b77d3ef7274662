"""Mermaid diagrams, drawn when the course is built, so that pages need no script and no network.

A `mermaid` fence holds a diagram in Mermaid's language; `alt="…"` says what it shows.
"""

from __future__ import annotations

import base64
import re
import sys
from pathlib import Path
from types import ModuleType

from markupsafe import Markup

from coursebuild.api import (
    Feature,
    FeatureBlock,
    Fence,
    FenceKind,
    IndexReader,
    MarkdownWriter,
    PageContext,
    Parsed,
    Rule,
    TextParser,
    diagnose,
    marks,
)

# It draws pictures of pixels, of which none is needed, and as soon as it is loaded, each command
# would end with 150 lines about what it leaves behind.
sys.modules["novasvg"] = ModuleType("novasvg")
import mmdr  # noqa: E402

del sys.modules["novasvg"]

SIZE = re.compile(r'viewBox="\S+ \S+ (\S+) (\S+)"')


class Diagram(FeatureBlock, frozen=True):
    """A diagram: its text and its drawing."""

    text: str
    alt: str
    """A description for readers who cannot see it."""
    svg: str


def parse(fence: Fence, texts: TextParser) -> Parsed[Diagram | None]:
    """Read the diagram of a fence."""
    keys = fence.keys(values=("alt",))
    diagnostics = list(keys.diagnostics)
    alt = keys.value.value("alt") or ""
    if not alt.strip():
        help = 'write `mermaid alt="…"`, for readers who cannot see it'
        diagnostics.append(
            diagnose("mermaid-alt", fence.head, "this diagram is not described", help=help)
        )
    try:
        svg = mmdr.render(fence.body.text).svg()
    except ValueError as error:
        place = fence.body_span.first_line()
        diagnostics.append(diagnose("mermaid-syntax", place, f"Mermaid: {error}"))
        return Parsed(None, tuple(diagnostics))
    text = fence.body.text.rstrip("\n")
    return Parsed(Diagram(fence.span, text, alt, svg), tuple(diagnostics))


def draw(page: PageContext, block: Diagram) -> Markup:
    """Draw the diagram as a picture, in which no script can run, with its text."""
    data = base64.b64encode(block.svg.encode()).decode()
    size = SIZE.search(block.svg)
    width, height = (f"{float(number):.0f}" for number in size.groups()) if size else ("", "")
    picture = Markup('<img src="data:image/svg+xml;base64,{}" alt="{}" width="{}" height="{}">')
    details = Markup("<details><summary>{}</summary>\n{}</details>")
    text = details.format(page.renderer.words("mermaid.text"), page.code("", block.text))
    image = picture.format(data, block.alt, width, height)
    return Markup('<figure class="mermaid">{}\n{}</figure>').format(image, text)


def markdown(writer: MarkdownWriter, block: Diagram) -> str:
    """Return the text itself, which many readers of Markdown draw."""
    return marks.fence("mermaid", block.text)


def index(reader: IndexReader, block: Diagram) -> None:
    """Let the search find its description."""
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
