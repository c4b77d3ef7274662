"""Scratch courses, written out of the input of a fixture, and the fixture files themselves.

Entry points: `read_cases` (a fixture file), `Layout.of` (an input as files), `parts` (the same as
texts).

A fixture file holds cases: a title, the input and the expected text, each ended by a line that
holds only `.`; what stands before a title on lines that begin with `#` is for its readers.

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

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

FIRST = "content/lessons/1.1-first.md"
SECOND = "content/lessons/1.2-second.md"
MAP = "content/course.toml"

DEFAULTS = {
    MAP: """\
[course]
title = "A scratch course"

[[level]]
id = "1"
title = "The only level"

[[level.lesson]]
id = "1.1"
slug = "first"
title = "The first lesson"
status = "complete"

[[level.lesson]]
id = "1.2"
slug = "second"
title = "The second lesson"
status = "complete"
""",
    FIRST: "## The first lesson\n",
    SECOND: """\
## The second lesson

```python file=examples/second.py
print("it runs")
```

Output:

```text
it runs
```
""",
}

_LINE = re.compile(r"[^\n]*\n|[^\n]+")
_HEADER = re.compile(r"=== (?:(crlf|bytes|link|folder|without|later) )?(\S.*)")
_ESCAPE = re.compile(rb"\\(?:x([0-9a-f]{2})|(.))")


@dataclass(frozen=True, slots=True)
class Case:
    """One case of a fixture file."""

    title: str
    input: str
    expected: str
    line: int
    """Of the title in the fixture file, from 1."""
    remarks: str = ""
    """The lines before the title, for readers."""

    @property
    def text(self) -> str:
        """The case as it stands in the file."""
        parts = [f"{self.title}\n", self.input, self.expected]
        return self.remarks + "".join(f"{part}.\n" for part in parts)


def read_cases(path: Path) -> list[Case]:
    """The cases of a fixture file.

    Raises:
        ValueError: the file ends inside a case.
    """
    lines = _lines(path.read_text(encoding="utf-8"))
    cases: list[Case] = []
    at = 0
    while at < len(lines):
        start = at
        while at < len(lines) and (lines[at].startswith("#") or not lines[at].strip()):
            at += 1
        if at == len(lines):
            break
        remarks, title_line, parts = "".join(lines[start:at]), at + 1, []
        for _ in range(3):
            end = next((i for i in range(at, len(lines)) if lines[i] == ".\n"), None)
            if end is None:
                raise ValueError(f"{path.name}:{title_line}: the case has no third `.`")
            parts.append("".join(lines[at:end]))
            at = end + 1
        cases.append(Case(parts[0].rstrip("\n"), parts[1], parts[2], title_line, remarks))
    return cases


@dataclass(slots=True)
class Layout:
    """The files of a scratch course."""

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

    def write(self, root: Path) -> None:
        """Put all but the later files into a folder."""
        for folder in self.folders:
            (root / folder).mkdir(parents=True)
        for path, data in self.files.items():
            put(root / path, data)
        for path, target in self.links.items():
            (root / path).parent.mkdir(parents=True, exist_ok=True)
            (root / path).symlink_to(target)


def _lines(text: str) -> list[str]:
    """Split at LF alone: a form feed in a lesson is no line end."""
    return _LINE.findall(text)


def put(path: Path, data: bytes) -> None:
    """Write a file, its folder as well."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(data)


def parts(text: str) -> Iterator[tuple[str, str, str]]:
    """The kind, the path and the body of each file."""
    if not _HEADER.match(text):
        yield "", FIRST, text
        return
    header: re.Match[str] | None = None
    body: list[str] = []
    for line in _lines(text):
        found = _HEADER.fullmatch(line.rstrip("\n"))
        if found is None:
            body.append(line)
            continue
        if header is not None:
            yield header[1] or "", header[2], "".join(body)
        header, body = found, []
    assert header is not None
    yield header[1] or "", header[2], "".join(body)


def _byte(found: re.Match[bytes]) -> bytes:
    if found[1]:
        return bytes([int(found[1], 16)])
    return {b"n": b"\n", b"r": b"\r", b"t": b"\t", b"\\": b"\\"}[found[2]]
