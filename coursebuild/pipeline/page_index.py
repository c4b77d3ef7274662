"""Records of the pages of the last build, so that unchanged pages need not be loaded.

Entry point: `PageIndex`, of `SitePage`s.

A page is unchanged where its key is: a hash of its inputs, of its document's text and of the tool.
Inputs are made from the course as other pages see it, the results of running it, and the page's own
document. Where a hash of these, its `origin`, is unchanged, so is its key, and no inputs are made.
"""

from __future__ import annotations

from collections.abc import Iterable

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core.engine.memo import Memo
from coursebuild.core.engine.tool import step_key
from coursebuild.core.pages.added_files import NotedPage
from coursebuild.core.pages.links import Reference, has_anchor
from coursebuild.core.pages.page_list import PageEntry
from coursebuild.core.pages.record import PageRecord

_KIND = "index"


class SitePage(Struct, frozen=True, array_like=True):
    """What the rest of the site must know of a page that was drawn, now or before."""

    entry: PageEntry
    key: str
    origin: str
    """A hash of all that its inputs are made from, and of its text; empty where that is unknown."""
    indexed: bool
    """Whether search engines should list it."""
    notes: tuple[tuple[str, NotedPage], ...]
    """What features have noted of it, by their names."""
    ids: tuple[str, ...]
    """Its anchors."""
    text: str
    """See `PageRecord`; likewise the next two."""
    mathematics: str
    declarations: tuple[str, ...]
    links: tuple[Reference, ...]
    """Its links to other pages and files."""
    sound: bool
    """Whether its links to itself have their anchors."""

    @classmethod
    def of(cls, entry: PageEntry, key: str, origin: str, record: PageRecord) -> SitePage:
        """The page of a record."""
        head = record.head
        references = [(path, anchor) for path, anchor in record.references if path != entry.path]
        anchors_here = {anchor for path, anchor in record.references if path == entry.path} - {
            "",
            "top",
        }
        ids = frozenset(record.ids)
        return cls(
            entry,
            key,
            origin,
            head.indexed,
            tuple(
                (name, NotedPage(head.path, head.kind, entry.id, head.title, digest))
                for name, digest in record.notes
            ),
            record.ids,
            record.text,
            record.mathematics,
            record.declarations,
            tuple((path, "" if anchor == "top" else anchor) for path, anchor in references),
            all(has_anchor(ids, anchor) for anchor in anchors_here),
        )


class PageIndex:
    """The pages of the last build."""

    def __init__(self, store: Memo) -> None:
        self._store = store
        self._name = step_key("index of pages")
        self._stored_pages = store.get_value(_KIND, self._name, tuple[SitePage, ...]) or ()
        self._pages = {page.entry.path: page for page in self._stored_pages}

    def key(self, path: str, origin: str) -> str | None:
        """The key of the page at a site path, if its origin is that of the last build."""
        page = self._pages.get(path)
        return page.key if page is not None and origin and page.origin == origin else None

    def page(self, entry: PageEntry, key: str, origin: str) -> SitePage | None:
        """The page of an entry, if it has this key; with its origin now."""
        page = self._pages.get(entry.path)
        if page is None or page.key != key or page.entry != entry:
            return None
        return page if page.origin == origin else replace(page, origin=origin)

    def save(self, pages: Iterable[SitePage]) -> None:
        """Store the pages of this build for the next one."""
        all_pages = tuple(pages)
        if all_pages != self._stored_pages:
            self._store.put_value(_KIND, self._name, all_pages)
