"""What is known of the pages of the last build, so that those that stay need not be read.

Entry point: `PageIndex`, of `SitePage`s.

A page is the one of before where its key is, a hash of its inputs, of its document's text and of
the tool. Inputs are made of the course as it looks to others, of what running it found, and of the
page's own document: where all three are those of before the key is known without making them.
"""

from __future__ import annotations

from collections.abc import Iterable

from msgspec import Struct

from coursebuild.core.engine.memo import Memo
from coursebuild.core.engine.tool import step_key
from coursebuild.core.pages.added_files import NotedPage
from coursebuild.core.pages.links import Reference, has
from coursebuild.core.pages.page_list import PageEntry
from coursebuild.core.pages.record import PageRecord

_KIND = "index"


class SitePage(Struct, frozen=True, array_like=True):
    """A page that was drawn, now or before: what the rest of the site must know of it."""

    entry: PageEntry
    key: str
    text_key: str
    """That of its document's text; empty where it has none."""
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
    def of(cls, entry: PageEntry, key: str, text_key: str, record: PageRecord) -> SitePage:
        """A page whose record is there."""
        head = record.head
        away = [(path, anchor) for path, anchor in record.references if path != entry.path]
        own = {anchor for path, anchor in record.references if path == entry.path} - {"", "top"}
        ids = frozenset(record.ids)
        return cls(
            entry,
            key,
            text_key,
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
            all(has(ids, anchor) for anchor in own),
        )


class _Kept(Struct, frozen=True, array_like=True):
    around: str | None
    pages: tuple[SitePage, ...]


class PageIndex:
    """The pages of the last build."""

    def __init__(self, store: Memo, around: str | None) -> None:
        """`around`: a hash of all that inputs are made of besides documents, where it is known."""
        self._store = store
        self._around = around
        self._name = step_key("index of pages")
        self._kept = store.get_value(_KIND, self._name, _Kept) or _Kept(None, ())
        self._pages = {page.entry.path: page for page in self._kept.pages}

    def key(self, path: str, text_key: str) -> str | None:
        """The key of the page at a site path, where it is known without its inputs."""
        page = self._pages.get(path)
        same = self._around is not None and self._around == self._kept.around
        return page.key if page is not None and same and page.text_key == text_key else None

    def page(self, entry: PageEntry, key: str) -> SitePage | None:
        """What is known of the page that has this key."""
        page = self._pages.get(entry.path)
        return page if page is not None and page.key == key and page.entry == entry else None

    def save(self, pages: Iterable[SitePage]) -> None:
        """Keep what is known of all pages of this build for the next one."""
        now = _Kept(self._around, tuple(pages))
        if now != self._kept:
            self._store.put_value(_KIND, self._name, now)
