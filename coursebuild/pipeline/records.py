"""Records of pages as bytes, alone and with the body of their page.

Entry points: `pack_record` and `unpack_record`; `join`, `part` and `searched_part`.
"""

from __future__ import annotations

import pickle
import struct
import zlib
from typing import TypeVar

from coursebuild.render.record import PageRecord
from coursebuild.render.search.values import Searched

Value = TypeVar("Value")

_LENGTH = struct.Struct("<I")


def pack_record(record: PageRecord) -> bytes:
    """A record as bytes."""
    return zlib.compress(pickle.dumps(record, pickle.HIGHEST_PROTOCOL), 1)


def unpack_record(data: bytes) -> PageRecord | None:
    """The record; `None` where the bytes are none."""
    try:
        found = pickle.loads(zlib.decompress(data))
    except Exception:  # whatever damaged bytes make of it
        return None
    return found if isinstance(found, PageRecord) else None


def join(record: bytes, body: str, searched: Searched | None = None) -> bytes:
    """A packed record, the body of its page, and what the page is found by."""
    parts = [record, *((b"", b"") if searched is None else (searched.text, searched.terms))]
    return b"".join((*(_LENGTH.pack(len(p)) + p for p in parts), body.encode()))


def part(data: bytes) -> tuple[bytes, bytes]:
    """A packed record and a body in UTF-8; the record is empty where the bytes are none."""
    record, _, body = _parted(data)
    return record, body


def searched_part(data: bytes) -> tuple[bytes, bytes]:
    """The text and the terms that the page is found by; empty where the bytes are none."""
    _, searched, _ = _parted(data)
    return searched


def _parted(data: bytes) -> tuple[bytes, tuple[bytes, bytes], bytes]:
    parts: list[bytes] = []
    at = 0
    while len(parts) < 3:
        if len(data) < at + _LENGTH.size:
            return b"", (b"", b""), b""
        start = at + _LENGTH.size
        at = start + _LENGTH.unpack_from(data, at)[0]
        parts.append(data[start:at])
    return parts[0], (parts[1], parts[2]), data[at:]


def pack_value(value: object) -> bytes:
    """A value as bytes; not compressed, which takes longer than all else that is done with them."""
    return pickle.dumps(value, pickle.HIGHEST_PROTOCOL)


def unpack_value(data: bytes | None, kind: type[Value]) -> Value | None:
    """The value, where it is of this type; `None` where the bytes are none of such."""
    try:
        found = None if data is None else pickle.loads(data)
    except Exception:  # whatever damaged bytes make of it
        return None
    return found if isinstance(found, kind) else None
