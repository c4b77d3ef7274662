"""Drawing pages: blocks beyond Markdown, texts of documents, and inputs through the templates."""

from __future__ import annotations

import re
import shlex
from collections.abc import Callable, Iterable, Iterator, Sequence
from decimal import Decimal
from typing import TypeAlias

from markupsafe import Markup, escape
from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core import model
from coursebuild.core.model.addresses import recorded_figures
from coursebuild.core.model.results import Outcome
from coursebuild.core.pages import urls
from coursebuild.core.pages.context import (
    AddedParts,
    HighlightedFile,
    LessonGraph,
    PageContext,
    PageHead,
    PageInputs,
    ShownDownload,
    ShownRun,
)
from coursebuild.core.pages.graph import drawings
from coursebuild.core.pages.listings import highlight_lines
from coursebuild.core.pages.markup import SpecialBlock
from coursebuild.core.pages.renderer import Renderer, Strings
from coursebuild.core.registry import kind_of_block, model_parts, page_kind
from coursebuild.core.text.characters import visible


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

    def other_marks(self) -> Markup:
        """What is shown before the text, of mistakes outside of its blocks."""
        return Markup()

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
            sides=self.sides(image.url),
            figure=recorded,
            is_drawn=not self.is_undrawn(image),
            dark=recorded and recorded.has_dark and self.place.href(urls.dark_path(recorded.path)),
            anchor=recorded and model.listing_anchor(recorded.script),
            unrepeated=recorded and recorded.script in runs and runs[recorded.script].unrepeated,
            data=data and self.place.href(urls.file_path(data.path)),
        )
        return html + Markup("\n")

    def is_undrawn(self, image: model.Image) -> bool:
        """Whether an image is a script's figure that is not recorded yet."""
        path = model.local_file(image.url, self.document.source.path)
        figures = {figure.span for figure in recorded_figures(self.document)}
        return path in self.inputs.absent_files and image.url_span in figures

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
                    number=self.number(block.label),
                    title=self.inlines(block.title),
                    body=self.blocks(block.blocks),
                )
            case model.Script() | model.ScriptPart():
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
                    editor=self.code_href(block),
                    enclosure=model.enclosure(block),
                )
            case model.PlainCode():
                code = self.highlight(block.language, block.code.text.rstrip("\n"))
                html = self.template("blocks/code.html", language=block.language, html=code)
                if block.source is not None:
                    source = block.source
                    lines = re.fullmatch(r"L(\d+)(?:-L(\d+))?", source.part)
                    part = source.part
                    if lines is not None:
                        part = self._lines(int(lines[1]), int(lines[2] or lines[1]))
                    html = self.template(
                        "blocks/source_part.html", path=source.path, part=part, code=html
                    )
            case model.FeatureBlock():
                html = kind_of_block(block).draw(self, block)
        return html + Markup("\n") if html else html

    def _script(
        self, block: model.Script | model.ScriptPart, recordings: tuple[model.Recording, ...]
    ) -> Markup:
        """A script or a part of one, and the outputs that belong to it, as one object."""
        script, first = self.script_places[block.span.start]
        lines = highlight_lines(script.language, block.code.text.rstrip("\n"))
        receipt = None
        if isinstance(block, model.Script) and not recordings:
            receipt = script_receipt(self, block)
        return self.template(
            "blocks/script.html",
            script=script,
            begins=isinstance(block, model.Script),
            label=block.label,
            number=self.number(block.label),
            first=first,
            code=numbered_lines(lines, block.path, first),
            lines=self._lines(first, first + len(lines) - 1),
            show=block.show,
            anchor=model.listing_anchor(block.path),
            download=self.inputs.downloads.get(block.path),
            commands=run_commands(self.inputs.downloads.get(block.path), script.args),
            outputs=tuple(map(self._output, recordings)),
            receipt=receipt,
        )

    def _lines(self, first: int, last: int) -> str:
        return self.words("code.lines" if first < last else "code.line", first=first, last=last)

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
    if verdict is None or run is None or verdict.status == "unchecked":
        return _not_run(words, run)
    versions = words.join(run.versions)
    match verdict.status:
        case "verified":
            text = words("receipt.verified", versions=versions)
            if run.recorded:
                text = words("receipt.once", when=run.recorded)
            text = f"{text} {_describe_comparison(words, verdict.comparison)}."
            if run.unrepeated:
                text = words("receipt.unrepeated", versions=versions)
            rows, printed_rows = verdict.rows
            if rows < printed_rows:
                text += f" {words('receipt.rows', count=rows, printed=printed_rows)}"
            return Receipt("unverified" if run.unrepeated else "verified", text)
        case "volatile":
            return Receipt("volatile", words("receipt.volatile", versions=versions))
        case "drift":
            return Receipt("unverified", words("receipt.drift", versions=versions))


