"""A course of another tool as values, its YAML among them."""

from __future__ import annotations

import posixpath
import re
from collections.abc import Mapping, ValuesView
from typing import Any, Literal

import yaml
from msgspec import Struct

from coursebuild.core.values import DAMAGE


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
    printed: str = ""
    """Of a cell: what it printed, as recorded."""
    value: str = ""
    """Of a cell: the value that was shown, as recorded."""


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


_YAML_SIZE, _YAML_DEPTH = 100_000, 100
"""Values in a YAML text, and how deep they may be nested."""


class _Yaml(yaml.SafeLoader):  # type: ignore[misc]  # which has no types
    """YAML in which a value with a tag of another tool, such as `!!python/name:`, is `None`."""


_Yaml.add_multi_constructor("", lambda loader, tag, node: None)


def read_yaml(text: str) -> Any:
    """Return the value of a YAML text; `None` where it is invalid, or too large.

    Its aliases can make a short text a large value, or one without end.
    """
    try:
        value = _Yaml(text).get_single_data()
    except (yaml.YAMLError, *DAMAGE):  # an invalid date, a tag of YAML's own with another text
        return None
    parts, count = [(value, 0)], 0
    while parts:
        part, depth = parts.pop()
        inside = part.values() if isinstance(part, dict) else part
        if isinstance(inside, list | ValuesView):
            parts += ((item, depth + 1) for item in inside)
            count += len(inside)
        if count > _YAML_SIZE or depth > _YAML_DEPTH:
            return None
    return value


def stem_of(path: str) -> str:
    """A file's path without its extension."""
    return posixpath.splitext(path)[0]


def title_of_file(path: str) -> str:
    """Turn a file's name into a title: without extension and leading number, with spaces."""
    name = posixpath.basename(stem_of(path))
    words = re.sub(r"^[\d.]+[\s._-]+(?=\S)", "", name)
    title = re.sub(r"[_-]+", " ", words).strip() or name
    return title[:1].upper() + title[1:]
