"""What the readers of one document share: diagnostics, anchors, footnotes, the script above.

Entry point: `ParsingState`. A document is read once, from its first line to its last; texts inside
quizzes and labs are read where they stand.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import islice
from typing import TypeVar

from msgspec import Struct, field

from coursebuild.core.model import Block, Footnote, FootnoteRef
from coursebuild.core.syntax.headings import Anchors
from coursebuild.core.syntax.markdown import Definitions
from coursebuild.core.text.diagnostics import Diagnostic, Note, Parsed, diagnose, did_you_mean
from coursebuild.core.text.source import Source, Span

T = TypeVar("T")


class ParsingState:
    """One reading of one document."""

    def __init__(self, source: Source, callouts: frozenset[str], lesson: bool) -> None:
        self.source = source
        self.callouts = callouts
        self.lesson = lesson
        self.definitions: Definitions = {}
        """The link definitions of the document, which its inner texts may use."""
        self.diagnostics: list[Diagnostic] = []
        self.script: str | None = None
        """The path of the nearest script above."""
        self.figures: list[str] = []
        """Names of figures of scripts above that no paragraph has shown yet."""
        self.script_wrong = False
        """Whether the nearest script above has no path that it may have."""
        self.closes_indented = False
        """Whether a fence above was indented, so that what closes it seems to open one."""
        self.level = 1
        """Level of the heading above."""
        self.notes = FootnoteList(self.report)
        self.anchors = Anchors(self.report)

    def report(self, diagnostic: Diagnostic) -> None:
        """Take note of a mistake."""
        self.diagnostics.append(diagnostic)

    def end(self) -> None:
        """Let go of what refers back to this, so that no memory waits for the collector."""
        self.notes.written.clear()
        del self.notes, self.anchors

    def apart(self, read: Callable[[], T]) -> Parsed[T]:
        """What `read` gives, with the diagnostics that it raised, for the caller to pass on."""
        before, self.diagnostics = self.diagnostics, []
        try:
            return Parsed(read(), tuple(self.diagnostics))
        finally:
            self.diagnostics = before


class Written(Struct):
    """A footnote that is written."""

    label: str
    label_span: Span
    span: Span
    read: Callable[[], tuple[Block, ...]]
    """Reads its blocks; done once all else is read, in the order of the numbers."""


class FootnoteList(Struct):
    """The footnotes of a document while it is read.

    Numbers follow the order of first reference; labels are the same without regard to case.
    """

    report: Callable[[Diagnostic], None]
    written: dict[str, Written] = field(default_factory=dict)
    """By label, without case."""
    numbers: dict[str, int] = field(default_factory=dict)
    """By label, in order of first reference."""
    references: dict[str, int] = field(default_factory=dict)
    """How often each is referred to."""

    def write(self, note: Written) -> None:
        """Take note of a footnote's text."""
        first = self.written.setdefault(note.label.casefold(), note)
        if first is not note:
            message = f"footnote `[^{note.label}]` is written twice"
            notes = [Note("first written here", first.label_span)]
            self.report(diagnose("footnote-repeated", note.label_span, message, notes=notes))

    def refer(self, label: str, span: Span) -> FootnoteRef | None:
        """A reference, or `None` (and a diagnostic) where no such footnote is written."""
        key = label.casefold()
        if key not in self.written:
            known = [f"[^{note.label}]" for note in islice(self.written.values(), 100)]
            message = f"footnote `[^{label}]` is not written anywhere"
            hint = (
                did_you_mean(f"[^{label}]", known)
                or f"write it as a paragraph that begins with `[^{label}]:`"
            )
            self.report(diagnose("footnote-undefined", span, message, help=hint))
            return None
        number = self.numbers.setdefault(key, len(self.numbers) + 1)
        occurrence = self.references.get(key, 0) + 1
        self.references[key] = occurrence
        return FootnoteRef(span, label, number, occurrence)

    def finish(self) -> tuple[Footnote, ...]:
        """Read the footnotes, also those that only footnotes refer to, and warn of the unused."""
        blocks: dict[str, tuple[Block, ...]] = {}
        while missing := [key for key in self.numbers if key not in blocks]:
            for key in missing:
                blocks[key] = self.written[key].read()
        numbers, references = dict(self.numbers), dict(self.references)
        for key, note in self.written.items():
            if key not in numbers:
                message = f"footnote `[^{note.label}]` is never referred to"
                self.report(diagnose("footnote-unused", note.label_span, message))
                note.read()
        return tuple(
            Footnote(note.span, note.label, number, references[key], blocks[key])
            for key, number in numbers.items()
            for note in (self.written[key],)
        )
