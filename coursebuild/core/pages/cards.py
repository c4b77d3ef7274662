"""Lessons and pages as cards with pictures, for lists of them.

Entry points: `pictures_of(library, place, owner)`; `lesson_cards`, `list_galleries`.
"""

from __future__ import annotations

from msgspec import Struct

from coursebuild.core.model import FeatureBlock, Lesson, Owner, document_blocks
from coursebuild.core.pages import urls
from coursebuild.core.pages.lesson import LessonLink, lesson_link
from coursebuild.core.pages.library import Library
from coursebuild.core.registry import kind_of_block


class PictureLink(Struct, frozen=True):
    """A picture of a block, with a link to the block."""

    src: str
    width: int
    height: int
    title: str
    href: str


class LessonCard(Struct, frozen=True):
    """A written lesson as a card."""

    link: LessonLink
    level: str
    picture: PictureLink | None


class Gallery(Struct, frozen=True):
    """A page with several pictures."""

    title: str
    href: str
    pictures: tuple[PictureLink, ...]


def pictures_of(library: Library, place: urls.Place, owner: Owner) -> tuple[PictureLink, ...]:
    """The pictures of a document's blocks in order, with addresses relative to a place."""
    links = []
    for block in document_blocks(owner.document) if owner.document is not None else ():
        if not isinstance(block, FeatureBlock):
            continue
        value = library.trial_values.get((block.span.path, block.span.start))
        picture = kind_of_block(block).picture(block, value)
        if picture is not None:
            src = place.href(picture.path)
            href = place.href(urls.owner_path(owner), picture.anchor)
            links.append(PictureLink(src, picture.width, picture.height, picture.title, href))
    return tuple(links)


def lesson_cards(library: Library, place: urls.Place) -> tuple[LessonCard, ...]:
    """The cards of the written lessons, in the order of the course."""
    return tuple(
        _lesson_card(library, place, lesson)
        for lesson in library.order
        if lesson.document is not None
    )


def _lesson_card(library: Library, place: urls.Place, lesson: Lesson) -> LessonCard:
    pictures = pictures_of(library, place, lesson)
    link = lesson_link(library, place, lesson, whole=True)
    level = library.levels[lesson.level].title
    return LessonCard(link, level, pictures[0] if pictures else None)


def list_galleries(library: Library, place: urls.Place) -> tuple[Gallery, ...]:
    """The pages in the menu that have more than one picture."""
    galleries = []
    for page in library.menu:
        pictures = pictures_of(library, place, page)
        if len(pictures) > 1:
            galleries.append(Gallery(page.title, place.href(urls.page_path(page)), pictures))
    return tuple(galleries)
