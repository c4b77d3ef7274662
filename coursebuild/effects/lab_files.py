"""The files that a trial runs besides the lab itself.

Entry points: `wasm_path`, `script_paths`, `engine_digest`. They are apart from `lab_engine`, as who
only asks for the digest needs no V8.
"""

from __future__ import annotations

import functools
import hashlib
from pathlib import Path

from coursebuild.effects.resources import assets_dir

_TIMERS = Path(__file__).with_name("lab_timers.js")


def wasm_path() -> Path:
    """MuJoCo, as browsers have it."""
    return assets_dir() / "mujoco" / "mujoco.wasm"


def script_paths() -> tuple[Path, ...]:
    """Scripts, in the order in which they are run."""
    return _TIMERS, assets_dir() / "js" / "lab-trial.js"


@functools.lru_cache(maxsize=1)
def engine_digest() -> str:
    """A hash of all of them."""
    digest = hashlib.sha256(wasm_path().read_bytes())
    for path in script_paths():
        digest.update(path.read_bytes())
    return digest.hexdigest()
