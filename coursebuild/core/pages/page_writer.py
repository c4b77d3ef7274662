"""Drawing the blocks beyond Markdown: values that templates in `blocks/` turn into HTML."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterable
from decimal import Decimal
from typing import assert_never

from markupsafe import Markup, escape
from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core import model
from coursebuild.core.model.addresses import recorded_figures
from coursebuild.core.model.results import Outcome
from coursebuild.core.pages import urls
from coursebuild.core.pages.context import PageContext
from coursebuild.core.pages.listings import Part, fold, highlight_lines
from coursebuild.core.pages.markup import SpecialBlock
from coursebuild.core.pages.page_inputs import ShownRun
from coursebuild.core.pages.strings import Strings
from coursebuild.core.registry import kind_of_block
from coursebuild.core.text.characters import visible


class CodePart(Struct, frozen=True):
    """A stretch of a script's lines, as HTML."""

    html: Markup
    first: int
    """The number of its first line."""
    folded: bool
    label: str
    """What is in a fold, in words."""


class Receipt(Struct, frozen=True):
    """A line that says how an output or a script was verified."""

    kind: str
    """`verified`, `volatile` or `unverified`; also a class of the style sheet."""
    text: str


class OutputView(Struct, frozen=True):
    """A recorded output, ready for its template."""

    caption: Markup
    path: str
    anchor: str
    """Empty if the script is not known."""
    text: str | None
    """The recorded text; `None` if it is a table."""
    table: Markup | None
    receipt: Receipt


class PageWriter(PageContext, frozen=True):
    """A page that can be written whole: its special blocks are drawn here, or by their feature."""

    def figure(self, block: model.Paragraph, image: model.Image, caption: Markup) -> Markup:
        """An image with its caption; a script's figure links to the script and its data."""
        files = [file for file in recorded_figures(self.document) if file.span == image.url_span]
        recorded, data = (*files, None, None)[:2]
        runs = self.inputs.runs
        html = self.template(
            "blocks/figure.html",
            image=image,
            caption=caption,
            label=block.label,
            number=self.number(block.label),
            href=self.url(image.url),
            figure=recorded,
            dark=recorded and recorded.has_dark and self.place.href(urls.dark_path(recorded.path)),
            anchor=recorded and model.listing_anchor(recorded.script),
            unrepeated=recorded and recorded.script in runs and runs[recorded.script].unrepeated,
            data=data and self.place.href(urls.file_path(data.path)),
        )
        return html + Markup("\n")

    def code(self, language: str, text: str) -> Markup:
        """A code block that is only shown, not run."""
        html = self.highlight(language, text.rstrip("\n"))
        return self.template("blocks/code.html", language=language, html=html) + Markup("\n")

    def binding(self, binding: model.NumberBinding) -> Markup:
        """A number that a script printed, marked with the script's name."""
        text = re.sub(r"(?<!\w)-(?=\d)", "\u2212", binding.text)
        runs = self.inputs.runs
        doubts = {p: r for p, r in runs.items() if r.outcome in (Outcome.SKIPPED, Outcome.NORUN)}
        path, source, doubt = binding.script, binding.source, ""
        if doubts and source is None:
            outputs = model.find_blocks(self.document, model.Recording)
            above = [block.script for block in outputs if block.body_span.end <= binding.span.start]
            printer = path or (above[-1] if above else None)
            doubt = _not_run(self.words, doubts[printer]).text if printer in doubts else ""
        return self.template(
            "blocks/binding.html", text=text, path=path, source=source, doubt=doubt
        )

    def block(self, block: SpecialBlock) -> Markup:
        """A special block, with its line end."""
        match block:
            case model.Callout():
                html = self.template(
                    "blocks/callout.html",
                    callout=block,
                    kind=self.inputs.callouts[block.kind],
                    title=self.inlines(block.title),
                    body=self.blocks(block.blocks),
                )
            case model.Script():
                html = self._script(block, self.script_outputs.get(block.span.start, ()))
            case model.Recording():
                if any(block in group for group in self.script_outputs.values()):
                    return Markup()  # drawn with its script
                html = self.template("blocks/recording.html", output=self._output(block))
            case model.Mjcf():
                html = self.template(
                    "blocks/mjcf.html",
                    mjcf=block,
                    number=self.number(block.label),
                    html=self.highlight("xml", block.code.text.rstrip("\n")),
                    engine=self.inputs.engine,
                )
            case model.PlainCode():
                code = self.highlight("python", block.code.text)
                html = self.template("blocks/code.html", language="python", html=code)
                if block.source is not None:
                    path = block.source.path
                    html = self.template("blocks/source_part.html", path=path, code=html)
            case model.FeatureBlock():
                html = kind_of_block(block).draw(self, block)
            case _:
                assert_never(block)
        return html + Markup("\n") if html else html

    def _script(self, block: model.Script, recordings: tuple[model.Recording, ...]) -> Markup:
        """A script and the outputs that belong to it, as one object."""
        text = block.code.text.rstrip("\n")
        lines = highlight_lines("python", text)
        parts = (Part(1, len(lines), folded=True),) if block.figures else fold(text)
        return self.template(
            "blocks/script.html",
            script=block,
            number=self.number(block.label),
            parts=tuple(
                CodePart(
                    numbered_lines(lines[part.first - 1 : part.last], block.path, part.first),
                    part.first,
                    part.folded,
                    _fold_label(self.words, part),
                )
                for part in parts
            ),
            anchor=model.listing_anchor(block.path),
            href=self.place.href(block.path),
            command=shlex.join(("python", block.path, *block.args)),
            outputs=tuple(map(self._output, recordings)),
            receipt=None if recordings else script_receipt(self, block),
        )

    def _output(self, block: model.Recording) -> OutputView:
        script, table = block.script, block.body
        numbers = model.output_numbers(self.document)
        caption = self.inlines(block.caption) or Markup(escape(self.words("code.caption")))
        if isinstance(table, model.Table) and table.label is not None:
            name = Markup('<span class="numbered" id="{}">{}</span> {}')
            caption = name.format(table.label.id, self.number(table.label), caption)
            table = replace(table, label=None)
        return OutputView(
            caption=caption,
            path=script or "",
            anchor=model.output_anchor(script, numbers[block.span.start]) if script else "",
            text=None if isinstance(table, model.Table) else visible(table.text).rstrip("\n"),
            table=self.blocks((table,)) if isinstance(table, model.Table) else None,
            receipt=output_receipt(self, block),
        )


