"""Writes the course's own blocks as plain Markdown: scripts, outputs, labs, quizzes, callouts.

Entry point: `DocumentWriter`, for one document on one page.

A script is a fence below its name, a lab its recorded picture and values, a quiz a list with its
answers.
"""

from __future__ import annotations

import shlex
from collections.abc import Callable
from dataclasses import dataclass
from typing import assert_never

from markupsafe import Markup

from coursebuild.core import model
from coursebuild.core.pages.context import PageContext
from coursebuild.core.pages.marks import block_quote, code_span, escape_marks, fence, hang, link
from coursebuild.core.pages.markup import SpecialBlock
from coursebuild.core.pages.page_writer import output_receipt, script_receipt
from coursebuild.core.registry import kind_of_block
from coursebuild.features.markdown.blocks import BlockWriter
from coursebuild.features.markdown.from_html import html_to_markdown


@dataclass(frozen=True)
class DocumentWriter(BlockWriter):
    """Writes a document as plain Markdown."""

    page: PageContext
    locate: Callable[[str], str]
    """Convert an address on the page to one in the Markdown."""
    live: str
    """The address of the page, where labs run."""
    notebook: bool = False
    """Whether scripts have cells of their own, answers are folded, and footnotes are a list."""

    def href(self, target: model.Target) -> str:
        """Return the address of a link."""
        return self.locate(self.page.href(target))

    def url(self, url: str) -> str:
        """Return the address of a picture."""
        return self.locate(self.page.url(url))

    def reference(self, note: int) -> str:
        """Return a reference to a footnote."""
        return f"<sup>{note}</sup>" if self.notebook else f"[^{note}]"

    def link_text(self, target: model.Target) -> str:
        """Return the text for a link without one."""
        return self.page.reference(target)

    def formula_number(self, start: int) -> str:
        """Return the number of a formula that does not show one itself."""
        item = self.page.numbered_items.get(start)
        return item.number if item is not None and item.has_margin_number else ""

    def number(self, label: model.Label | None) -> str:
        """Return the name that a label gives."""
        return self.page.number(label)

    def citation(self, citation: model.Citation) -> str:
        """Return a citation, with links to the references below the text."""
        return self.html(self.page.citation(citation))

    def references(self) -> str:
        """Return the list of the sources that the document cites; perhaps empty."""
        entries = (self.html(entry.html) for entry in self.page.inputs.citations.entries)
        items = "\n".join(hang("- ", entry) for entry in entries)
        return f"**{self.words('references.title')}**\n\n{items}" if items else ""

    def own_block(self, block: SpecialBlock) -> str:
        """Write one of the course's own blocks."""
        match block:
            case model.Callout():
                return self._callout(block)
            case model.PlainCode():
                return self.below_caption(block, fence("python", block.code.text))
            case model.Script():
                return self._script(block)
            case model.Recording():
                is_joined = any(block in outputs for outputs in self.page.script_outputs.values())
                return "" if is_joined else self.recording(block)
            case model.Mjcf():
                return self._mjcf(block)
            case model.FeatureBlock():
                text = kind_of_block(block).markdown(self, block)
                return self.below_caption(block, text)
            case _:
                assert_never(block)

    def html(self, html: Markup) -> str:
        """Convert HTML of a template to Markdown."""
        return html_to_markdown(str(html), self.locate)

    def words(self, key: str, **values: str | int | float) -> str:
        """Return a text of the interface as Markdown."""
        return escape_marks(self.page.renderer.words(key, **values))

    # --- callouts, io, MJCF

    def _callout(self, block: model.Callout) -> str:
        label = f"**{escape_marks(self.page.inputs.callouts[block.kind].label)}**"
        title = self.inlines(block.title)
        head = f"{label} {title}" if title else label
        inner = self.blocks(block.blocks)
        return block_quote(f"{head}\n\n{inner}" if inner else head)

    def _mjcf(self, block: model.Mjcf) -> str:
        engine = self.page.inputs.engine
        label = (
            self.words("mjcf.fragment", element=block.fragment)
            if block.fragment
            else self.words("mjcf.label")
        )
        receipt = f"*{self.words('mjcf.compiles', engine=engine)}*"
        if block.error is not None:
            receipt = f"*{self.words('mjcf.fails', engine=engine)}* {code_span(block.error)}"
        return self.below_caption(
            block, f"{label}:\n\n{fence('xml', block.code.text)}\n\n{receipt}"
        )

    # --- scripts and outputs

    def _script(self, block: model.Script) -> str:
        href = self.locate(self.page.place.href(block.path))
        name = link(code_span(block.path), href)
        if number := self.number(block.label):
            name = f"**{escape_marks(number)}** {name}"
        if self.notebook:
            return self.words("exports.cell_below", path="\ue000").replace("\ue000", name)
        command = code_span(shlex.join(("python", block.path, *block.args)))
        run = f"{self.words('code.run')}: {command}"
        if block.requires:
            run += f" ({self.words('code.requires', modules=', '.join(block.requires))})"
        parts = [f"{name}:", fence("python", block.code.text), run]
        recordings = self.page.script_outputs.get(block.span.start, ())
        parts += [self.recording(recording) for recording in recordings]
        if not recordings:
            receipt = script_receipt(self.page, block)
            parts.append(f"*{escape_marks(receipt.text)}*")
        return "\n\n".join(parts)

    def recording(self, block: model.Recording) -> str:
        """Write an output with its caption and its receipt."""
        if isinstance(block.body, model.Table):
            body = self.blocks((block.body,))
        else:
            body = fence("text", block.body.text)
        return f"{self.caption(block)}\n\n{body}\n\n{self.receipt(block)}"

    def caption(self, block: model.Recording) -> str:
        """Write the caption of an output."""
        return self.inlines(block.caption) or escape_marks(self.words("code.caption"))

    def receipt(self, block: model.Recording) -> str:
        """Write the receipt of an output: how it was verified."""
        return f"*{escape_marks(output_receipt(self.page, block).text)}*"

    def folded(self, label: str, text: str) -> str:
        """Write a text with its label; in a notebook it is folded."""
        if self.notebook:
            return f"<details>\n<summary>{label}</summary>\n\n{text}\n\n</details>"
        begins_block = text.startswith(("```", "- ", "1. ", "$$", "> ", "| ", "<"))
        return f"**{label}:**\n\n{text}" if begins_block else f"**{label}:** {text}"
