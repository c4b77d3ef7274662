"""The files that a trial runs besides the lab itself.

Entry points: `wasm_path`, `script_path`, `engine_digest`, `lab_digest`. They are apart from
`browser`, as who only asks for a digest needs no V8.
"""

from __future__ import annotations

import functools
import hashlib
from pathlib import Path

from coursebuild.core.engine.tool import code_digest
from coursebuild.core.files.resources import assets_dir


def wasm_path() -> Path:
    """MuJoCo, as browsers have it."""
    return assets_dir() / "mujoco" / "mujoco.wasm"


def script_path() -> Path:
    """The script that tries labs."""
    return assets_dir() / "js" / "lab-trial.js"


@functools.cache
def engine_digest() -> str:
    """A hash of both."""
    digest = hashlib.sha256(wasm_path().read_bytes())
    digest.update(script_path().read_bytes())
    return digest.hexdigest()


@functools.cache
def lab_digest(*parts: str) -> str:
    """A hash of parts of this feature's code, such as `picture` or `engines/native_worker.py`."""
    return code_digest(*(f"coursebuild/features/lab/{part}" for part in parts))
