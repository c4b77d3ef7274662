"""The files of the search: the list of pages, the shards of the index, the text of each page.

Entry point: `SearchFiles`.

1. The terms of a bucket's pages are sorted into slices, unless `shelf` has these from before.
2. Every file is known by name and key before it is made, and is made when it is published.
3. `search/index.js` lists pages and names; it has the one name that is always the same, so that a
   page need not change with the index.
"""

from __future__ import annotations

import functools
import hashlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Protocol

from msgspec import Struct

from coursebuild.core.model.results import CachedFile
from coursebuild.core.pages import urls
from coursebuild.core.pages.compressed import COPIES, copy_of
from coursebuild.core.pages.search import index
from coursebuild.core.pages.search.index import IndexPlan, Numbers
from coursebuild.core.pages.search.page import call
from coursebuild.core.pages.strings import Strings

FOLDER = "assets/search"
_QUALITY = 5
"""Of Brotli: the tenth would be a seventh less for ten times the time."""


class IndexEntry(Struct, frozen=True):
    """A page that is searched."""

    path: str
    """Its site path."""
    kind: str
    title: str
    name: str
    """See `PageText`."""
    digest: str
    """Of its text and terms."""

    @property
    def file(self) -> str:
        """The name of the file with its text: by its path too, since two pages may be alike."""
        return hashlib.sha256(f"{self.digest} {self.path}".encode()).hexdigest()[:10]


class Shelf(Protocol):
    """Keeps bytes from build to build."""

    def get(self, key: str) -> bytes | None:
        """What was kept under a key, if it is still there."""

    def put(self, key: str, data: bytes) -> None:
        """Keep something for later builds."""


class SearchFiles:
    """See the module."""

    def __init__(
        self,
        entries: Sequence[IndexEntry],
        words: Mapping[str, str],
        text: Callable[[str], bytes],
        terms: Callable[[str], bytes],
        shelf: Shelf,
    ) -> None:
        """What the files are made from.

        Args:
            entries: in the order of the course.
            words: texts of the interface, by key.
            text: gives the file of a page, and `terms` its terms, both by its path.
            terms: see there.
            shelf: what was made before.
        """
        self._entries, self._words = entries, words
        self._text, self._terms, self._shelf = text, terms, shelf
        self._plan = IndexPlan.of(len(entries))
        members: list[list[int]] = [[] for _ in range(self._plan.buckets)]
        for number, entry in enumerate(entries):
            members[self._plan.bucket(entry.path)].append(number)
        self._numbers = list(map(Numbers, members))
        buckets = map(self._slices_of, members)
        self._slices = list(zip(*buckets, strict=True))
        """Of each shard, in the order of the buckets."""
        order = hashlib.sha256("\n".join(entry.path for entry in entries).encode()).hexdigest()
        self._names = tuple(index.name(slices, order) for slices in self._slices)
        self._shard = functools.lru_cache(maxsize=1)(self._shard_of)  # its copies come next

    def files(self) -> Iterator[CachedFile]:
        """All of them, with smaller copies of the index but not of the pages' texts."""
        listing = self._listing()
        key = hashlib.sha256(listing).hexdigest()
        yield from _copied(urls.SEARCH_INDEX, key, lambda: listing)
        for number, name in enumerate(self._names):
            make = functools.partial(self._shard, number)
            key = f"search-{index.FORMAT}-{number}-{name}"
            path = f"{FOLDER}/{number:04x}.{name}.js"
            yield from _copied(path, key, make)
        for entry in self._entries:
            yield CachedFile(
                f"{FOLDER}/{entry.file}.js",
                f"search-{index.FORMAT}-{entry.digest}",
                functools.partial(self._text, entry.path),
            )

    def _listing(self) -> bytes:
        """What a browser has to know before the first query."""
        kinds = sorted({entry.kind for entry in self._entries})
        at = {kind: number for number, kind in enumerate(kinds)}
        value = {
            "format": index.FORMAT,
            "terms": self._plan.terms,
            "words": self._plan.words,
            "files": "".join(self._names),
            "kinds": kinds,
            "pages": [
                [entry.path, at[entry.kind], entry.title, entry.name, entry.file]
                for entry in self._entries
            ],
            "strings": dict(self._words),
        }
        return call("index", "", value)

    def _shard_of(self, number: int) -> bytes:
        parts = zip(self._slices[number], self._numbers, strict=True)
        return call("shard", f"{number}", index.shard(parts))

    def _slices_of(self, members: Sequence[int]) -> list[bytes]:
        """What the pages of a bucket give to each shard."""
        plan = self._plan
        said = [f"slices {index.FORMAT} {plan.terms} {plan.words}"]
        said += [self._entries[number].digest for number in members]
        key = hashlib.sha256("\n".join(said).encode()).hexdigest()
        known = self._shelf.get(key)
        found = [] if known is None else known.split(b"\0")
        if len(found) != plan.shards:
            pages = (self._terms(self._entries[number].path) for number in members)
            found = index.sort_terms(plan, pages)
            self._shelf.put(key, b"\0".join(found))
        return found


_LIVE = "search.live."


def search_words(words: Strings) -> dict[str, str]:
    """Texts of the interface that a page carries only with its search, by the end of their key."""
    return {key.removeprefix(_LIVE): text for key, text in words.entries if key.startswith(_LIVE)}


def _copied(path: str, key: str, make: Callable[[], bytes]) -> Iterator[CachedFile]:
    """A file and its copies, which are there whether or not they are smaller: nobody knows yet."""
    yield CachedFile(path, key, make)
    for suffix in COPIES:
        copy = functools.partial(_copy, make, suffix)
        yield CachedFile(f"{path}.{suffix}", f"{key}-{suffix}", copy)


def _copy(make: Callable[[], bytes], suffix: str) -> bytes:
    return copy_of(make(), suffix, _QUALITY)
