"""What some saves come to, before it is taken over.

Entry point: `Plan`, which `LiveCourse.plan` makes.
"""

from __future__ import annotations

from collections.abc import Mapping

from msgspec import Struct

from coursebuild.checks.links import Places
from coursebuild.diagnostics import Diagnostic
from coursebuild.model import Course, Document
from coursebuild.pipeline.preview.pages import Drawn
from coursebuild.render.frame import Names
from coursebuild.render.library import Library


class Plan(Struct, frozen=True):
    """What some saves come to."""

    edits: int
    """The number of the state that it was made from."""
    course: Course
    library: Library
    known: Places
    found: Mapping[str, tuple[Diagnostic, ...]]
    """The mistakes of the documents that changed; empty where none did."""
    drawn: Mapping[str, tuple[Drawn, bytes | None]]
    """Pages, and their finished texts, where their frames are those of before."""
    names: Names | None
    """Of the shared files that these texts name."""
    stale: frozenset[str] | None
    """Pages that show something of it as well; `None` for all."""
    documents: Mapping[str, Document]
    """Those that changed, by path."""

    @property
    def whole(self) -> bool:
        """Whether no document became empty."""
        return all(document.source.text.strip() for document in self.documents.values())
