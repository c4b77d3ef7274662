"""From the records of a `Tracer` to a `Trace`.

Entry point: `read_records`.
"""

from __future__ import annotations

import contextlib
import os
from collections import defaultdict
from collections.abc import Iterable

from coursebuild.core.model.results import Divergence, Effect, EffectKind, Sign, Trace


def read_records(records: bytes, root: str, script: str) -> Trace:
    """What the records say, each of which ends with a null byte.

    Args:
        records: those of one script; see `tracing` for what they hold.
        root: the project's folder, resolved.
        script: the script's path relative to it.
    """
    top = root.rstrip("/")
    found: dict[str, list[str]] = defaultdict(list)
    effects: list[Effect] = []
    divergences: list[Divergence] = []
    for record in records.decode("utf-8", "surrogateescape").split("\0"):
        kind, about = record[:1], record[1:]
        found[kind].append(about)
        with contextlib.suppress(ValueError):  # half of one, by a script that was killed
            if kind in ("w", "c"):
                what, file, line = about.rsplit("\t", 2)
                effects.append(Effect(EffectKind(kind), what, file, int(line)))
            elif kind == "d":
                divergences.append(_divergence(about))
    files = {_resolved(path, top) for path in found["r"]}
    inside = {path.removeprefix(f"{top}/") for path in files if path.startswith(f"{top}/")}
    return Trace(
        files=tuple(sorted(inside - {os.path.normpath(script)})),
        folders=tuple(sorted({_relative(folder, top) or "." for folder in found["l"]})),
        outside=tuple(sorted(path for path in files if not path.startswith(f"{top}/"))),
        modules=tuple(sorted(set(found["m"]))),
        opaque=next(iter(found["o"]), ""),
        divergences=tuple(dict.fromkeys(divergences)),
        effects=tuple(effects),
        is_perturbed=bool(found["p"]),
        states=tuple(found["s"]),
        sought=_sought(found["v"], top),
    )


def _relative(folder: str, top: str) -> str:
    """A folder relative to the project's; empty for that itself."""
    return folder.removeprefix(top).lstrip("/")


def _resolved(path: str, top: str) -> str:
    """The path of a source, and of a file of the project that a link leads to."""
    folder, _, name = path.rpartition("/")
    if name.endswith(".pyc") and folder.endswith("/__pycache__"):
        path = f"{folder.removesuffix('/__pycache__')}/{name.partition('.')[0]}.py"
    if not path.startswith(f"{top}/"):
        with contextlib.suppress(OSError):
            resolved = os.path.realpath(path)
            path = resolved if resolved.startswith(f"{top}/") else path
    return path


def _divergence(about: str) -> Divergence:
    sign, detail, time, model, path, line = about.split("\t")
    depth, *geoms = detail.split("\x1f")
    return Divergence(Sign(sign), time, model, path, int(line), depth, tuple(geoms))


def _sought(records: Iterable[str], top: str) -> tuple[str, ...]:
    """The modules that were looked for, as `folder/{one,two}`."""
    found: dict[str, set[str]] = defaultdict(set)
    for about in records:
        folder, _, names = about.partition("\t")
        found[_relative(folder, top)].update(names.split(","))
    return tuple(f"{folder}/{{{','.join(sorted(n))}}}" for folder, n in sorted(found.items()))
