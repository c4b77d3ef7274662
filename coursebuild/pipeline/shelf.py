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
from coursebuild.model import Document
from coursebuild.pipeline.outlines import pack, unpack
from coursebuild.source import Excerpt, Source

ROOM = 4 << 20
"""Bytes of packed documents that stay; in memory they take about three times as much."""
CODE_ROOM = 1 << 20
"""Characters of the code of scripts that stay; the code of a script is asked for many times."""
_LAST = 4
"""Further ones that are remembered."""


class Shelf:
    """See the module. Safe to use from several threads."""

    def __init__(self, aside: Aside, room: int | None = None) -> None:
        """`room`: see `ROOM`."""
        self.aside = aside
        self._room = ROOM if room is None else room
        self._code_room = CODE_ROOM
        self._held: dict[int, Document] = {}
        self._last: OrderedDict[int, Document] = OrderedDict()
        self._lock = threading.Lock()

    def document(self, source: Source, data: bytes, again: Callable[[], Document]) -> Document:
        """A document by what `pack` made of it; `again` makes it where that cannot be used."""
        kept = self.aside.put(data)

        def keep(code: Excerpt) -> Callable[[], Excerpt]:
            with self._lock:
                self._code_room -= len(code.text)
                stays = self._code_room >= 0
            if stays:
                return lambda: code
            put = self.aside.put(pack((code.text, code.pieces)))
            return lambda: Excerpt(source, *unpack(put(), source))

        return Document.away(source, lambda: self._fetched(kept, source, again), keep)

    def _fetched(self, kept: Kept, source: Source, again: Callable[[], Document]) -> Document:
        with self._lock:
            found = self._held.get(kept.start) or self._last.pop(kept.start, None)
            if found is None:
                made = unpack(kept(), source)
                found = made if isinstance(made, Document) else again()
                if kept.size <= self._room and kept.data is None:
                    self._room -= kept.size
                    self._held[kept.start] = found
            if kept.start not in self._held and kept.data is None:
                self._last[kept.start] = found
                if len(self._last) > _LAST:
                    self._last.popitem(last=False)
            return found
