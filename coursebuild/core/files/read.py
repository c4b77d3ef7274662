"""Reading a course: where it is, which files it has, what they say.

Lessons, pages and models are decoded as strict UTF-8. Line ends and byte order marks stay, so that
edits by offset change no other byte. A file that cannot be read becomes a diagnostic. One that is
not UTF-8 still becomes a source, with U+FFFD for the wrong bytes, so that its other mistakes are
found in the same run; since it differs from the file, no edit can be written back over that. A file
with a NUL byte as well is no text, nor is one in UTF-16: what else is found in it would be noise.
"""

from __future__ import annotations

import contextlib
import os
import stat
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

from msgspec import Struct

from coursebuild.core.drawing.picture_size import WHOLE_COLUMN, picture_size
from coursebuild.core.files.course_root import MAP, find_course_root, is_dropping, read_regular
from coursebuild.core.files.errors import EffectError, OutsideProjectError, UsageError, reason
from coursebuild.core.model import Document, Image, MjcfModel, find_inlines, local_file
from coursebuild.core.model.lesson_record import LessonRecord, record_path
from coursebuild.core.text.diagnostics import Diagnostic, Parsed, diagnose
from coursebuild.core.text.source import Source

_UTF16 = (b"\xff\xfe", b"\xfe\xff")
"""Byte order marks."""
_MOST_LINKED = 10_000
"""Links, and files and folders behind them: a few links among folders can make endless paths."""
_OUTSIDE_REASON = "is reached through a link that leads out of the project"


class CourseFiles(Struct, frozen=True):
    """The files of a course, sorted; paths are POSIX and relative to the root."""

    map: Source | None
    lessons: tuple[Source, ...]
    """`content/lessons/*.md`."""
    pages: tuple[Source, ...]
    """`content/pages/**/*.md`."""
    models: tuple[MjcfModel, ...]
    """`models/**/*.xml`, including those that other models include."""
    declarations: tuple[Source, ...]
    """`models/**/*.toml`: what is to be measured on the models beside them."""
    files: tuple[str, ...]
    """Every regular file in `content/` and `models/`: what a relative link can lead to."""
    unreadable: tuple[str, ...]
    """Files that cannot be read, or not as text."""


def find_root(path: Path | None, start: Path) -> Path:
    """The course folder: the one named, or the nearest from `start` upwards with a course map.

    Raises:
        UsageError: the named folder is none, or there is no course here.
    """
    if path is not None:
        folder = start / path
        if folder.is_dir():
            return folder.resolve()
        problem = f"{path} is not a folder" if folder.exists() else f"there is no folder {path}"
        raise UsageError(problem)
    root = find_course_root(str(start))
    if root is not None:
        return Path(root)
    help = "go to a course, or name one with `-C DIR`"
    raise UsageError(f"there is no {MAP} in this folder or one above it", help=help)


def read_course(root: Path, open_texts: Mapping[str, str] = {}) -> Parsed[CourseFiles]:
    """Read the map, the lessons, the pages and the models of a course.

    `open_texts` are the texts of files that are open in an editor, perhaps unsaved, by path.
    """
    root = root.resolve()
    reader = _Reader(root, open_texts)
    files = [*reader.walk("content"), *reader.walk("models")]

    def sources(folder: str, ending: str) -> tuple[Source, ...]:
        return reader.sources([f for f in files if f.startswith(folder) and f.endswith(ending)])

    course_files = CourseFiles(
        map=reader.map(),
        lessons=sources("content/lessons/", ".md"),
        pages=sources("content/pages/", ".md"),
        models=tuple(
            MjcfModel(source.path.removeprefix("models/").removesuffix(".xml"), source)
            for source in sources("models/", ".xml")
        ),
        declarations=sources("models/", ".toml"),
        files=tuple(sorted(files)),
        unreadable=tuple(sorted(reader.unreadable)),
    )
    return Parsed(course_files, tuple(reader.diagnostics))


