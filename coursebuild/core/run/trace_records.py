"""From the records of a `Tracer` to a `Trace`.

Entry point: `read_records`.
"""

from __future__ import annotations

import contextlib
import os

from coursebuild.core.model.results import Divergence, Effect, EffectKind, Sign, Trace

_FIELDS = 6
"""Of a record that says that a simulation was lost."""


def read_records(records: bytes, root: str, script: str) -> Trace:
    """What the records say, each of which ends with a null byte.

    Args:
        records: those of one script.
        root: the project's folder, resolved.
        script: the script's path relative to it.
    """
    collected = _Collected(root)
    for record in records.split(b"\0"):
        if record:
            collected.take(record.decode("utf-8", "surrogateescape"))
    collected.files.discard(os.path.normpath(script))
    return Trace(
        files=tuple(sorted(collected.files)),
        folders=tuple(sorted(collected.folders)),
        outside=tuple(sorted(collected.outside)),
        modules=tuple(sorted(collected.modules)),
        opaque=collected.opaque,
        divergences=tuple(dict.fromkeys(collected.divergences)),
        effects=tuple(collected.effects),
        moved=collected.moved,
        states=tuple(collected.states),
        sought=tuple(
            f"{folder}/{{{','.join(sorted(names))}}}"
            for folder, names in sorted(collected.sought.items())
        ),
    )


class _Collected:
    def __init__(self, root: str) -> None:
        self.files: set[str] = set()
        self.folders: set[str] = set()
        self.outside: set[str] = set()
        self.modules: set[str] = set()
        self.sought: dict[str, set[str]] = {}
        self.opaque = ""
        self.divergences: list[Divergence] = []
        self.effects: list[Effect] = []
        self.moved = False
        self.states: list[str] = []
        self._root = root.rstrip("/") + "/"

    def take(self, record: str) -> None:
        kind, about = record[0], record[1:]
        if kind == "r":
            self._file(about)
        elif kind == "l":
            self.folders.add(self._inside(about) or ".")
        elif kind == "m":
            self.modules.add(about)
        elif kind == "v":
            folder, _, names = about.partition("\t")
            self.sought.setdefault(self._inside(folder), set()).update(names.split(","))
        elif kind == "d":
            self._divergence(about.split("\t"))
        elif kind in "wc":
            what, file, line = about.rsplit("\t", 2)
            self.effects.append(Effect(EffectKind(kind), what, file, int(line)))
        elif kind == "p":
            self.moved = True
        elif kind == "s":
            self.states.append(about)
        elif kind == "o" and not self.opaque:
            self.opaque = about

    def _inside(self, folder: str) -> str:
        """A folder relative to the project's; empty for that itself."""
        return folder.removeprefix(self._root[:-1]).lstrip("/")

    def _divergence(self, fields: list[str]) -> None:
        if len(fields) == _FIELDS:
            sign, detail, time, model, path, line = fields
            depth, *geoms = detail.split("\x1f")
            lost = Divergence(Sign(sign), time, model, path, int(line), depth, tuple(geoms))
            self.divergences.append(lost)

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
