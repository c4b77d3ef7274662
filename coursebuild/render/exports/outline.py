"""What of a course is written, in order: the contents of the whole course.

Entry point: `written(library)`.
"""

from __future__ import annotations

from msgspec import Struct

from coursebuild.model import Lesson
from coursebuild.render.exports.parts import anchor
from coursebuild.render.library import Library


class Entry(Struct, frozen=True):
    """A lesson in the contents."""

    id: str
    title: str
    href: str


class LevelEntry(Struct, frozen=True):
    """A level with its written lessons."""

    id: str
    title: str
    summary: str
    anchor: str
    """Its id on the page of the whole course."""
    href: str
    lessons: tuple[Entry, ...]


class Part(Struct, frozen=True):
    """A level and its written lessons, of which there is at least one."""

    id: str
    title: str
    summary: str
    lessons: tuple[Lesson, ...]

    @property
    def anchor(self) -> str:
        """The id of the level on the page of the whole course; no lesson's id has a space."""
        return anchor("level", self.id)


def written(library: Library) -> tuple[Part, ...]:
    """The levels that have written lessons."""
    parts = (
        Part(
            level.id,
            level.title,
            level.summary,
            tuple(lesson for lesson in level.lessons if lesson.document is not None),
        )
        for level in library.course.levels
    )
    return tuple(part for part in parts if part.lessons)


def facts(library: Library, lessons: int) -> str:
    """How much there is, and with what it was verified."""
    words, results = library.words, library.results
    verified = words("site.verified", engine=results.engine, python=results.python)
    return f"{words('exports.lessons', n=lessons)}. {verified}."
