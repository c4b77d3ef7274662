"""What is read of a course of another tool."""

from __future__ import annotations

import posixpath
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal, TypeAlias

import yaml
from msgspec import Struct

from coursebuild.core.files.errors import UsageError

TEXTS = (".md", ".qmd", ".ipynb", ".myst")
"""What lessons are written in."""
SKIPPED = ("_build", "_site", "_book", "node_modules", "site-packages", "__pycache__", "public")
"""Folders of which nothing is read: what tools have made."""


class Leftover(Struct, frozen=True, order=True):
    """Something that has no counterpart, or that the author has to look at."""

    path: str
    """The file, relative to the folder that is imported."""
    place: str
    """Where in it, as `line 12` or `cell 3`; may be empty."""
    what: str


class Segment(Struct, frozen=True, kw_only=True):
    """A stretch of a lesson."""

    kind: Literal["prose", "block", "cell"]
    """`cell`: Python that is run; `block`: what else stands between marks."""
    place: str
    text: str
    """The prose, or what stands inside."""
    head: str = ""
    """What stands behind the marks that begin it."""
    mark: str = "```"
    """Which these are: backticks, tildes, colons, or `!!!`."""
    value: bool | None = None
    """Of a cell: whether the value of its last expression was shown; `None` where that is not
    known, since nothing is recorded."""


class ImportedText(Struct, frozen=True, kw_only=True):
    """A lesson or page, as the map of its course has it; what is last, once it is read."""

    old_id: str = ""
    """As its own course calls it; empty where that has no ids."""
    file: str = ""
    """Relative to the folder that is imported; empty where it is only planned."""
    title: str = ""
    slug: str = ""
    summary: str = ""
    status: str = ""
    objectives: tuple[str, ...] = ()
    prerequisites: tuple[str, ...] = ()
    minutes: int | None = None
    id: str = ""
    path: str = ""
    """Of its new file; empty where it is only planned."""
    segments: tuple[Segment, ...] = ()
    pictures: Mapping[str, bytes] = {}
    """What its file holds itself."""

    @property
    def link(self) -> str:
        """What leads to it."""
        kind = "page" if self.path.startswith("content/pages/") else "lesson"
        return f"{kind}:{self.id}"


class ImportedLevel(Struct, frozen=True, kw_only=True):
    """A group of lessons."""

    id: str = ""
    title: str
    summary: str = ""
    lessons: tuple[ImportedText, ...]


class ImportedCourse(Struct, frozen=True, kw_only=True):
    """The map of a course."""

    title: str
    summary: str = ""
    language: str = ""
    levels: tuple[ImportedLevel, ...]
    pages: tuple[ImportedText, ...] = ()
    camera_is_position: bool = False
    """Whether the camera of a lab says where the camera is, seen from its target."""
    left: tuple[Leftover, ...] = ()


Files: TypeAlias = dict[str, Path]
"""The files of a folder by their path in it."""


def files_of(folder: Path) -> Files:
    """All files below a folder, but for hidden ones and what tools have made.

    Raises:
        UsageError: there is no such folder.
    """
    if not folder.is_dir():
        raise UsageError(f"there is no folder {folder}")
    found = {}
    for path in sorted(folder.rglob("*")):
        parts = path.relative_to(folder).parts
        if path.is_file() and not any(part.startswith(".") or part in SKIPPED for part in parts):
            found["/".join(parts)] = path
    return found


def read_text(path: Path, name: str) -> str:
    """A text file with LF line ends.

    Raises:
        UsageError: it cannot be read, or is not UTF-8.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise UsageError(f"{name} cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise UsageError(f"{name} is not UTF-8") from None
    return text.replace("\r\n", "\n").replace("\r", "\n")


class _Yaml(yaml.SafeLoader):  # type: ignore[misc]  # which has no types
    """YAML in which what other tools tag, as by `!!python/name:`, is nothing."""


_Yaml.add_multi_constructor("", lambda loader, tag, node: None)


def read_yaml(text: str) -> Any:
    """What a text of YAML says; `None` where it is none."""
    try:
        return _Yaml(text).get_single_data()
    except (yaml.YAMLError, ValueError, RecursionError):  # such as a date that is none
        return None


def stem_of(path: str) -> str:
    """A file's path without its extension."""
    return posixpath.splitext(path)[0]


def name_of(path: str) -> str:
    """A file's name as a title: without extension and leading number, words apart."""
    name = posixpath.basename(stem_of(path))
    words = re.sub(r"^[\d.]+[\s._-]+(?=\S)", "", name)
    title = re.sub(r"[_-]+", " ", words).strip() or name
    return title[:1].upper() + title[1:]
