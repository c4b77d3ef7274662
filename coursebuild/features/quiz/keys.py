"""Keys that lead a learner's answers back to their question, whatever else in the quiz changes.

Entry points: `text_key`, `unique_keys`.

A question's key is its `id`, or else a hash of its kind and its text; the key of an option or
an item is a hash of its text. So adding, removing or moving one changes the key of no other.
"""

from __future__ import annotations

import unicodedata
from collections.abc import Iterable, Iterator

from coursebuild.core.text.source import key_of, unique_name


def text_key(kind: str, text: str) -> str:
    """Return the key of a text of a kind (`mcq`, `option`), whatever its white space."""
    normalized_text = unicodedata.normalize("NFC", " ".join(text.split()))
    return key_of(f"{kind}\n{normalized_text}")[:8]  # few, as addresses hold it


def unique_keys(texts: Iterable[tuple[str, str]], used_keys: Iterable[str] = ()) -> Iterator[str]:
    """Yield the keys of texts, given as (kind, text); a key already in use gets a number."""
    all_keys = set(used_keys)
    for kind, text in texts:
        key = unique_name(text_key(kind, text), all_keys)
        all_keys.add(key)
        yield key
