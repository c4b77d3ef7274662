"""The outlines of a whole course in one entry of the store, beside those of single texts.

Entry point: `Bundle`.

One file is read in a tenth of the time that a file for each text takes. It is written anew when so
many of the course's outlines are not in it that this pays.
"""

from __future__ import annotations

import hashlib
import zlib

from coursebuild.effects.store import Store
from coursebuild.effects.tool import tool_digest
from coursebuild.pipeline.records import bundle, unbundle

_BUNDLES = "bundles"
"""The kind of the entry."""
WORTHWHILE = 32
"""Texts for which there is one."""


class Bundle:
    """See the module."""

    def __init__(self, store: Store, count: int) -> None:
        """`count` texts are asked for; few are not worth it."""
        self._store = store
        self._count = count
        self._name = hashlib.sha256(f"outlines of a course\0{tool_digest()}".encode()).hexdigest()
        data = store.peek(_BUNDLES, self._name) if count >= WORTHWHILE and not store.fresh else None
        self._before = unbundle(data) if data is not None else {}
        self._used: dict[str, bytes] = {}
        self._new = 0

    def get(self, key: str) -> bytes | None:
        """An outline that is in it."""
        packed = self._before.get(key)
        if packed is None:
            return None
        try:
            data = zlib.decompress(packed)
        except zlib.error:
            return None
        self._used[key] = packed
        return data

    def add(self, key: str, data: bytes) -> None:
        """An outline that is not in it."""
        if self._count >= WORTHWHILE:
            self._used[key] = zlib.compress(data, 1)
            self._new += 1

    def save(self) -> None:
        """Write it anew, where that pays."""
        if self._new >= WORTHWHILE // 2 + self._count // 16:
            self._store.keep(_BUNDLES, self._name, bundle(self._used.items()), local=True)
