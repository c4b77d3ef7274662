"""Drawn pages as bytes: what the site must know of a page, its body, and what it is found by.

Entry points: `KeptPage.of`, `KeptPage.read`.
"""

from __future__ import annotations

import msgspec
from msgspec import Struct

from coursebuild.core.values import decode, encode
from coursebuild.render.record import PageRecord
from coursebuild.render.search.values import Searched


class KeptPage(Struct, frozen=True, array_like=True):
    """A page in the store."""

    packed_record: bytes
    text: bytes
    """See `Searched`; empty where the page is not searched. So is the next."""
    terms: bytes
    body: bytes
    """UTF-8."""

    @classmethod
    def of(cls, record: PageRecord, body: str, searched: Searched | None) -> KeptPage:
        """A page that was drawn just now."""
        text, terms = (b"", b"") if searched is None else (searched.text, searched.terms)
        return cls(encode(record), text, terms, body.encode())

    @classmethod
    def read(cls, data: bytes | None) -> KeptPage | None:
        """The page; `None` where the bytes are none."""
        try:
            return None if data is None else msgspec.msgpack.decode(data, type=cls)
        except msgspec.MsgspecError:
            return None

    @property
    def record(self) -> PageRecord | None:
        """What the site must know of it; `None` where the bytes are none."""
        return decode(self.packed_record, PageRecord)
