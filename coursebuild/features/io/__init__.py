"""Io cards: three parts, each after its label, that say what a script takes, does and gives."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from markupsafe import Markup
from msgspec import Struct

from coursebuild.api import (
    Diagnostic,
    Edit,
    Excerpt,
    Feature,
    FeatureBlock,
    Fence,
    FenceKind,
    Fix,
    IndexReader,
    Inline,
    MarkdownWriter,
    Note,
    PageContext,
    Parsed,
    Span,
    TextParser,
    diagnose,
    regex,
)
from coursebuild.core.syntax.spans import trim
from coursebuild.core.text.near import nearest

LABELS = ("INPUT", "PROCESS", "OUTPUT")
_LABEL = regex(r"\s*(INPUT|PROCESS|OUTPUT):")
_LIKE_LABEL = regex(r"\s*([A-Za-z]+)(?:\s*:|(?<=[A-Z]{3})[^\w\s]?(?!\S))")


class Io(FeatureBlock, frozen=True):
    """What a script takes, does and gives."""

    input: tuple[Inline, ...]
    process: tuple[Inline, ...]
    output: tuple[Inline, ...]

    def parts(self) -> tuple[tuple[str, tuple[Inline, ...]], ...]:
        """The three parts with the names of their interface texts, in order."""
        return ("io.input", self.input), ("io.process", self.process), ("io.output", self.output)

    def child_inlines(self) -> tuple[Inline, ...]:
        """The lines of all parts."""
        return (*self.input, *self.process, *self.output)


class _Part(Struct, frozen=True):
    label: str
    span: Span
    lines: list[Excerpt]


def parse_io(fence: Fence, texts: TextParser) -> Parsed[Io]:
    """Parse an `io` fence."""
    unlabelled = part = _Part("", fence.body.span(), [])
    parts: dict[str, _Part] = {}
    diagnostics = list(fence.keys().diagnostics)
    for line in fence.body.lines():
        mark = _LABEL.match(line.text)
        if mark is None:
            part.lines.append(line)
            continue
        span = line.span(mark.start(1), mark.end())
        part = _Part(mark[1], span, [line.slice(mark.end())])
        if (first := parts.setdefault(part.label, part)) is not part:
            notes = [Note("first given here", first.span)]
            message = f"`{part.label}:` is given twice"
            diagnostics.append(diagnose("io-repeated", part.span, message, notes=notes))
    for line in [line for line in unlabelled.lines if line.text.strip()][:1]:
        help = "begin with a line `INPUT: …`"
        span, message = trim(line).span(), "this text belongs to no line of the io block"
        diagnostics.append(diagnose("io-stray", span, message, help=help))
    expected = [label for label in LABELS if label in parts]
    swaps = [(label, first) for label, first in zip(parts, expected, strict=True) if label != first]
    for label, expected_label in swaps[:1]:
        message = f"`{label}:` comes before `{expected_label}:`"
        help = "the order is `INPUT:`, `PROCESS:`, `OUTPUT:`"
        diagnostics.append(diagnose("io-order", parts[label].span, message, help=help))
    contents: dict[str, tuple[Inline, ...]] = {}
    for label in LABELS:
        lines = parts[label].lines if label in parts else []
        trimmed_lines = [trim(line) for line in lines if line.text.strip()]
        if not trimmed_lines:
            all_parts = (unlabelled, *parts.values())
            diagnostics.append(_diagnose_missing(label, parts, all_parts, fence))
        else:
            inlines = texts.inlines(Excerpt.join(trimmed_lines, "\n"))
            contents[label] = inlines.value
            diagnostics += inlines.diagnostics
    io = Io(fence.span, *(contents.get(label, ()) for label in LABELS))
    return Parsed(io, tuple(diagnostics))


def _diagnose_missing(
    label: str, parts: Mapping[str, _Part], all_parts: Iterable[_Part], fence: Fence
) -> Diagnostic:
    if label in parts:
        return diagnose("io-missing", parts[label].span, f"nothing follows `{label}:`")
    notes, fix = [], Fix("")
    for line in (line for part in all_parts for line in part.lines):
        word = _LIKE_LABEL.match(line.text)
        if word is not None and label in (word[1], nearest(word[1], LABELS)):
            span = line.span(word.start(1), word.end())
            notes.append(Note(f"`{span.text}` is read as text", span))
            edit = Edit(span, f"{label}:")
            fix = Fix(f"write `{label}:`", edits=(edit,), safe=word[1] == label)
    message = f"the io block has no line `{label}:`"
    return diagnose("io-missing", fence.head, message, help=fix, notes=notes)


def draw(page: PageContext, card: Io) -> Markup:
    """Draw the card as a list of terms."""
    rows = tuple((page.renderer.words(name), page.inlines(text)) for name, text in card.parts())
    return page.template("io/io.html", rows=rows)


def markdown(writer: MarkdownWriter, card: Io) -> str:
    """Write the card as a list."""
    rows = ((writer.words(name), writer.inlines(text)) for name, text in card.parts())
    return "\n".join(f"- **{label}:** {text}" for label, text in rows)


def index(reader: IndexReader, card: Io) -> None:
    """Index all lines of the card."""
    for _, text in card.parts():
        reader.add("text", reader.text(text))


KIND = FenceKind(
    name="io",
    block=Io,
    parse=parse_io,
    draw=draw,
    markdown=markdown,
    index=index,
    nested=True,
    wide=False,
)
FEATURE = Feature(name="io", fences=(KIND,))
