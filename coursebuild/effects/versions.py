"""The versions of what runs the scripts, found without importing any of it.

Entry points: `python_version`, `engine_version`, `package_version`.
"""

from __future__ import annotations

import importlib.metadata
import platform

from coursebuild.effects.errors import EffectError


def python_version() -> str:
    """Of the interpreter that runs this tool and the scripts, such as `3.11.7`."""
    return platform.python_version()


def engine_version() -> str:
    """Of the installed MuJoCo, such as `3.14.0`.

    Raises:
        EffectError: there is none.
    """
    try:
        return importlib.metadata.version("mujoco")
    except importlib.metadata.PackageNotFoundError:
        raise EffectError(
            "MuJoCo is not installed for this Python", help="run `pip install coursebuild` again"
        ) from None


def package_version(name: str) -> str:
    """Of an installed distribution; `none` where there is none."""
    try:
        return importlib.metadata.version(name)
    except importlib.metadata.PackageNotFoundError:
        return "none"
