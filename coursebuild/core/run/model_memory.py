"""Compiled models, remembered: MuJoCo starts only if something that a model is made of changed.

Entry points: `compile_kept`, `model_key`.

A result, an error too, is kept under its text, where that stands, and the state of every other file
that MuJoCo looks for. What changed while it was compiled is not kept.
"""

from __future__ import annotations

import contextlib
import functools
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from pathlib import Path

from coursebuild.core.engine.digests import file_state
from coursebuild.core.engine.memo import Memo
from coursebuild.core.model.results import CompileResult
from coursebuild.core.run import mjcf, mjcf_worker, mujoco_files
from coursebuild.core.run.child import MEMORY
from coursebuild.core.run.versions import engine_version
from coursebuild.core.values import fingerprint

_KIND = "models"


def compile_kept(
    root: Path,
    store: Memo,
    texts: Sequence[tuple[str, str]],
    stage: Callable[[], AbstractContextManager[None]] = contextlib.nullcontext,
    memory: int = MEMORY,
) -> tuple[CompileResult, ...]:
    """A result for each text, see `mjcf.compile_all`.

    `stage` is entered where anything has to be compiled.
    """
    keys = {each: model_key(root, *each) for each in texts}
    kept = {each: store.get_value(_KIND, key, CompileResult) for each, key in keys.items()}
    found = {each: result for each, result in kept.items() if result is not None}
    left = [each for each in keys if each not in found]
    if left:
        with stage():
            made = mjcf.compile_all(root, left, memory=memory)
        for each, result in zip(left, made, strict=True):
            found[each] = result
            if not result.error.startswith(mjcf.OWN_FAULT) and model_key(root, *each) == keys[each]:
                with contextlib.suppress(UnicodeEncodeError):  # a name of a file that is no text
                    store.put_value(_KIND, keys[each], result)
    return tuple(found[each] for each in texts)


def model_key(root: Path, path: str, text: str) -> str:
    """A hash of all that a compiled model depends on."""
    files = mjcf.model_files(root, path, text)
    states = tuple((file, file_state(str(root / file))) for file in files)
    return fingerprint((engine_version(), _code(), path, text, states))


@functools.cache
def _code() -> tuple[bytes, ...]:
    """How models are compiled, and what is told of them."""
    files = (mjcf.__file__, mjcf_worker.__file__, mujoco_files.__file__)
    return tuple(Path(file).read_bytes() for file in files)
