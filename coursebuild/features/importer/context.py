"""What the conversion of a lesson needs to know of the whole course.

Entry point: `LessonContext`.
"""

from __future__ import annotations

import posixpath
import re
from collections.abc import Mapping
from urllib.parse import unquote, urlsplit

from msgspec import Struct, field
from msgspec.structs import replace

from coursebuild.features.importer.source_files import SourceFiles
from coursebuild.features.importer.values import Leftover, stem_of


class LessonContext(Struct, frozen=True, kw_only=True):
    """Resolves what a lesson names while it is converted, and collects files and leftovers.

    Lessons of a course, and places in a lesson, have contexts that collect together.
    """

    targets: Mapping[str, str]
    """New addresses of lessons and pages, by the path of the old file without extension."""
    ids: Mapping[str, str]
    """New ids of lessons, by the old ones."""
    labels: Mapping[str, str]
    """The address of the lesson or page that sets an anchor, by the anchor."""
    files: SourceFiles
    camera_is_position: bool
    path: str = ""
    """The lesson's file, relative to the folder that is imported."""
    pictures: Mapping[str, bytes] = {}
    """Pictures that this file contains, by name."""
    folder: str = ""
    """The folder of the new file, such as `content/lessons`."""
    place: str = ""
    """The place in the lesson that is converted, as `line 12` or `cell 3`."""
    depth: int = 0
    """How many blocks are around the place."""
    leftovers: list[Leftover] = field(default_factory=list)
    copies: dict[str, bytes] = field(default_factory=dict)
    """The files and pictures that the lesson uses, by their new paths."""
    notebook_outputs: dict[str, str] = field(default_factory=dict)
    """The notebooks whose recorded outputs are kept, by the paths of their scripts."""
    callouts: dict[str, str] = field(default_factory=dict)
    """Labels of kinds of callouts that coursebuild does not have, by kind."""

    def at(self, place: str) -> LessonContext:
        """Return the context of a place in the lesson."""
        return replace(self, place=place)

    def line_below(self, lines: int) -> LessonContext:
        """Return the context of so many lines further down; a cell is a single place."""
        kind, _, number = self.place.partition(" ")
        return self.at(f"line {int(number) + lines}") if kind == "line" else self

    def add_leftover(self, message: str) -> None:
        """Note that something has no counterpart."""
        self.leftovers.append(Leftover(self.path, self.place, message))

    def resolve_link(self, address: str) -> str:
        """Return the new address of a link; empty where nothing in the course has it."""
        route = re.fullmatch(r"#?/lessons?/([^#?/]+)/?(#.*)?", address)
        if route is not None:
            id = self.ids.get(unquote(route[1]))
            if id is None:
                self.add_leftover(f"a link to `{address}`, a lesson that the map does not have")
            return "" if id is None else f"lesson:{id}{route[2] or ''}"
        parts = urlsplit(address)
        if parts.scheme or parts.netloc or not parts.path:
            return address
        path = self.resolve_path(parts.path)
        anchor = f"#{parts.fragment.lower()}" if parts.fragment else ""
        target = self.targets.get(stem_of(path)) or self.targets.get(path)
        if target is not None:
            return target + anchor
        if path in self.files:
            return self.add_file(path)
        self.add_leftover(f"a link to `{address}`, which is not in the folder")
        return ""

    def resolve_anchor(self, anchor: str) -> str:
        """Return the address of an anchor; empty where no text of the course sets it."""
        target = self.labels.get(anchor)
        if target is None:
            return ""
        is_here = target == self.targets.get(stem_of(self.path))
        return f"#{anchor}" if is_here else f"{target}#{anchor}"

    def resolve_path(self, path: str) -> str:
        """Return a path that the lesson names, relative to the folder that is imported."""
        path = unquote(path)
        resolved = posixpath.normpath(posixpath.join(posixpath.dirname(self.path), path))
        if path.startswith("/"):
            resolved = posixpath.normpath(path.lstrip("/"))
        if file := self.files.find(resolved):
            return file
        if stem_of(resolved) in self.targets:
            return resolved
        return next((f for f in self.files if f.endswith("/" + path.lstrip("./"))), resolved)

    def add_picture(self, name: str) -> str:
        """Copy a picture that the lesson's file contains, and return its new address."""
        file = re.sub(r"[^\w.+-]", "-", name)  # it is a name, whatever path it looks like
        return self._add_copy(f"{stem_of(self.path)}/{file}", self.pictures[name])

    def add_file(self, path: str) -> str:
        """Copy a file of the folder, and return its new address."""
        return self._add_copy(path, self.files.read(path))

    def _add_copy(self, name: str, data: bytes) -> str:
        path = f"content/files/{name}"
        self.copies[path] = data
        return posixpath.relpath(path, self.folder).replace(" ", "%20")
