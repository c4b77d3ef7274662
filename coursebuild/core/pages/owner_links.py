"""Lessons and pages as other pages name them.

Entry points: `owner_link`, `owner_links`; `added_page`.
"""

from __future__ import annotations

from collections.abc import Sequence

from msgspec import Struct

from coursebuild.core.model import Lesson, Owner
from coursebuild.core.pages import urls
from coursebuild.core.pages.library import Library

MOST = 12
"""Links that a list shows; of more it says how many there are."""


class OwnerLink(Struct, frozen=True):
    """A lesson or page as a link."""

    href: str
    id: str
    """Of a lesson; empty for a page."""
    title: str


class OwnerLinks(Struct, frozen=True):
    """Some of them, and how many more there are."""

    shown: tuple[OwnerLink, ...]
    more: int


def owner_link(place: urls.Place, owner: Owner, anchor: str = "") -> OwnerLink:
    """The link to one, or to an anchor there."""
    id = owner.id if isinstance(owner, Lesson) else ""
    return OwnerLink(place.href(urls.owner_path(owner), anchor or None), id, owner.title)


def owner_links(library: Library, place: urls.Place, owners: Sequence[Owner]) -> OwnerLinks:
    """The links to some; titles are those of the map as it is now."""
    current = (
        library.lessons[owner.id] if isinstance(owner, Lesson) else library.pages[owner.id]
        for owner in owners[:MOST]
    )
    shown = tuple(owner_link(place, owner) for owner in current)
    return OwnerLinks(shown, max(0, len(owners) - MOST))


def added_page(library: Library, place: urls.Place, name: str) -> str:
    """The address of the page of a name that a feature adds; empty where there is none."""
    found = (kind for kind in library.added_pages if kind.name == name)
    return next((place.href(kind.path) for kind in found), "")