def _describe_comparison(words: Strings, comparison: model.Comparison) -> str:
    match comparison.mode:
        case model.Mode.EXACT | model.Mode.VOLATILE:
            text = words("receipt.exact")
        case model.Mode.DIGITS:
            text = words("receipt.digits")
        case model.Mode.TOLERANCE:
            rtol, atol = _short(comparison.rtol), _short(comparison.atol)
            if comparison.rtol and comparison.atol:
                text = words("receipt.rtol_atol", rtol=rtol, atol=atol)
            elif comparison.rtol:
                text = words("receipt.rtol", rtol=rtol)
            else:
                text = words("receipt.atol", atol=atol)
    if comparison.ellipsis:
        text += f"; {words('receipt.ellipsis')}"
    if comparison.volatile:
        text += f"; {words('receipt.varies', pattern=comparison.volatile)}"
    return text


def _short(value: Decimal) -> str:
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
        return Receipt("verified", words("receipt.ran", versions=words.join(run.versions)))
    return _not_run(words, run)


def _not_run(words: Strings, run: ShownRun | None) -> Receipt:
    if run is not None and run.outcome is Outcome.SKIPPED:
        return Receipt("unverified", words("receipt.skipped", modules=words.join(run.missing)))
    if run is not None and run.outcome is Outcome.NORUN:
        return Receipt("unverified", words("receipt.norun"))
    return Receipt("unverified", words("receipt.unchecked"))


def run_commands(
    download: ShownDownload | None, args: Sequence[str]
) -> tuple[tuple[str, ...], ...]:
    """The ways to run what is handed over, each in steps: with uv, or with nothing but Python."""
    if download is None:
        return ()
    run = shlex.join((download.entry, *args))
    if not download.packages:
        uv_steps = () if download.unknown_modules else ((f"uv run {run}",),)
        return *uv_steps, (f"python {run}",)
    if download.is_archive:
        packages = "-r requirements.txt"
        uv = f"uv run --with-requirements requirements.txt {run}"
    else:
        packages, uv = shlex.join(download.packages), f"uv run {run}"
    steps = (f"pip install {packages}", f"python {run}")
    return (steps,) if download.unknown_modules else ((uv,), steps)


def numbered_lines(lines: Iterable[Markup], path: str, first: int = 1) -> Markup:
    """Number lines of a file, from its line `first` on, so that each can be linked to.

    The number is in the anchor only, not in the text, so that it is neither copied nor read out.
    """
    start, _, _ = model.line_anchor(path, first).rpartition(str(first))
    before = f'<span id="{escape(start)}'
    return Markup("\n".join(f'{before}{n}">{line}</span>' for n, line in enumerate(lines, first)))


# --- whole pages


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


_WIDE = (model.Script, model.ScriptPart, model.Recording, model.Mjcf, model.Table, model.HtmlBlock)


def _is_wide(block: model.Block) -> bool:
    if isinstance(block, model.FeatureBlock):
        return kind_of_block(block).wide
    return isinstance(block, _WIDE)


def _docked(block: model.Block) -> model.FeatureBlock | None:
    if isinstance(block, model.FeatureBlock) and kind_of_block(block).docked(block):
        return block
    return None


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
    inputs: PageInputs,
    document: model.Document | None,
    renderer: Renderer,
    make_writer: Callable[..., PageWriter] = PageWriter,
) -> tuple[PageHead, Markup, PageContext | None]:
    """Draw a page: return its head, its body and the context of its document."""
    page: PageWriter | None = None
    values = dict(inputs.values)
    for name, value in inputs.values.items():
        match value:
            case HighlightedFile():
                lines = highlight_lines(value.language, value.text)
                values[name] = numbered_lines(lines, value.path)
            case LessonGraph():
                values[name] = drawings(value)
            case AddedParts():
                parts = model_parts()
                html = (parts[key].draw(renderer, part) for key, part in value.values.items())
                values[name] = Markup("").join(html)
            case _:
                pass
    head = inputs.head
    if document is not None and inputs.document_inputs is not None:
        page = make_writer(renderer, inputs.document_inputs, urls.Place(head.path), document)
        values["contents"] = contents(page, document)
        text_html = article(page, document)
        values["article"] = page.other_marks() + text_html
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
