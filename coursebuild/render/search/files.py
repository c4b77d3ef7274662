"""The files of the search: the list of pages, the shards of the index, the text of each page.

Entry point: `SearchFiles`, a sequence of steps that need little memory however long the course is.

1. The terms of a bucket's pages become cells, unless `shelf` has them from an earlier build.
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

from coursebuild.render import urls
from coursebuild.render.compressed import COPIES, copy_of
from coursebuild.render.search import index
from coursebuild.render.search.index import DIGEST, Cells, Numbers, Plan
from coursebuild.render.search.page import call
from coursebuild.results import CachedFile

FOLDER = "assets/search"
_QUALITY = 5
"""Of Brotli: the tenth would be a seventh less for ten times the time."""
_MOST = 64
"""Buckets of which the numbers of pages are remembered."""


class Entry(Struct, frozen=True):
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
        entries: Sequence[Entry],
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
        self._plan = Plan.of(len(entries))
        self._members: list[list[int]] = [[] for _ in range(self._plan.buckets)]
        for number, entry in enumerate(entries):
            self._members[self._plan.bucket(entry.path)].append(number)
        self._numbers = functools.lru_cache(_MOST)(self._numbers_of)
        self._made: dict[tuple[int, int], bytes] = {}
        self._group: tuple[int, list[list[bytes]]] = (-1, [])
        self._last: tuple[int, bytes] = (-1, b"")
        digests = [self._digests(bucket) for bucket in range(self._plan.buckets)]
        order = hashlib.sha256("\n".join(entry.path for entry in entries).encode()).hexdigest()
        self._names = tuple(index.names(self._plan, digests, order))

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

    # --- shards

    def _shard(self, number: int) -> bytes:
        if self._last[0] != number:  # its copies are asked for next
            self._last = number, self._merged(number)
        return self._last[1]

    def _merged(self, number: int) -> bytes:
        group = next(g for g, numbers in enumerate(self._plan.groups) if number in numbers)
        at = number - self._plan.groups[group].start
        if self._group[0] != group:
            buckets = range(self._plan.buckets)
            self._group = group, [index.slices(self._cell(b, group)) for b in buckets]
        parts = (slices[at] for slices in self._group[1])
        numbers = map(self._numbers, range(self._plan.buckets))
        return call("shard", f"{number}", index.shard(zip(parts, numbers, strict=True)))

    def _numbers_of(self, bucket: int) -> Numbers:
        return Numbers(self._members[bucket])

    def _digests(self, bucket: int) -> bytes:
        """Of all slices of a bucket."""
        known = self._shelf.get(self._key(bucket, "digests"))
        size = (self._plan.terms + self._plan.words) * DIGEST
        if known is not None and len(known) == size:
            return known
        return self._sorted(bucket).digests

    def _cell(self, bucket: int, group: int) -> bytes:
        made = self._made.get((bucket, group))
        if made is not None:
            return made
        known = self._shelf.get(self._key(bucket, str(group)))
        if known is not None and known.count(b"\0") == len(self._plan.groups[group]) - 1:
            return known
        return self._sorted(bucket).groups[group]

    def _sorted(self, bucket: int) -> Cells:
        """The cells of a bucket, made now and kept."""
        pages = (self._terms(self._entries[number].path) for number in self._members[bucket])
        found = index.cells(self._plan, pages)
        for group, data in enumerate(found.groups):
            self._made[bucket, group] = data
            self._shelf.put(self._key(bucket, str(group)), data)
        self._shelf.put(self._key(bucket, "digests"), found.digests)
        return found

    def _key(self, bucket: int, part: str) -> str:
        plan = self._plan
        said = [f"cells {index.FORMAT} {plan.terms} {plan.words} {part}"]
        said += [self._entries[number].digest for number in self._members[bucket]]
        return hashlib.sha256("\n".join(said).encode()).hexdigest()


def _copied(path: str, key: str, make: Callable[[], bytes]) -> Iterator[CachedFile]:
    """A file and its copies, which are there whether or not they are smaller: nobody knows yet."""
    yield CachedFile(path, key, make)
    for suffix in COPIES:
        copy = functools.partial(_copy, make, suffix)
        yield CachedFile(f"{path}.{suffix}", f"{key}-{suffix}", copy)


def _copy(make: Callable[[], bytes], suffix: str) -> bytes:
    return copy_of(make(), suffix, _QUALITY)
