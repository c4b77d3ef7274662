"""The virtual environment whose interpreter runs a course's scripts, where its map names one.

Entry point: `course_environment`, which reads files of the environment and runs nothing of it.
"""

from __future__ import annotations

import os
import re
from pathlib import Path

from coursebuild.core.files.errors import reason
from coursebuild.core.model import Course, NamedPath
from coursebuild.core.run.script_environment import OtherEnvironment
from coursebuild.core.run.versions import engine_version, version_in
from coursebuild.core.text.diagnostics import Parsed, diagnose

_OLDEST = (3, 11)
"""The oldest Python that what runs scripts is written for."""
_SETTING = re.compile(r"^(\w+) *= *(.*?) *$", re.MULTILINE)


def course_environment(root: Path, course: Course) -> Parsed[OtherEnvironment | None]:
    """The environment that the map names, or why scripts cannot run there."""
    named = course.python
    if named is None:
        return Parsed(None, ())
    python = root / named.path
    prefix = python.parent.parent
    if not os.access(python, os.X_OK):
        folder = named.path.rpartition("/bin/")[0]
        help = f"make it: `python -m venv {folder}`, then install there what scripts import"
        return _wrong(named, f"there is no interpreter `{named.path}`", help)
    try:
        settings = dict(_SETTING.findall((prefix / "pyvenv.cfg").read_text("utf-8", "replace")))
    except OSError as error:
        message = f"`{named.path}` is not of a virtual environment: no pyvenv.cfg, {reason(error)}"
        return _wrong(named, message)
    said = settings.get("version") or settings.get("version_info", "")
    major, minor, version = _release(said)
    if (major, minor) < _OLDEST:
        message = f"`{named.path}` is of Python {said}, and scripts need 3.11 or newer"
        return _wrong(named, message)
    packages = str(prefix / "lib" / f"python{major}.{minor}" / "site-packages")
    engine = version_in((packages,), "mujoco")
    if engine is None:
        wanted = course.engine or engine_version()
        help = f"run `{named.path} -m pip install mujoco=={wanted}`"
        return _wrong(named, f"MuJoCo is not installed for `{named.path}`", help)
    base = str(Path(settings.get("home", "")).parent)
    place = OtherEnvironment("", str(python), str(prefix), base, version, engine, (packages,))
    return Parsed(place, ())


def _release(text: str) -> tuple[int, int, str]:
    """The parts of a version such as 3.12.1, or virtualenv's 3.12.1.final.0."""
    found = re.match(r"(\d+)\.(\d+)\.\d+", text)
    return (int(found[1]), int(found[2]), found[0]) if found is not None else (0, 0, "")


def _wrong(named: NamedPath, message: str, help: str = "") -> Parsed[OtherEnvironment | None]:
    return Parsed(None, (diagnose("script-python", named.span, message, help=help),))
