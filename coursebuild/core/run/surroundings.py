"""What a process that runs scripts finds around it.

Entry points: `clean_environment`, `library_folder`, `wanted_packages`; `OtherEnvironment`, another
interpreter than that of the tool.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable, Mapping
from pathlib import Path

from msgspec import Struct

_PASSED_ON = (
    "PATH",
    "HOME",
    "USER",
    "LOGNAME",
    "LD_LIBRARY_PATH",
    "DYLD_LIBRARY_PATH",
    "DYLD_FALLBACK_LIBRARY_PATH",
    "VIRTUAL_ENV",
    "CONDA_PREFIX",
    "CUDA_HOME",
    "CUDA_PATH",
    "CUDA_VISIBLE_DEVICES",
    "NVIDIA_VISIBLE_DEVICES",
    "NVIDIA_DRIVER_CAPABILITIES",
    "MUJOCO_GL",
    "MUJOCO_EGL_DEVICE_ID",
    "PYOPENGL_PLATFORM",
    "SYSTEMROOT",
    "SYSTEMDRIVE",
)
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
_PRELOADED = ("numpy", "numpy.random", "mujoco")
"""Packages that are worth importing once for all scripts, in this order: one may import those
before it. None does anything that a script could see."""
_IMPORTS = re.compile(rb"^[ \t]*(?:import|from)[ \t]+([^\n#;]+)", re.MULTILINE)


class OtherEnvironment(Struct, frozen=True):
    """An interpreter and what is installed for it, where scripts run that do not run here."""

    name: str
    """Other places have other names: what is remembered of one holds in no other."""
    python: str
    """The interpreter's absolute path."""
    prefix: str
    """The folder that holds all of it."""
    packages: str
    """The folder with the installed packages, `mjcourse` among them."""

    def environment(self, clean: Mapping[str, str]) -> dict[str, str]:
        """The environment of scripts there, of the one that they have here."""
        programs = f"{self.prefix}/bin"
        path = f"{programs}:{clean['PATH']}" if clean.get("PATH") else programs
        return {**clean, "PATH": path, "VIRTUAL_ENV": self.prefix}


def clean_environment(outer: Mapping[str, str]) -> dict[str, str]:
    """The environment of scripts, but for their TMPDIR, given the one that the tool runs in."""
    return {name: outer[name] for name in _PASSED_ON if name in outer} | _FIXED


def library_folder() -> str:
    """The folder that holds the package `mjcourse` that came with this tool."""
    return str(Path(__file__).resolve().parents[3])


def wanted_packages(scripts: Iterable[Path]) -> tuple[str, ...]:
    """Which of the packages that can be imported for all scripts these ask for.

    A module beside a script, and `mjcourse`, count as part of it.
    """
    found: set[str] = set()
    todo, seen = list(scripts), set[Path]()
    while todo and not found.issuperset(_PRELOADED):
        path = todo.pop()
        if path in seen:
            continue
        seen.add(path)
        try:
            data = path.read_bytes()
        except OSError:
            continue
        said = _said(data)
        if "numpy" in said and b".random" in data:
            said.add("numpy.random")
        if not said.isdisjoint(_PRELOADED) and not found.issuperset(said.intersection(_PRELOADED)):
            found |= _imported(data)
        if "mjcourse" in said:
            found.add("numpy")  # which it is built on
        todo += [beside for name in said if (beside := path.parent / f"{name}.py").is_file()]
    if "mujoco" in found:
        found.add("numpy")
    return tuple(name for name in _PRELOADED if name in found)


def _said(data: bytes) -> set[str]:
    """Top-level names that a text imports, or has in lines that look so."""
    return {
        word.partition(".")[0]
        for line in _IMPORTS.findall(data)
        for part in line.decode("utf-8", "replace").split(",")
        for word in part.split()[:1]
    }


def _imported(data: bytes) -> set[str]:
    """Names of the packages that a text really imports; none where it is no Python."""
    try:
        tree = ast.parse(data)
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return set()
    names: set[str] = set()
    random = False
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names |= {alias.name.partition(".")[0] for alias in node.names}
            random = random or any(alias.name == "numpy.random" for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            names.add(node.module.partition(".")[0])
            random = random or node.module == "numpy.random"
        elif isinstance(node, ast.Attribute):
            random = random or node.attr == "random"
    return names | ({"numpy.random"} if random and "numpy" in names else set())
