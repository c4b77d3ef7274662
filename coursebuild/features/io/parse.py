"""Io blocks: what a script takes, does and gives.

Entry point: `parse_io`. A line that begins with `INPUT:`, `PROCESS:` or `OUTPUT:` starts a part;
the lines after it continue it. All three must be there, once, in this order.
"""

from __future__ import annotations

import re

from coursebuild.core.model import Inline
from coursebuild.core.syntax.fence import Fence
from coursebuild.core.syntax.spans import trimmed
from coursebuild.core.syntax.texts import TextParser
from coursebuild.core.text.diagnostics import Diagnostic, Note, Parsed, diagnose, nearest
from coursebuild.core.text.source import Excerpt, Span
from coursebuild.features.io.model import Io

LABELS = ("INPUT", "PROCESS", "OUTPUT")
_LABEL = re.compile(r"\s*(INPUT|PROCESS|OUTPUT):")
_LIKE_LABEL = re.compile(r"\s*([A-Za-z]+)\s*:")


class _Parts:
    """The lines of an io block, sorted by label."""

    def __init__(self) -> None:
        self.labels: dict[str, Span] = {}
        """In the order in which they stand."""
        self.lines: dict[str, list[Excerpt]] = {}
        self.stray: list[Excerpt] = []
        self.diagnostics: list[Diagnostic] = []

    def read(self, body: Excerpt) -> None:
        """Sort the lines."""
        into = self.stray
        for line in body.lines():
            found = _LABEL.match(line.text)
            if found is None:
                into.append(line)
                continue
            label, span = found[1], line.span(found.start(1), found.end())
            rest = line.slice(found.end())
            if label in self.labels:
                notes = [Note("first given here", self.labels[label])]
                message = f"`{label}:` is given twice"
                self.diagnostics.append(diagnose("io-repeated", span, message, notes=notes))
                into = []
            else:
                self.labels[label] = span
                into = self.lines[label] = [rest]


def parse_io(fence: Fence, texts: TextParser) -> Parsed[Io]:
    """An `io` fence."""
    parts = _Parts()
    parts.read(fence.body)
    diagnostics = [*fence.keys().diagnostics, *parts.diagnostics]
    diagnostics += _stray(parts) + _order(parts)
    contents: dict[str, tuple[Inline, ...]] = {}
    for label in LABELS:
        text = _text(parts.lines.get(label, []))
        if text is None:
            diagnostics.append(_missing(label, parts, fence))
        else:
            parsed = texts.inlines(text)
            contents[label] = parsed.value
            diagnostics += parsed.diagnostics
    io = Io(fence.span, *(contents.get(label, ()) for label in LABELS))
    return Parsed(io, tuple(diagnostics))


def _stray(parts: _Parts) -> list[Diagnostic]:
    lines = [line for line in parts.stray if line.text.strip()]
    if not lines:
        return []
    first = lines[0]
    span = first.span(len(first.text) - len(first.text.lstrip()), len(first.text.rstrip()))
    help = "begin with a line `INPUT: …`"
    return [diagnose("io-stray", span, "this text belongs to no line of the io block", help=help)]


def _order(parts: _Parts) -> list[Diagnostic]:
    found = list(parts.labels)
    wanted = [label for label in LABELS if label in parts.labels]
    for have, want in zip(found, wanted, strict=True):
        if have != want:
            message = f"`{have}:` stands before `{want}:`"
            help = "the order is `INPUT:`, `PROCESS:`, `OUTPUT:`"
            return [diagnose("io-order", parts.labels[have], message, help=help)]
    return []


def _missing(label: str, parts: _Parts, fence: Fence) -> Diagnostic:
    span = parts.labels.get(label)
    if span is not None:
        return diagnose("io-missing", span, f"nothing follows `{label}:`")
    notes = []
    for line in [*parts.stray, *(line for lines in parts.lines.values() for line in lines[1:])]:
        like = _LIKE_LABEL.match(line.text)
        if like is not None and nearest(like[1].upper(), LABELS, cutoff=0.75) == label:
            notes.append(
                Note(f"`{like[1]}:` is read as text", line.span(like.start(1), like.end()))
            )
    message = f"the io block has no line `{label}:`"
    return diagnose("io-missing", fence.head, message, notes=notes)


def _text(lines: list[Excerpt]) -> Excerpt | None:
    """The lines of a part as one text without indentation and empty lines; `None` where none is."""
    parts = [trimmed(line) for line in lines if line.text.strip()]
    return Excerpt.join(parts, "\n") if parts else None
