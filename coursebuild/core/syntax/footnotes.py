"""Footnotes: which are written, which are referred to, and their numbers.

Entry point: `FootnoteList`. Numbers follow the order of first reference; labels are the same
without regard to case.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import islice

from msgspec import Struct, field

from coursebuild.core.model import Block, Footnote, FootnoteRef
from coursebuild.core.text.diagnostics import Diagnostic, Note, diagnose, did_you_mean
from coursebuild.core.text.source import Span


class Written(Struct):
    """A footnote that is written."""

    label: str
    label_span: Span
    span: Span
    read: Callable[[], tuple[Block, ...]]
    """Reads its blocks; done once all else is read, in the order of the numbers."""


class FootnoteList(Struct):
    """The footnotes of a document while it is read."""

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