def read_bytes(root: Path, path: str) -> bytes:
    """The bytes of a file of the course.

    Raises:
        OutsideProjectError: it lies outside the project, or a link leads out of it.
        EffectError: it cannot be read.
    """
    if "\0" in path:
        raise EffectError("a path holds a null character")
    if not Path(os.path.realpath(root / path)).is_relative_to(os.path.realpath(root)):
        raise OutsideProjectError(f"{path} {_OUTSIDE_REASON}")
    try:
        return read_regular(root / path)
    except OSError as error:
        raise EffectError(f"{path} cannot be read: {reason(error)}") from None


def read_sources(
    root: Path, paths: list[str], open_texts: Mapping[str, str] = {}
) -> Parsed[tuple[Source, ...]]:
    """Read further text files of the project, such as pages outside `content/`."""
    reader = _Reader(root.resolve(), open_texts)
    return Parsed(reader.sources(paths), tuple(reader.diagnostics))


def read_folder(
    root: Path, folder: str, endings: str | tuple[str, ...] = ""
) -> Parsed[tuple[Source, ...]]:
    """Read the text files below a folder of the course whose names end so, sorted."""
    reader = _Reader(root.resolve())
    sources = reader.sources([path for path in reader.walk(folder) if path.endswith(endings)])
    return Parsed(sources, tuple(reader.diagnostics))


def read_picture_sizes(
    root: Path, documents: Iterable[Document], files: Iterable[str]
) -> dict[str, tuple[int, int]]:
    """Width and height of the pictures that documents show, in CSS pixels, by path.

    `files`: those that a page may show. Pictures of unknown size, or that cannot be read, are left
    out.
    """
    images = ((i.url, d.source.path) for d in documents for i in find_inlines(d, Image))
    sizes: dict[str, tuple[int, int]] = {}
    for path in sorted({local_file(*image) for image in images} & {*files}):
        with contextlib.suppress(EffectError):  # it is told where the file is copied
            if (size := picture_size(read_bytes(root, path), WHOLE_COLUMN)) is not None:
                sizes[path] = size
    return sizes


def read_records(root: Path, documents: Iterable[str]) -> dict[str, LessonRecord]:
    """The records of the lessons and pages that have one, by the paths of these."""
    records = {}
    for path in documents:
        record = record_path(path)
        if not os.path.lexists(f"{root}/{record}"):  # as most; to find that out here takes less
            continue
        with contextlib.suppress(EffectError):
            text = read_bytes(root, record).decode("utf-8", "replace")
            records[path] = LessonRecord.parse(text)
    return records


