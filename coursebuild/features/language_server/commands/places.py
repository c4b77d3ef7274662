"""Converts places and edits between the course and a client.

Entry point: `Places`. A client counts lines as CommonMark does, and within a line UTF-16 units or
those of the agreed encoding. Other line ends that Python knows, such as U+2028, end no line.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from lsprotocol import types
from pygls import uris

from coursebuild.core.text.diagnostics import Edit
from coursebuild.core.text.source import Source, Span

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
