"""The versions of Python, MuJoCo and packages that run the scripts, found without importing them.

Entry points: `python_version`, `engine_version`, `package_version`; `version_in`, for the packages
of another interpreter.
"""

from __future__ import annotations

import functools
import sys
from collections.abc import Iterable
from importlib.metadata import distributions

from coursebuild.core.files.errors import EffectError


def python_version() -> str:
    """The version of the interpreter that runs this tool and the scripts, such as `3.11.7`."""
    return sys.version.split()[0]


@functools.cache
def engine_version() -> str:
    """The version of the installed MuJoCo, such as `3.14.0`.

    Raises:
        EffectError: there is none.
    """
    version = version_in(sys.path, "mujoco")
    if version is None:
        raise EffectError(
            "MuJoCo is not installed for this Python", help="run `pip install coursebuild` again"
        )
    return version


def package_version(name: str, folders: Iterable[str] | None = None) -> str:
    """The version of a distribution, here or in these folders; `none` where it is not installed."""
    return version_in(sys.path if folders is None else folders, name) or "none"


def version_in(folders: Iterable[str], name: str) -> str | None:
    """The version of a distribution that is installed in one of these folders."""
    installed = distributions(name=name, path=list(folders))
    return next((distribution.version for distribution in installed), None)
