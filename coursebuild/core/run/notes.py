"""From the records of a `Tracer` to what a script depends on.

Entry point: `read_notes`.
"""

from __future__ import annotations

import _imp
import contextlib
import os
from collections.abc import Iterable
from pathlib import Path
from typing import TypedDict

_FIELDS = 6
"""Of a record that says that a simulation was lost."""


class Notes(TypedDict):
    """The fields of `coursebuild.core.model.results.Trace`."""

    files: list[str]
    folders: list[str]
    outside: list[str]
    modules: list[str]
    opaque: str
    divergences: list[list[str]]
    """Of each its sign, detail, time, model, path and line."""
    moved: bool
    states: list[str]


def read_notes(data: bytes, overflow: str, root: str, script: str) -> Notes:
    """What the records say.

    Args:
        data: records, each ended by a null byte.
        overflow: a folder that may hold more, in files.
        root: the project's folder, resolved.
        script: the script's path relative to it.
    """
    collected = _Collected(root)
    for part in (data, *_spilled(overflow)):
        for record in part.split(b"\0"):
            if record:
                collected.take(record.decode("utf-8", "surrogateescape"))
    collected.files.discard(script)
    return {
        "files": sorted(collected.files),
        "folders": sorted(collected.folders),
        "outside": sorted(collected.outside),
        "modules": sorted(collected.modules),
        "opaque": collected.opaque,
        "divergences": collected.divergences,
        "moved": collected.moved,
        "states": collected.states,
    }


class _Collected:
    def __init__(self, root: str) -> None:
        self.files: set[str] = set()
        self.folders: set[str] = set()
        self.outside: set[str] = set()
        self.modules: set[str] = set()
        self.opaque = ""
        self.divergences: list[list[str]] = []
        self.moved = False
        self.states: list[str] = []
        self._root = root.rstrip("/") + "/"

    def take(self, record: str) -> None:
        kind, about = record[0], record[1:]
        if kind == "r":
            self._file(about)
        elif kind == "l":
            self.folders.add(about.removeprefix(self._root[:-1]).lstrip("/") or ".")
        elif kind == "m":
            self.modules.add(about)
        elif kind == "n":
            folder, _, names = about.partition("\t")
            self._not_looked_for(f"{folder}/".removeprefix(self._root), names.split(","))
        elif kind == "d":
            fields = about.split("\t")
            if len(fields) == _FIELDS and fields not in self.divergences:
                self.divergences.append(fields)
        elif kind == "p":
            self.moved = True
        elif kind == "s":
            self.states.append(about)
        elif kind == "o" and not self.opaque:
            self.opaque = about

    def _file(self, path: str) -> None:
        folder, _, name = path.rpartition("/")
        if name.endswith(".pyc") and folder.endswith("/__pycache__"):
            path = f"{folder.removesuffix('/__pycache__')}/{name.partition('.')[0]}.py"
        if not path.startswith(self._root):
            with contextlib.suppress(OSError):
                resolved = os.path.realpath(path)
                path = resolved if resolved.startswith(self._root) else path
        if path.startswith(self._root):
            self.files.add(path.removeprefix(self._root))
        else:
            self.outside.add(path)

    def _not_looked_for(self, folder: str, names: Iterable[str]) -> None:
        for name in names:
            if not _imp.is_frozen(name):
                self.files |= {f"{folder}{name}/__init__.py", f"{folder}{name}.py"}


def _spilled(overflow: str) -> Iterable[bytes]:
    with contextlib.suppress(OSError):
        for path in sorted(Path(overflow).iterdir()):
            with contextlib.suppress(OSError):
                yield path.read_bytes()
