"""The result of a script as it is stored: what it depends on, and what it did.

Entry points: `RunRecord`, `to_bytes`, `from_bytes`.

In a script's error output, paths of this machine are replaced by marks; when the record is read,
the marks become the paths of the machine that reads it.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable
from typing import Annotated, TypeAlias

import msgspec
from msgspec import Meta, Struct
from msgspec.structs import replace

from coursebuild.core.model.results import Outcome, ScriptRun, Trace
from coursebuild.core.run.dependencies import Dependency, Inputs, Kind

Moment: TypeAlias = Annotated[int, Meta(ge=0, lt=1 << 37)]
"""Seconds since 1970, in a year that has a name."""
STORABLE_OUTCOMES = (Outcome.OK, Outcome.FAILED, Outcome.OUTPUT_LIMIT, Outcome.ENCODING)
_MARK = "\0"
_EMPTY_TRACE = Trace((), (), (), (), "")


class RunRecord(
    Struct,
    frozen=True,
    rename={"timestamp": "made", "reason_forgotten": "forgotten", "stored_run": "kept"},
):
    """One run of a script."""

    inputs: Inputs
    dependencies: tuple[Dependency, ...]
    timestamp: Moment
    """When it ran, in seconds since 1970."""
    reason_forgotten: str
    """Why the result is not remembered, as the end of a sentence; empty where it is."""
    stored_run: ScriptRun
    """What it did; of its trace only what is no dependency."""

    def restore(self, places: Iterable[tuple[str, str]]) -> ScriptRun:
        """The run as if it had been made here; see `to_bytes` for the places."""
        names: dict[Kind, list[str]] = {kind: [] for kind in Kind}
        for dependency in self.dependencies:
            names[dependency.kind].append(dependency.name)
        trace = replace(
            self.stored_run.trace or _EMPTY_TRACE,
            files=tuple(names[Kind.FILE]),
            folders=tuple(names[Kind.LISTING]),
            outside=tuple(names[Kind.OUTSIDE]),
            modules=tuple(names[Kind.MODULE]),
            sought=tuple(names[Kind.SOUGHT]),
        )
        stderr = _insert_places(self.stored_run.stderr, places)
        return replace(self.stored_run, stderr=stderr, cached=True, trace=trace)


def record_of(
    inputs: Inputs,
    dependencies: tuple[Dependency, ...],
    timestamp: int,
    reason_forgotten: str,
    run: ScriptRun,
) -> RunRecord:
    """The record of a run."""
    bare = run.trace and replace(run.trace, files=(), folders=(), outside=(), modules=(), sought=())
    return RunRecord(inputs, dependencies, timestamp, reason_forgotten, replace(run, trace=bare))


def to_bytes(record: RunRecord, places: Iterable[tuple[str, str]]) -> bytes:
    """A record as JSON; `places` are this machine's folders by name, longer ones first."""
    run = record.stored_run
    run = replace(run, seconds=round(run.seconds, 4), stderr=_replace_places(run.stderr, places))
    # Names of files may hold bytes that are no text; JSON can hold those as escapes only.
    return json.dumps(
        msgspec.to_builtins(replace(record, stored_run=run)), ensure_ascii=True
    ).encode()


def from_bytes(data: bytes) -> RunRecord:
    """Read a record from JSON.

    Raises:
        ValueError: there is none in it.
    """
    try:
        return msgspec.json.decode(data, type=RunRecord)
    except msgspec.DecodeError:  # perhaps for an escape that is half a letter
        return msgspec.convert(json.loads(data), RunRecord)


def _replace_places(text: str, places: Iterable[tuple[str, str]]) -> str:
    text = text.replace(_MARK, "\ufffd")
    for name, folder in places:
        if folder == "/":
            continue  # every path begins with it
        pattern = rf"(?<![\w./-]){re.escape(folder.rstrip('/'))}(?=[/\"'\s:,;)\]]|$)"
        text = re.sub(pattern, f"{_MARK}{name}{_MARK}", text)
    return text


def _insert_places(text: str, places: Iterable[tuple[str, str]]) -> str:
    for name, folder in places if _MARK in text else ():
        text = text.replace(f"{_MARK}{name}{_MARK}", folder.rstrip("/"))
    return text
