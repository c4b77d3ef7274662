"""The texts of a course as they are now, in an editor or on the disk.

Entry point: `OpenTexts`.
"""

from __future__ import annotations

from functools import lru_cache

from msgspec import Struct

from coursebuild.core.engine.memo import Memo
from coursebuild.core.files.read import read_sources
from coursebuild.core.model import Document, Lesson, Owner
from coursebuild.core.pages.library import Library
from coursebuild.core.syntax.document import parse_document
from coursebuild.core.text.source import Source
from coursebuild.features.language_server.commands.places import Places
from coursebuild.preview.session import Session


class OpenTexts(Struct, frozen=True):
    """See the module."""

    session: Session
    library: Library
    """What is known of the course."""
    places: Places
    store: Memo

    def source(self, path: str) -> Source:
        """The text of a file of the course; one of nothing where there is none."""
        read = read_sources(self.session.root, [path], self.session.open_texts)
        return next(iter(read.value), Source(path, ""))

    def document(self, source: Source) -> Document | None:
        """A lesson or page with its prose; `None` for any other text, and for one too long."""
        owner = self.owner(source)
        callouts = frozenset(self.library.callouts)
        return None if owner is None else _parsed(source, callouts, isinstance(owner, Lesson))

    def owner(self, source: Source) -> Owner | None:
        """The lesson or page that has a text, if it is not too long to be read."""
        course = self.library.course
        known = course.owners if len(source.text) <= course.limits.text else ()
        return next((owner for owner in known if owner.path == source.path), None)


@lru_cache(maxsize=16)
def _parsed(source: Source, callouts: frozenset[str], lesson: bool) -> Document:
    """Remembered: an editor asks many things about a text before it is another."""
    return parse_document(source, callouts, lesson=lesson).value
