"""The result of a script as it is kept: what it depends on, and what it did.

Entry points: `Record`, `to_bytes`, `from_bytes`, `Record.run`.

Paths of the machine in what a script wrote to its error output are taken out before it is kept, and
those of the machine that reads it are put in.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable

import msgspec
from msgspec import Struct

from coursebuild.results import Divergence, Outcome, ScriptRun, Sign, Trace
from coursebuild.scripts.dependencies import Dependency, Inputs, Kind, sought_files

REMEMBERED = (Outcome.OK, Outcome.FAILED, Outcome.OUTPUT_LIMIT, Outcome.ENCODING)
_MARK = "\0"


class Record(Struct, frozen=True):
    """One run of a script."""

    inputs: Inputs
    dependencies: tuple[Dependency, ...]
    outcome: Outcome
    status: int
    seconds: float
    made: int
    """When, in seconds since 1970."""
    forgotten: str
    """Why it is not remembered, as the end of a sentence; empty where it is."""
    stdout: str = ""
    stderr: str = ""
    """Of one that is not remembered both are left out."""
    divergences: tuple[Divergence, ...] = ()
    moved: bool = False
    states: tuple[str, ...] = ()

    def run(self, places: Iterable[tuple[str, str]]) -> ScriptRun:
        """The run as if it had been made here; see `to_bytes` for the places."""
        names: dict[Kind, list[str]] = {kind: [] for kind in Kind}
        for one in self.dependencies:
            names[one.kind].append(one.name)
        for name in names[Kind.SOUGHT]:
            names[Kind.FILE] += sought_files(name)
        return ScriptRun(
            self.inputs.path,
            self.outcome,
            self.status,
            self.stdout,
            _put_in(self.stderr, places),
            self.seconds,
            cached=True,
            trace=Trace(
                files=tuple(sorted(names[Kind.FILE])),
                folders=tuple(sorted(names[Kind.LISTING])),
                outside=tuple(sorted(names[Kind.OUTSIDE])),
                modules=tuple(sorted(names[Kind.MODULE])),
                opaque="",
                divergences=self.divergences,
                moved=self.moved,
                states=self.states,
            ),
        )


def to_bytes(record: Record, places: Iterable[tuple[str, str]]) -> bytes:
    """As JSON; `places` are folders of this machine, each with a name, the longer ones first."""
    inputs = record.inputs
    value = {
        "path": inputs.path,
        "text": inputs.text,
        "args": inputs.args,
        "timeout": inputs.timeout,
        "requires": inputs.requires,
        "around": inputs.around,
        "version": inputs.version,
        "dependencies": [(d.kind.value, d.name, d.state) for d in record.dependencies],
        "outcome": record.outcome.value,
        "status": record.status,
        "seconds": round(record.seconds, 4),
        "made": record.made,
        "forgotten": record.forgotten,
        "stdout": record.stdout,
        "stderr": _take_out(record.stderr, places),
        "divergences": [
            (d.sign.value, d.time, d.model, d.path, d.line, d.depth, d.geoms)
            for d in record.divergences
        ],
        "moved": record.moved,
        "states": record.states,
    }
    # Names of files may hold bytes that are no text; only escapes can carry them.
    return json.dumps(value, ensure_ascii=True).encode()


class _Stored(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What JSON must hold to be a record."""

    path: str
    text: str
    args: tuple[str, ...]
    timeout: float
    requires: tuple[str, ...]
    around: tuple[tuple[str, str], ...]
    version: str
    dependencies: tuple[tuple[Kind, str, str], ...]
    outcome: Outcome
    status: int
    seconds: float
    made: int
    forgotten: str
    stdout: str
    stderr: str
    divergences: tuple[tuple[Sign, str, str, str, int, str, tuple[str, ...]], ...]
    moved: bool
    states: tuple[str, ...]


def from_bytes(data: bytes) -> Record | None:
    """The record that JSON holds; `None` where it holds none."""
    try:
        s = _decoded(data)
    except (ValueError, RecursionError):
        return None
    return Record(
        Inputs(s.path, s.text, s.args, s.timeout, s.requires, s.around, s.version),
        tuple(Dependency(*parts) for parts in s.dependencies),
        s.outcome,
        s.status,
        s.seconds,
        s.made,
        s.forgotten,
        s.stdout,
        s.stderr,
        tuple(Divergence(*parts) for parts in s.divergences),
        s.moved,
        s.states,
    )


def _decoded(data: bytes) -> _Stored:
    try:
        return msgspec.json.decode(data, type=_Stored)
    except msgspec.DecodeError:  # perhaps for an escape that is half a letter
        return msgspec.convert(json.loads(data), _Stored, strict=True)


def _take_out(text: str, places: Iterable[tuple[str, str]]) -> str:
    text = text.replace(_MARK, "\ufffd")
    for name, folder in places:
        pattern = rf"(?<![\w./-]){re.escape(folder.rstrip('/'))}(?=[/\"'\s:,;)\]]|$)"
        text = re.sub(pattern, f"{_MARK}{name}{_MARK}", text)
    return text


def _put_in(text: str, places: Iterable[tuple[str, str]]) -> str:
    for name, folder in places if _MARK in text else ():
        text = text.replace(f"{_MARK}{name}{_MARK}", folder.rstrip("/"))
    return text
