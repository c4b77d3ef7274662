"""From the records of a `Tracer` to what a script depends on.

Entry point: `read_notes`.
"""

from __future__ import annotations

import _imp
import contextlib
import os
import sys
from collections.abc import Callable, Iterable
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


def read_notes(
    data: bytes,
    overflow: str,
    root: str,
    script: str,
    looked_for: Callable[[str], Iterable[str]] | None = None,
) -> Notes:
    """What the records say.

    Args:
        data: records, each ended by a null byte.
        overflow: a folder that may hold more, in files.
        root: the project's folder, resolved.
        script: the script's path relative to it.
        looked_for: the top-level names of all that importing a module imports or tries to.
    """
    collected = _Collected(root, looked_for or (lambda name: (name,)))
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
    def __init__(self, root: str, looked_for: Callable[[str], Iterable[str]]) -> None:
        self.files: set[str] = set()
        self.folders: set[str] = set()
        self.outside: set[str] = set()
        self.modules: set[str] = set()
        self.opaque = ""
        self.divergences: list[list[str]] = []
        self.moved = False
        self.states: list[str] = []
        self._root = root.rstrip("/") + "/"
        self._looked_for = looked_for

    def take(self, record: str) -> None:
        kind, about = record[0], record[1:]
        if kind == "r":
            self._file(about)
        elif kind == "l":
            self.folders.add(about.removeprefix(self._root[:-1]).lstrip("/") or ".")
        elif kind == "m":
            self.modules.add(about)
        elif kind == "n":
            folder, _, name = about.partition("\t")
            self._imported(folder.removeprefix(self._root[:-1]).lstrip("/"), name, bool(folder))
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

    def _imported(self, folder: str, name: str, in_project: bool) -> None:
        prefix = f"{folder}/" if folder else ""
        for module in self._looked_for(name):
            if module in sys.builtin_module_names or _imp.is_frozen(module):
                continue
            if in_project:
                self.files.add(f"{prefix}{module}/__init__.py")
                self.files.add(f"{prefix}{module}.py")
            elif module not in sys.stdlib_module_names:
                self.modules.add(module)


def _spilled(overflow: str) -> Iterable[bytes]:
    with contextlib.suppress(OSError):
        for path in sorted(Path(overflow).iterdir()):
            with contextlib.suppress(OSError):
                yield path.read_bytes()
