"""The index of a course: terms and the pages that have them, in many small files.

Entry points: `IndexPlan`, how many files there are; `sort_terms` and `shard`, by which they are
made.

A query loads the file of each of its words, and no other. Terms that begin alike stand in one file,
so that the beginning of a word finds it. A third kind of file has the terms alone: by these a
misspelt word is set right.

1. Pages are dealt out to buckets by their path. The terms of a bucket's pages are sorted into the
   shards of the index; what one shard gets of one bucket is a slice. The slices of a bucket are
   kept from build to build.
2. A shard is put together from its slices of all buckets, and is named by a hash of them. An edit
   sorts one bucket anew, and makes those shards of which a slice is another.

So every file follows from the pages and from nothing else.
"""

from __future__ import annotations

import functools
import hashlib
from collections import defaultdict
from collections.abc import Iterable, Sequence

from msgspec import Struct

from coursebuild.core.pages.search.words import BEGINNING, is_fuzzy, shelf_of

FORMAT = 1
"""Of the files; part of every name."""
_PAGES_A_BUCKET = 16
_PAGES_A_SHARD = 8
_MOST_SHARDS = 1024
_DIGIT = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz-_"


class IndexPlan(Struct, frozen=True):
    """How an index is cut: by the number of pages alone."""

    buckets: int
    terms: int
    """Shards of terms with their pages."""
    words: int
    """Shards of terms alone."""

    @classmethod
    def of(cls, pages: int) -> IndexPlan:
        """For a number of pages; all are powers of two."""
        terms = min(_MOST_SHARDS, _below(pages / _PAGES_A_SHARD))
        return cls(_below(pages / _PAGES_A_BUCKET), terms, _below(terms / 8))

    @property
    def shards(self) -> int:
        """All of them: those of terms with pages come first."""
        return self.terms + self.words

    def bucket(self, path: str) -> int:
        """Which bucket has a page."""
        return _hash(path) & (self.buckets - 1)

    def places(self, term: str) -> tuple[int, ...]:
        """Numbers of the shards that have a term."""
        if term.isascii() and term.isalpha():  # as most are: what follows would give the same
            first, fuzzy = _placed(term[:BEGINNING]), 3 <= len(term) <= 24
        else:
            first, fuzzy = _placed(shelf_of(term)), is_fuzzy(term)
        first &= self.terms - 1
        return (first, self.terms + (_placed(term[0]) & (self.words - 1))) if fuzzy else (first,)


def _below(number: float) -> int:
    """The largest power of two that is no larger, and at least one."""
    return 1 << max(0, int(number).bit_length() - 1)


def _hash(text: str) -> int:
    """FNV-1a of the text in UTF-8, 32 bits, as the browser computes it."""
    value = 0x811C9DC5
    for byte in text.encode("utf-8", "surrogatepass"):
        value = (value ^ byte) * 0x01000193 & 0xFFFFFFFF
    return value


_placed = functools.lru_cache(maxsize=1 << 14)(_hash)


def sort_terms(plan: IndexPlan, pages: Iterable[bytes]) -> list[bytes]:
    """Sort the terms of a bucket's pages, given in the order of the course, into slices."""
    found: list[dict[str, str]] = [{} for _ in range(plan.shards)]
    pages_of: defaultdict[str, list[str]] = defaultdict(list)
    for number, data in enumerate(pages):
        having = {digit: f" {number:x}{digit}" for digit in "0123456789abcdef"}
        for line in data.decode().split("\n") if data else ():
            pages_of[line[1:]].append(having[line[0]])
    for term, said in pages_of.items():
        first, *others = plan.places(term)
        found[first][term] = "".join(said)
        for place in others:
            found[place][term] = " "
    return [_slice(terms) for terms in found]


def _slice(terms: dict[str, str]) -> bytes:
    """Lines of a term and the pages that have it: their hexadecimal number here, and the weight."""
    return "\n".join([term + terms[term] for term in sorted(terms)]).encode()


class Numbers(dict[str, int]):
    """The pages of a bucket's slices as numbers in the course, times 16 and with the weight.

    Each is worked out once: the slices of a bucket have the same pages again and again.
    """

    def __init__(self, numbers: Sequence[int]) -> None:
        """`numbers` are those that the bucket's pages have in the course."""
        super().__init__()
        self._numbers = numbers

    def __missing__(self, page: str) -> int:
        """As `_slice` writes it."""
        self[page] = found = self._numbers[int(page[:-1], 16)] << 4 | int(page[-1], 16)
        return found


def shard(parts: Iterable[tuple[bytes, Numbers]]) -> str:
    """A shard as the browser reads it, from its slices of all buckets.

    Args:
        parts: slices, each with the numbers of its bucket's pages.

    Returns:
        Lines of a term and, after a blank, its pages: rising numbers as differences to the one
        before, times 16 and with the weight, each in digits of five bits, the lowest first.
    """
    found: dict[str, list[int]] = {}
    for part, numbers in parts:
        number = numbers.__getitem__
        for line in part.decode().split("\n") if part else ():
            term, _, pages = line.partition(" ")
            here = map(number, pages.split())
            held = found.get(term)
            if held is None:
                found[term] = [*here]
            else:
                held += here
    return "\n".join([_line(term, found[term]) for term in sorted(found)])


def _line(term: str, pages: list[int]) -> str:
    if not pages:
        return term
    pages.sort()
    said, before = [f"{term} "], 0
    for page in pages:
        said.append(_digits(page - (before << 4)))
        before = page >> 4
    return "".join(said)


@functools.lru_cache(maxsize=1 << 14)
def _digits(value: int) -> str:
    """A number in digits of five bits, the lowest first; all but the last have the sixth bit."""
    said = ""
    while value > 31:
        said += _DIGIT[value & 31 | 32]
        value >>= 5
    return said + _DIGIT[value]


def name(slices: Iterable[bytes], order: str) -> str:
    """What a shard is called by: a hash of all that it is made from.

    Args:
        slices: of all buckets.
        order: a digest of the order of all pages, whose numbers the shard has.
    """
    digests = (hashlib.blake2b(part, digest_size=8).digest() for part in slices)
    whole = hashlib.sha256(f"{FORMAT} {order} ".encode() + b"".join(digests))
    return whole.hexdigest()[:8]
