"""The virtual environment that runs a course's scripts, where the course map names one.

Entry point: `course_environment`, which reads files of the environment but runs nothing of it.
"""

from __future__ import annotations

import os
import re
from pathlib import Path

from coursebuild.core.files.errors import reason
from coursebuild.core.model import Course, NamedPath
from coursebuild.core.run.script_environment import Interpreter
from coursebuild.core.run.versions import engine_version, version_in
from coursebuild.core.text.diagnostics import Parsed, diagnose

_OLDEST = (3, 11)
"""The oldest Python that can run the modules of this package."""
_SETTING = re.compile(r"^(\w+) *= *(.*?) *$", re.MULTILINE)


def course_environment(root: Path, course: Course) -> Parsed[Interpreter | None]:
    """The environment that the map names, or why scripts cannot run there."""
    named_path = course.python
    if named_path is None:
        return Parsed(None, ())
    python = root / named_path.path
    prefix = python.parent.parent
    if not os.access(python, os.X_OK):
        folder = named_path.path.rpartition("/bin/")[0]
        help = f"make it: `python -m venv {folder}`, then install there what scripts import"
        return _reject(named_path, f"there is no interpreter `{named_path.path}`", help)
    try:
        settings = dict(_SETTING.findall((prefix / "pyvenv.cfg").read_text("utf-8", "replace")))
    except OSError as error:
        message = (
            f"`{named_path.path}` is not of a virtual environment: no pyvenv.cfg, {reason(error)}"
        )
        return _reject(named_path, message)
    version_text = settings.get("version") or settings.get("version_info", "")
    major, minor, version = _parse_version(version_text)
    if (major, minor) < _OLDEST:
        message = f"`{named_path.path}` is of Python {version_text}, and scripts need 3.11 or newer"
        return _reject(named_path, message)
    packages = str(prefix / "lib" / f"python{major}.{minor}" / "site-packages")
    engine = version_in((packages,), "mujoco")
    if engine is None:
        required = course.engine or engine_version()
        help = f"run `{named_path.path} -m pip install mujoco=={required}`"
        return _reject(named_path, f"MuJoCo is not installed for `{named_path.path}`", help)
    base = str(Path(settings.get("home", "")).parent)
    interpreter = Interpreter("", str(python), str(prefix), base, version, engine, (packages,))
    return Parsed(interpreter, ())


def _parse_version(text: str) -> tuple[int, int, str]:
    """The parts of a version such as 3.12.1, or virtualenv's 3.12.1.final.0."""
    match = re.match(r"(\d+)\.(\d+)\.\d+", text)
    return (int(match[1]), int(match[2]), match[0]) if match is not None else (0, 0, "")


def _reject(named_path: NamedPath, message: str, help: str = "") -> Parsed[Interpreter | None]:
    return Parsed(None, (diagnose("script-python", named_path.span, message, help=help),))
