"""The scripts of a course: what is extracted to which path, and which lesson line each line is.

Entry points: `extract` (a course's scripts and what is wrong with their paths), `jobs`.

Two paths clash when they are equal, when they are one file where upper and lower case are not told
apart, or when one is a folder on the way to the other. The first in the order of the course stays.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable, Iterator

from msgspec import Struct

from coursebuild.core.model import Course, Document, Lesson, Page, Script, document_scripts
from coursebuild.core.model.results import ScriptJob
from coursebuild.core.text.diagnostics import Diagnostic, Edit, Note, Parsed, diagnose
from coursebuild.core.text.source import Span


class Extraction(Struct, frozen=True):
    """A script and the file that it becomes."""

    path: str
    """POSIX path relative to the project root."""
    text: str
    """LF line ends, ending in exactly one newline."""
    script: Script
    owner: str
    """The id of the lesson or page that it stands in."""

    @classmethod
    def of(cls, script: Script, owner: str) -> Extraction:
        """That of a script."""
        return cls(script.path, _text(script), script, owner)

    @property
    def data(self) -> bytes:
        """The file's bytes."""
        return self.text.encode()

    @property
    def document(self) -> str:
        """The path of the lesson or page."""
        return self.script.span.path

    def line_span(self, line: int) -> Span | None:
        """Where a line of the file (from 1) stands in the lesson; `None` if it has no such line."""
        code = self.script.code
        start = 0
        for _ in range(line - 1):
            newline = code.text.find("\n", start)
            if newline < 0:
                return None
            start = newline + 1
        if line < 1 or start >= len(code.text):
            return None
        end = code.text.find("\n", start)
        return code.span(start, len(code.text) if end < 0 else end)


def owners(course: Course) -> Iterator[tuple[str, Document]]:
    """Every document of a course with the id of its lesson or page, in order."""
    parts: tuple[Lesson | Page, ...] = (*course.lessons, *course.pages)
    for part in parts:
        if part.document is not None:
            yield part.id, part.document


def extract(course: Course) -> Parsed[tuple[Extraction, ...]]:
    """The scripts of a course in order, no two of which clash."""
    kept: list[Extraction] = []
    found: list[Diagnostic] = []
    paths = _Paths()
    for owner, document in owners(course):
        for script in document_scripts(document):
            extraction = Extraction.of(script, owner)
            clash = paths.clash(extraction)
            if clash is None:
                paths.add(extraction)
                kept.append(extraction)
            else:
                found.append(clash)
    return Parsed(tuple(kept), tuple(found))


def _text(script: Script) -> str:
    return script.code.text.rstrip("\n") + "\n"


def jobs(extractions: Iterable[Extraction], perturbation: int = 0) -> tuple[ScriptJob, ...]:
    """What to run; with initial states moved, which takes longer, in the direction of a number."""
    patience = _PATIENCE if perturbation else 1.0
    scripts = ((e.path, e.script) for e in extractions)
    return tuple(
        ScriptJob(p, s.args, s.timeout * patience, s.requires, s.norun, perturbation)
        for p, s in scripts
    )


_PATIENCE = 3.0
"""How many times as long a script may take whose initial states are moved."""


def _key(path: str) -> str:
    """The same for paths that some file system takes for one."""
    return unicodedata.normalize("NFC", path).casefold()


def _folders(key: str) -> Iterator[str]:
    while "/" in key:
        key = key.rpartition("/")[0]
        yield key


class _Paths:
    """The paths taken so far."""

    def __init__(self) -> None:
        self._files: dict[str, Extraction] = {}
        self._folders: dict[str, Extraction] = {}

    def add(self, extraction: Extraction) -> None:
        key = _key(extraction.path)
        self._files[key] = extraction
        for folder in _folders(key):
            self._folders.setdefault(folder, extraction)

    def clash(self, new: Extraction) -> Diagnostic | None:
        key = _key(new.path)
        same = self._files.get(key)
        if same is not None and same.path == new.path:
            return _clash(new, same, f"`{new.path}` is written by two blocks", "written here first")
        if same is not None:
            message = f"`{new.path}` and `{same.path}` are one file where case does not count"
            return _clash(new, same, message, f"`{same.path}` is written here")
        inside = self._folders.get(key)
        if inside is not None:
            message = f"`{new.path}` is a file here and a folder of `{inside.path}`"
            return _clash(new, inside, message, f"`{inside.path}` is written here")
        for folder in _folders(key):
            file = self._files.get(folder)
            if file is not None:
                message = f"`{file.path}` is a file and cannot be a folder of `{new.path}`"
                return _clash(new, file, message, f"`{file.path}` is written here")
        return None


def _clash(new: Extraction, old: Extraction, message: str, note: str) -> Diagnostic:
    return diagnose(
        "script-repeated",
        new.script.path_span,
        message,
        help="give one of them another path",
        notes=[Note(note, old.script.path_span)],
    )


def adopted(script: Script, data: bytes) -> Edit | Diagnostic:
    """What to write into the block so that it extracts to `data`; a diagnostic where it cannot be.

    The lesson's line ends and what stands before each line of the block are kept.
    """

    def refused(why: str) -> Diagnostic:
        message = f"{script.path} cannot be brought into the lesson: {why}"
        return diagnose("example-edited", script.path_span, message, help="bring it over by hand")

    text = block_text(data)
    if text is None:
        return refused("it is not UTF-8")
    if text == "\n":
        return refused("it is empty")
    lines = text.removesuffix("\n").split("\n")
    opening = re.search(r"`{3,}|~{3,}", script.span.first_line().text)
    fence = opening.group() if opening else "```"
    closing = re.compile(rf" {{0,3}}{re.escape(fence[0])}{{{len(fence)},}}[ \t]*")
    if any(closing.fullmatch(line) for line in lines):
        return refused("one of its lines would close the fence")
    if "\0" in text:
        return refused("it holds a NUL")
    newline = "\r\n" if "\r\n" in script.span.text else "\n"
    written = [f"{script.prefix}{line}" if line else script.prefix.rstrip() for line in lines]
    return Edit(script.body_span, "".join(line + newline for line in written))


def block_text(data: bytes) -> str | None:
    """A file as a block can hold it; `None` where it is not UTF-8.

    Without a byte order mark, with LF line ends, and one at the end.
    """
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return None
    return text.replace("\r\n", "\n").replace("\r", "\n").rstrip("\n") + "\n"
