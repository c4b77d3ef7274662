"""Drawing a page: its inputs and its document through the templates."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TypeAlias

from markupsafe import Markup
from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core import model
from coursebuild.core.pages import page_inputs, urls
from coursebuild.core.pages.context import PageContext
from coursebuild.core.pages.graph import drawings
from coursebuild.core.pages.listings import highlight_lines
from coursebuild.core.pages.page_writer import PageWriter, numbered_lines
from coursebuild.core.pages.renderer import Renderer
from coursebuild.core.registry import kind_of_block, model_parts, page_kind


class ContentsEntry(Struct, frozen=True):
    """An entry of the table of contents."""

    anchor: str
    title: Markup
    further: bool = False
    children: tuple[ContentsEntry, ...] = ()


def article(page: PageContext, document: model.Document) -> Markup:
    """The text of a document; a docked block is placed beside the paragraphs around it."""
    parts: list[Markup] = []
    for further, blocks in model.main_and_further(document.blocks):
        heading = page.blocks(blocks[:1]) if further else None
        texts: list[Markup] = []
        for before, docked, after in _groups(blocks[1:] if further else blocks):
            html = page.blocks(before)
            if docked is not None:
                values = {"before": html, "docked": page.block(docked), "after": page.blocks(after)}
                html = page.template("partials/dock.html", **values)
            texts.append(html)
        text = Markup("\n").join(texts)
        parts.append(
            page.template("partials/further.html", heading=heading, text=text) if further else text
        )
    return Markup("\n").join(filter(None, (*parts, page.footnotes(), page.references())))


_WIDE = (model.Script, model.Recording, model.Mjcf, model.Table, model.HtmlBlock)


def _is_wide(block: model.Block) -> bool:
    if isinstance(block, model.FeatureBlock):
        return kind_of_block(block).wide
    return isinstance(block, _WIDE)


def _docked(block: model.Block) -> model.FeatureBlock | None:
    return (
        block
        if isinstance(block, model.FeatureBlock) and kind_of_block(block).docked(block)
        else None
    )


_Blocks: TypeAlias = tuple[model.Block, ...]


def _groups(blocks: _Blocks) -> Iterator[tuple[_Blocks, model.FeatureBlock | None, _Blocks]]:
    """Blocks, a docked one if any, and those after it; headings and wide blocks end a group."""
    rest = blocks
    while (at := next((i for i, b in enumerate(rest) if _docked(b)), None)) is not None:
        docked = _docked(rest[at])
        start, end = at, at + 1
        while start and not _is_wide(rest[start - 1]):
            start -= 1
            if isinstance(rest[start], model.Heading):
                break
        while end < len(rest) and not (_is_wide(rest[end]) or isinstance(rest[end], model.Heading)):
            end += 1
        if start:
            yield rest[:start], None, ()
        yield rest[start:at], docked, rest[at + 1 : end]
        rest = rest[end:]
    if rest:
        yield rest, None, ()


def contents(page: PageContext, document: model.Document) -> tuple[ContentsEntry, ...]:
    """The table of contents: headings of level 2, with those of level 3 below them."""
    entries: list[ContentsEntry] = []
    for block in document.blocks:
        if not isinstance(block, model.Heading) or block.level > 3:
            continue
        title = page.inlines(model.without_links(block.children, page.reference))
        entry = ContentsEntry(block.anchor, title, block.goes_further)
        if block.level == 3 and entries:
            entries[-1] = replace(entries[-1], children=(*entries[-1].children, entry))
        else:
            entries.append(entry)
    return tuple(entries)


def draw(
    inputs: page_inputs.PageInputs, document: model.Document | None, renderer: Renderer
) -> tuple[page_inputs.PageHead, Markup, PageContext | None]:
    """Draw a page: return its head, its body and the context of its document."""
    page: PageContext | None = None
    values = {name: _draw_value(value, renderer) for name, value in inputs.values.items()}
    head = inputs.head
    if document is not None and inputs.document_inputs is not None:
        page = PageWriter(renderer, inputs.document_inputs, urls.Place(head.path), document)
        values["contents"] = contents(page, document)
        values["article"] = article(page, document)
        values["title_anchor"] = document.title_anchor
        if head.kind == "page":
            first = next((b for b in document.blocks if isinstance(b, model.Paragraph)), None)
            inlines = () if first is None else model.without_links(first.children, page.reference)
            text = " ".join(model.plain_text(inlines).split())
            text = text if len(text) <= 200 else text[:200].rsplit(" ", 1)[0] + " …"
            head = replace(head, description=text)
    kind = page_kind(head.kind)
    if kind is not None and kind.draw is not None:
        values |= {"title": head.title, "content": kind.draw(renderer, values)}
    return head, renderer.render(inputs.template, **values), page


def _draw_value(value: object, renderer: Renderer) -> object:
    match value:
        case page_inputs.HighlightedFile():
            return numbered_lines(highlight_lines(value.language, value.text), value.path)
        case page_inputs.LessonGraph():
            return drawings(value, renderer.words)
        case page_inputs.AddedParts():
            parts = model_parts()
            html = (parts[name].draw(renderer, values) for name, values in value.values.items())
            return Markup("").join(html)
        case _:
            return value
