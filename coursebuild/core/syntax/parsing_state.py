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
from coursebuild.core.syntax.markdown import References
from coursebuild.core.text.diagnostics import Diagnostic, Note, Parsed, diagnose, did_you_mean
from coursebuild.core.text.source import Span

T = TypeVar("T")


class ParsingState:
    """One reading of one document."""

    def __init__(self, callouts: frozenset[str], lesson: bool) -> None:
        self.callouts = callouts
        self.lesson = lesson
        self.references: References = {}
        """The link definitions of the document, which its inner texts may use."""
        self.diagnostics: list[Diagnostic] = []
        self.report = self.diagnostics.append
        self.script: str | None = None
        """The path of the nearest script above."""
        self.figures: list[str] = []
        """Names of figures of scripts above that no paragraph has shown yet."""
        self.has_invalid_script = False
        """Whether the nearest script above has no path that it may have."""
        self.closes_indented = False
        """Whether a fence above was indented, so that what closes it seems to open one."""
        self.level = 1
        """Level of the heading above."""
        self.notes = FootnoteList(self.report)
        self.anchors = Anchors(self.report)

    def collect_diagnostics(self, read: Callable[[], T]) -> Parsed[T]:
        """What `read` gives, with the diagnostics that it raised, for the caller to pass on."""
        before = len(self.diagnostics)
        value = read()
        found = tuple(self.diagnostics[before:])
        del self.diagnostics[before:]
        return Parsed(value, found)


class FootnoteText(Struct):
    """A footnote that is written."""

    label: str
    label_span: Span
    span: Span
    read: Callable[[], tuple[Block, ...]]
    """Reads its blocks; done once all else is read, in the order of the numbers."""
    number: int = 0
    """0 until it is referred to."""
    references: int = 0
    """How often it is referred to."""


class FootnoteList(Struct):
    """The footnotes of a document while it is read.

    Numbers follow the order of first reference; labels are the same without regard to case.
    """

    report: Callable[[Diagnostic], None]
    written: dict[str, FootnoteText] = field(default_factory=dict)
    """By label, without case."""
    referred: list[FootnoteText] = field(default_factory=list)
    """In the order of their numbers."""

    def write(self, note: FootnoteText) -> None:
        """Take note of a footnote's text."""
        first = self.written.setdefault(note.label.casefold(), note)
        if first is not note:
            message = f"footnote `[^{note.label}]` is written twice"
            notes = [Note("first written here", first.label_span)]
            self.report(diagnose("footnote-repeated", note.label_span, message, notes=notes))

    def refer(self, label: str, span: Span) -> FootnoteRef | None:
        """A reference, or `None` (and a diagnostic) where no such footnote is written."""
        note = self.written.get(label.casefold())
        if note is None:
            known = [f"[^{note.label}]" for note in islice(self.written.values(), 100)]
            message = f"footnote `[^{label}]` is not written anywhere"
            help = did_you_mean(f"[^{label}]", known)
            help = help or f"write it as a paragraph that begins with `[^{label}]:`"
            self.report(diagnose("footnote-undefined", span, message, help=help))
            return None
        if not note.number:
            self.referred.append(note)
            note.number = len(self.referred)
        note.references += 1
        return FootnoteRef(span, label, note.number, note.references)

    def finish(self) -> tuple[Footnote, ...]:
        """Read the footnotes, also those that only footnotes refer to, and warn of the unused."""
        blocks = [note.read() for note in self.referred]  # which grows while they are read
        footnotes = tuple(
            Footnote(note.span, note.label, note.number, note.references, inner)
            for note, inner in zip(self.referred, blocks, strict=True)
        )
        for note in [note for note in self.written.values() if not note.number]:
            message = f"footnote `[^{note.label}]` is never referred to"
            self.report(diagnose("footnote-unused", note.label_span, message))
            note.read()
        self.written.clear()
        self.referred.clear()  # as their readers refer back to this
        return footnotes
