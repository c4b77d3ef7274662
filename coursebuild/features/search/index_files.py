"""The index of a course: terms and the pages that have them, in many small files.

A query loads only the file of each of its words. Terms that begin alike are in one file, so that
the beginning of a word finds it; a third kind of file has terms only, to correct misspelt words.

1. A page's text has a file; of pages that are found by title and summary only, some share one.
2. The terms of a few consecutive pages are sorted into the shards of the index; the part for one
   shard is a slice. Slices are cached from build to build.
3. A shard is joined from its slices and named by a hash of them, so an edit writes few of them.
4. `search/index.js` lists the pages and the names of shards. Its own name never changes, so that
   pages need not change with the index.
"""

from __future__ import annotations

import functools
import hashlib
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence

from msgspec import Struct

from coursebuild.api import CachedFile, SiteContext
from coursebuild.core.pages.context import NotedPage
from coursebuild.features.search.page import LEAD_ONLY, as_json, script, text_and_terms
from coursebuild.features.search.words import is_fuzzy, shelf_of

LIST = "search/index.js"
_FOLDER = "assets/search"
_FORMAT = 2
"""The version of the files' format; part of every name."""
_BATCH = 16
"""Pages that are sorted together: the number of a page in its batch is one hexadecimal digit."""
_PAGES_PER_SHARD = 8
_MAX_SHARDS = 1024
_DIGITS = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz-_"
_LIVE = "search.live."
"""The prefix of interface texts that only the search script needs."""


