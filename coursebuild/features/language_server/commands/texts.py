"""The texts of a course as they are now, in an editor or on the disk.

Entry point: `OpenTexts`.
"""

from __future__ import annotations

from functools import lru_cache

from msgspec import Struct

from coursebuild.core.files.read import read_sources
from coursebuild.core.model import Document, Lesson, Owner
from coursebuild.core.model.vocabulary import Words
from coursebuild.core.pages.library import Library
from coursebuild.core.syntax.document import parse_document
from coursebuild.core.text.source import Source
from coursebuild.features.language_server.commands.places import Places
from coursebuild.preview.session import Session


class OpenTexts(Struct, frozen=True):
    """The texts of a course as they are now."""

    session: Session
    library: Library
    """The course as it was last read."""
    places: Places

    def source(self, path: str) -> Source:
        """Return the text of a file of the course; an empty one where there is no such file."""
        read = read_sources(self.session.root, [path], self.session.open_texts)
        return next(iter(read.value), Source(path, ""))

    def document(self, source: Source) -> Document | None:
        """Return the document of a lesson or page; `None` for other texts, and those too long."""
        owner = self.owner(source)
        if owner is None:
            return None
        course = self.library.course
        return _parse(source, course.callout_names, isinstance(owner, Lesson), course.words)

    def owner(self, source: Source) -> Owner | None:
        """Return the lesson or page of a text, unless the text is too long to be read."""
        course = self.library.course
        owners = course.owners if len(source.text) <= course.limits.text else ()
        return next((owner for owner in owners if owner.path == source.path), None)


@lru_cache(maxsize=16)
def _parse(source: Source, callouts: frozenset[str], lesson: bool, words: Words) -> Document:
    """Cached, since an editor sends many requests about the same text."""
    return parse_document(source, callouts, lesson=lesson, words=words).value
