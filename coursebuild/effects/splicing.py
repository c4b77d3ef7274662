"""Pieces of a file taken out of the file that was published before, where it has them.

Entry points: `Spliced`, whose `pieces` are those of the new file and whose `places` say where each
is; `Earlier`, the file of before.

A file is put together of hundreds of lessons, of which an edit changes one. What the others give to
it is copied from where it was, and not fetched, decoded and filled with links anew.
"""

from __future__ import annotations

import os
import zlib
from collections.abc import Iterable, Iterator

from coursebuild.results import Piece


class Earlier:
    """A published file that is as it was written."""

    def __init__(self, fd: int, places: str) -> None:
        """`places` are those that `Spliced` gave when it was written."""
        self._fd = fd
        self._places = dict(row.split("/", 1) for row in places.split(","))

    def get(self, key: str) -> bytes | None:
        """The bytes of the piece with this key, if it is there and whole."""
        place = self._places.get(key)
        if place is None:
            return None
        start, size, check = map(int, place.split("/"))
        try:
            data = os.pread(self._fd, size, start)
        except OSError:
            return None
        return data if len(data) == size and zlib.crc32(data) == check else None


class Spliced:
    """A file on its way to the disk, made of pieces."""

    def __init__(self, earlier: Earlier | None) -> None:
        self._earlier = earlier
        self._rows: list[str] = []

    @property
    def places(self) -> str:
        """Where the pieces with keys are; no white space."""
        return ",".join(self._rows)

    def pieces(self, pieces: Iterable[bytes | Piece]) -> Iterator[bytes]:
        """The bytes of each, taken from the earlier file or made."""
        at = 0
        for piece in pieces:
            if isinstance(piece, bytes):
                data = piece
            else:
                known = None if self._earlier is None else self._earlier.get(piece.key)
                data = piece.make() if known is None else known
                piece.seen(data)
                self._rows.append(f"{piece.key}/{at}/{len(data)}/{zlib.crc32(data)}")
            at += len(data)
            yield data
