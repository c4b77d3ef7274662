"""Links to lessons and pages.

Entry points: `owner_link`, `owner_links`; `added_page`.
"""

from __future__ import annotations

from collections.abc import Sequence

from msgspec import Struct

from coursebuild.core.model import Lesson, Owner
from coursebuild.core.pages import urls
from coursebuild.core.pages.library import Library

MAX_LINKS = 12
"""The most links that a list shows; it says how many more there are."""


class OwnerLink(Struct, frozen=True):
    """A lesson or page as a link."""

    href: str
    id: str
    """The id of a lesson; empty for a page."""
    title: str


class OwnerLinks(Struct, frozen=True):
    """A list of links, with the number of those left out."""

    visible: tuple[OwnerLink, ...]
    omitted: int


def owner_link(place: urls.Place, owner: Owner, anchor: str = "") -> OwnerLink:
    """The link to a lesson or page, or to an anchor there."""
    id = owner.id if isinstance(owner, Lesson) else ""
    return OwnerLink(place.href(urls.owner_path(owner), anchor or None), id, owner.title)


def owner_links(place: urls.Place, owners: Sequence[Owner]) -> OwnerLinks:
    """The links to lessons and pages."""
    visible = tuple(owner_link(place, owner) for owner in owners[:MAX_LINKS])
    return OwnerLinks(visible, max(0, len(owners) - MAX_LINKS))


def added_page(library: Library, place: urls.Place, name: str) -> str:
    """The address of the page of this name that a feature adds; empty if there is none."""
    kinds = (kind for kind in library.added_pages if kind.name == name)
    return next((place.href(kind.path) for kind in kinds), "")
