"""Records of pages as bytes, alone, with the body of their page, and all of a site together.

Entry points: `pack_record` and `unpack_record`; `join` and `part`; `bundle` and `unbundle`, for any
bytes whose keys are hashes.
"""

from __future__ import annotations

import pickle
import struct
import zlib
from collections.abc import Iterable

from coursebuild.render.record import PageRecord

_LENGTH = struct.Struct("<I")
_KEY = 64
"""Characters of a key: a hash."""


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


def join(record: bytes, body: str) -> bytes:
    """A packed record and the body of its page."""
    return _LENGTH.pack(len(record)) + record + body.encode()


def part(data: bytes) -> tuple[bytes, bytes]:
    """A packed record and a body in UTF-8; the record is empty where the bytes are none."""
    if len(data) < _LENGTH.size:
        return b"", b""
    end = _LENGTH.size + _LENGTH.unpack_from(data)[0]
    return data[_LENGTH.size : end], data[end:]


def bundle(records: Iterable[tuple[str, bytes]]) -> bytes:
    """All of them with their keys."""
    return b"".join(
        piece
        for key, record in records
        for piece in (key.encode("ascii"), _LENGTH.pack(len(record)), record)
    )


def unbundle(data: bytes) -> dict[str, bytes]:
    """The same by their keys; as many as there are whole ones."""
    found: dict[str, bytes] = {}
    at = 0
    while at + _KEY + _LENGTH.size <= len(data):
        start = at + _KEY + _LENGTH.size
        end = start + _LENGTH.unpack_from(data, at + _KEY)[0]
        found[data[at : at + _KEY].decode("ascii", "replace")] = data[start:end]
        at = end
    return found
