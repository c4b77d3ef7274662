"""Keys by which a learner's answers find their question again, whatever else of a quiz changes.

Entry points: `text_key`, `unique_keys`.

A question's key is its `id`, or else a hash of its kind and its text; an option's and an item's is
a hash of its text. So adding, removing and moving them changes no other's key.
"""

from __future__ import annotations

import hashlib
import unicodedata
from collections.abc import Iterable, Iterator

DIGITS = 8
"""Hexadecimal digits of a hash: so few that an address with them can still be read."""


def text_key(kind: str, text: str) -> str:
    """The key of a text of a kind (`mcq`, `option`); what white space stands in it is no matter."""
    folded = unicodedata.normalize("NFC", " ".join(text.split()))
    data = f"{kind}\n{folded}".encode("utf-8", "surrogatepass")
    return hashlib.sha256(data).hexdigest()[:DIGITS]


def unique_keys(texts: Iterable[tuple[str, str]], taken: Iterable[str] = ()) -> Iterator[str]:
    """The keys of texts, each after its kind; one that is taken gets a number behind it."""
    known = set(taken)
    for kind, text in texts:
        base = key = text_key(kind, text)
        count = 1
        while key in known:
            count += 1
            key = f"{base}-{count}"
        known.add(key)
        yield key
