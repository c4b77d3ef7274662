"""What is known of the pages of the last build, so that those that stay need not be read.

Entry point: `PageIndex`, of `SitePage`s.

A page is the one of before where its key is, a hash of its inputs, of its document's text and of
the tool. Inputs are made of the course as it looks to others, of what running it found, and of the
page's own document: where this origin is that of before the key is known without making them.
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
    """A page that was drawn, now or before: what the rest of the site must know of it."""

    entry: PageEntry
    key: str
    origin: str
    """A hash of all that its inputs are made of, and of its text; empty where that is not known."""
    indexed: bool
    """Whether search engines should list it."""
    notes: tuple[tuple[str, NotedPage], ...]
    """Of features, by name."""
    ids: tuple[str, ...]
    """Its anchors."""
    text: str
    """See `PageRecord`; likewise the next two."""
    mathematics: str
    declarations: tuple[str, ...]
    links: tuple[Reference, ...]
    """Where it leads on other pages."""
    sound: bool
    """Whether it has the anchors that it leads to itself."""

    @classmethod
    def of(cls, entry: PageEntry, key: str, origin: str, record: PageRecord) -> SitePage:
        """A page whose record is there."""
        head = record.head
        away = [(path, anchor) for path, anchor in record.references if path != entry.path]
        own = {anchor for path, anchor in record.references if path == entry.path} - {"", "top"}
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
            tuple((path, "" if anchor == "top" else anchor) for path, anchor in away),
            all(has_anchor(ids, anchor) for anchor in own),
        )


class PageIndex:
    """The pages of the last build."""

    def __init__(self, store: Memo) -> None:
        self._store = store
        self._name = step_key("index of pages")
        self._kept = store.get_value(_KIND, self._name, tuple[SitePage, ...]) or ()
        self._pages = {page.entry.path: page for page in self._kept}

    def key(self, path: str, origin: str) -> str | None:
        """The key of the page at a site path, where it is known without its inputs."""
        page = self._pages.get(path)
        return page.key if page is not None and origin and page.origin == origin else None

    def page(self, entry: PageEntry, key: str, origin: str) -> SitePage | None:
        """What is known of the page that has this key, with its origin now."""
        page = self._pages.get(entry.path)
        if page is None or page.key != key or page.entry != entry:
            return None
        return page if page.origin == origin else replace(page, origin=origin)

    def save(self, pages: Iterable[SitePage]) -> None:
        """Keep what is known of all pages of this build for the next one."""
        now = tuple(pages)
        if now != self._kept:
            self._store.put_value(_KIND, self._name, now)
