"""The result of a script as it is kept: what it depends on, and what it did.

Entry points: `RunRecord`, `to_bytes`, `from_bytes`.

Paths of the machine in what a script wrote to its error output are taken out before it is kept, and
those of the machine that reads it are put in.
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
REMEMBERED = (Outcome.OK, Outcome.FAILED, Outcome.OUTPUT_LIMIT, Outcome.ENCODING)
_MARK = "\0"
_NOTHING = Trace((), (), (), (), "")


class RunRecord(Struct, frozen=True):
    """One run of a script."""

    inputs: Inputs
    dependencies: tuple[Dependency, ...]
    made: Moment
    """When, in seconds since 1970."""
    forgotten: str
    """Why it is not remembered, as the end of a sentence; empty where it is."""
    kept: ScriptRun
    """What it did; of its trace only what is no dependency."""

    def run(self, places: Iterable[tuple[str, str]]) -> ScriptRun:
        """The run as if it had been made here; see `to_bytes` for the places."""
        names: dict[Kind, list[str]] = {kind: [] for kind in Kind}
        for one in self.dependencies:
            names[one.kind].append(one.name)
        trace = replace(
            self.kept.trace or _NOTHING,
            files=tuple(names[Kind.FILE]),
            folders=tuple(names[Kind.LISTING]),
            outside=tuple(names[Kind.OUTSIDE]),
            modules=tuple(names[Kind.MODULE]),
            sought=tuple(names[Kind.SOUGHT]),
        )
        stderr = _put_in(self.kept.stderr, places)
        return replace(self.kept, stderr=stderr, cached=True, trace=trace)


def record_of(
    inputs: Inputs, dependencies: tuple[Dependency, ...], made: int, forgotten: str, run: ScriptRun
) -> RunRecord:
    """The record of a run."""
    bare = run.trace and replace(run.trace, files=(), folders=(), outside=(), modules=(), sought=())
    return RunRecord(inputs, dependencies, made, forgotten, replace(run, trace=bare))


def to_bytes(record: RunRecord, places: Iterable[tuple[str, str]]) -> bytes:
    """As JSON; `places` are folders of this machine, each with a name, the longer ones first."""
    run = record.kept
    run = replace(run, seconds=round(run.seconds, 4), stderr=_take_out(run.stderr, places))
    # Names of files may hold bytes that are no text; only escapes can carry them.
    return json.dumps(msgspec.to_builtins(replace(record, kept=run)), ensure_ascii=True).encode()


def from_bytes(data: bytes) -> RunRecord:
    """The record that JSON holds.

    Raises:
        ValueError: it holds none.
    """
    try:
        return msgspec.json.decode(data, type=RunRecord)
    except msgspec.DecodeError:  # perhaps for an escape that is half a letter
        return msgspec.convert(json.loads(data), RunRecord)


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
