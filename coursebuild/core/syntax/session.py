"""What the readers of one document share: diagnostics, anchors, footnotes, the script above.

Entry point: `ParsingState`. A document is read once, from its first line to its last; texts inside
quizzes and labs are read where they stand.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from coursebuild.core.syntax.footnotes import FootnoteList
from coursebuild.core.syntax.headings import Anchors
from coursebuild.core.syntax.markdown import Definitions
from coursebuild.core.text.diagnostics import Diagnostic, Parsed
from coursebuild.core.text.source import Source

T = TypeVar("T")


class ParsingState:
    """One reading of one document."""

    def __init__(self, source: Source, callouts: frozenset[str], lesson: bool) -> None:
        self.source = source
        self.callouts = callouts
        self.lesson = lesson
        self.definitions = Definitions()
        """The link definitions of the document, which its inner texts may use."""
        self.diagnostics: list[Diagnostic] = []
        self.script: str | None = None
        """The path of the nearest script above."""
        self.script_wrong = False
        """Whether the nearest script above has no path that it may have."""
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
