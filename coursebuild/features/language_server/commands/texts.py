"""The texts of a course as they are now, in an editor or on the disk.

Entry point: `OpenTexts`.
"""

from __future__ import annotations

from functools import lru_cache

from coursebuild.core.engine.memo import Memo
from coursebuild.core.files.read import read_sources
from coursebuild.core.model import Document, Lesson
from coursebuild.core.model.results import Formula
from coursebuild.core.pages.library import Library, Owner, owners
from coursebuild.core.syntax.document import parse_document
from coursebuild.core.text.source import Source
from coursebuild.features.authoring.format import format_document
from coursebuild.pipeline.reading import kept_formulas
from coursebuild.preview.session import Session


class OpenTexts:
    """See the module."""

    def __init__(self, session: Session, store: Memo) -> None:
        self.session = session
        self._store = store

    @property
    def library(self) -> Library | None:
        """What is known of the course; `None` where its map could never be read."""
        return self.session.library

    def source(self, path: str) -> Source | None:
        """The text of a file of the course."""
        read = read_sources(self.session.root, [path], self.session.open_texts)
        return next(iter(read.value), None)

    def document(self, source: Source) -> Document | None:
        """A lesson or page with its prose."""
        owner, callouts = self._owner(source)
        return None if owner is None else _parsed(source, callouts, isinstance(owner, Lesson))

    def formatted(self, source: Source) -> str | None:
        """The text of a lesson or page as `coursebuild fmt` has it; `None` if it has mistakes."""
        owner, callouts = self._owner(source)
        if owner is None or self.library is None:
            return None
        lesson, width = isinstance(owner, Lesson), self.library.course.width
        new = format_document(source, callouts, lesson=lesson, width=width)
        return None if new.diagnostics else new.value

    def _owner(self, source: Source) -> tuple[Owner | None, frozenset[str]]:
        """The lesson or page that has a text, and the kinds of callouts that it may use."""
        if self.library is None:
            return None, frozenset()
        known = owners(self.library.course)
        owner = next((owner for owner in known if owner.path == source.path), None)
        return owner, frozenset(self.library.callouts)

    def formulas(self, path: str) -> dict[Formula, str]:
        """MathML of the formulas that a text had when it was last read."""
        return kept_formulas(self._store, path)


@lru_cache(maxsize=16)
def _parsed(source: Source, callouts: frozenset[str], lesson: bool) -> Document:
    """Remembered: an editor asks many things about a text before it is another."""
    return parse_document(source, callouts, lesson=lesson).value
