"""What a build knows of all pages together: the keys of the build before, and what pages say.

Entry points: `PageKeys`, of pages without their inputs; `Facts`.

Inputs are made of the course as it looks to others, of what running it found, and of the page's
own document. So a page has the key of before where all three are those of before, and no inputs are
needed to know it.
"""

from __future__ import annotations

import hashlib
import sys

from coursebuild.core.engine.memo import Memo
from coursebuild.core.engine.tool import step_key
from coursebuild.core.pages.links import has
from coursebuild.core.pages.record import PageRecord
from coursebuild.core.pages.shared import PageFacts

_KIND = "keys"


class PageKeys:
    """Those of the last build are kept, and no others."""

    def __init__(self, store: Memo, around: str | None) -> None:
        """`around`: a hash of all that inputs are made of besides documents, where it is known."""
        self._store = store
        self._around = around
        self._name = step_key("keys of pages")
        self._before = self._load()
        """What was not asked for yet; what was is moved, so that no row is held twice."""
        self._now: dict[str, str] = {}
        self._changed = False

    def get(self, path: str, document: str) -> str | None:
        """The key of the page at a site path, with the key of its document, if it has one."""
        row = _row(path, document)
        key = self._before.pop(row, None)
        if key is not None:
            self._now[row] = key
        return self._now.get(row)

    def add(self, path: str, document: str, key: str) -> None:
        """The same of a page whose inputs were made."""
        row = _row(path, document)
        self._changed = self._changed or self._now.get(row) != key
        self._now[row] = key

    def save(self) -> None:
        """Keep them for the next build."""
        if self._around is not None and (self._changed or self._before):
            known = self._around, self._now
            self._store.put_value(_KIND, self._name, known, local=True)

    def _load(self) -> dict[str, str]:
        known = self._store.get_value(_KIND, self._name, tuple[str, dict[str, str]], local=True)
        return known[1] if known is not None and known[0] == self._around else {}


def _row(path: str, document: str) -> str:
    """A name for a page and its document that takes little memory: there is one for each page."""
    text = f"{document} {path}".encode("utf-8", "surrogatepass")
    return hashlib.blake2b(text, digest_size=16).hexdigest()


class Facts:
    """What is known of pages together."""

    def __init__(self) -> None:
        self._text: set[str] = set()
        self._mathematics: set[str] = set()
        self._declarations: set[str] = set()
        self.sound = True
        """Whether every page has the anchors that it leads to itself."""
        self.leads: dict[str, str] = {}
        """Site paths that pages lead to, each by itself, so that none is held twice."""
        self.anchors: set[tuple[str, str]] = set()
        """Anchors that pages lead to on others, each after the site path of its page."""

    def add(self, record: PageRecord) -> None:
        """Note what a page shows and where it leads."""
        self._text.update(record.text)
        self._mathematics.update(record.mathematics)
        self._declarations.update(record.declarations)
        own = {"", "top", *record.ids}
        for path, anchor in record.references:
            if path == record.draft.path:
                self.sound = self.sound and has(own, anchor)
            else:
                self._lead(path, anchor)

    def _lead(self, path: str, anchor: str) -> None:
        path = self.leads.setdefault(path, path)
        if anchor not in ("", "top"):
            self.anchors.add((path, sys.intern(anchor)))

    def together(self) -> PageFacts:
        """What the shared files must know."""
        return PageFacts(
            frozenset(self._text), frozenset(self._mathematics), frozenset(self._declarations)
        )
