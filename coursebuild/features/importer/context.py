"""What is known of the whole course where one of its lessons is written.

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
    """A lesson under way: resolves what it names, and collects files and leftovers."""

    path: str
    """Its file, relative to the folder that is imported."""
    targets: Mapping[str, str]
    """What is linked to instead of a file, by its path without extension."""
    ids: Mapping[str, str]
    """Ids of lessons as coursebuild has them, by those of the course."""
    labels: Mapping[str, str]
    """The lesson or page that sets an anchor, as `targets` has it."""
    files: frozenset[str]
    """Paths of all files of the folder."""
    folder: str
    """Where the text will stand, as `content/lessons`."""
    camera_is_position: bool
    left: list[Leftover] = field(default_factory=list)
    copied: dict[str, str] = field(default_factory=dict)
    """Where files of the folder go, by their path there."""
    pictures: dict[str, str] = field(default_factory=dict)
    """Where pictures go that its file holds itself, by their names."""
    callouts: dict[str, str] = field(default_factory=dict)
    """Labels of kinds of callouts that coursebuild does not have."""

    def leave(self, place: str, what: str) -> None:
        """Note that something has no counterpart."""
        self.left.append(Leftover(self.path, place, what))

    def link(self, address: str, place: str) -> str:
        """Where a link leads now."""
        route = re.fullmatch(r"#?/lessons?/([^#?/]+)/?(#.*)?", address)
        if route is not None:
            known = self.ids.get(unquote(route[1]))
            if known is None:
                self.leave(place, f"a link to `{address}`, a lesson that the map does not have")
            return "" if known is None else f"lesson:{known}{route[2] or ''}"
        parts = urlsplit(address)
        if parts.scheme or parts.netloc or not parts.path:
            return address
        path = self.resolve(parts.path)
        anchor = f"#{parts.fragment.lower()}" if parts.fragment else ""
        target = self.targets.get(stem_of(path)) or self.targets.get(path)
        if target is not None:
            return target + anchor
        if path in self.files:
            return self.file(path)
        self.leave(place, f"a link to `{address}`, which is not in the folder")
        return ""

    def labelled(self, anchor: str) -> str:
        """The address of an anchor that a text of the course sets; empty where none does."""
        target = self.labels.get(anchor)
        if target is None:
            return ""
        here = target == self.targets.get(stem_of(self.path))
        return f"#{anchor}" if here else f"{target}#{anchor}"

    def resolve(self, path: str) -> str:
        """A path that the lesson names, relative to the folder that is imported."""
        path = unquote(path)
        beside = posixpath.normpath(posixpath.join(posixpath.dirname(self.path), path))
        if path.startswith("/"):
            beside = posixpath.normpath(path.lstrip("/"))
        if beside in self.files or stem_of(beside) in self.targets:
            return beside
        return next((f for f in sorted(self.files) if f.endswith("/" + path.lstrip("./"))), beside)

    def picture(self, name: str) -> str:
        """The address of a picture that the file of the lesson holds itself."""
        self.pictures[name] = f"content/files/{stem_of(self.path)}/{name}"
        return posixpath.relpath(self.pictures[name], self.folder).replace(" ", "%20")

    def file(self, path: str) -> str:
        """The address of a file that goes with the course."""
        self.copied[path] = f"content/files/{path}"
        return posixpath.relpath(self.copied[path], self.folder).replace(" ", "%20")
