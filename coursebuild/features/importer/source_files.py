"""A course of another tool: its files and the one way to read them, and what it says, as values.

A link is followed only to a file that is imported itself, or within a folder that is. All other
links, and what is no regular file, are leftovers with their reasons. A file is opened from the
folder downwards, one part of its real path after the other, and none may be a link by then.
"""

from __future__ import annotations

import os
import posixpath
import re
import stat
import tomllib
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence, ValuesView
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import yaml
from msgspec import Struct

from coursebuild.api import UsageError, regex
from coursebuild.core.files.errors import reason
from coursebuild.core.values import DAMAGE
from coursebuild.features.importer.account import Account, Leftover


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
    """The opening mark: backticks, tildes, colons, `!!!`, `===` or `>`."""
    indent: str = ""
    """What stands before a block in a list; in its further lines, as many blanks."""
    shows_value: bool | None = None
    """Of a cell: whether the value of its last expression was shown; `None` where no output of any
    cell is recorded."""
    printed: str = ""
    """Of a cell: what it printed, as recorded."""
    value: str = ""
    """Of a cell: the value that was shown, or the error, as recorded."""
    picture: tuple[str, bytes] | None = None
    """Of a cell: the picture that is recorded below it, with its extension; empty for none, and
    `None` where no output is recorded."""
    lost: tuple[str, ...] = ()
    """Of a cell: the kinds of recorded outputs that are neither text nor a picture."""


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
    substitutions: Mapping[str, str] = {}
    """What names between braces stand for in it, as its metadata say."""
    macros: str = ""
    """The definitions of macros in its metadata."""

    @property
    def label(self) -> str:
        """The label that its metadata give the whole text; may be empty."""
        return self.substitutions.get("label", "")

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
    has_own_titles: bool = False
    """Whether the title that a text has itself goes before that of the map, which is short."""
    substitutions: Mapping[str, str] = {}
    """What names between braces stand for in its texts."""
    macros: str = ""
    """The definitions of macros in its settings."""
    camera_is_position: bool = False
    """Whether the angles of a lab's camera give its position as seen from its target."""


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


def read_toml(text: str) -> Mapping[str, Any] | None:
    """Return the value of a TOML text; `None` where it is invalid."""
    try:
        return tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError):
        return None


def value_at(settings: object, *path: str) -> object:
    """Return the value at a path of nested keys; `None` where there is none."""
    for key in path:
        settings = settings.get(key) if isinstance(settings, Mapping) else None
    return settings


def _texts_below(settings: object, names: Sequence[str]) -> Iterator[str]:
    values = enumerate(settings) if isinstance(settings, list) else ()
    for name, part in settings.items() if isinstance(settings, Mapping) else values:
        if name in names:
            yield from filter(str.__instancecheck__, part if isinstance(part, list) else [part])
        else:
            yield from _texts_below(part, names)


def find_group(pattern: str | re.Pattern[str], text: str) -> str:
    """Return the last group of the first match of a pattern; empty where there is none."""
    match = re.search(pattern, text) if isinstance(pattern, str) else pattern.search(text)
    return match[match.lastindex or 0] if match else ""


def stem_of(path: str) -> str:
    """A file's path without its extension."""
    return posixpath.splitext(path)[0]


def title_of_file(path: str) -> str:
    """Turn a file's name into a title: without extension and leading number, with spaces."""
    name = posixpath.basename(stem_of(path))
    words = re.sub(r"^[\d.]+[\s._-]+(?=\S)", "", name)
    title = re.sub(r"[_-]+", " ", words).strip() or name
    return title[:1].upper() + title[1:]


TEXTS = (".md", ".qmd", ".ipynb", ".mdx", ".myst", ".markdown", ".Rmd")
"""Extensions of the files that can be lessons."""
_SKIPPED = frozenset("__pycache__ _book _build _site node_modules public site-packages".split())
"""Names of folders that tools write."""
_MAX_SIZE = 256 << 20
"""Bytes of a file."""
_MAX_DEPTH = 100
"""Folders around a folder."""
_MAX_INCLUDED = 2_000_000
"""Characters that a lesson may include: files that include each other could become endless."""
PAIR = "the text of a notebook, which is taken"
TOO_MUCH = "with it the lesson would include too much text"
_BAD_NAME = regex("[\x00-\x1f\x7f\ud800-\udfff]")
_OPEN_FOLDER = os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW | os.O_CLOEXEC
_OPEN_FILE = os.O_RDONLY | os.O_NONBLOCK | os.O_NOFOLLOW | os.O_CLOEXEC


