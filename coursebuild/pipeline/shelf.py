"""The skeletons of the documents of a course, put aside: as many as there are, in the same memory.

Entry point: `Shelf.document`.

A document of the shelf fetches its blocks when somebody asks for them. Those that were asked for
first stay, as long as there is room; for the others only the last few are remembered.
"""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable

from coursebuild.effects.aside import Aside, Kept
from coursebuild.model import Document, Script, document_blocks
from coursebuild.pipeline.outlines import unpack
from coursebuild.source import Excerpt, Source
from coursebuild.values import dataclass

ROOM = 6 << 20
"""Bytes of packed documents that stay; in memory they take about three times as much."""
_LAST = 4
"""Further ones that are remembered."""


class Shelf:
    """See the module. Safe to use from several threads."""

    def __init__(self, aside: Aside, room: int | None = None) -> None:
        """`room`: see `ROOM`."""
        self.aside = aside
        self._room = ROOM if room is None else room
        self._held: dict[int, Document] = {}
        self._last: OrderedDict[int, Document] = OrderedDict()
        self._lock = threading.Lock()

    def document(self, source: Source, kept: Kept, again: Callable[[Source], Document]) -> Document:
        """A document by what `pack` made of it; `again` makes it where that cannot be used."""
        place = _Place(self, kept, source, again)
        return Document.away(source, place, place.code)

    def _fetched(self, kept: Kept, source: Source, again: Callable[[Source], Document]) -> Document:
        with self._lock:
            found = self._held.get(kept.start) or self._last.pop(kept.start, None)
            if found is None:
                made = unpack(kept(), source)
                found = made if isinstance(made, Document) else again(source)
                if kept.size <= self._room and kept.data is None:
                    self._room -= kept.size
                    self._held[kept.start] = found
            if kept.start not in self._held and kept.data is None:
                self._last[kept.start] = found
                if len(self._last) > _LAST:
                    self._last.popitem(last=False)
            return found


@dataclass(frozen=True, eq=False, slots=True)
class _Place:
    """Where a document is.

    There is one for each document, and a function would hold more than this does.
    """

    shelf: Shelf
    kept: Kept
    source: Source
    again: Callable[[Source], Document]

    def __call__(self) -> Document:
        """The document."""
        return self.shelf._fetched(self.kept, self.source, self.again)

    def code(self, script: Script) -> Callable[[], Excerpt]:
        """How to get the code of a script of it again, without holding it."""
        return _Code(self, script.span.start)


@dataclass(frozen=True, eq=False, slots=True)
class _Code:
    """Where the code of a script is."""

    place: _Place
    start: int

    def __call__(self) -> Excerpt:
        """The code."""
        blocks = document_blocks(self.place())
        return next(b.code for b in blocks if isinstance(b, Script) and b.span.start == self.start)