class IndexPlan(Struct, frozen=True):
    """The numbers of shards, powers of two, which depend only on the number of pages."""

    terms: int
    """Shards of terms with their pages."""
    words: int
    """Shards of terms only, which follow after those."""

    @classmethod
    def of(cls, pages: int) -> IndexPlan:
        """Return the plan for a number of pages."""
        terms = min(_MAX_SHARDS, _power_below(pages // _PAGES_PER_SHARD))
        return cls(terms, _power_below(terms // 8))

    def places(self, term: str) -> tuple[int, ...]:
        """Return the numbers of the shards that have a term."""
        first = _hash(shelf_of(term)) & (self.terms - 1)
        if not is_fuzzy(term):
            return (first,)
        return first, self.terms + (_hash(term[0]) & (self.words - 1))


def _power_below(number: int) -> int:
    """Return the largest power of two that is not above a number; at least one."""
    return 1 << max(0, number.bit_length() - 1)


@functools.lru_cache(maxsize=1 << 14)
def _hash(text: str) -> int:
    """Return the FNV-1a hash of the text in UTF-8, 32 bits, as the browser computes it."""
    value = 0x811C9DC5
    for byte in text.encode("utf-8", "surrogatepass"):
        value = (value ^ byte) * 0x01000193 & 0xFFFFFFFF
    return value


def search_files(site: SiteContext) -> Iterator[CachedFile]:
    """Yield all files of the search."""
    plan = IndexPlan.of(len(site.pages))
    starts = range(0, max(1, len(site.pages)), _BATCH)
    slices = [_sorted_slices(site, plan, site.pages[start : start + _BATCH]) for start in starts]
    shards = list(zip(*slices, strict=True))
    names = [_digest(b"\0".join(parts))[:8] for parts in shards]
    # The pages of each file of texts; its name depends on paths, as texts can be alike
    groups: list[tuple[NotedPage, ...]] = [
        (page,) for page in site.pages if page.kind not in LEAD_ONLY
    ]
    leads = tuple(page for page in site.pages if page.kind in LEAD_ONLY)
    groups += [leads[start : start + _BATCH] for start in range(0, len(leads), _BATCH)]
    sums = (" ".join(f"{page.digest} {page.path}" for page in group) for group in groups)
    texts = {_digest(s.encode())[:10]: g for s, g in zip(sums, groups, strict=True)}
    listing = script("index", "", as_json(_listing(site, plan, "".join(names), texts)))
    yield CachedFile(LIST, _digest(listing), lambda: listing)
    for number, (name, parts) in enumerate(zip(names, shards, strict=True)):
        path = f"{_FOLDER}/{number:04x}.{name}.js"
        make = functools.partial(_shard_script, number, parts)
        yield CachedFile(path, f"search-{number}-{name}", make)
    for name, pages in texts.items():
        make = functools.partial(_text_script, site, pages)
        yield CachedFile(f"{_FOLDER}/{name}.js", f"search-{name}", make)


def _text_script(site: SiteContext, pages: Iterable[NotedPage]) -> bytes:
    texts = (text_and_terms(site.note(page.path))[0].decode() for page in pages)
    return script("page", "", f"[{','.join(texts)}]")


def _digest(data: bytes) -> str:
    return hashlib.sha256(b"%d " % _FORMAT + data).hexdigest()


def _listing(
    site: SiteContext, plan: IndexPlan, names: str, texts: Mapping[str, Sequence[NotedPage]]
) -> dict[str, object]:
    """Return what a browser has to know before the first query."""
    places = {p.path: (name, n) for name, pages in texts.items() for n, p in enumerate(pages)}
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
                *places[page.path],
            ]
            for page in site.pages
        ],
        "strings": {
            key.removeprefix(_LIVE): text
            for key, text in site.library.words.texts.items()
            if key.startswith(_LIVE)
        }
        | {"comma": site.library.words("site.comma")},
    }


def _sorted_slices(site: SiteContext, plan: IndexPlan, pages: Sequence[NotedPage]) -> list[bytes]:
    """Return the slice of each shard for a batch of pages; cached."""
    key = _digest(repr((plan.terms, plan.words, [page.digest for page in pages])).encode())

    def make() -> bytes:
        return b"\0".join(sort_terms(plan, (text_and_terms(site.note(p.path))[1] for p in pages)))

    return site.get_or_make(key, make).split(b"\0")


def sort_terms(plan: IndexPlan, pages: Iterable[bytes]) -> list[bytes]:
    """Sort the terms of some pages, given in the order of the course, into slices.

    A line of a slice has a term and, after a blank, two hexadecimal digits for each page that has
    it: the page's number in the batch, and the weight.
    """
    pages_by_term: defaultdict[str, str] = defaultdict(str)
    for number, data in enumerate(pages):
        digit = f"{number:x}"
        for line in data.decode().split("\n") if data else ():
            pages_by_term[line[1:]] += digit + line[0]
    slices: list[list[str]] = [[] for _ in range(plan.terms + plan.words)]
    for term in sorted(pages_by_term):
        term_shard, *word_shards = plan.places(term)
        slices[term_shard].append(f"{term} {pages_by_term[term]}")
        for word_shard in word_shards:
            slices[word_shard].append(f"{term} ")
    return ["\n".join(lines).encode() for lines in slices]


def _shard_script(number: int, slices: Iterable[bytes]) -> bytes:
    return script("shard", f"{number}", as_json(join_slices(slices)))


def join_slices(slices: Iterable[bytes]) -> str:
    """Return a shard as the browser reads it, from its slices in the order of their pages.

    A line has a term and, after a blank, its pages: rising numbers as differences from the previous
    one, times 16 and with the weight, each in digits of five bits, the lowest first.
    """
    pages_by_term: defaultdict[str, list[int]] = defaultdict(list)
    for number, part in enumerate(slices):
        first = number * _BATCH << 4
        for line in part.decode().split("\n") if part else ():
            term, _, pages = line.partition(" ")
            pages_by_term[term] += [first + page for page in bytes.fromhex(pages)]
    lines = []
    for term, pages_of_term in sorted(pages_by_term.items()):
        digits, previous = "", 0
        for page in sorted(pages_of_term):
            digits += _encode(page - previous)
            previous = page & ~15
        lines.append(f"{term} {digits}" if digits else term)
    return "\n".join(lines)


@functools.lru_cache(maxsize=1 << 14)
def _encode(value: int) -> str:
    """Write a number in digits of five bits, lowest first; a sixth bit marks all but the last."""
    digits = ""
    while value > 31:
        digits += _DIGITS[value & 31 | 32]
        value >>= 5
    return digits + _DIGITS[value]
