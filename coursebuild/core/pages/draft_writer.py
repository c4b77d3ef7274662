"""Drawing documents with mistakes, as a preview does: whole, with a mark at each mistake.

The mark stands before the block in which the mistake is. A link with an error is its text, and so
is an image. HTML with an error is shown as source: it might swallow what follows, or run.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import cached_property

from markupsafe import Markup, escape
from msgspec.structs import replace

from coursebuild.core import model
from coursebuild.core.pages.context import Mistakes
from coursebuild.core.pages.markup import SpecialBlock
from coursebuild.core.pages.page_writer import PageWriter


class DraftWriter(PageWriter, frozen=True):
    """A page of a document with mistakes; see the module."""

    mistakes: Mistakes = ()

    def _block(self, block: model.Block) -> str:
        if isinstance(block, model.Paragraph) and block.figure:
            images = (part for part in block.children if isinstance(part, model.Image))
            broken = filter(self._is_broken, images)  # one that is not drawn yet says so itself
            block = replace(block, figure=all(map(self.is_undrawn, broken)))
        if isinstance(block, model.HtmlBlock) and self._is_broken(block):
            html = str(self.code("html", block.html))
        else:
            html = super()._block(block)
        span = block.span
        marks = self._marks(at for at, _ in self.mistakes if span.start <= at <= span.end)
        return "".join((marks, html))

    @cached_property
    def _mark_places(self) -> set[int]:
        return set()

    def _marks(self, places: Iterable[int]) -> str:
        """Marks of mistakes, each only once on a page."""
        new = [at for at in dict.fromkeys(places) if at not in self._mark_places]
        self._mark_places.update(new)
        return "".join(f'<span id="mistake:{at}"></span>' for at in new)

    def other_marks(self) -> Markup:
        """Marks of mistakes outside of the blocks that were drawn."""
        return Markup(self._marks(at for at, _ in self.mistakes))

    def _is_broken(self, node: model.Inline | model.Block) -> bool:
        return any(node.span.start <= at < node.span.end for at, error in self.mistakes if error)

    def _link(self, link: model.Link) -> str:
        if self._is_broken(link) or not self.href(link.target):
            return self._inlines(link.children) or escape(link.span.text)
        return super()._link(link)

    def _inline(self, inline: model.Inline) -> str:
        if isinstance(inline, model.RawInline) and self._is_broken(inline):
            return f"<code>{escape(inline.html)}</code>"
        return super()._inline(inline)

    def _image(self, image: model.Image) -> str:
        if self._is_broken(image):
            return escape(image.alt)
        return super()._image(image)

    def block(self, block: SpecialBlock) -> Markup:
        """A special block; its source, if it has errors for which nothing can be drawn."""
        is_broken, places_before = self._is_broken(block), set(self._mark_places)
        try:
            html = super().block(block)
        except Exception:
            if not is_broken:
                raise
        else:
            if not is_broken or not isinstance(block, model.FeatureBlock) or html.striptags():
                return html
        self._mark_places.intersection_update(places_before)
        return self.code("", block.span.text)
