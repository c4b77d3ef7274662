"""What a script did: the trace that its notes give, and its result as it is stored.

In a script's error output, marks replace paths of this machine; the machine that reads a record
puts its own there.
"""

from __future__ import annotations

import contextlib
import json
import os
import re
from collections import defaultdict
from collections.abc import Iterable
from typing import Annotated, Any, TypeAlias

import msgspec
from msgspec import Meta, Struct
from msgspec.structs import replace

from coursebuild.core.model.results import (
    Divergence,
    Effect,
    EffectKind,
    Outcome,
    ScriptRun,
    Sign,
    Trace,
)
from coursebuild.core.run.dependencies import ANSWERS, FIELDS, Dependency, Inputs, Kind

Moment: TypeAlias = Annotated[int, Meta(ge=0, lt=1 << 37)]
"""Seconds since 1970, in a year that has a name."""
STORABLE_OUTCOMES = (Outcome.OK, Outcome.FAILED, Outcome.OUTPUT_LIMIT, Outcome.ENCODING)
_MARK = "\0"


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
        fields: dict[str, Any] = {field: tuple(names[kind]) for field, kind in FIELDS.items()}
        for field, kind in ANSWERS.items():
            fields[field] = tuple((d.name, d.state) for d in self.dependencies if d.kind is kind)
        trace = replace(self.stored_run.trace or Trace((), (), (), (), ""), **fields)
        stderr = self.stored_run.stderr
        for name, folder in places if _MARK in stderr else ():
            stderr = stderr.replace(f"{_MARK}{name}{_MARK}", folder.rstrip("/"))
        return replace(self.stored_run, stderr=stderr, cached=True, trace=trace)


def record_of(
    inputs: Inputs,
    dependencies: tuple[Dependency, ...],
    timestamp: int,
    reason_forgotten: str,
    run: ScriptRun,
) -> RunRecord:
    """The record of a run."""
    bare = run.trace and replace(run.trace, **dict.fromkeys((*FIELDS, *ANSWERS), ()))
    return RunRecord(inputs, dependencies, timestamp, reason_forgotten, replace(run, trace=bare))


def to_bytes(record: RunRecord, places: Iterable[tuple[str, str]]) -> bytes:
    """A record as JSON; `places` are this machine's folders by name, longer ones first."""
    run = record.stored_run
    text = run.stderr.replace(_MARK, "\ufffd")
    for name, folder in places:
        if folder == "/":
            continue  # every path begins with it
        pattern = rf"(?<![\w./-]){re.escape(folder.rstrip('/'))}(?=[/\"'\s:,;)\]]|$)"
        text = re.sub(pattern, f"{_MARK}{name}{_MARK}", text)
    run = replace(run, seconds=round(run.seconds, 4), stderr=text)
    # Names of files may hold bytes that are no text; JSON can hold those as escapes only.
    return json.dumps(
        msgspec.to_builtins(replace(record, stored_run=run)), ensure_ascii=True
    ).encode()


def from_bytes(data: bytes) -> RunRecord:
    """Read a record from JSON; a `ValueError` says that there is none in it."""
    try:
        return msgspec.json.decode(data, type=RunRecord)
    except msgspec.DecodeError:  # perhaps for an escape that is half a letter
        return msgspec.convert(json.loads(data), RunRecord)


# --- from notes to a trace


def read_records(records: bytes, root: str, script: str) -> Trace:
    """The trace that the records of one script hold, each ended by a null byte: see `tracing`.

    `root` is the project's folder, resolved; `script` is relative to it.
    """
    top = root.rstrip("/")
    values_by_kind: dict[str, list[str]] = defaultdict(list)
    effects: list[Effect] = []
    divergences: list[Divergence] = []
    for record in records.decode("utf-8", "surrogateescape").split("\0"):
        kind, value = record[:1], record[1:]
        values_by_kind[kind].append(value)
        with contextlib.suppress(ValueError):  # a killed script may leave half a record
            if kind in ("w", "c"):
                target, file, line = value.rsplit("\t", 2)
                effects.append(Effect(EffectKind(kind), target, file, int(line)))
            elif kind == "d":
                sign, detail, time, model, path, line = value.split("\t")
                depth, *geoms = detail.split("\x1f")
                place = (time, model, path, int(line))
                divergences.append(Divergence(Sign(sign), *place, depth, tuple(geoms)))
    files = {_resolve(path, top) for path in values_by_kind["r"]}
    inside = {path.removeprefix(f"{top}/") for path in files if path.startswith(f"{top}/")}
    sought_names: dict[str, set[str]] = defaultdict(set)  # by the folder where they are not
    for record in values_by_kind["v"]:
        folder, _, names = record.partition("\t")
        sought_names[_make_relative(folder, top)].update(names.split(","))
    folders = {_make_relative(folder, top) or "." for folder in values_by_kind["l"]}
    own_paths = {os.path.normpath(script), *(_make_relative(p, top) for p in values_by_kind["x"])}

    def answers(kind: str) -> tuple[tuple[str, str], ...]:
        pairs = {value.rpartition("\t")[::2] for value in values_by_kind[kind] if "\t" in value}
        relative = {(_make_relative(path, top) or ".", answer) for path, answer in pairs}
        return tuple(sorted(pair for pair in relative if pair[0] not in own_paths))

    sought = (f"{at}/{{{','.join(sorted(n))}}}" for at, n in sorted(sought_names.items()))
    return Trace(
        files=tuple(sorted(inside - {os.path.normpath(script)})),
        folders=tuple(sorted(folders)),
        outside=tuple(sorted(path for path in files if not path.startswith(f"{top}/"))),
        modules=tuple(sorted(set(values_by_kind["m"]))),
        opaque=next(iter(values_by_kind["o"]), ""),
        divergences=tuple(dict.fromkeys(divergences)),
        effects=tuple(effects),
        is_perturbed=bool(values_by_kind["p"]),
        states=tuple(values_by_kind["s"]),
        sought=tuple(sought),
        existence=answers("e"),
        statuses=answers("t"),
    )


def _make_relative(folder: str, top: str) -> str:
    return folder.removeprefix(top).lstrip("/")


def _resolve(path: str, top: str) -> str:
    """The path of a compiled module's source, or of the project's file that a link leads to."""
    folder, _, name = path.rpartition("/")
    if name.endswith(".pyc") and folder.endswith("/__pycache__"):
        path = f"{folder.removesuffix('/__pycache__')}/{name.partition('.')[0]}.py"
    if not path.startswith(f"{top}/"):
        with contextlib.suppress(OSError):
            resolved = os.path.realpath(path)
            path = resolved if resolved.startswith(f"{top}/") else path
    return path
