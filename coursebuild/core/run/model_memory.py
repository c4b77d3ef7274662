"""Memory of compiled models: MuJoCo starts only if something that a model is made of changed.

Entry points: `compile_or_recall`, `model_key`.

A result, also an error, is stored under a hash of the text, its place, and the state of every other
file that MuJoCo looks for. If one of these changed during the compilation, nothing is stored.
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


def compile_or_recall(
    root: Path,
    store: Memo,
    texts: Sequence[tuple[str, str]],
    stage: Callable[[], AbstractContextManager[None]] = contextlib.nullcontext,
    memory: int = MEMORY,
) -> tuple[CompileResult, ...]:
    """A result for each text, see `mjcf.compile_all`.

    `stage` is entered only if anything has to be compiled.
    """
    keys = {model: model_key(root, *model) for model in texts}
    entries = {model: store.get_value(_KIND, key, CompileResult) for model, key in keys.items()}
    results = {model: result for model, result in entries.items() if result is not None}
    uncompiled = [model for model in keys if model not in results]
    if uncompiled:
        with stage():
            new_results = mjcf.compile_all(root, uncompiled, memory=memory)
        for model, result in zip(uncompiled, new_results, strict=True):
            results[model] = result
            if (
                not result.error.startswith(mjcf.OWN_FAULT)
                and model_key(root, *model) == keys[model]
            ):
                with contextlib.suppress(UnicodeEncodeError):  # a name of a file that is no text
                    store.put_value(_KIND, keys[model], result)
    return tuple(results[model] for model in texts)


def model_key(root: Path, path: str, text: str) -> str:
    """A hash of all that a compiled model depends on."""
    files = mjcf.model_files(root, path, text)
    states = tuple((file, file_state(str(root / file))) for file in files)
    return fingerprint((engine_version(), _code(), path, text, states))


@functools.cache
def _code() -> tuple[bytes, ...]:
    """The code that compiles models and reads their facts."""
    files = (mjcf.__file__, mjcf_worker.__file__, mujoco_files.__file__)
    return tuple(Path(file).read_bytes() for file in files)
