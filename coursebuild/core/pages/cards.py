"""Lessons and pages as cards: what a list of them shows beside their titles.

Entry points: `pictures_of(library, place, owner)`; `lesson_cards`, `galleries`.
"""

from __future__ import annotations

from msgspec import Struct

from coursebuild.core.model import FeatureBlock, Lesson, Owner, document_blocks
from coursebuild.core.pages import urls
from coursebuild.core.pages.lesson import LessonLink, lesson_link
from coursebuild.core.pages.library import Library
from coursebuild.core.registry import kind_of_block


class PictureLink(Struct, frozen=True):
    """A picture of something in a document, and where that stands."""

    src: str
    width: int
    height: int
    title: str
    href: str


class LessonCard(Struct, frozen=True):
    """A lesson that can be read."""

    link: LessonLink
    level: str
    picture: PictureLink | None


class Gallery(Struct, frozen=True):
    """A page that is looked at rather than read."""

    title: str
    href: str
    pictures: tuple[PictureLink, ...]


def pictures_of(library: Library, place: urls.Place, owner: Owner) -> tuple[PictureLink, ...]:
    """Pictures of what stands in a document, in its order, as seen from a place."""
    found = []
    for block in document_blocks(owner.document) if owner.document is not None else ():
        if not isinstance(block, FeatureBlock):
            continue
        shown = library.tried.get((block.span.path, block.span.start))
        picture = kind_of_block(block).picture(block, shown)
        if picture is not None:
            src = place.href(picture.path)
            href = place.href(urls.owner_path(owner), picture.anchor)
            found.append(PictureLink(src, picture.width, picture.height, picture.title, href))
    return tuple(found)


def lesson_cards(library: Library, place: urls.Place) -> tuple[LessonCard, ...]:
    """The lessons that are written, in the order of the course."""
    return tuple(
        _lesson_card(library, place, one) for one in library.order if one.document is not None
    )


def _lesson_card(library: Library, place: urls.Place, lesson: Lesson) -> LessonCard:
    pictures = pictures_of(library, place, lesson)
    link = lesson_link(library, place, lesson, whole=True)
    level = library.levels[lesson.level].title
    return LessonCard(link, level, pictures[0] if pictures else None)


def galleries(library: Library, place: urls.Place) -> tuple[Gallery, ...]:
    """The pages in the menu that have more than one picture."""
    found = []
    for page in library.menu:
        pictures = pictures_of(library, place, page)
        if len(pictures) > 1:
            found.append(Gallery(page.title, place.href(urls.page_path(page)), pictures))
    return tuple(found)
