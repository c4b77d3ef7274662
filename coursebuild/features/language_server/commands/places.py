"""Places in texts and edits of them, as a client has them.

Entry point: `Places`. A client counts lines as CommonMark does, and in a line UTF-16 units, or what
it has agreed on. Texts are never cut at other line ends that Python knows, such as U+2028.
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
    """Of the files of a course."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self.encoding: str = "utf-16"
        self._uris: dict[str, str] = {}
        """As the client writes them, by path."""

    def path(self, uri: str) -> str:
        """The path of a file below the course's folder, POSIX and relative; empty for others."""
        file = Path((uri.startswith("file:") and uris.to_fs_path(uri)) or "/")
        full = file.parent.resolve() / file.name
        if not full.is_relative_to(self.root):
            return ""
        path = full.relative_to(self.root).as_posix()
        self._uris[path] = uri
        return path

    def uri(self, path: str) -> str:
        """The address of a file of the course."""
        return self._uris.get(path) or uris.from_fs_path(str(self.root / path)) or ""

    def offset(self, source: Source, position: types.Position) -> int:
        """The offset of a position, or the nearest that there is."""
        if position.line >= len(source.line_starts):
            return len(source.text)
        codec, size = _UNITS[self.encoding]
        units = source.line_text(position.line + 1).encode(codec)[: position.character * size]
        return source.line_starts[position.line] + len(units.decode(codec, "ignore"))

    def position(self, source: Source, offset: int) -> types.Position:
        """The position of an offset."""
        codec, size = _UNITS[self.encoding]
        line, column = source.position(offset)
        before = source.line_text(line)[: column - 1]
        return types.Position(line - 1, len(before.encode(codec)) // size)

    def range(self, span: Span) -> types.Range:
        """The range of a span."""
        start, end = (self.position(span.source, at) for at in (span.start, span.end))
        return types.Range(start, end)

    def location(self, span: Span) -> types.Location:
        """Where a span stands."""
        return types.Location(self.uri(span.path), self.range(span))

    def changes(self, edits: Iterable[Edit]) -> dict[str, list[types.TextEdit]]:
        """Edits by the addresses of their files."""
        found: dict[str, list[types.TextEdit]] = {}
        for edit in edits:
            its = found.setdefault(self.uri(edit.span.path), [])
            its.append(types.TextEdit(self.range(edit.span), edit.text))
        return found
