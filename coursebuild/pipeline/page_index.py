"""Which pages have inputs of which the keys are known without making them.

Entry point: `PageKeys`.

Inputs are made of the course as it looks to others, of what running it found, and of the page's own
document. So a page has the key of before where all three are those of before.
"""

from __future__ import annotations

from msgspec import Struct

from coursebuild.core.engine.memo import Memo
from coursebuild.core.engine.tool import step_key

_KIND = "keys"


class _Kept(Struct, frozen=True, array_like=True):
    around: str
    keys: dict[str, tuple[str, str]]
    """By site path: the key of the text and that of the page."""


class PageKeys:
    """Those of the last build are kept, and no others."""

    def __init__(self, store: Memo, around: str | None) -> None:
        """`around`: a hash of all that inputs are made of besides documents, where it is known."""
        self._store = store
        self._around = around
        self._name = step_key("keys of pages")
        found = store.get_value(_KIND, self._name, _Kept)
        known = found is not None and found.around == around
        self._before = found.keys if found is not None and known else {}
        self._now: dict[str, tuple[str, str]] = {}

    def get(self, path: str, text: str) -> str | None:
        """The key of the page at a site path, given that of its document's text."""
        before = self._before.get(path)
        if before is None or before[0] != text:
            return None
        self._now[path] = before
        return before[1]

    def add(self, path: str, text: str, key: str) -> None:
        """The same of a page whose inputs were made."""
        self._now[path] = text, key

    def save(self) -> None:
        """Keep them for the next build."""
        if self._around is not None and self._now != self._before:
            kept = _Kept(self._around, self._now)
            self._store.put_value(_KIND, self._name, kept)
