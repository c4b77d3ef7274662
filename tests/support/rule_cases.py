"""Scratch courses, written out of the input of a fixture, and what is found in them.

An input is the text of `content/lessons/1.1-first.md`, or several files, each after a line `=== …`:

    === PATH                  a text file
    === crlf PATH             the same with CRLF line ends
    === bytes PATH            its bytes, written with Python's escapes, line ends left out
    === link PATH -> TARGET   a symbolic link
    === folder PATH           a folder
    === without PATH          none of the files that every scratch course has
    === later PATH            a file that is put there after a first check of the course

What is not given is there by itself: a map with the lessons 1.1 `first` and 1.2 `second`, and both
lessons; 1.2 has a script whose output is recorded, so that every course has something to verify.
"""

from __future__ import annotations

import copy
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Self

import pytest
from msgspec.structs import replace

from coursebuild.core.engine.shared_place import shared_place
from coursebuild.core.engine.store import Store
from coursebuild.core.run.script_server import ScriptServer
from coursebuild.core.text.diagnostics import Diagnostic
from coursebuild.features.lab.engines.browser import LabEngine
from coursebuild.pipeline.check import judge
from coursebuild.pipeline.load import load
from coursebuild.pipeline.options import Options
from coursebuild.pipeline.verify import compile_models
from support.fixture_cases import fixture_text, text_lines
from support.lab_values import OpenEngines, try_labs

FIRST = "content/lessons/1.1-first.md"
SECOND = "content/lessons/1.2-second.md"
MAP = "content/course.toml"

DEFAULTS = {
    MAP: fixture_text("documents/scratch_map.toml"),
    FIRST: "## The first lesson\n\nIt begins.\n",
    SECOND: fixture_text("documents/scratch_lesson.md"),
}

_HEADER = re.compile(r"=== (?:(crlf|bytes|link|folder|without|later) )?(\S.*)")
_ESCAPE = re.compile(rb"\\(?:x([0-9a-f]{2})|(.))")


@dataclass(slots=True)
class Layout:
    files: dict[str, bytes] = field(default_factory=dict)
    later: dict[str, bytes] = field(default_factory=dict)
    links: dict[str, str] = field(default_factory=dict)
    folders: list[str] = field(default_factory=list)

    @classmethod
    def of(cls, text: str) -> Layout:
        """The files that an input names, and those that every scratch course has."""
        layout = cls({path: default.encode() for path, default in DEFAULTS.items()})
        for kind, path, body in parts(text):
            layout._add(kind, path, body)
        return layout

    def _add(self, kind: str, path: str, body: str) -> None:
        match kind:
            case "":
                self.files[path] = body.encode()
            case "crlf":
                self.files[path] = body.replace("\n", "\r\n").encode()
            case "bytes":
                self.files[path] = _ESCAPE.sub(_byte, body.replace("\n", "").encode())
            case "later":
                self.later[path] = body.encode()
            case "link":
                path, _, target = path.partition(" -> ")
                self.files.pop(path, None)
                self.links[path] = target
            case "folder":
                self.files.pop(path, None)
                self.folders.append(path)
            case "without":
                del self.files[path]
            case unknown:
                raise ValueError(f"no kind of file {unknown!r}")

    def write(self, root: Path) -> None:
        root.mkdir(parents=True, exist_ok=True)
        for folder in self.folders:
            (root / folder).mkdir(parents=True)
        for path, data in self.files.items():
            write_file(root / path, data)
        for path, target in self.links.items():
            (root / path).parent.mkdir(parents=True, exist_ok=True)
            (root / path).symlink_to(target)

    def write_later(self, root: Path) -> None:
        for path, data in self.later.items():
            write_file(root / path, data)


def write_file(path: Path, data: bytes) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(data)


def parts(text: str) -> Iterator[tuple[str, str, str]]:
    if not _HEADER.match(text):
        yield "", FIRST, text
        return
    header: re.Match[str] | None = None
    body: list[str] = []
    for line in text_lines(text):
        header_match = _HEADER.fullmatch(line.rstrip("\n"))
        if header_match is None:
            body.append(line)
            continue
        if header is not None:
            yield header[1] or "", header[2], "".join(body)
        header, body = header_match, []
    assert header is not None
    yield header[1] or "", header[2], "".join(body)


def _byte(match: re.Match[bytes]) -> bytes:
    if match[1]:
        return bytes([int(match[1], 16)])
    return {b"n": b"\n", b"r": b"\r", b"t": b"\t", b"\\": b"\\"}[match[2]]


class Workshop:
    """What checks of many small courses share: results, the process of scripts, both engines."""

    def __init__(self, folder: Path) -> None:
        self._results = shared_place(str(folder / "results"))
        self._scripts = ScriptServer()
        self._engines = OpenEngines(folder)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._scripts.close()
        self._engines.close()

    def options(self, root: Path, *, fresh: bool = False) -> Options:
        """For a command on a course; `fresh`: all is to be made again."""
        store = Store(root, shared=self._results, fresh=fresh)
        return Options(root, 1, store, run_all=self._scripts.run)

    def try_labs(
        self, root: Path, wrap: Callable[[LabEngine], Any] = lambda engine: engine
    ) -> tuple[Diagnostic, ...]:
        """What is found in a course whose scripts are not run; the browser engine is `changed`."""
        course_load = load(root)
        assert course_load.value is not None
        options = self.options(root)
        models, model_diagnostics = compile_models(course_load.value, options)
        engines = copy.copy(self._engines)
        engines.browser = wrap(engines.browser)
        # What labs did is not shared: it would not be tried by another engine.
        unshared = replace(options, store=Store(root))
        _, lab_diagnostics = try_labs(
            course_load.value, unshared, engines, dict(models), model_diagnostics
        )
        diagnostics = [*course_load.diagnostics, *model_diagnostics, *lab_diagnostics]
        return judge(course_load.value, diagnostics).diagnostics


@pytest.fixture(scope="module")
def workshop(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Workshop]:
    with Workshop(tmp_path_factory.mktemp("workshop")) as workshop:
        yield workshop
