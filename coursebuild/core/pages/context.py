"""What the Markdown renderer asks about a page: addresses, formulas, code, our own blocks.

Entry point: `PageContext`, the `Context` of one document on one page.

A recorded output that directly follows its script is drawn as one object with it; `joined` says
which recordings those are, and such a recording gives nothing where it stands by itself.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cached_property
from typing import Literal, assert_never
from urllib.parse import unquote

from markupsafe import Markup
from msgspec import Struct

from coursebuild.core.model import (
    Block,
    Callout,
    Document,
    Equation,
    FeatureBlock,
    Image,
    Inline,
    Mjcf,
    NumberBinding,
    PlainCode,
    Recording,
    Script,
    Target,
    UrlTarget,
    document_blocks,
    sibling_groups,
)
from coursebuild.core.pages import blocks, formulas, markup, urls
from coursebuild.core.pages.direction import direction
from coursebuild.core.pages.document_inputs import file_address
from coursebuild.core.pages.equations import number_equations
from coursebuild.core.pages.html_context import Context, OwnBlock
from coursebuild.core.pages.page_inputs import DocumentInputs
from coursebuild.core.pages.renderer import Renderer
from coursebuild.core.pages.strings import Strings
from coursebuild.core.registry import kind_of_block


class PageContext(Context, Struct, frozen=True, dict=True):
    """One document on one page."""

    renderer: Renderer
    inputs: DocumentInputs
    place: urls.Place
    document: Document

    @cached_property
    def joined(self) -> Mapping[int, tuple[Recording, ...]]:
        """The recordings drawn with a script, by the offset at which the script begins."""
        return dict(_joined(self.document))

    @cached_property
    def outputs(self) -> Mapping[int, int]:
        """Which output of its script a recording is, from 1, by the offset at which it begins."""
        counts: dict[str, int] = {}
        numbers: dict[int, int] = {}
        for block in document_blocks(self.document):
            if isinstance(block, Recording) and block.script is not None:
                counts[block.script] = numbers[block.span.start] = counts.get(block.script, 0) + 1
        return numbers

    @cached_property
    def equations(self) -> Mapping[int, Equation]:
        """Formulas on lines of their own, by their offset."""
        return number_equations(self.document, self.renderer.mathml)

    # what the Markdown renderer asks

    @property
    def words(self) -> Strings:
        """The interface's words."""
        return self.renderer.words

    @property
    def direction(self) -> Literal["ltr", "rtl"]:
        """Which way the course's language runs."""
        return direction(self.words.language)

    def href(self, target: Target) -> str:
        """The address of a link's target."""
        return self.inputs.hrefs[target]

    def url(self, url: str) -> str:
        """An address as written, but a file of the course becomes its place in the site."""
        return file_address(self.place, self.document.source.path, url)

    def figure(self, image: Image, caption: Markup) -> Markup:
        """An image with its caption, its script and its data."""
        return blocks.figure(self, image, caption) + Markup("\n")

    def math(self, tex: str) -> Markup:
        """A formula in a line of text."""
        label = self.words("markup.formula")
        return Markup(formulas.in_line(str(self.renderer.mathml(tex, False)), label))

    def display(self, tex: str, start: int) -> Markup:
        """A formula on a line of its own, which scrolls inside itself where it is too wide."""
        mathml = self.renderer.mathml(tex, True)
        known = self.equations.get(start)
        return self.template("blocks/formula.html", mathml=mathml, known=known)

    def reference(self, target: Target) -> str:
        """What a link without a text says: the number of the formula that it leads to."""
        if isinstance(target, UrlTarget) and target.url.startswith("#"):
            name = unquote(target.url[1:])
            here = (known.number for known in self.equations.values() if known.id == name)
            number = next(here, "")
            return f"({number})" if number else ""
        return self.inputs.equations.get(target, "")

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
        return Markup(str.rstrip(markup.render_blocks(content, self), "\n"))

    def inlines(self, content: tuple[Inline, ...]) -> Markup:
        """Inlines as HTML."""
        return markup.render_inlines(content, self)

    def footnotes(self) -> Markup:
        """The document's footnotes."""
        return markup.render_footnotes(self.document.footnotes, self)

    def highlight(self, language: str, text: str) -> Markup:
        """Code with its tokens marked."""
        return self.renderer.highlight(language, text)

    def template(self, name: str, **values: object) -> Markup:
        """A filled-in template."""
        return self.renderer.render(name, **values)


def _joined(document: Document) -> Iterator[tuple[int, tuple[Recording, ...]]]:
    """Where each script begins, and the recordings that follow it at once."""
    for siblings in sibling_groups(document):
        for number, block in enumerate(siblings):
            if not isinstance(block, Script):
                continue
            following: list[Recording] = []
            for sibling in siblings[number + 1 :]:
                if not isinstance(sibling, Recording) or sibling.script != block.path:
                    break
                following.append(sibling)
            yield block.span.start, tuple(following)
