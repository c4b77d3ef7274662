"""What the conversion of one lesson needs to know of the whole course.

Entry point: `LessonContext`.
"""

from __future__ import annotations

import posixpath
import re
from collections.abc import Mapping
from urllib.parse import unquote, urlsplit

from msgspec import Struct, field

from coursebuild.features.importer.values import Leftover, stem_of


class LessonContext(Struct):
    """Resolves what a lesson names while it is converted, and collects files and leftovers."""

    path: str
    """Its file, relative to the folder that is imported."""
    targets: Mapping[str, str]
    """New addresses of lessons and pages, by the path of the old file without extension."""
    ids: Mapping[str, str]
    """New ids of lessons, by the old ones."""
    labels: Mapping[str, str]
    """The address of the lesson or page that sets an anchor, by the anchor."""
    files: frozenset[str]
    """Paths of all files of the folder."""
    folder: str
    """The folder of the new file, such as `content/lessons`."""
    camera_is_position: bool
    leftovers: list[Leftover] = field(default_factory=list)
    file_paths: dict[str, str] = field(default_factory=dict)
    """New paths of the files that the lesson uses, by the old ones."""
    picture_paths: dict[str, str] = field(default_factory=dict)
    """New paths of the pictures that its file contains, by their names."""
    callouts: dict[str, str] = field(default_factory=dict)
    """Labels of kinds of callouts that coursebuild does not have, by kind."""

    def add_leftover(self, place: str, message: str) -> None:
        """Note that something has no counterpart."""
        self.leftovers.append(Leftover(self.path, place, message))

    def resolve_link(self, address: str, place: str) -> str:
        """Return the new address of a link; empty where nothing in the course has it."""
        route = re.fullmatch(r"#?/lessons?/([^#?/]+)/?(#.*)?", address)
        if route is not None:
            id = self.ids.get(unquote(route[1]))
            if id is None:
                self.add_leftover(
                    place, f"a link to `{address}`, a lesson that the map does not have"
                )
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
        self.add_leftover(place, f"a link to `{address}`, which is not in the folder")
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
        if resolved in self.files or stem_of(resolved) in self.targets:
            return resolved
        return next(
            (f for f in sorted(self.files) if f.endswith("/" + path.lstrip("./"))), resolved
        )

    def add_picture(self, name: str) -> str:
        """Copy a picture that the lesson's file contains, and return its new address."""
        self.picture_paths[name] = f"content/files/{stem_of(self.path)}/{name}"
        return posixpath.relpath(self.picture_paths[name], self.folder).replace(" ", "%20")

    def add_file(self, path: str) -> str:
        """Copy a file of the folder, and return its new address."""
        self.file_paths[path] = f"content/files/{path}"
        return posixpath.relpath(self.file_paths[path], self.folder).replace(" ", "%20")
