"""What the Markdown renderer asks about a page: addresses, formulas, code, our own blocks.

Entry point: `PageContext`, the renderer's context for one document on one page.

A recorded output that directly follows its script is drawn as one object with it; `joined` says
which recordings those are, and such a recording gives nothing where it stands by itself.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import assert_never
from urllib.parse import quote, unquote

from markupsafe import Markup, escape
from msgspec import Struct

from coursebuild.core.model import (
    Block,
    Callout,
    Document,
    FeatureBlock,
    Image,
    Inline,
    ListBlock,
    Mjcf,
    NumberBinding,
    PlainCode,
    Recording,
    Script,
    Target,
    UrlTarget,
    child_blocks,
    document_blocks,
)
from coursebuild.core.pages import blocks, formulas, markup, urls
from coursebuild.core.pages.direction import direction
from coursebuild.core.pages.document_inputs import document_inputs, file_address
from coursebuild.core.pages.equations import NumberedFormula, numbered
from coursebuild.core.pages.html_context import HtmlOptions, OwnBlock, Words
from coursebuild.core.pages.library import Library
from coursebuild.core.pages.page_inputs import ShownDocument
from coursebuild.core.pages.renderer import Renderer
from coursebuild.core.pages.strings import Strings
from coursebuild.core.registry import kind_of_block


class PageContext(Struct, frozen=True):
    """One document on one page."""

    renderer: Renderer
    shown: ShownDocument
    place: urls.Place
    document: Document
    joined: Mapping[int, tuple[Recording, ...]]
    """The recordings drawn with a script, by the offset at which the script begins."""
    options: HtmlOptions
    """The words that Markdown's own elements need."""
    outputs: Mapping[int, int]
    """Which output of its script a recording is, from 1, by the offset at which it begins."""
    equations: Mapping[int, NumberedFormula]
    """Formulas on lines of their own, by their offset."""

    @classmethod
    def of(cls, library: Library, place: urls.Place, document: Document) -> PageContext:
        """The context of a document on a page of a course."""
        return cls.made(
            library.renderer, document_inputs(library, place, document), place, document
        )

    @classmethod
    def made(
        cls, renderer: Renderer, shown: ShownDocument, place: urls.Place, document: Document
    ) -> PageContext:
        """The context, once it is known what the page shows of the course."""
        options = HtmlOptions(
            words=_markup_words(renderer.words), quantities=direction(renderer.words.language)
        )
        joined, outputs = dict(_joined(document)), _numbers(document)
        equations = numbered(document, lambda tex: renderer.mathml(tex, True))
        return cls(renderer, shown, place, document, joined, options, outputs, equations)

    # what the Markdown renderer asks

    def href(self, target: Target) -> str:
        """The address of a link's target."""
        return self.shown.hrefs[target]

    def url(self, url: str) -> str:
        """An address as written, but a file of the course becomes its place in the site."""
        return file_address(self.place, self.document.source.path, url)

    def figure(self, image: Image, caption: Markup) -> Markup:
        """An image with its caption, its script and its data."""
        return blocks.figure(self, image, caption) + Markup("\n")

    def math(self, tex: str) -> Markup:
        """A formula in a line of text."""
        label = self.renderer.words("markup.formula")
        return Markup(formulas.in_line(str(self.renderer.mathml(tex, False)), label))

    def display(self, tex: str, start: int) -> Markup:
        """A formula on a line of its own, which scrolls inside itself where it is too wide."""
        mathml = self.renderer.mathml(tex, True)
        html = self.template("blocks/formula.html", mathml=mathml)
        known = self.equations.get(start)
        if known is None:
            return html
        number = f'<span class="equation-number">({escape(known.number)})</span>'
        label = escape(self.options.words.formula)
        link = f'<a class="anchor" href="#{quote(known.id)}" aria-label="{label}">#</a>'
        return Markup(
            f'<span class="equation" id="{escape(known.id)}">{html}'
            f"{number if known.shown else ''}{link}</span>"
        )

    def reference(self, target: Target) -> str:
        """What a link without a text says: the number of the formula that it leads to."""
        if isinstance(target, UrlTarget) and target.url.startswith("#"):
            name = unquote(target.url[1:])
            here = (known.number for known in self.equations.values() if known.id == name)
            number = next(here, "")
            return f"({number})" if number else ""
        return self.shown.equations.get(target, "")

    def code(self, language: str, text: str) -> Markup:
        """A code block that is only shown."""
        return blocks.code(self, language, text.rstrip("\n")) + Markup("\n")

    def binding(self, binding: NumberBinding) -> Markup:
        """A number that the build has compared with what a script printed."""
        return blocks.binding(self, binding)

    def block(self, block: OwnBlock) -> Markup:
        """A block that is ours, with its line end."""
        html = self._block(block)
        return html + Markup("\n") if html else html

    def _block(self, block: OwnBlock) -> Markup:
        match block:
            case Callout():
                return blocks.callout(self, block)
            case Script():
                return blocks.script(self, block, self.joined.get(block.span.start, ()))
            case Recording():
                joined = any(block in recordings for recordings in self.joined.values())
                return Markup() if joined else blocks.recording(self, block)
            case Mjcf():
                return blocks.mjcf(self, block)
            case PlainCode():
                return blocks.plain_code(self, block)
            case FeatureBlock():
                return kind_of_block(block).draw(self, block)
            case _:
                assert_never(block)

    # what the blocks ask

    def blocks(self, content: tuple[Block, ...]) -> Markup:
        """Blocks as HTML, without the last line end."""
        return Markup(str.rstrip(markup.render_blocks(content, self, self.options), "\n"))

    def inlines(self, content: tuple[Inline, ...]) -> Markup:
        """Inlines as HTML."""
        return markup.render_inlines(content, self, self.options)

    def footnotes(self) -> Markup:
        """The document's footnotes."""
        return markup.render_footnotes(self.document.footnotes, self, self.options)

    def highlight(self, language: str, text: str) -> Markup:
        """Code with its tokens marked."""
        return self.renderer.highlight(language, text)

    def template(self, name: str, **values: object) -> Markup:
        """A filled-in template."""
        return self.renderer.render(name, **values)


