"""What the site must know of all its pages before any of them is written."""

from __future__ import annotations

import sys

from coursebuild.render.links import has
from coursebuild.render.record import PageRecord
from coursebuild.render.shared import PageFacts


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
