"""Make a `Trace` from the records of a `Tracer`.

Entry point: `read_records`.
"""

from __future__ import annotations

import contextlib
import os
from collections import defaultdict
from collections.abc import Iterable

from coursebuild.core.model.results import Divergence, Effect, EffectKind, Sign, Trace


def read_records(records: bytes, root: str, script: str) -> Trace:
    """The trace that records hold, each of which ends with a null byte.

    Args:
        records: those of one script; see `tracing` for what they hold.
        root: the project's folder, resolved.
        script: the script's path relative to it.
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
                divergences.append(_parse_divergence(value))
    files = {_resolve(path, top) for path in values_by_kind["r"]}
    inside = {path.removeprefix(f"{top}/") for path in files if path.startswith(f"{top}/")}
    return Trace(
        files=tuple(sorted(inside - {os.path.normpath(script)})),
        folders=tuple(
            sorted({_make_relative(folder, top) or "." for folder in values_by_kind["l"]})
        ),
        outside=tuple(sorted(path for path in files if not path.startswith(f"{top}/"))),
        modules=tuple(sorted(set(values_by_kind["m"]))),
        opaque=next(iter(values_by_kind["o"]), ""),
        divergences=tuple(dict.fromkeys(divergences)),
        effects=tuple(effects),
        is_perturbed=bool(values_by_kind["p"]),
        states=tuple(values_by_kind["s"]),
        sought=_join_sought(values_by_kind["v"], top),
    )


def _make_relative(folder: str, top: str) -> str:
    """A folder relative to the project's; empty for the project's own."""
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


def _parse_divergence(fields: str) -> Divergence:
    sign, detail, time, model, path, line = fields.split("\t")
    depth, *geoms = detail.split("\x1f")
    return Divergence(Sign(sign), time, model, path, int(line), depth, tuple(geoms))


def _join_sought(records: Iterable[str], top: str) -> tuple[str, ...]:
    """The modules that were looked for in vain, as `folder/{one,two}`."""
    names_by_folder: dict[str, set[str]] = defaultdict(set)
    for record in records:
        folder, _, names = record.partition("\t")
        names_by_folder[_make_relative(folder, top)].update(names.split(","))
    return tuple(
        f"{folder}/{{{','.join(sorted(n))}}}" for folder, n in sorted(names_by_folder.items())
    )
