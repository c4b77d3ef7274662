"""The index of a course: terms and the pages that have them, in many small files.

Entry point: `search_files(site)`: the list of pages, the shards of the index, the text of each
page.

A query loads the file of each of its words, and no other. Terms that begin alike stand in one file,
so that the beginning of a word finds it. A third kind of file has the terms alone: by these a
misspelt word is set right.

1. The terms of some pages after each other are sorted into the shards of the index; what one shard
   gets of them is a slice. Slices are kept from build to build.
2. A shard is put together from its slices and named by a hash of them. An edit sorts some pages
   anew, and makes those shards of which a slice is another.
3. `search/index.js` lists pages and names; it has the one name that is always the same, so that a
   page need not change with the index.
"""

from __future__ import annotations

import functools
import hashlib
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence

from msgspec import Struct

from coursebuild.core.model.results import CachedFile
from coursebuild.core.pages.added_files import NotedPage, SiteContext
from coursebuild.features.search.page import call, text_and_terms
from coursebuild.features.search.words import is_fuzzy, shelf_of

LIST = "search/index.js"
_FOLDER = "assets/search"
_FORMAT = 1
"""Of the files; part of every name."""
_TOGETHER = 16
"""Pages that are sorted together: the number of one among them is a digit."""
_PAGES_A_SHARD = 8
_MOST_SHARDS = 1024
_DIGIT = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz-_"
_LIVE = "search.live."
"""What interface texts begin with that a page carries only with its search."""


class IndexPlan(Struct, frozen=True):
    """How many shards an index has: by the number of pages alone. All are powers of two."""

    terms: int
    """Shards of terms with their pages."""
    words: int
    """Shards of terms alone, which come after these."""

    @classmethod
    def of(cls, pages: int) -> IndexPlan:
        """For a number of pages."""
        terms = min(_MOST_SHARDS, _power_below(pages // _PAGES_A_SHARD))
        return cls(terms, _power_below(terms // 8))

    def places(self, term: str) -> tuple[int, ...]:
        """Numbers of the shards that have a term."""
        first = _hash(shelf_of(term)) & (self.terms - 1)
        if not is_fuzzy(term):
            return (first,)
        return first, self.terms + (_hash(term[0]) & (self.words - 1))


def _power_below(number: int) -> int:
    """The largest power of two that is no larger, and at least one."""
    return 1 << max(0, number.bit_length() - 1)


@functools.lru_cache(maxsize=1 << 14)
def _hash(text: str) -> int:
    """FNV-1a of the text in UTF-8, 32 bits, as the browser computes it."""
    value = 0x811C9DC5
    for byte in text.encode("utf-8", "surrogatepass"):
        value = (value ^ byte) * 0x01000193 & 0xFFFFFFFF
    return value


def search_files(site: SiteContext) -> Iterator[CachedFile]:
    """All files of the search."""
    plan = IndexPlan.of(len(site.pages))
    starts = range(0, max(1, len(site.pages)), _TOGETHER)
    slices = [_slices(site, plan, site.pages[at : at + _TOGETHER]) for at in starts]
    shards = list(zip(*slices, strict=True))
    names = [_digest(b"\0".join(parts))[:8] for parts in shards]
    listing = call("index", "", _listing(site, plan, "".join(names)))
    yield CachedFile(LIST, _digest(listing), lambda: listing)
    for number, (name, parts) in enumerate(zip(names, shards, strict=True)):
        path = f"{_FOLDER}/{number:04x}.{name}.js"
        yield CachedFile(path, f"search-{number}-{name}", functools.partial(_shard, number, parts))
    for page in site.pages:
        make = functools.partial(_text, site, page.path)
        yield CachedFile(_text_path(page), f"search-{page.digest}", make)


def _text(site: SiteContext, path: str) -> bytes:
    return text_and_terms(site.note(path))[0]


def _text_path(page: NotedPage) -> str:
    """By the page's path too, since two pages may be alike."""
    return f"{_FOLDER}/{_digest(f'{page.digest} {page.path}'.encode())[:10]}.js"


def _digest(data: bytes) -> str:
    return hashlib.sha256(b"%d " % _FORMAT + data).hexdigest()


def _listing(site: SiteContext, plan: IndexPlan, names: str) -> dict[str, object]:
    """What a browser has to know before the first query."""
    kinds = sorted({page.kind for page in site.pages})
    return {
        "format": _FORMAT,
        "terms": plan.terms,
        "words": plan.words,
        "files": names,
        "kinds": kinds,
        "pages": [
            [
                page.path,
                kinds.index(page.kind),
                page.title,
                page.id if page.kind in ("lesson", "stub") else "",
                _text_path(page).removeprefix(f"{_FOLDER}/").removesuffix(".js"),
            ]
            for page in site.pages
        ],
        "strings": {
            key.removeprefix(_LIVE): text
            for key, text in site.library.words.texts.items()
            if key.startswith(_LIVE)
        },
    }


def _slices(site: SiteContext, plan: IndexPlan, pages: Sequence[NotedPage]) -> list[bytes]:
    """What some pages give to each shard."""
    key = _digest(repr((plan.terms, plan.words, [page.digest for page in pages])).encode())

    def make() -> bytes:
        return b"\0".join(sort_terms(plan, (text_and_terms(site.note(p.path))[1] for p in pages)))

    return site.get_or_create(key, make).split(b"\0")


def sort_terms(plan: IndexPlan, pages: Iterable[bytes]) -> list[bytes]:
    """Sort the terms of some pages, given in the order of the course, into slices.

    A slice has lines of a term and, after a blank, two hexadecimal digits for each page that has
    it: the page's number here, and the weight.
    """
    having: defaultdict[str, str] = defaultdict(str)
    for number, data in enumerate(pages):
        digit = f"{number:x}"
        for line in data.decode().split("\n") if data else ():
            having[line[1:]] += digit + line[0]
    found: list[list[str]] = [[] for _ in range(plan.terms + plan.words)]
    for term in sorted(having):
        first, *others = plan.places(term)
        found[first].append(f"{term} {having[term]}")
        for place in others:
            found[place].append(f"{term} ")
    return ["\n".join(lines).encode() for lines in found]


def _shard(number: int, slices: Iterable[bytes]) -> bytes:
    return call("shard", f"{number}", shard(slices))


def shard(slices: Iterable[bytes]) -> str:
    """A shard as the browser reads it, from its slices in the order of their pages.

    It has lines of a term and, after a blank, its pages: rising numbers as differences to the one
    before, times 16 and with the weight, each in digits of five bits, the lowest first.
    """
    found: defaultdict[str, list[int]] = defaultdict(list)
    for number, part in enumerate(slices):
        first = number * _TOGETHER << 4
        for line in part.decode().split("\n") if part else ():
            term, _, pages = line.partition(" ")
            found[term] += [first + page for page in bytes.fromhex(pages)]
    return "\n".join([_line(term, found[term]) for term in sorted(found)])


def _line(term: str, pages: list[int]) -> str:
    if not pages:
        return term
    said, before = [f"{term} "], 0
    for page in pages:
        said.append(_digits(page - before))
        before = page & ~15
    return "".join(said)


@functools.lru_cache(maxsize=1 << 14)
def _digits(value: int) -> str:
    """A number in digits of five bits, the lowest first; all but the last have the sixth bit."""
    said = ""
    while value > 31:
        said += _DIGIT[value & 31 | 32]
        value >>= 5
    return said + _DIGIT[value]