def output_receipt(page: PageContext, block: model.Recording) -> Receipt:
    """The receipt of a recorded output."""
    words, inputs = page.words, page.inputs
    verdict, run = inputs.verdicts.get(block.span.start), inputs.runs.get(block.script or "")
    versions = {"engine": inputs.engine, "python": inputs.python}
    if verdict is None or verdict.status == "unchecked":
        return _not_run(words, run)
    match verdict.status:
        case "verified":
            text = words("receipt.verified", **versions)
            if run is not None and run.recorded:
                text = words("receipt.once", when=run.recorded)
            if run is not None and run.unrepeated:
                return Receipt("unverified", words("receipt.unrepeated", **versions))
            return Receipt("verified", f"{text} {_describe_comparison(words, verdict.comparison)}.")
        case "volatile":
            return Receipt("volatile", words("receipt.volatile", **versions))
        case "drift":
            return Receipt("unverified", words("receipt.drift", **versions))
        case _:
            assert_never(verdict.status)


def _describe_comparison(words: Strings, comparison: model.Comparison) -> str:
    match comparison.mode:
        case model.Mode.EXACT | model.Mode.VOLATILE:
            text = words("receipt.exact")
        case model.Mode.DIGITS:
            text = words("receipt.digits")
        case model.Mode.TOLERANCE:
            rtol, atol = short(comparison.rtol), short(comparison.atol)
            if comparison.rtol and comparison.atol:
                text = words("receipt.rtol_atol", rtol=rtol, atol=atol)
            elif comparison.rtol:
                text = words("receipt.rtol", rtol=rtol)
            else:
                text = words("receipt.atol", atol=atol)
        case _:
            assert_never(comparison.mode)
    if comparison.ellipsis:
        text += f"; {words('receipt.ellipsis')}"
    if comparison.volatile:
        text += f"; {words('receipt.varies', pattern=comparison.volatile)}"
    return text


def short(value: Decimal) -> str:
    """A tolerance as a person writes it: `1e-6`, `0.05`."""
    value = value.normalize()
    return f"{value:f}" if -4 < value.adjusted() < 6 else f"{value:e}"


def script_receipt(page: PageContext, block: model.Script) -> Receipt:
    """The receipt of a script without a recorded output."""
    words, inputs = page.words, page.inputs
    run = inputs.runs.get(block.path)
    if run is not None and run.recorded:
        return Receipt("verified", words("receipt.once_ran", when=run.recorded))
    if run is not None and run.outcome is Outcome.OK:
        text = words("receipt.ran", engine=inputs.engine, python=inputs.python)
        return Receipt("verified", text)
    return _not_run(words, run)


def _not_run(words: Strings, run: ShownRun | None) -> Receipt:
    if run is not None and run.outcome is Outcome.SKIPPED:
        return Receipt("unverified", words("receipt.skipped", modules=", ".join(run.missing)))
    if run is not None and run.outcome is Outcome.NORUN:
        return Receipt("unverified", words("receipt.norun"))
    return Receipt("unverified", words("receipt.unchecked"))


def numbered_lines(lines: Iterable[Markup], path: str, first: int = 1) -> Markup:
    """Number lines of a file, from its line `first` on, so that each can be linked to.

    The number is in the anchor only, not in the text, so that it is neither copied nor read out.
    """
    start, _, _ = model.line_anchor(path, first).rpartition(str(first))
    before = f'<span id="{escape(start)}'
    return Markup("\n".join(f'{before}{n}">{line}</span>' for n, line in enumerate(lines, first)))


def _fold_label(words: Strings, part: Part) -> str:
    lines = words(
        "code.lines" if part.first < part.last else "code.line", first=part.first, last=part.last
    )
    holds = [words("code.docstring")] if part.docstring else []
    holds += [words("code.imports")] if part.imports else []
    holds += part.names
    return f"{lines}: {', '.join(holds)}" if holds else lines
