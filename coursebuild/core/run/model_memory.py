"""Compiled models, remembered: MuJoCo starts only for what changed.

Entry point: `compile_all`, as `core.run.mjcf.compile_all`.

What a model is compiled of besides its own text (included files, meshes, textures, attached models,
and where these were looked for) is worked out when it is compiled; the result, an error too, holds
as long as all of these are as they were.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import json
from collections.abc import Callable, Iterable, Sequence
from contextlib import AbstractContextManager
from pathlib import Path

import msgspec

from coursebuild.core.engine.digests import Clock, changed_since
from coursebuild.core.engine.memo import Memo
from coursebuild.core.model import MjcfModel
from coursebuild.core.model.results import CompileResult
from coursebuild.core.run import mjcf, mjcf_worker, mujoco_files
from coursebuild.core.run.dependencies import Need, need_of
from coursebuild.core.run.memory import States
from coursebuild.core.run.versions import engine_version

_KIND = "models"
_OWN_FAULT = "MuJoCo's compiler "
"""A message about the process that compiles begins so."""


class _Entry(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A result and what it was made of."""

    files: tuple[tuple[str, str], ...]
    """Path and state of each further file."""
    result: CompileResult


def compile_all(
    root: Path,
    store: Memo,
    models: Sequence[MjcfModel],
    texts: Sequence[str],
    stage: Callable[[], AbstractContextManager[None]] = contextlib.nullcontext,
) -> tuple[tuple[CompileResult, ...], tuple[CompileResult, ...]]:
    """A result for each model, and one for each text; see `mjcf.compile_all`.

    `stage` is entered where anything has to be compiled.
    """
    memory = _Models(root, store)
    named = [(model.source.path, model.source.text) for model in models]
    unnamed = [("", text) for text in texts]
    found: dict[tuple[str, str], CompileResult] = {}
    for key in (*named, *unnamed):
        known = memory.recall(*key)
        if known is not None:
            found[key] = known
    left = [model for model, key in zip(models, named, strict=True) if key not in found]
    rest = [text for text in dict.fromkeys(texts) if ("", text) not in found]
    if left or rest:
        memory.begin()
        with stage():
            made, parts = mjcf.compile_all(root, left, rest)
        keys = [*((m.source.path, m.source.text) for m in left), *(("", text) for text in rest)]
        for key, result in zip(keys, (*made, *parts), strict=True):
            memory.keep(*key, result)
            found[key] = result
    memory.states.save()
    return tuple(found[key] for key in named), tuple(found[key] for key in unnamed)


class _Models:
    def __init__(self, root: Path, store: Memo) -> None:
        self.root = root
        self.store = store
        self.states = States(root, store)
        self._clock = Clock(store)
        self._since = 0

    def begin(self) -> None:
        self._clock.tick()
        self._since = self._clock.now()

    def recall(self, path: str, text: str) -> CompileResult | None:
        """The result of a text at a path, if it holds."""
        if self.store.fresh:
            return None
        group = _group(path, text)
        keys = self.store.group(_KIND, group)
        found = self._first(keys)
        if found is None:
            shared = [key for key in self.store.shared_group(_KIND, group) if key not in keys]
            found = self._first(shared)
        return found

    def keep(self, path: str, text: str, result: CompileResult) -> None:
        """Remember a result, where all is known that it was made of."""
        if result.error.startswith(_OWN_FAULT):
            return
        needed = [need_of(f) for f in mjcf.model_files(self.root, path or mjcf.TEXT_PATH, text)]
        if any(changed_since(self._full(need), self._since) for need in needed):
            return
        files = tuple((need.name, self.states.now(need)) for need in needed)
        key = hashlib.sha256(json.dumps(files).encode()).hexdigest()
        try:
            data = msgspec.json.encode(_Entry(files, result))
        except UnicodeEncodeError:  # a name of a file that is no text
            return
        self.store.put(_KIND, f"{_group(path, text)}/{key}", data)

    def _first(self, keys: Iterable[str]) -> CompileResult | None:
        for key in keys:
            data = self.store.get(_KIND, key)
            try:
                entry = None if data is None else msgspec.json.decode(data, type=_Entry)
            except (msgspec.MsgspecError, RecursionError):
                continue
            if entry and all(self.states(need_of(name)) == state for name, state in entry.files):
                return entry.result
        return None

    def _full(self, need: Need) -> str:
        return str(self.root / need.name)


def _group(path: str, text: str) -> str:
    """All that counts and is known before: a text without a path stands in `models/`."""
    parts = [engine_version(), _way(), path, text]
    return hashlib.sha256(json.dumps(parts).encode()).hexdigest()


@functools.cache
def _way() -> str:
    """A hash of how models are compiled, and of what is told of them."""
    files = (mjcf.__file__, mjcf_worker.__file__, mujoco_files.__file__)
    return hashlib.sha256(b"".join(Path(file).read_bytes() for file in files)).hexdigest()
