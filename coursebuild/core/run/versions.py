"""The versions of Python, MuJoCo and packages that run the scripts, found without importing them.

Entry points: `python_version`, `engine_version`, `package_version`; `version_in`, for the packages
of another interpreter.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable

from coursebuild.core.files.errors import EffectError


def python_version() -> str:
    """The version of the interpreter that runs this tool and the scripts, such as `3.11.7`."""
    return sys.version.split()[0]


def engine_version() -> str:
    """The version of the installed MuJoCo, such as `3.14.0`.

    Raises:
        EffectError: there is none.
    """
    version = _version("mujoco")
    if version is None:
        raise EffectError(
            "MuJoCo is not installed for this Python", help="run `pip install coursebuild` again"
        )
    return version


def package_version(name: str, folders: Iterable[str] | None = None) -> str:
    """The version of a distribution, here or in these folders; `none` where it is not installed."""
    return (_version(name) if folders is None else version_in(folders, name)) or "none"


def version_in(folders: Iterable[str], name: str) -> str | None:
    """The version of a distribution that is installed in one of these folders."""
    start = f"{name.replace('-', '_').lower()}-"
    for folder in folders:
        try:
            entries = [e for e in os.listdir(folder or ".") if e.lower().startswith(start)]  # noqa: PTH208
        except OSError:
            continue
        for entry in sorted(entries):
            if entry.endswith(".dist-info"):
                return entry[len(start) : -len(".dist-info")]
    return None


def _version(name: str) -> str | None:
    """The version of a distribution, read from the name of its `.dist-info` folder if possible."""
    version = version_in(sys.path, name)
    if version is not None:
        return version
    import importlib.metadata  # reads more, and is slow to import

    try:
        return importlib.metadata.version(name)
    except importlib.metadata.PackageNotFoundError:
        return None
