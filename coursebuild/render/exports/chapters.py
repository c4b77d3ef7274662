"""The chapters of the e-book, compressed, and what its package says of each.

Entry point: `Chapters`. A chapter is compressed once, and kept with what is to be known of it. That
alone is noted for all chapters together: a book of which most is taken from the last one needs no
more of the others.
"""

from __future__ import annotations

import json
import struct
import sys
from collections.abc import Callable
from typing import TypeAlias

from msgspec import Struct

from coursebuild.model import Lesson
from coursebuild.render.exports.archive import Deflated, deflate
from coursebuild.render.exports.epub import Chapter, Epub
from coursebuild.render.exports.parts import OpenChapter

Keep: TypeAlias = Callable[[str, Callable[[], bytes]], bytes]
"""Gives what was made under a key before, or makes it."""
_HEAD = struct.Struct("<LLL")
_ROOM = 4 << 20
"""Bytes of compressed chapters that wait to be written, at most."""


def _nothing() -> None:
    return None


class Note(Struct, frozen=True):
    """Bytes that are kept until others take their place."""

    get: Callable[[], bytes | None] = _nothing
    put: Callable[[bytes], object] = len


class Chapters:
    """The chapters of one e-book."""

    def __init__(
        self,
        epub: Epub,
        key: Callable[[Lesson], str],
        part: Callable[[Lesson], OpenChapter],
        keep: Keep,
        note: Note,
    ) -> None:
        """`key` says what a chapter depends on, `part` gives it with its links left open."""
        self.key = key
        self._epub = epub
        self._part = part
        self._keep = keep
        self._note = note
        self._waiting: dict[str, bytes] = {}
        self._room = _ROOM

    def facts(self) -> Callable[[Lesson], Chapter]:
        """What the package must know of each lesson's chapter."""
        known = _noted(self._note.get())
        heads, new = dict[str, str](), False
        for lesson in self._epub.lessons:
            head = known.pop(self.key(lesson), None)
            if head is None:
                head = self._head(lesson).decode()
                new = True
            heads[lesson.id] = sys.intern(head)  # most say the same
        if known or new:
            noted = {self.key(lesson): heads[lesson.id] for lesson in self._epub.lessons}
            self._note.put(json.dumps(noted).encode())
        return lambda lesson: _facts(heads[lesson.id])

    def deflated(self, lesson: Lesson) -> Deflated:
        """A chapter."""
        data = self._waiting.pop(lesson.id, None) or self._kept(lesson)
        crc, size, length = _HEAD.unpack_from(data)
        return crc, size, data[_HEAD.size + length :]

    def _head(self, lesson: Lesson) -> bytes:
        """What is to be known of a chapter, which waits to be written if there is room."""
        data = self._kept(lesson)
        self._room -= len(data)
        if self._room >= 0:
            self._waiting[lesson.id] = data
        _, _, length = _HEAD.unpack_from(data)
        return data[_HEAD.size : _HEAD.size + length]

    def _kept(self, lesson: Lesson) -> bytes:
        """A chapter and what is to be known of it: of a long course, one is made anew."""
        return self._keep(self.key(lesson), lambda: self._made(lesson))

    def _made(self, lesson: Lesson) -> bytes:
        part = self._part(lesson)
        crc, size, data = deflate(self._epub.chapter(lesson, part))
        head = json.dumps([part.pictures, part.mathml, part.svg]).encode()
        return _HEAD.pack(crc, size, len(head)) + head + data


def _facts(head: str) -> Chapter:
    pictures, mathml, svg = json.loads(head)
    return Chapter(tuple(pictures), mathml, svg)


def _noted(data: bytes | None) -> dict[str, str]:
    """What was noted of chapters, by their keys."""
    found = {} if data is None else json.loads(data)
    return found if isinstance(found, dict) else {}
