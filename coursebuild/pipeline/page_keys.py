"""Keys of pages without their sheets, where nothing that a sheet is made of has changed.

Entry point: `PageKeys`.

A sheet is made of the course as it looks to others, of what running it found, and of the page's
own document. So a page has the key of before where all three are those of before, and no sheet is
needed to know it.
"""

from __future__ import annotations

import hashlib

from coursebuild.effects.store import Store
from coursebuild.effects.tool import tool_digest

_KIND = "keys"


class PageKeys:
    """See the module; those of the last build are kept, and no others."""

    def __init__(self, store: Store, around: str | None) -> None:
        """`around`: a hash of all that sheets are made of besides documents, where it is known."""
        self._store = store
        self._around = around
        self._name = hashlib.sha256(f"keys of pages\0{tool_digest()}".encode()).hexdigest()
        self._before = self._load()
        self._now: dict[str, str] = {}

    def get(self, path: str, document: str) -> str | None:
        """The key of the page at a site path, with the key of its document, if it has one."""
        key = self._before.get(_row(path, document))
        if key is not None:
            self.add(path, document, key)
        return key

    def add(self, path: str, document: str, key: str) -> None:
        """The same of a page whose sheet was made."""
        self._now[_row(path, document)] = key

    def save(self) -> None:
        """Keep them for the next build."""
        if self._around is not None and self._now != self._before:
            rows = (f"{key} {row}" for row, key in self._now.items())
            data = "\n".join((self._around, *rows)).encode("utf-8", "surrogatepass")
            self._store.keep(_KIND, self._name, data, packed=True)

    def _load(self) -> dict[str, str]:
        data = None if self._store.fresh else self._store.peek(_KIND, self._name)
        if data is None or self._around is None:
            return {}
        around, *rows = data.decode("utf-8", "surrogatepass").split("\n")
        if around != self._around:
            return {}
        return {row: key for key, _, row in (line.partition(" ") for line in rows)}


def _row(path: str, document: str) -> str:
    return f"{document} {path}"