class _Reader:
    def __init__(self, root: Path, open_texts: Mapping[str, str] = {}) -> None:
        self.root = root
        self.open_texts = open_texts
        self.diagnostics: list[Diagnostic] = []
        self.unreadable: list[str] = []

    def map(self) -> Source | None:
        if not (self.root / MAP).is_symlink() and not (self.root / MAP).exists():
            help = "the map names every level, lesson and page; start with `[course]`"
            message, place = f"there is no {MAP}", Source(MAP, "").span()
            self.diagnostics.append(diagnose("map-missing", place, message, help=help))
            return None
        return next(iter(self.sources([MAP])), None)

    def walk(self, top: str) -> Iterator[str]:
        """Every regular file below a folder of the course, sorted by path."""
        folder = self.root / top
        if not folder.exists() and not folder.is_symlink():
            return
        if not Path(os.path.realpath(folder)).is_relative_to(self.root):
            self._refuse(top, _OUTSIDE_REASON)
        elif not folder.is_dir():
            self._refuse(top, "is not a folder")
        else:
            yield from self._walk(top)

    def _walk(self, top: str) -> Iterator[str]:
        # Each entry with the folders around it, and whether a link is on the way to it.
        entries: list[tuple[str, bool, frozenset[tuple[int, int]]]] = [(top, False, frozenset())]
        linked_count = 0
        while entries:
            path, is_linked, ancestors = entries.pop()
            is_link = os.path.islink(f"{self.root}/{path}")  # noqa: PTH114 (time counts)
            linked_count += is_linked or is_link
            if (is_linked or is_link) and linked_count > _MOST_LINKED:
                if linked_count == _MOST_LINKED + 1:
                    most = f"{_MOST_LINKED:,}"
                    self._refuse(path, f"is one more than the {most} places that links may lead to")
                continue
            mode = self._mode(path, is_link)
            if mode is not None and stat.S_ISREG(mode):
                yield path
            elif mode is not None:
                contents, enclosing = self._list(path, ancestors)
                entries += ((name, is_linked or is_link, enclosing) for name in reversed(contents))

    def _list(
        self, folder: str, ancestors: frozenset[tuple[int, int]]
    ) -> tuple[list[str], frozenset[tuple[int, int]]]:
        """The paths of what is in a folder, sorted, and the identities of all folders around it."""
        try:
            status = os.stat(f"{self.root}/{folder}")  # noqa: PTH116
            names = sorted(os.listdir(f"{self.root}/{folder}"))  # noqa: PTH208
        except OSError as error:
            self._refuse(folder, f"cannot be read: {reason(error)}")
            return [], ancestors
        identity = (status.st_dev, status.st_ino)
        if identity in ancestors:  # a link to one of its own parents
            return [], ancestors
        paths = [f"{folder}/{name}" for name in names if not is_dropping(name)]
        return paths, ancestors | {identity}

    def _mode(self, path: str, is_link: bool) -> int | None:
        """The mode of a file or folder that is to be read; `None` where it is not."""
        if not _is_text(path):
            self._refuse(path, "has a name that is not UTF-8")
            return None
        full = f"{self.root}/{path}"
        if is_link and not Path(os.path.realpath(full)).is_relative_to(self.root):
            self._refuse(path, _OUTSIDE_REASON)
            return None
        try:
            mode = os.stat(full).st_mode  # noqa: PTH116
        except FileNotFoundError:
            if is_link:
                self._refuse(path, "is a link to a file that is not there")
            return None  # otherwise it was removed meanwhile
        except OSError as error:
            self._refuse(path, f"cannot be read: {reason(error)}")
            return None
        is_folder = stat.S_ISDIR(mode)
        if stat.S_ISREG(mode) or (is_folder and not path.endswith((".md", ".xml", ".toml"))):
            return mode
        self._refuse(path, "is a folder" if is_folder else "is not a regular file")
        return None

    def sources(self, paths: list[str]) -> tuple[Source, ...]:
        sources = []
        for path in paths:
            if path in self.unreadable:
                continue
            if path in self.open_texts:
                sources.append(Source(path, self.open_texts[path]))
                continue
            try:
                source = self._decode(path, read_bytes(self.root, path))
                sources += [] if source is None else [source]
            except EffectError as error:
                self._refuse(path, error.message.removeprefix(f"{path} "))
        return tuple(sources)

    def _decode(self, path: str, data: bytes) -> Source | None:
        try:
            return Source(path, data.decode("utf-8"))
        except UnicodeDecodeError as error:
            position = error.start
        source = Source(path, data.decode("utf-8", "replace"))
        at = len(data[:position].decode("utf-8"))
        message, help = f"byte 0x{data[position]:02x} is not UTF-8", "save the file as UTF-8"
        place = source.span(at, at + 1)
        self.diagnostics.append(diagnose("file-encoding", place, message, help=help))
        if b"\0" not in data and not data.startswith(_UTF16):
            return source
        self.unreadable.append(path)
        return None

    def _refuse(self, path: str, problem: str) -> None:
        name = path if _is_text(path) else path.encode("utf-8", "backslashreplace").decode("utf-8")
        self.unreadable.append(name)
        span = Source(name, "").span()
        self.diagnostics.append(diagnose("file-unreadable", span, f"{name} {problem}"))


def _is_text(path: str) -> bool:
    """Whether a path is proper Unicode (Python keeps other bytes as lone surrogates)."""
    return path.isascii() or not any("\udc80" <= c <= "\udcff" for c in path)
