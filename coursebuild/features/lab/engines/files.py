"""The files that a trial runs besides the lab itself.

Entry points: `wasm_path`, `script_path`, `engine_digest`, `lab_digest`. They are not in `browser`,
so that a digest can be had without V8.
"""

from __future__ import annotations

import functools
import hashlib
from pathlib import Path

from coursebuild.core.engine.tool import code_digest
from coursebuild.core.files.resources import assets_dir


def wasm_path() -> Path:
    """The path of MuJoCo for browsers."""
    return assets_dir() / "mujoco" / "mujoco.wasm"


def script_path() -> Path:
    """The path of the script that runs trials in V8."""
    return assets_dir() / "js" / "lab-trial.js"


@functools.cache
def engine_digest() -> str:
    """Return a hash of both files."""
    digest = hashlib.sha256(wasm_path().read_bytes())
    digest.update(script_path().read_bytes())
    return digest.hexdigest()


@functools.cache
def lab_digest(*parts: str) -> str:
    """Return a hash of parts of this feature's code: `picture`, `engines/native_worker.py`."""
    return code_digest(*(f"coursebuild/features/lab/{part}" for part in parts))