class SourceFiles:
    """The files of a folder by their path in it, sorted; or one file, and what it names beside it.

    Of a single file the folder is not listed: `find` adds what is asked for.
    """

    def __init__(self, source: Path) -> None:
        """List the files.

        Raises:
            UsageError: there is no such folder or text.
        """
        place = Path(os.path.realpath(source))
        self.is_single = place.name.endswith(TEXTS) and place.is_file()
        if not self.is_single and not place.is_dir():
            if not os.path.lexists(source):
                raise UsageError(f"there is no folder or file {source}")
            extensions = f"{', '.join(TEXTS[:-1])} or {TEXTS[-1]}"
            message = f"{source} is neither a folder nor a file with the extension {extensions}"
            raise UsageError(message, help="name the folder of its course")
        self.folder = place.parent if self.is_single else place
        self.name = stem_of(place.name) if self.is_single else place.name
        """What the new folder is called, and the course where nothing else gives it a title."""
        self.account = Account()
        self.read_paths: set[str] = set()
        self._real_paths: dict[str, str] = {}
        """The path of each file without links, by its path."""
        self._included = Counter[str]()
        """Characters that each lesson has included, by its path."""
        if self.is_single:
            self._real_paths[place.name] = place.name
        else:
            self._list()

    def __iter__(self) -> Iterator[str]:
        return iter(tuple(self._real_paths))

    def __contains__(self, path: str) -> bool:
        return path in self._real_paths

    @cached_property
    def dollars(self) -> str:
        """What begins a formula: two dollars in GitBook; empty where settings name no extension."""
        if (self.folder / ".gitbook.yaml").is_file():
            return "$$"
        names = ("mkdocs.yml", "book.toml", self.docusaurus, "book.json" * ("SUMMARY.md" in self))
        path = next(filter(None, map(self.find_settings, names)), "")
        pattern = "[Mm]ath|arithmatex|[Kk]a[Tt]e[Xx]|INHERIT"
        if path and not re.search(pattern, self.read_text(path)):
            return ""
        return "$$" if path == "book.json" else "$"

    @cached_property
    def docusaurus(self) -> str:
        """The path of the settings of Docusaurus; empty where it is no site of it."""
        pattern = r"(?:[\w-]+/){0,2}docusaurus\.config\.[cm]?[jt]s"
        return min((p for p in self if re.fullmatch(pattern, p)), key=len, default="")

    def find_settings(self, name: str) -> str:
        """Return the path of settings, whose extension or tool has two names; empty for none."""
        tools = (name.replace("mkdocs", tool) for tool in ("properdocs", "zensical"))
        return next((p for p in (name, name.replace(".yml", ".yaml"), *tools) if p in self), "")

    def settings(self, name: str) -> Mapping[str, Any]:
        """Return the settings in a file; none where it is not there, or cannot be read."""
        path = self.find_settings(name)
        read = read_toml if path.endswith(".toml") else read_yaml  # JSON is YAML
        value = read(self.read_text(path)) if path else {}
        if value is None:
            self.leave(path, "settings that cannot be read: nothing here is as they say", "setting")
        return value if isinstance(value, dict) else {}

    @cached_property
    def mkdocs(self) -> str:
        """The settings of MkDocs; empty where it is no project of it."""
        path = self.find_settings("mkdocs.yml") or self.find_settings("zensical.toml")
        return path and (self.read_text(path) or "\n")

    @cached_property
    def _mkdocs_settings(self) -> Mapping[str, Any]:
        return self.settings("mkdocs.yml") or self.settings("zensical.toml")

    def mkdocs_values(self, *names: str) -> Sequence[str]:
        """The texts that the settings of MkDocs have below any of these names, one or a list."""
        return tuple(_texts_below(self._mkdocs_settings, names))

    @cached_property
    def hidden_marks(self) -> Mapping[str, str]:
        """What begins lines of code that mdBook hides, by language."""
        marks = value_at(self.settings("book.toml"), "output", "html", "code", "hidelines")
        own_marks = marks if isinstance(marks, dict) else {}
        return {**own_marks, "rust": "#"} if "book.toml" in self else {}

    def has_signs(self, path: str) -> bool:
        """Whether the tool of a text draws hyphens in a row as a dash."""
        return (
            path.endswith((".qmd", ".Rmd"))
            or "conf.py" in self
            or "_config.yml" in self
            or value_at(self.settings("book.toml"), "output", "html", "smart-punctuation") is True
        )

    def find(self, path: str, *, is_hidden: bool = False) -> str:
        """Return the path of a file, given perhaps with links to folders; empty for no file.

        A hidden one is found where only what is part of a text or of the map is asked for.
        """
        if path in self._real_paths:
            return path
        real = "" if "\0" in path else self._real_path(path)
        if (self.is_single and self._is_found(path, real)) or (
            is_hidden and real and Path(self.folder, real).is_file()
        ):
            self._real_paths[real] = real
        return real if real in self._real_paths else ""

    def read(self, path: str) -> bytes:
        """Return the content of a file.

        Raises:
            UsageError: it cannot be read.
        """
        parts = self._real_paths[path].split("/")
        self.read_paths.add(path)
        try:
            fd = os.open(self.folder, _OPEN_FOLDER)
            try:
                for number, part in enumerate(parts, 1):
                    flags = _OPEN_FOLDER if number < len(parts) else _OPEN_FILE
                    above, fd = fd, os.open(part, flags, dir_fd=fd)
                    os.close(above)
                if not stat.S_ISREG(os.fstat(fd).st_mode):
                    raise OSError("it is not a regular file")
                with open(fd, "rb", closefd=False) as file:
                    return file.read()
            finally:
                os.close(fd)
        except OSError as error:
            raise UsageError(f"{path} cannot be read: {reason(error)}") from None

    def read_text(self, path: str) -> str:
        """Return a text with LF line ends.

        Raises:
            UsageError: it cannot be read, or is not UTF-8.
        """
        try:
            text = self.read(path).decode("utf-8-sig")
        except UnicodeDecodeError:
            raise UsageError(f"{path} is not UTF-8") from None
        return text.replace("\r\n", "\n").replace("\r", "\n")

    def may_include(self, text: str, lesson: str) -> bool:
        """Whether a lesson may include this text as well; it counts from now on."""
        self._included[lesson] += 1_000 + len(text)  # an empty one counts, too
        return self._included[lesson] <= _MAX_INCLUDED

    def _list(self) -> None:
        links, folders = [], {"."}
        pending = [""]
        while pending:
            folder = pending.pop()
            try:
                with os.scandir(self.folder / folder) as iterator:
                    entries = tuple(iterator)
            except OSError as error:
                self.leave(folder or ".", f"a folder that cannot be read: {reason(error)}")
                continue
            for entry in entries:
                path = f"{folder}/{entry.name}".lstrip("/")
                if _is_skipped(entry.name):
                    continue
                if _BAD_NAME.search(entry.name):
                    name = path.encode("unicode_escape").decode()
                    self.leave(name, "the name is not UTF-8, or holds a control character")
                    continue
                try:
                    status = entry.stat(follow_symlinks=False)
                except OSError as error:
                    self.leave(path, reason(error))
                    continue
                if stat.S_ISLNK(status.st_mode):
                    links.append(path)
                elif stat.S_ISDIR(status.st_mode) and path.count("/") == _MAX_DEPTH:
                    self.leave(path, f"a folder in {_MAX_DEPTH} others, which is not read")
                elif stat.S_ISDIR(status.st_mode):
                    pending.append(path)
                    folders.add(path)
                elif not stat.S_ISREG(status.st_mode):
                    self.leave(path, "a pipe, socket or device, which is not read")
                elif status.st_size > _MAX_SIZE:
                    self.leave(path, f"a file larger than {_MAX_SIZE >> 20} MiB")
                else:
                    self._real_paths[path] = path
        regular_paths = {*self._real_paths}
        for link in links:
            real = self._real_path(link)
            if real in regular_paths:
                self._real_paths[link] = real
            elif not real:
                self.leave(link, _LINK_OUT)
            elif not os.path.lexists(self.folder / real) or Path(self.folder, real).is_symlink():
                self.leave(link, "a broken link")
            elif real not in folders:
                self.leave(link, "a link to what is not imported")
        self._real_paths = dict(sorted(self._real_paths.items(), key=lambda e: e[0].split("/")))

    def _real_path(self, path: str) -> str:
        """Return the path of what all links in a path lead to; empty if it is not in the folder."""
        try:
            real = Path(os.path.realpath(self.folder / path))
        except OSError:  # it was a link a moment ago
            return ""
        return real.relative_to(self.folder).as_posix() if real.is_relative_to(self.folder) else ""

    def _is_found(self, path: str, real: str) -> bool:
        """Whether a single file may take this one along."""
        if not real and not path.startswith("../"):
            self.leave(path, _LINK_OUT)
        is_public = not any(map(_is_skipped, (*path.split("/"), *real.split("/"))))
        return is_public and Path(self.folder, real).is_file()

    def change(self, kind: str, change: str, count: int = 1) -> None:
        """Note that things of a kind were changed in a way."""
        self.account.changed[kind, change] += count

    def leave(self, path: str, message: str, kind: str = "file", place: str = "") -> None:
        """Note that something is not imported, and why."""
        self.account.leave(Leftover(path, place, " ".join(message.split()), kind))


_LINK_OUT = "a link leads out of the folder, and nothing behind it is read"


def _is_skipped(name: str) -> bool:
    return name.startswith(".") or name in _SKIPPED
