"""Results of scripts from other machines, as they would be here.

Entry points: `run_as_here`, `would_differ`, `write_output`, `lost_run`.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

import msgspec
from msgspec.structs import replace

from coursebuild.api import (
    Dependency,
    EffectError,
    Outcome,
    ScriptJob,
    ScriptRun,
    States,
    resolve_inside,
)
from coursebuild_cluster.messages import Answer

_MISSING_MODULE = re.compile(r"^(?:\w+\.)*(?:ModuleNotFound|Import)Error\b", re.MULTILINE)


def lost_run(job: ScriptJob, deaths: int) -> ScriptRun:
    """The run of a script whose worker has died too often."""
    text = f"each of the {deaths} workers that ran this script died\n"
    return ScriptRun(job.path, Outcome.KILLED, 9, "", text, 0.0)


def run_as_here(answer: Answer, places: Iterable[tuple[str, str]]) -> ScriptRun | None:
    """A run with the folders of here in the place of those of the worker."""
    if answer.run is None:
        return None
    replace_all = _replacer(answer, places, ("course", "library", "prefix", "base"))
    replace_own = _replacer(answer, places, ("course", "library"))
    parts = msgspec.to_builtins(replace(answer.run, stdout=""), builtin_types=(bytes,))
    run = msgspec.convert(_map_texts(parts, replace_all), ScriptRun)
    return replace(run, stdout=replace_own(answer.run.stdout))


def would_differ(answer: Answer, states: States) -> bool:
    """Whether the script would have seen something else here."""
    run = answer.run
    assert run is not None
    if run.outcome is Outcome.SKIPPED or _MISSING_MODULE.search(run.stderr):
        return True
    replace_all = _replacer(answer, states.places, ("course", "library", "prefix", "base"))
    needs = (replace(d, name=replace_all(d.name)) for d in answer.dependencies)
    return any(_state_here(need, states) != need.state for need in needs)


def _state_here(dependency: Dependency, states: States) -> str:
    # The path of a folder is another one on a worker, and is replaced where it was printed.
    return dependency.state if dependency.kind.value == "place" else states.now(dependency.need)


def _replacer(
    answer: Answer, places: Iterable[tuple[str, str]], names: Sequence[str]
) -> Callable[[str], str]:
    own_folders = dict(places)
    pairs = [
        (folder.rstrip("/"), own_folders[name].rstrip("/"))
        for name, folder in answer.places  # longer ones come first
        if name in names and len(folder) > 1 and folder != own_folders[name]
    ]
    if not pairs:
        return lambda text: text
    targets = dict(pairs)
    alternatives = "|".join(map(re.escape, targets))
    pattern = re.compile(rf"(?<![\w./-])(?:{alternatives})(?![\w.-])")
    return lambda text: pattern.sub(lambda match: targets[match[0]], text)


def _map_texts(value: Any, change: Callable[[str], str]) -> Any:
    """A value of plain parts with all texts changed."""
    if isinstance(value, str):
        return change(value)
    if isinstance(value, list | tuple):
        return [_map_texts(part, change) for part in value]
    if isinstance(value, dict):
        return {key: _map_texts(part, change) for key, part in value.items()}
    return value


def write_output(root: Path, job: ScriptJob, path: str, data: bytes) -> None:
    """Write what a script has written where it may."""
    target = resolve_inside(root, path)
    folders = (resolve_inside(root, folder) for folder in job.writes)
    if not any(folder in target.parents for folder in folders):
        raise EffectError(f"--cluster: {job.path} may not write {path}")
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_bytes(data)
