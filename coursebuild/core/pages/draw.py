"""Drawing a page: its inputs and its document through the templates.

Entry point: `draw(inputs, document, renderer)`.
"""

from __future__ import annotations

from markupsafe import Markup
from msgspec.structs import replace

from coursebuild.core.model import Document, Paragraph, plain_text
from coursebuild.core.pages import urls
from coursebuild.core.pages.article import article, contents
from coursebuild.core.pages.blocks import numbered_lines
from coursebuild.core.pages.context import PageContext
from coursebuild.core.pages.graph import drawings
from coursebuild.core.pages.highlight import highlight_lines
from coursebuild.core.pages.page_inputs import (
    AddedParts,
    HighlightedFile,
    LessonGraph,
    PageHead,
    PageInputs,
)
from coursebuild.core.pages.renderer import Renderer
from coursebuild.core.registry import model_parts, page_kind


def draw(
    inputs: PageInputs, document: Document | None, renderer: Renderer
) -> tuple[PageHead, Markup, PageContext | None]:
    """Draw a page: return its head, its body and the context of its document.

    The same values give the same page.
    """
    page: PageContext | None = None
    values = {name: _draw_value(value, renderer) for name, value in inputs.values.items()}
    head = inputs.head
    if document is not None and inputs.document_inputs is not None:
        page = PageContext(renderer, inputs.document_inputs, urls.Place(head.path), document)
        values["contents"] = contents(page, document)
        values["article"] = article(page, document)
        values["title_anchor"] = document.title_anchor
        if head.kind == "page":
            head = replace(head, description=_first_sentences(document))
    kind = page_kind(head.kind)
    if kind is not None and kind.draw is not None:
        values |= {"title": head.title, "content": kind.draw(renderer, values)}
    return head, renderer.render(inputs.template, **values), page


def _draw_value(value: object, renderer: Renderer) -> object:
    match value:
        case HighlightedFile():
            return numbered_lines(highlight_lines(value.language, value.text), value.path)
        case LessonGraph():
            return drawings(value, renderer.words)
        case AddedParts():
            parts = model_parts()
            html = (parts[name].draw(renderer, values) for name, values in value.values.items())
            return Markup("").join(html)
        case _:
            return value


def _first_sentences(document: Document) -> str:
    """The first paragraph, cut at a word, for search engines."""
    first = next((b for b in document.blocks if isinstance(b, Paragraph)), None)
    text = " ".join(plain_text(first.children).split()) if first is not None else ""
    return text if len(text) <= 200 else text[:200].rsplit(" ", 1)[0] + " …"
