"""Io blocks: what a script takes, does and gives.

Entry points: `Io`, `parse_io`. A line that begins with `INPUT:`, `PROCESS:` or `OUTPUT:` starts a
part; the lines after it continue it. All three must be there, once, in this order.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping

from msgspec import Struct

from coursebuild.core.model import FeatureBlock, Inline
from coursebuild.core.syntax.fence import Fence
from coursebuild.core.syntax.spans import trim
from coursebuild.core.syntax.texts import TextParser
from coursebuild.core.text.diagnostics import Diagnostic, Note, Parsed, diagnose, nearest
from coursebuild.core.text.source import Excerpt, Span

LABELS = ("INPUT", "PROCESS", "OUTPUT")
_LABEL = re.compile(r"\s*(INPUT|PROCESS|OUTPUT):")
_LIKE_LABEL = re.compile(r"\s*([A-Za-z]+)\s*:")


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
    """The lines that stand under a label."""

    label: str
    span: Span
    lines: list[Excerpt]


def parse_io(fence: Fence, texts: TextParser) -> Parsed[Io]:
    """An `io` fence."""
    stray, *given = _parts(fence.body)
    parts: dict[str, _Part] = {}
    found = list(fence.keys().diagnostics)
    for part in given:
        if (first := parts.setdefault(part.label, part)) is not part:
            notes = [Note("first given here", first.span)]
            message = f"`{part.label}:` is given twice"
            found.append(diagnose("io-repeated", part.span, message, notes=notes))
    found += (*_stray(stray), *_order(parts))
    contents: dict[str, tuple[Inline, ...]] = {}
    for label in LABELS:
        text = _text(parts[label].lines) if label in parts else None
        if text is None:
            found.append(_missing(label, parts, (stray, *parts.values()), fence))
        else:
            parsed = texts.inlines(text)
            contents[label] = parsed.value
            found += parsed.diagnostics
    io = Io(fence.span, *(contents.get(label, ()) for label in LABELS))
    return Parsed(io, tuple(found))


def _parts(body: Excerpt) -> list[_Part]:
    """The lines of a block by their labels; those before the first have none."""
    parts = [_Part("", body.span(), [])]
    for line in body.lines():
        found = _LABEL.match(line.text)
        if found is None:
            parts[-1].lines.append(line)
        else:
            span = line.span(found.start(1), found.end())
            parts.append(_Part(found[1], span, [line.slice(found.end())]))
    return parts


def _stray(part: _Part) -> Iterator[Diagnostic]:
    for line in [line for line in part.lines if line.text.strip()][:1]:
        help = "begin with a line `INPUT: …`"
        span, message = trim(line).span(), "this text belongs to no line of the io block"
        yield diagnose("io-stray", span, message, help=help)


def _order(parts: Mapping[str, _Part]) -> Iterator[Diagnostic]:
    wanted = [label for label in LABELS if label in parts]
    odd = [(have, want) for have, want in zip(parts, wanted, strict=True) if have != want]
    for have, want in odd[:1]:
        message = f"`{have}:` stands before `{want}:`"
        help = "the order is `INPUT:`, `PROCESS:`, `OUTPUT:`"
        yield diagnose("io-order", parts[have].span, message, help=help)


def _missing(
    label: str, parts: Mapping[str, _Part], looked_at: Iterable[_Part], fence: Fence
) -> Diagnostic:
    if label in parts:
        return diagnose("io-missing", parts[label].span, f"nothing follows `{label}:`")
    notes = []
    for line in (line for part in looked_at for line in part.lines):
        like = _LIKE_LABEL.match(line.text)
        if like is not None and nearest(like[1].upper(), LABELS, cutoff=0.75) == label:
            span = line.span(like.start(1), like.end())
            notes.append(Note(f"`{like[1]}:` is read as text", span))
    message = f"the io block has no line `{label}:`"
    return diagnose("io-missing", fence.head, message, notes=notes)


def _text(lines: list[Excerpt]) -> Excerpt | None:
    """The lines of a part as one text without indentation and empty lines; `None` where none is."""
    parts = [trim(line) for line in lines if line.text.strip()]
    return Excerpt.join(parts, "\n") if parts else None
