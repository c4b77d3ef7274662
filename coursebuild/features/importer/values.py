"""A course of another tool as values, and how its files are read."""

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
"""Extensions of the files that can be lessons."""
SKIPPED_FOLDERS = (
    "_build",
    "_site",
    "_book",
    "node_modules",
    "site-packages",
    "__pycache__",
    "public",
)
"""Folders that are not read: tools write them."""


class Leftover(Struct, frozen=True, order=True):
    """Something that has no counterpart, or that the author has to look at."""

    path: str
    """The file, relative to the folder that is imported."""
    place: str
    """Where in the file, as `line 12` or `cell 3`; may be empty."""
    message: str


class Segment(Struct, frozen=True, kw_only=True):
    """A stretch of a lesson."""

    kind: Literal["prose", "block", "cell"]
    """`cell`: Python that is run; `block`: anything else between marks, such as a fence."""
    place: str
    text: str
    """The prose, or the text between the marks."""
    head: str = ""
    """The rest of the line after the opening mark; of a notebook's cell, its tags."""
    mark: str = "```"
    """The opening mark: backticks, tildes, colons, or `!!!`."""
    shows_value: bool | None = None
    """Of a cell: whether the value of its last expression was shown; `None` where no output is
    recorded."""


class ImportedText(Struct, frozen=True, kw_only=True):
    """A lesson or page as the map of its course has it.

    `id` and the fields below it are set when its file is read.
    """

    old_id: str = ""
    """The id that it has in the other course; empty where lessons have none there."""
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
    """The path of its new file; empty where it is only planned."""
    segments: tuple[Segment, ...] = ()
    pictures: Mapping[str, bytes] = {}
    """Pictures that its file contains, by name."""

    @property
    def link(self) -> str:
        """The address for links to it."""
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
    """Whether the angles of a lab's camera give its position as seen from its target."""
    leftovers: tuple[Leftover, ...] = ()


Files: TypeAlias = dict[str, Path]
"""The files of a folder by their path in it."""


def list_files(folder: Path) -> Files:
    """All files below a folder, but for hidden ones and what tools have made.

    Raises:
        UsageError: there is no such folder.
    """
    if not folder.is_dir():
        raise UsageError(f"there is no folder {folder}")
    files = {}
    for path in sorted(folder.rglob("*")):
        parts = path.relative_to(folder).parts
        if path.is_file() and not any(
            part.startswith(".") or part in SKIPPED_FOLDERS for part in parts
        ):
            files["/".join(parts)] = path
    return files


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
    """YAML in which a value with a tag of another tool, such as `!!python/name:`, is `None`."""


_Yaml.add_multi_constructor("", lambda loader, tag, node: None)


def read_yaml(text: str) -> Any:
    """Return the value of a YAML text; `None` where it is invalid."""
    try:
        return _Yaml(text).get_single_data()
    except (yaml.YAMLError, ValueError, RecursionError):  # such as an invalid date
        return None


def stem_of(path: str) -> str:
    """A file's path without its extension."""
    return posixpath.splitext(path)[0]


def title_of_file(path: str) -> str:
    """Turn a file's name into a title: without extension and leading number, with spaces."""
    name = posixpath.basename(stem_of(path))
    words = re.sub(r"^[\d.]+[\s._-]+(?=\S)", "", name)
    title = re.sub(r"[_-]+", " ", words).strip() or name
    return title[:1].upper() + title[1:]
