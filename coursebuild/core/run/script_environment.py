"""The environment of processes that run scripts.

Entry points: `clean_environment`, `library_folder`, `wanted_packages`; `Interpreter`, one other
than the tool's; `conditions` and `places`, on which results depend.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import platform
import re
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path

from msgspec import Struct

from coursebuild.core.files.course_root import DECISIVE

_SAYS_NOTHING = (
    "PATH",
    "HOME",
    "USER",
    "LOGNAME",
    "VIRTUAL_ENV",
    "CONDA_PREFIX",
)
"""Variables about the user and the places of programs, which do not change a result."""
_FIXED = {
    "LC_ALL": "C.UTF-8",
    "LANG": "C.UTF-8",
    "TZ": "UTC",
    "PYTHONUTF8": "1",
    "PYTHONIOENCODING": "utf-8",
    "PYTHONHASHSEED": "0",
    "PYTHONDONTWRITEBYTECODE": "1",
    # A crash, and a script that is stopped after its time limit, say where they were.
    "PYTHONFAULTHANDLER": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    "OMP_NUM_THREADS": "1",
    "BLIS_NUM_THREADS": "1",
    "NUMEXPR_NUM_THREADS": "1",
    "VECLIB_MAXIMUM_THREADS": "1",
    "NO_COLOR": "1",
    "TERM": "dumb",
    "MPLBACKEND": "Agg",
}


class Interpreter(Struct, frozen=True):
    """Another interpreter that runs scripts, and what is installed for it."""

    name: str
    """Empty for the course's own. Results of another one, as `check --against` makes it, are kept
    apart under its name."""
    python: str
    """The interpreter's absolute path."""
    prefix: str
    """The folder that holds all of it."""
    base: str
    """The folder of the Python that it was made with."""
    version: str
    """Of Python, such as `3.11.7`."""
    engine: str
    """The version of MuJoCo."""
    packages: tuple[str, ...]
    """The folders with the packages that are installed there."""

    def environment(self, clean: Mapping[str, str]) -> dict[str, str]:
        """The environment of scripts there, made from the one that they have here."""
        programs = f"{self.prefix}/bin"
        path = f"{programs}:{clean['PATH']}" if clean.get("PATH") else programs
        return {**clean, "PATH": path, "VIRTUAL_ENV": self.prefix}


def clean_environment(outer: Mapping[str, str]) -> dict[str, str]:
    """The environment of scripts except TMPDIR, made from the one that the tool runs in."""
    names = (*_SAYS_NOTHING, *DECISIVE)
    return {name: outer[name] for name in names if name in outer} | _FIXED


def library_folder() -> str:
    """The folder that holds the package `mjcourse` that came with this tool."""
    return str(Path(__file__).resolve().parents[3])


def wanted_packages(scripts: Iterable[Path]) -> tuple[str, ...]:
    """The packages to import once for these scripts: those that a file of their folders names.

    A script that imports MuJoCo in another way still runs, but its result is not remembered.
    """
    words: set[bytes] = set()
    for folder in {path.parent for path in scripts}:
        for path in folder.glob("*.py"):
            if b"mujoco" not in words and path.is_file():  # a pipe has no end
                with contextlib.suppress(OSError):
                    words.update(re.findall(rb"\b(?:mujoco|mjcourse|numpy)\b", path.read_bytes()))
    if b"mujoco" in words:
        return "numpy", "mujoco"
    return ("numpy",) if words else ()


# --- what a result depends on besides the script


def conditions(
    outer: Mapping[str, str], interpreter: Interpreter | None = None
) -> tuple[tuple[str, str], ...]:
    """The conditions under which results are the same, by name and sorted.

    `outer` is the environment of the tool; `interpreter` is another one than runs the tool.
    """
    values = {f"environment variable {name}": outer[name] for name in DECISIVE if name in outer}
    version = platform.python_version() if interpreter is None else interpreter.version
    values["Python"] = f"{platform.python_implementation()} {version}"
    if interpreter is not None and interpreter.name:
        values["environment"] = interpreter.name
    values["platform"] = f"{sys.platform} {platform.machine()} {_c_library()}".strip()
    fixed = json.dumps(_FIXED, sort_keys=True).encode()
    values["the fixed environment of scripts"] = hashlib.sha256(fixed).hexdigest()[:12]
    return tuple(sorted(values.items()))


def _c_library() -> str:
    """The C library, whose mathematical functions Python uses."""
    try:
        return os.confstr("CS_GNU_LIBC_VERSION") or ""
    except (OSError, ValueError):
        return ""


def places(
    root: Path, outer: Mapping[str, str], interpreter: Interpreter | None = None
) -> tuple[tuple[str, str], ...]:
    """Folders of this machine, by name, whose paths a script may print; longest first.

    `interpreter` is another one than runs the tool.
    """
    folders = {
        "course": str(root),
        "library": library_folder(),
        "prefix": sys.prefix if interpreter is None else interpreter.prefix,
        "base": sys.base_prefix if interpreter is None else interpreter.base,
        "home": outer.get("HOME", ""),
    }
    return tuple(sorted(folders.items(), key=lambda item: (-len(item[1]), item[0])))
