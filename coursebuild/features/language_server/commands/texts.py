"""The texts of a course as they are now, in an editor or on the disk.

A client counts lines as CommonMark does, and within a line UTF-16 units or those of the agreed
encoding. Other line ends that Python knows, such as U+2028, end no line.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache
from pathlib import Path

from lsprotocol import types
from msgspec import Struct
from pygls import uris

from coursebuild.core.files.read import read_sources
from coursebuild.core.model import Document, Lesson, Owner
from coursebuild.core.model.course import Words
from coursebuild.core.pages.library import Library
from coursebuild.core.syntax.document import parse_document
from coursebuild.core.text.diagnostics import Edit
from coursebuild.core.text.source import Source, Span
from coursebuild.preview.session import Session

_UNITS = {"utf-8": ("utf-8", 1), "utf-16": ("utf-16-le", 2), "utf-32": ("utf-32-le", 4)}
"""The codec of each encoding, and the bytes of a unit."""


class Places:
    """The paths, offsets and spans of a course as a client writes them."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self.encoding: str = "utf-16"
        self._uris: dict[str, str] = {}
        """The URIs that the client used, by path."""

    def path(self, uri: str) -> str:
        """Return the path of a file relative to the course's folder; empty for files outside."""
        try:
            file = Path((uri.startswith("file:") and uris.to_fs_path(uri)) or "/")
            full = file.parent.resolve() / file.name
        except (ValueError, RuntimeError):  # no name of a file, as with NUL; links in a circle
            return ""
        if not full.is_relative_to(self.root):
            return ""
        path = full.relative_to(self.root).as_posix()
        self._uris[path] = uri
        return path

    def uri(self, path: str) -> str:
        """Return the URI of a file of the course."""
        return self._uris.get(path) or uris.from_fs_path(str(self.root / path)) or ""

    def offset(self, source: Source, position: types.Position) -> int:
        """Return the offset of a position, or the nearest that exists."""
        if position.line >= len(source.line_starts):
            return len(source.text)
        codec, size = _UNITS[self.encoding]
        units = source.line_text(position.line + 1).encode(codec)[: position.character * size]
        return source.line_starts[position.line] + len(units.decode(codec, "ignore"))

    def position(self, source: Source, offset: int) -> types.Position:
        """Return the position of an offset."""
        codec, size = _UNITS[self.encoding]
        line, column = source.position(offset)
        before = source.line_text(line)[: column - 1]
        return types.Position(line - 1, len(before.encode(codec)) // size)

    def range(self, span: Span) -> types.Range:
        """Return the range of a span."""
        start, end = (self.position(span.source, offset) for offset in (span.start, span.end))
        return types.Range(start, end)

    def location(self, span: Span) -> types.Location:
        """Return the file and the range of a span."""
        return types.Location(self.uri(span.path), self.range(span))

    def changes(self, edits: Iterable[Edit]) -> dict[str, list[types.TextEdit]]:
        """Return edits by the URIs of their files."""
        changes: dict[str, list[types.TextEdit]] = {}
        for edit in edits:
            file_edits = changes.setdefault(self.uri(edit.span.path), [])
            file_edits.append(types.TextEdit(self.range(edit.span), edit.text))
        return changes


class OpenTexts(Struct, frozen=True):
    """The texts of a course as they are now."""

    session: Session
    library: Library
    """The course as it was last read."""
    places: Places

    def source(self, path: str) -> Source:
        """Return the text of a file of the course; an empty one where there is no such file."""
        read = read_sources(self.session.root, [path], self.session.open_texts)
        return next(iter(read.value), Source(path, ""))

    def document(self, source: Source) -> Document | None:
        """Return the document of a lesson or page; `None` for other texts, and those too long."""
        owner = self.owner(source)
        if owner is None:
            return None
        course = self.library.course
        return _parse(source, course.callout_names, isinstance(owner, Lesson), course.words)

    def owner(self, source: Source) -> Owner | None:
        """Return the lesson or page of a text, unless the text is too long to be read."""
        course = self.library.course
        owners = course.owners if len(source.text) <= course.limits.text else ()
        return next((owner for owner in owners if owner.path == source.path), None)


@lru_cache(maxsize=16)
def _parse(source: Source, callouts: frozenset[str], lesson: bool, words: Words) -> Document:
    """Cached, since an editor sends many requests about the same text."""
    return parse_document(source, callouts, lesson=lesson, words=words).value