def _markup_words(words: Strings) -> Words:
    return Words(
        anchor=words("markup.anchor"),
        formula=words("markup.formula_anchor"),
        footnotes=words("markup.footnotes"),
        footnote=words("markup.footnote"),
        back=words("markup.back"),
        back_again=words("markup.back_again"),
        table=words("markup.table"),
        done=words("markup.done"),
        not_done=words("markup.not_done"),
    )


def _numbers(document: Document) -> dict[int, int]:
    """The outputs of each script, counted."""
    counts: dict[str, int] = {}
    numbers: dict[int, int] = {}
    for block in document_blocks(document):
        if isinstance(block, Recording) and block.script is not None:
            counts[block.script] = numbers[block.span.start] = counts.get(block.script, 0) + 1
    return numbers


def _joined(document: Document) -> Iterator[tuple[int, tuple[Recording, ...]]]:
    yield from _joined_in(document.blocks)
    for footnote in document.footnotes:
        yield from _joined_in(footnote.blocks)


def _joined_in(siblings: tuple[Block, ...]) -> Iterator[tuple[int, tuple[Recording, ...]]]:
    """The scripts among siblings, each with the recordings that follow it at once."""
    for number, block in enumerate(siblings):
        if isinstance(block, Script):
            following: list[Recording] = []
            for sibling in siblings[number + 1 :]:
                if not isinstance(sibling, Recording) or sibling.script != block.path:
                    break
                following.append(sibling)
            yield block.span.start, tuple(following)
        for children in _sibling_groups(block):
            if children:
                yield from _joined_in(children)


def _sibling_groups(block: Block) -> tuple[tuple[Block, ...], ...]:
    """The blocks inside a block; those of different list items are no siblings."""
    if isinstance(block, ListBlock):
        return tuple(item.blocks for item in block.items)
    return (child_blocks(block),)
