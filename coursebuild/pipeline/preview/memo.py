"""Remembering what was worked out for documents that did not change.

Entry points: `PerDocument`, for a function of a document; `Parsing`, for the parser. Each remembers
the last two results of a file: what an author saves is looked at before it is certain that the file
is complete. So memory does not grow with the number of saves.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Generic, TypeVar

from msgspec import Struct

from coursebuild.diagnostics import Parsed
from coursebuild.model import Document
from coursebuild.source import Source
from coursebuild.syntax.document import parse_document

T = TypeVar("T")


class PerDocument(Generic[T]):
    """A function of a document; the very same document is not looked at twice."""

    def __init__(self, make: Callable[[Document], T]) -> None:
        self._make = make
        self._kept: dict[str, tuple[tuple[Document, T], ...]] = {}

    def __call__(self, document: Document) -> T:
        """The result for a document."""
        path = document.source.path
        kept = self._kept.get(path, ())
        for known, result in kept:
            if known is document:
                return result
        made = self._make(document)
        self._kept[path] = ((document, made), *kept[:1])
        return made


class _Entry(Struct, frozen=True):
    text: str
    callouts: frozenset[str]
    lesson: bool
    parsed: Parsed[Document]


class Parsing:
    """The parser; a text that it has parsed gives the very same document again.

    Safe to call from several threads.
    """

    def __init__(self, most: int | None = None) -> None:
        """`most`: of so many files the results are remembered, those that were used last."""
        self._kept: dict[str, tuple[_Entry, ...]] = {}
        self._most = most
        self._lock = threading.Lock()

    def __call__(
        self, source: Source, callouts: frozenset[str], *, lesson: bool
    ) -> Parsed[Document]:
        """Parse a text; see `parse_document`."""
        with self._lock:
            found = self._find(source, callouts, lesson)
            if found is None:
                found = parse_document(source, callouts, lesson=lesson)
                new = _Entry(source.text, callouts, lesson, found)
                self._kept[source.path] = (new, *self._kept.pop(source.path, ())[:1])
                while self._most is not None and len(self._kept) > self._most:
                    del self._kept[next(iter(self._kept))]
            return found

    def known(
        self, source: Source, callouts: frozenset[str], *, lesson: bool
    ) -> Parsed[Document] | None:
        """What parsing a text gave, if it is remembered."""
        with self._lock:
            return self._find(source, callouts, lesson)

    def _find(
        self, source: Source, callouts: frozenset[str], lesson: bool
    ) -> Parsed[Document] | None:
        for entry in self._kept.get(source.path, ()):
            if (entry.text, entry.callouts, entry.lesson) == (source.text, callouts, lesson):
                return entry.parsed
        return None
